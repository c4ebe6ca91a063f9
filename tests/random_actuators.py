"""Two-stage actuators drawn at random, all of them sensible, for tests that should hold for every actuator."""

import math
from typing import NamedTuple

import numpy as np

from actuator import PMSM, Actuator, Inverter, Load, Sine, Step, Sum
from controllers import Cascade
from gear import Backlash, Bearing, Coulomb, ExternalPair, Linear, Mesh, Shaft, Transmission

RESISTANCE, INDUCTANCE, ROTOR = 0.3, 4e-4, 2e-5  # ohm, H, kg m^2
SHAFTS = ("motor", "idler", "surface")


class Drawn(NamedTuple):
    """An actuator with the inputs it is to follow."""

    actuator: Actuator
    inputs: dict
    stick_by: str


def draw(seed, duration):
    """The actuator with this number, and a scenario of the given duration [s]."""
    rng = np.random.default_rng(seed)
    stick_by = ("mesh speed", "conjugate speed")[seed % 2]
    gear = _gear(rng, stick_by)
    load = Load(
        inertia=_spread(rng, 0.01, 0.1),
        stiffness=rng.uniform(0, 60),
        damping=rng.uniform(0, 0.5),
        bias=rng.uniform(-15, 15),
    )
    actuator = Actuator(
        name=f"random {seed}",
        motor=PMSM(
            pole_pairs=4,
            resistance=RESISTANCE,
            inductance_d=INDUCTANCE,
            inductance_q=INDUCTANCE,
            flux=0.0125,
            inertia=ROTOR,
        ),
        inverter=Inverter(dc_voltage=270.0, current_limit=30.0),
        gear=gear,
        load=load,
        controller=_controller(rng, gear, load),
    )
    inputs = {
        "reference": Sum(
            parts=(
                Step(time=0.04 * duration, after=rng.uniform(-0.2, 0.2)),
                Step(time=0.6 * duration, after=rng.uniform(-0.1, 0.1)),
            )
        ),
        "load_torque": Sine(amplitude=rng.uniform(0, 5), frequency=rng.uniform(0.5, 5)),
    }
    return Drawn(actuator, inputs, stick_by)


def _spread(rng, low, high):
    """A number between the bounds, as likely in one decade as in another."""
    return math.exp(rng.uniform(math.log(low), math.log(high)))


def _gear(rng, stick_by):
    gap = rng.random() < 0.4
    friction = {"motor": (2e-3, 2e-2), "idler": (5e-3, 1e-1), "surface": (0.05, 1.0)}
    bearings = {}
    for shaft in SHAFTS[: rng.integers(0, 4)]:
        coulomb = _spread(rng, *friction[shaft])
        bearings[shaft] = Bearing(
            shaft=shaft, coulomb=coulomb, breakaway=coulomb * rng.uniform(1, 1.7), viscous=_spread(rng, 1e-6, 1e-4)
        )
    return Transmission(
        shafts={
            "motor": Shaft(inertia=_spread(rng, 5e-6, 5e-5)),
            "idler": Shaft(inertia=_spread(rng, 2e-5, 2e-4)),
            "surface": Shaft(inertia=_spread(rng, 2e-4, 2e-3)),
        },
        meshes={
            "first": _mesh(rng, "motor", "idler", 0.8e-3, stick_by, gap),
            "second": _mesh(rng, "idler", "surface", 1.25e-3, stick_by, gap),
        },
        bearings=bearings,
        input="motor",
        output="surface",
    )


def _mesh(rng, a, b, module, stick_by, gap):  # noqa: PLR0913 - one mesh in one line
    elasticity = Linear(stiffness=_spread(rng, 2e7, 3e8), damping=_spread(rng, 1e3, 2e5))
    if gap:
        elasticity = Backlash(gap=_spread(rng, 5e-6, 1e-4), law=elasticity)
    sliding = rng.uniform(0.03, 0.35)
    pair = ExternalPair(teeth_a=int(rng.integers(17, 30)), teeth_b=int(rng.integers(50, 130)), module=module)
    friction = Coulomb(sliding=sliding, static=sliding * rng.uniform(1, 1.6))
    return Mesh(a=a, b=b, pair=pair, elasticity=elasticity, friction=friction, stick_by=stick_by)


def _controller(rng, gear, load):
    bandwidth = _spread(rng, 60, 400)
    return Cascade.for_bandwidths(
        position=bandwidth / rng.uniform(5, 15),
        speed=bandwidth,
        current=rng.uniform(2000, 6000),
        inertia=ROTOR + gear.shafts["motor"].inertia + load.inertia / gear.ratio() ** 2,
        resistance=RESISTANCE,
        inductance=INDUCTANCE,
        speed_limit=400.0,
        feedback="load" if rng.random() < 0.5 else "motor",
    )
