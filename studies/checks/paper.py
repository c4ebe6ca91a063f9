"""Cases of the gear paper: figure 9, a preloaded gear with stick-slip; and a compound planetary set for benchmarks.

F. L. J. van der Linden, "Modeling of geared positioning systems: an object oriented gear contact model with
validation", Tables 3 and 4. The paper gives neither load spring nor damper; 1000 N m/rad and 2 N m s/rad
are used. Its printed lever arms do not follow from its printed geometry (they are those of r_B = r_A);
both are here by name.
"""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Literal

from actuator import Actuator, Constant, Load, Ramp, Sine, TorqueSource
from actuator.simulation.signals import Signal
from gear import Bearing, Coulomb, ExternalPair, GivenPair, InternalPair, Linear, Mesh, Shaft, Transmission
from gear.arrangements import stepped_planetary
from gear.planets import MeshLaws, Planets

PRELOAD = 5.0  # N m on wheel A
RAMP = 1.0  # N m/s
PAIRS = {
    "geometric": ExternalPair(teeth_a=20, teeth_b=60, module=1e-3),
    "printed": GivenPair(
        radius_a=0.01,
        radius_b=0.03,
        friction_arm_a=9.2e-3,
        friction_arm_b=15.0e-3,
        friction_factor=0.84,
        pressure_angle=math.radians(20),
    ),
}


def figure_9(arms: Literal["geometric", "printed"] = "geometric") -> Actuator:
    """Torque on wheel A, one mesh with Coulomb friction 0.15 (0.2 static), a spring on wheel B."""
    mesh = Mesh(
        a="wheel_a",
        b="wheel_b",
        pair=PAIRS[arms],
        elasticity=Linear(stiffness=2e8, damping=2e5),
        friction=Coulomb(sliding=0.15, static=0.2),
    )
    gear = Transmission(
        shafts={"wheel_a": Shaft(inertia=5e-4), "wheel_b": Shaft(inertia=1e-3)},
        meshes={"mesh": mesh},
        input="wheel_a",
        output="wheel_b",
    )
    return Actuator(
        name=f"figure 9, {arms} lever arms", motor=TorqueSource(), gear=gear, load=Load(stiffness=1000.0, damping=2.0)
    )


def figure_9_inputs() -> Mapping[str, Signal]:
    """5 N m, rising by 1 N m/s from time zero."""
    return {"torque_reference": Ramp(start=PRELOAD, slope=RAMP)}


def figure_9_start(plant: Actuator) -> Mapping[str, float]:
    """The static equilibrium of the preload without friction."""
    assert isinstance(plant.load, Load)  # of that case
    pair, spring, stiffness = plant.gear.meshes["mesh"].pair, plant.load.stiffness, 2e8
    force = PRELOAD / (pair.radius_a * math.cos(pair.working_angle))
    angle_b = -force * pair.radius_b * math.cos(pair.working_angle) / spring
    return {
        "wheel_a.angle": (force / stiffness - pair.radius_b * angle_b) / pair.radius_a,
        "wheel_b.angle": angle_b,
    }


def compound_planetary() -> Actuator:
    """A stepped planetary set, 1:9, with every mesh and two bearings able to stick, against a spring."""
    laws = MeshLaws(elasticity=Linear(stiffness=1e8, damping=2e4), friction=Coulomb(sliding=0.1, static=0.15))
    gear = stepped_planetary(
        sun_planet=ExternalPair(teeth_a=20, teeth_b=40, module=1e-3),
        step_ring=InternalPair(teeth_a=20, teeth_b=80, module=1e-3, addendum_b=0.7),
        planets=Planets(count=3, inertia=2e-6, mass=0.02),
        inertias={"sun": 1e-5, "carrier": 1e-5, "ring": 1e-5},
        laws=laws,
    )
    bearings = {name: Bearing(shaft=name, coulomb=0.005, breakaway=0.01) for name in ("sun", "carrier")}
    return Actuator(
        name="compound planetary",
        motor=TorqueSource(),
        gear=replace(gear, bearings=bearings),
        load=Load(inertia=1e-3, damping=0.05, stiffness=2.0),
    )


def compound_planetary_inputs() -> Mapping[str, Signal]:
    """Back and forth under a constant load."""
    return {"torque_reference": Sine(amplitude=0.5, frequency=1.0), "load_torque": Constant(value=0.5)}
