"""Actuators put together at random of all parts there are, for tests that should hold for every composition."""

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from random_actuators import draw as draw_plain

from actuator import (
    PMSM,
    Actuator,
    AngleSensor,
    BrakingChopper,
    Bridge,
    Cogging,
    Constant,
    CurrentSensor,
    CurrentSource,
    DCLink,
    DCMotor,
    Gravity,
    Gust,
    Inverter,
    Lever,
    LinearLoad,
    Load,
    OverheatDerating,
    Rack,
    Rotor,
    RotorDrag,
    Saturation,
    Screw,
    Sensors,
    Sine,
    Step,
    TemperatureDependence,
    ThermalNetwork,
    ThermalNode,
    ThermalPath,
    TorqueSource,
    UndervoltageDerating,
    WhiteNoise,
)
from controllers import (
    PI,
    PID,
    Cascade,
    DisturbanceObserver,
    Dither,
    FeedForward,
    FilteredDerivative,
    FrictionCompensation,
    IntegralRemedies,
    Knocker,
    LeadLag,
    LowPass,
    Notch,
    P,
    PositionObserver,
    RateAndAccelerationLimit,
    RateLimit,
    Remedies,
    Sampling,
    ScheduledGain,
    SecondOrderLowPass,
)
from controllers.integral import ANTI_WINDUP
from gear import Bearing, Coupling, Din3990, EndStop, KnownOil, OilAt, Palmgren, Shaft, Thickening

RESISTANCE, INDUCTANCE, ROTOR = 0.3, 4e-4, 2e-5  # ohm, H, kg m^2
LINK, CURRENT = 270.0, 30.0  # V, A
COLD = 253.15  # K
STOP = 0.6  # rad
MOTORS = ("PMSM", "PMSM", "DCMotor", "CurrentSource", "TorqueSource")


class Drawn(NamedTuple):
    """An actuator, the same in continuous time with ideal sensors, inputs, and what never stands still."""

    actuator: Actuator
    design: Actuator
    inputs: dict
    drifting: tuple[str, ...]


class Chance:
    """Draws."""

    def __init__(self, seed):
        self.rng = np.random.default_rng(seed)

    def __call__(self, share=0.5):
        return bool(self.rng.random() < share)

    def of(self, *choices):
        return choices[int(self.rng.integers(len(choices)))]

    def between(self, low, high):
        return float(self.rng.uniform(low, high))

    def spread(self, low, high):
        """A number between the bounds, as likely in one decade as in another."""
        return math.exp(self.between(math.log(low), math.log(high)))


def draw(seed):
    """The composition with this number."""
    chance = Chance(seed)
    sampled, kind = chance(0.6), chance.of(*MOTORS)
    electric = kind in ("PMSM", "DCMotor")
    thermal = _thermal(chance) if chance() else None
    gear = _gear(chance, seed, oiled=thermal is not None)
    controller = _pid(chance, gear, sampled) if kind == "TorqueSource" and chance() else None
    if controller is None and not (kind == "TorqueSource" and chance(0.3)):
        controller = _cascade(chance, gear, kind, sampled, warm=thermal is not None)
    sampled = sampled and controller is not None
    link = _link(chance) if electric and chance() else None
    actuator = Actuator(
        name=f"composition {seed}",
        motor=_motor(chance, kind),
        inverter=_inverter(chance, link, thermal) if electric else None,
        link=link,
        gear=gear,
        load=_load(chance),
        controller=controller,
        sampling=_sampling(chance, controller) if sampled else None,
        sensors=_sensors(chance, controller, sampled, electric),
        thermal=thermal,
    )
    inputs = {"load_torque": chance.of(Sine(amplitude=3.0, frequency=20.0), Gust(amplitude=4.0, duration=0.02))}
    if controller is None:
        inputs["torque_reference"] = Step(time=0.005, after=chance.between(-0.5, 0.5))
    else:
        inputs["reference"] = chance.of(Step(time=0.005, after=chance.between(-0.2, 0.2)), Constant(value=0.05))
    if isinstance(actuator.load, LinearLoad):
        inputs["load_force"] = Constant(value=chance.between(-100, 100))
    design = _design(actuator)
    return Drawn(actuator, design, inputs, _drifting(design))


