"""Where the energy of an actuator goes.

Oracles: the powers that the outputs name, integrated over time by the engine as further states, against the differences
of the stored energies; the damping loss from the speeds of the shafts, by its laws; the work done on the load from its
own potential and damping.
"""

import math
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from actuator import (
    PMSM,
    Actuator,
    BrakingChopper,
    Bridge,
    Cogging,
    DCLink,
    DCMotor,
    Gravity,
    Inverter,
    Lever,
    LinearLoad,
    Load,
    Rotor,
    RotorDrag,
    Saturation,
    Sine,
    Step,
    simulate,
)
from actuator.system.hybrid import Quantity
from controllers import Cascade, Sampling
from gear import Backlash, Bearing, Coulomb, Coupling, ExternalPair, Linear, Mesh, Shaft, Transmission

pytestmark = pytest.mark.thorough

LOSSES = ("copper", "iron", "drag", "inverter", "friction", "damping")
POWERS = ("electrical_power", "load_power", "source_power", *(f"{name}_loss" for name in (*LOSSES, "link", "chopper")))
STORED = ("magnetic_energy", "mechanical_energy")
USUAL = 1e-3  # J
DURATION = 0.3  # s


def integrating(system, names):
    """The same system with the integrals of some outputs as states, behind those that move."""
    moving, places = system.moving, [[quantity.name for quantity in system.outputs].index(name) for name in names]
    sizes = [system.flow.size1_in(k) for k in range(4)]

    def with_integrals(function, result, *first):
        """`function` of the plain system with the wider state, its first result through `result` (value, integrals)."""
        kind = ca.MX if function.is_a("MXFunction") else ca.SX
        x, m, u, p = (kind.sym(name, size) for name, size in zip("xmup", sizes, strict=True))
        y, before = kind.sym("y", len(names)), [kind.sym("first", size) for size in first]
        rest = [m, u, p] if function.n_in() == len(first) + 4 else [p]
        found = function.call([*before, x, *rest])
        wide = ca.vertcat(x[:moving], y, x[moving:])
        powers = system.outputs_function(x, m, u, p)[places]
        inner = ca.Function("inner", [x, y, *before, *rest], [result(found[0], y, powers), *found[1:]])
        whole = kind.sym("whole", wide.numel())
        parts = [ca.vertcat(whole[:moving], whole[moving + len(names) :]), whole[moving : moving + len(names)]]
        return ca.Function(function.name(), [*before, whole, *rest], inner.call([*parts, *before, *rest]))

    def beside(more):
        return lambda value, y, powers: ca.vertcat(value[:moving], more(y, powers), value[moving:])

    kept, growing = beside(lambda y, powers: y), beside(lambda y, powers: powers)
    return replace(
        system,
        contact_state=None,  # that of the plain system has fewer states
        states=(
            *system.states[:moving],
            *(Quantity(f"{name}.integral", "J", USUAL) for name in names),
            *system.states[moving:],
        ),
        flow=with_integrals(system.flow, growing),
        margins=with_integrals(system.margins, lambda value, *_: value),
        reset=with_integrals(system.reset, kept, len(system.margin_names)),
        outputs_function=with_integrals(system.outputs_function, lambda value, *_: value),
        tick=with_integrals(system.tick, kept, len(system.clocks)) if system.clocks else None,
        begin=None if system.begin is None else with_integrals(system.begin, kept),
    )


def gear(**more):
    """Two stages of which one has a gap, bearings that stick, and a flexible hinge with free play."""
    parts = {
        "shafts": {
            "motor": Shaft(inertia=2e-5),
            "idler": Shaft(inertia=5e-5),
            "surface": Shaft(inertia=1e-3),
            "flap": Shaft(inertia=5e-3),
        },
        "meshes": {
            "first": Mesh(
                a="motor",
                b="idler",
                pair=ExternalPair(teeth_a=18, teeth_b=90, module=0.8e-3),
                elasticity=Linear(stiffness=1e8, damping=2e4),
                friction=Coulomb(sliding=0.1, static=0.15),
                stick_by="conjugate speed",  # by mesh speed, friction may drive by a little near standstill
            ),
            "second": Mesh(
                a="idler",
                b="surface",
                pair=ExternalPair(teeth_a=17, teeth_b=119, module=1.25e-3),
                elasticity=Backlash(gap=2e-5, law=Linear(stiffness=1e8, damping=2e4)),
                friction=Coulomb(sliding=0.1, static=0.15),
                stick_by="conjugate speed",  # by mesh speed, friction may drive by a little near standstill
            ),
        },
        "couplings": {"hinge": Coupling(a="surface", b="flap", stiffness=8e3, damping=2.0, gap=5e-4)},
        "bearings": {"motor": Bearing(shaft="motor", coulomb=0.01, breakaway=0.02, viscous=2e-5)},
        "input": "motor",
        "output": "flap",
    }
    return Transmission(**(parts | more))


ROTOR = Rotor(
    cogging=Cogging(amplitude=0.01, periods=24, phase=0.4), drag=RotorDrag(eddy=3e-6, viscous=2e-5, windage=1e-8)
)
BRIDGE = Bridge(dead_time=1e-6, switching_frequency=2e4, threshold=0.5, forward_drop=0.8, on_resistance=0.02)
SALIENT = PMSM(
    pole_pairs=4,
    resistance=0.3,
    inductance_d=4e-4,
    inductance_q=6e-4,
    flux=0.0125,
    inertia=2e-5,
    rotor=ROTOR,
    saturation=Saturation(lost_q=1e-4, current_d=40.0, current_q=20.0, magnet_current=30.0),
)
BRUSHED = DCMotor(resistance=0.3, inductance=4e-4, torque_constant=0.075, inertia=2e-5, rotor=ROTOR)
SURFACE = Load(inertia=0.03, stiffness=40.0, damping=0.2, bias=4.0, gravity=Gravity(moment=3.0, hanging_angle=-1.0))
LEVER = LinearLoad(
    mass=8.0,
    stiffness=2e3,
    damping=30.0,
    force=60.0,
    mechanism=Lever(radius=0.05, angle=0.3, link=0.2, offset=0.01),
)