def _design(actuator):
    """In continuous time with ideal sensors: without what only a sampled controller can do."""
    controller = actuator.controller
    if isinstance(controller, Cascade):
        dither = controller.remedies.dither
        controller = replace(
            controller,
            speed=_without_reset(controller.speed),
            position=_without_reset(controller.position),
            remedies=replace(
                controller.remedies, knocker=None, dither=None if dither and dither.shape == "square" else dither
            ),
            schedule=None if controller.schedule and controller.schedule.over == "load" else controller.schedule,
        )
    elif controller is not None:
        controller = _without_reset(controller)
    return replace(actuator, controller=controller, sampling=None, sensors=Sensors())


def _without_reset(law):
    remedies = getattr(law, "remedies", None)
    return law if remedies is None else replace(law, remedies=replace(remedies, reset_on_reversal=False))


def _drifting(actuator):
    remedies = getattr(actuator.controller, "remedies", None)
    return ("controller.dither.phase",) if isinstance(actuator.controller, Cascade) and remedies.dither else ()


# -- plant --------------------------------------------------------------------------------------------------


def _gear(chance, seed, oiled):
    plain = draw_plain(seed, 1.0).actuator.gear
    shafts, couplings, bearings, meshes = dict(plain.shafts), {}, dict(plain.bearings), dict(plain.meshes)
    output, oil = "surface", OilAt(oil=KnownOil(name="X/C 5606J"), temperature=COLD)
    if chance(0.4):
        output, shafts["flap"] = "flap", Shaft(inertia=chance.spread(1e-3, 1e-2))
        gap = chance.spread(1e-4, 2e-3) if chance() else None
        couplings["hinge"] = Coupling(
            a="surface", b="flap", stiffness=chance.spread(2e3, 2e4), damping=chance.spread(0.1, 2), gap=gap
        )
    if chance(0.2):
        couplings["return"] = Coupling(a="idler", stiffness=0.2, damping=1e-4)
    if oiled:
        warm = OilAt(oil=oil.oil, temperature=293.15)
        bearings["oiled"] = Bearing(
            shaft="motor",
            coulomb=2e-3,
            breakaway=3e-3,
            viscous=2e-5,
            thickening=Thickening(lubricant=oil, measured_with=warm, exponent=0.7),
            film=Palmgren(diameter=0.012, factor=1.0, lubricant=oil) if chance() else None,
        )
        if chance():
            friction = Din3990(static=0.2, lubricant=oil, roughness=0.8e-6, face_width=8e-3)
            meshes["first"] = replace(meshes["first"], friction=friction)
    stops = {}
    if chance(0.3):
        stops["ends"] = EndStop(
            shaft=output, lower=-STOP, upper=STOP, stiffness=chance.spread(1e3, 1e4), damping=chance.spread(0.1, 10)
        )
    return replace(
        plain, shafts=shafts, couplings=couplings, bearings=bearings, meshes=meshes, stops=stops, output=output
    )


def _rotor(chance):
    return Rotor(
        cogging=Cogging(amplitude=chance.spread(1e-3, 2e-2), periods=24, phase=1.0) if chance() else None,
        drag=RotorDrag(eddy=2e-6, viscous=1e-5, windage=1e-8) if chance() else None,
    )


def _motor(chance, kind):
    limit = chance.between(1, 3) if chance() else None
    if kind == "TorqueSource":
        return TorqueSource(torque_limit=limit)
    common = {"inertia": ROTOR, "rotor": _rotor(chance)}
    if kind == "CurrentSource":
        lag = chance.spread(1e-4, 1e-3) if chance() else None
        return CurrentSource(torque_constant=0.075, lag=lag, torque_limit=limit, **common)
    common |= {"resistance": RESISTANCE, "temperature_dependence": TemperatureDependence() if chance() else None}
    if kind == "DCMotor":
        return DCMotor(inductance=INDUCTANCE, torque_constant=0.075, **common)
    ratio = chance.of(1.0, 1.0, 2.0)
    saturation = Saturation(lost_q=1e-4, current_d=40.0, current_q=20.0, magnet_current=30.0) if chance(0.3) else None
    inductances = {"inductance_d": INDUCTANCE, "inductance_q": ratio * INDUCTANCE}
    return PMSM(pole_pairs=4, flux=0.0125, saturation=saturation, **inductances, **common)


def _link(chance):
    chopper = BrakingChopper(resistance=20.0, start=LINK + 10, full=LINK + 30) if chance() else None
    return DCLink(
        source_voltage=LINK,
        source_resistance=chance.spread(0.1, 2),
        capacitance=chance.spread(1e-4, 2e-3),
        source=chance.of("battery", "rectifier"),
        chopper=chopper,
    )


def _inverter(chance, link, thermal):
    bridge = Bridge(
        dead_time=1e-6, switching_frequency=2e4, threshold=0.5, forward_drop=chance.of(0.0, 0.8), on_resistance=0.02
    )
    undervoltage = UndervoltageDerating(full=LINK - 10, none=LINK - 60) if link and chance() else None
    overheat = OverheatDerating(full=300.0, none=400.0) if thermal and chance() else None
    return Inverter(
        dc_voltage=LINK,
        current_limit=CURRENT,
        limit=chance.of("circle", "hexagon"),
        bridge=bridge if chance() else None,
        undervoltage=undervoltage,
        overheat=overheat,
    )


def _thermal(chance):
    simulated, stator = chance(0.7), chance()
    nodes = {
        "winding": ThermalNode(temperature=COLD + 10, capacity=20.0 if simulated else None),
        "housing": ThermalNode(temperature=COLD, capacity=200.0 if simulated else None),
        "oil": ThermalNode(temperature=COLD, capacity=50.0 if simulated and chance() else None),
        "ambient": ThermalNode(temperature=COLD),
    }
    if stator:
        nodes["stator"] = ThermalNode(temperature=COLD, capacity=100.0)
    inner = "stator" if stator else "housing"
    paths = {"copper": ThermalPath(a="winding", b=inner, resistance=0.5)}
    if stator:
        paths["iron"] = ThermalPath(a="stator", b="housing", resistance=0.2)
    paths["air"] = ThermalPath(a="housing", b="ambient", resistance=0.4)
    paths["gear"] = ThermalPath(a="oil", b="housing", resistance=0.3)
    return ThermalNetwork(nodes=nodes, paths=paths)


def _load(chance):
    if chance(0.3):
        mechanism = chance.of(
            Rack(radius=0.03), Screw(lead=0.1), Lever(radius=0.05, angle=0.2), Lever(radius=0.05, link=0.2, offset=0.01)
        )
        return LinearLoad(
            mass=chance.spread(2, 20),
            stiffness=chance.between(0, 5e3),
            damping=chance.between(0, 50),
            force=chance.between(-100, 100),
            mechanism=mechanism,
        )
    return Load(
        inertia=chance.spread(0.01, 0.1),
        stiffness=chance.between(0, 60),
        damping=chance.between(0, 0.5),
        bias=chance.between(-10, 10),
        gravity=Gravity(moment=5.0, hanging_angle=-1.0) if chance(0.3) else None,
    )


# -- control ------------------------------------------------------------------------------------------------


def _integral(chance, sampled, error):
    if not chance(0.3):
        return None
    return IntegralRemedies(
        dead_band=error * 0.01 if chance() else None,
        leakage=1.0 if chance() else None,
        reset_on_reversal=sampled and chance(),
    )


def _pid(chance, gear, sampled):
    pid = PID.for_inertia(inertia=0.05, bandwidth=chance.spread(20, 80), filter_time=chance.of(None, 1e-3))
    return replace(
        pid,
        limit=chance.of(None, 40.0),
        anti_windup=chance.of(*ANTI_WINDUP) if sampled else "back-calculation",
        setpoint_weight=chance.of(None, 0.5),
        remedies=_integral(chance, sampled, 0.05),
    )