def drive(motor=SALIENT, load=SURFACE, sampling=None, **more):
    controller = Cascade.for_bandwidths(
        position=20.0,
        speed=150.0,
        current=2000.0,
        inertia=8e-5,
        resistance=0.3,
        inductance=4e-4,
        speed_limit=400.0,
    )
    link = DCLink(
        source_voltage=270.0,
        source_resistance=0.5,
        capacitance=5e-4,
        source="rectifier",
        chopper=BrakingChopper(resistance=20.0, start=270.5, full=275.0),
    )
    return Actuator(
        motor=motor,
        inverter=Inverter(dc_voltage=270.0, current_limit=30.0, bridge=BRIDGE),
        link=link,
        gear=gear(),
        load=load,
        controller=replace(controller, current_demand="MTPA") if motor is SALIENT else controller,
        sampling=sampling,
        **more,
    )


CYCLE = {"reference": Step(time=0.01, after=0.3), "load_torque": Sine(amplitude=8.0, frequency=9.0)}
FAST = Sampling(current=1e-4, speed=2e-4, position=1e-3)
DRIVES = {
    "PMSM": drive(),
    "PMSM and a rod": drive(load=LEVER),
    "PMSM, sampled": drive(sampling=FAST),
    "DC motor": drive(motor=BRUSHED),
}


@pytest.fixture(scope="module", params=DRIVES.values(), ids=DRIVES.keys())
def cycle(request):
    """A driving cycle: there with its whole torque, stopped, and shaken by the load."""
    system = integrating(request.param.system(), POWERS)
    inputs = CYCLE | ({"load_force": 40.0} if "load_force" in [q.name for q in system.inputs] else {})
    run = simulate(system, DURATION, inputs=inputs, resolution=2e-4, tolerance=1e-9, compiled=False)
    return request.param, run


def gained(run, name):
    return run[name][-1] - run[name][0]


def test_the_energy_of_a_driving_cycle_is_accounted_for(cycle):
    _, run = cycle
    work = {name: gained(run, f"{name}.integral") for name in POWERS}
    scale = abs(work["electrical_power"])
    losses = sum(work[f"{name}_loss"] for name in LOSSES)
    stored = sum(gained(run, name) for name in STORED)
    assert scale > 1.0
    assert all(work[f"{name}_loss"] > 1e-5 * scale for name in (*LOSSES, "chopper"))
    assert work["electrical_power"] == pytest.approx(work["load_power"] + losses + stored, abs=1e-6 * scale)
    at_link = work["electrical_power"] + work["link_loss"] + work["chopper_loss"] + gained(run, "link_energy")
    assert work["source_power"] == pytest.approx(at_link, abs=1e-6 * scale)


def test_no_loss_is_ever_negative(cycle):
    _, run = cycle
    for name in (*LOSSES, "link", "chopper"):
        assert run[f"{name}_loss"].min() >= -1e-9 * run[f"{name}_loss"].max(), name


def test_damping_is_what_the_laws_of_teeth_hinge_and_grease_take(cycle):
    """While the flanks are pressed harder than they are damped, force and rate of each are known."""
    plant, run = cycle
    expected = plant.gear.bearings["motor"].viscous * run["motor.speed"] ** 2
    sure = np.ones(len(run.t), dtype=bool)
    for name, mesh in plant.gear.meshes.items():
        pair = mesh.pair
        rate = pair.radius_a * run[f"{mesh.a}.speed"] + pair.radius_b * run[f"{mesh.b}.speed"]
        law, gap = (mesh.elasticity.law, mesh.elasticity.gap) if name == "second" else (mesh.elasticity, None)
        beyond = abs(run[f"gear.meshes.{name}.deflection"]) - (gap or 0) / 2
        engaged = (beyond > 0) if gap else True
        expected = expected + engaged * law.damping * rate**2 * math.cos(pair.working_angle)
        if gap:
            sure &= (beyond < 0) | (law.stiffness * beyond > law.damping * abs(rate))
    hinge = plant.gear.couplings["hinge"]
    rate, beyond = run["surface.speed"] - run["flap.speed"], abs(run["gear.couplings.hinge.twist"]) - hinge.gap / 2
    expected = expected + (beyond > 0) * hinge.damping * rate**2
    sure &= (beyond < 0) | (hinge.stiffness * beyond > hinge.damping * abs(rate))
    assert sure.mean() > 0.5
    scale = run["damping_loss"].max()
    np.testing.assert_allclose(run["damping_loss"][sure], expected[sure], rtol=1e-6, atol=1e-9 * scale)


def test_the_load_gets_its_potential_and_its_damping():
    load = SURFACE
    run = simulate(
        integrating(drive().system(), ("load_power",)),
        0.1,
        inputs={"reference": 0.3},
        resolution=1e-4,
        tolerance=1e-9,
        compiled=False,
    )
    angle = run["load_angle"]
    potential = load.stiffness * angle**2 / 2 - load.bias * angle
    potential = potential - load.gravity.moment * np.cos(angle - load.gravity.hanging_angle)
    damped = np.trapezoid(load.damping * run["load_speed"] ** 2, run.t)
    assert damped > 0.01
    assert gained(run, "load_power.integral") == pytest.approx(potential[-1] - potential[0] + damped, rel=1e-5)