def _cascade(chance, gear, kind, sampled, warm):
    bandwidth, inertia = chance.spread(60, 250), ROTOR + gear.shafts["motor"].inertia + 0.05 / gear.ratio() ** 2
    base = Cascade.for_bandwidths(
        position=bandwidth / chance.between(6, 15),
        speed=bandwidth,
        current=chance.between(1500, 2500),
        inertia=inertia,
        resistance=RESISTANCE,
        inductance=INDUCTANCE,
        speed_limit=400.0,
        feedback=chance.of("load", "motor"),
    )
    reference = chance.of(None, RateLimit(rate=3.0), RateAndAccelerationLimit(rate=3.0, acceleration=200.0))
    return replace(
        base,
        position=chance.of(base.position, P(gain=20.0), PI(proportional=20.0, integral=10.0, limit=8.0)),
        speed=replace(
            base.speed,
            limit=chance.of(None, 1.5),
            anti_windup=chance.of(*ANTI_WINDUP) if sampled else "back-calculation",
            setpoint_weight=chance.of(None, 0.7),
            remedies=_integral(chance, sampled, 10.0),
        ),
        current=base.current if kind in ("PMSM", "DCMotor") else None,
        decoupling=chance(0.8),
        reference=reference,
        feed_forward=FeedForward(inertia=inertia, viscous=1e-4, coulomb=0.01) if reference and chance() else None,
        speed_from=chance.of(None, FilteredDerivative(time=1e-3), PositionObserver(bandwidth=1500.0)),
        torque_filters=_filters(chance),
        disturbance_observer=DisturbanceObserver(inertia=inertia, bandwidth=60.0) if chance(0.3) else None,
        remedies=Remedies(
            compensation=FrictionCompensation(coulomb=0.01, breakaway=0.02, standstill=5.0, width=0.02)
            if chance(0.3)
            else None,
            dither=Dither(amplitude=0.02, frequency=800.0, shape=chance.of("sine", "square") if sampled else "sine")
            if chance(0.3)
            else None,
            knocker=Knocker(amplitude=0.1, width=2e-3, interval=1e-2, dead_band=0.01)
            if sampled and chance(0.3)
            else None,
        ),
        current_demand="MTPA" if kind == "PMSM" and chance(0.4) else "quadrature",
        schedule=_schedule(chance, sampled, warm),
    )


def _filters(chance):
    laws = {
        "low": LowPass(frequency=2000.0),
        "second": SecondOrderLowPass(frequency=2500.0),
        "notch": Notch(frequency=1500.0, damping=0.3, depth=0.1),
        "lead": LeadLag(zero=500.0, pole=800.0),
    }
    return {name: law for name, law in laws.items() if chance(0.25)}


def _schedule(chance, sampled, warm):
    if warm and chance(0.3):
        return ScheduledGain(over="temperature", points=(COLD, 293.15), values=(0.8, 1.0))
    if sampled and chance(0.3):
        return ScheduledGain(over="load", points=(-1.0, 0.0, 1.0), values=(1.2, 1.0, 1.2))
    return None


def _sampling(chance, controller):
    delay = chance.of(0, 1)
    if isinstance(controller, PID):
        return Sampling(position=1e-3, delay=delay)
    if controller.current is None:
        return Sampling(speed=5e-4, position=chance.of(5e-4, 1e-3), delay=delay)
    return Sampling(current=1e-4, speed=chance.of(1e-4, 3e-4), position=chance.of(3e-4, 9e-4), delay=delay)


def _sensors(chance, controller, sampled, electric):
    if controller is None:
        return Sensors()
    pid = isinstance(controller, PID)
    fine = {"resolution": 2 * math.pi / 2**16, "delay": chance.of(0, 1, 3), "noise": 2e-4} if sampled else {}
    angle = AngleSensor(offset=1e-3, eccentricity=2e-3, eccentricity_phase=0.3, **fine)
    small = replace(angle, white_noise=WhiteNoise(distribution="uniform"), noise=2e-5 if sampled else None)
    analog = {"resolution": 0.01, "noise": 0.02} if sampled else {}
    uses_load = pid or controller.feedback == "load"
    return Sensors(
        motor=angle if chance() and not pid else None,
        load=small if chance() and uses_load else None,
        current=CurrentSensor(gain_error=0.01, offset=0.05, **analog) if electric and chance() else None,
    )
