"""Comparison of an electromechanical actuator with Dymola: Modelica's ActuatorWithNoise.

The example Blocks.Examples.Noise.ActuatorWithNoise of the Modelica Standard Library, by A. Kloeckner, F. van der
Linden, D. Zimmer and M. Otter (DLR), and its published result (Modelica Association, MAP-LIB_ReferenceResults, BSD
3-clause; Dymola 2020x), built here from the parts of this project. Its parts and their counterparts:

    ideal rotation to translation   rod and load are shafts turned by 300 rad per metre
    LossyGear, rigid teeth          teeth 10 times as stiff as the free play, friction at the motor, with sticking
    bearing friction of LossyGear   behind the teeth, as there: 0.1 N m at the motor is 1 N m at the wheel
    noise on the measured angle     the input `motor_angle_error`, a new value every 5 ms from the generator of this
                                    project, as the numbers of Dymola are not published
"""

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from actuator import Actuator, CurrentSource, LinearLoad, Rack, Run, Staircase, Step, WhiteNoise, simulate
from controllers import PI, Cascade, FilteredDerivative, RateLimit
from gear import (
    Bearing,
    Coupling,
    EfficiencyPoint,
    GivenPair,
    Linear,
    Mesh,
    Shaft,
    TabulatedEfficiency,
    Transmission,
)
from studies.checks.cross_check_record import require_columns
from studies.checks.deviation import Deviation

DATA = Path(__file__).parent.parent / "data" / "cross_check_actuator.json"
DURATION = 8.0  # s
RESOLUTION = 2e-4  # s
RATIO = 10.0
TURNS = 300.0  # rad of rod and load per metre
COMMAND = 50.0  # rad of the motor
TRAVEL = COMMAND / RATIO / TURNS  # m
TORQUE_CONSTANT = 3 * 112.3 / (2 * math.pi * 50 / 2)  # N m per A rms: 112.3 V rms a phase at 50 Hz, 2 pole pairs
SPEED_GAIN = 10.0 * TORQUE_CONSTANT
NOISE, NOISE_PERIOD = 0.01, 5e-3  # rad, s
TEETH = 1e7  # N m/rad at the wheel
WHEEL = 1e-3  # kg m^2; LossyGear has no inertia, the rotors are 58 there
ALLOWED = 1e-3  # of the travel


class Recorded(NamedTuple):
    """Dymola's rod position [m] over time [s]."""

    time: np.ndarray
    position: np.ndarray


def recorded(csv: Path | None = None) -> Recorded:
    """Read the published table; by default the excerpt of this package."""
    if csv is None:
        stored = json.loads(DATA.read_text(encoding="utf-8"))
        return Recorded(np.array(stored["time_s"]), np.array(stored["rod_position_m"]))
    rows = np.genfromtxt(csv, delimiter=",", names=True, deletechars="")
    require_columns(csv, ("time", "rodMass.s"), rows.dtype.names or ())
    return Recorded(rows["time"], rows["rodMass.s"])


def actuator_with_noise() -> Actuator:
    """The actuator of the example; its noise is an input."""
    return Actuator(
        motor=CurrentSource(torque_constant=TORQUE_CONSTANT, inertia=0.29, lag=1e-3),
        gear=_gear(),
        load=LinearLoad(mass=100.0, force=1e4, mechanism=Rack(radius=1 / TURNS)),
        controller=Cascade(
            position=PI(proportional=3.0, integral=3.0 / 0.5),
            speed=PI(proportional=SPEED_GAIN, integral=SPEED_GAIN / 0.05),
            current=None,
            speed_limit=1e4,  # never reached: the example has none
            feedback="motor",
            reference=RateLimit(rate=50.0 / RATIO, time=1e-3),
            speed_from=FilteredDerivative(time=0.01),
        ),
        name="ActuatorWithNoise",
    )


def _gear() -> Transmission:
    # friction on wheel A alone; a wheel B inside a ring turns the same way
    pair = GivenPair(radius_a=0.01, radius_b=-0.01 * RATIO, friction_arm_a=0.01, friction_arm_b=0.0)
    per_square = 1 / (pair.radius_b**2 * math.cos(pair.pressure_angle))
    efficiency = EfficiencyPoint(speed=0.0, a_drives=0.85, b_drives=0.80)
    return Transmission(
        shafts={
            "motor": Shaft(inertia=0.29),
            "wheel": Shaft(inertia=WHEEL),
            "rod": Shaft(inertia=3.0 / TURNS**2),
            "load": Shaft(inertia=1e-9),  # the mass is that of the load
        },
        meshes={
            "gearbox": Mesh(
                a="motor",
                b="wheel",
                pair=pair,
                elasticity=Linear(stiffness=TEETH * per_square, damping=math.sqrt(TEETH * WHEEL) * per_square),
                friction=TabulatedEfficiency(points=(efficiency,)),
                stick_by="conjugate speed",
            )
        },
        bearings={"gearbox": Bearing(shaft="wheel", coulomb=0.1 * RATIO, breakaway=0.1 * RATIO)},
        couplings={
            "free_play": Coupling(a="wheel", b="rod", stiffness=1e6, damping=1e4, gap=math.radians(0.1)),
            "rod": Coupling(a="rod", b="load", stiffness=1e8 / TURNS**2, damping=1e5 / TURNS**2),
        },
        input="motor",
        output="load",
    )


def noise(seed: int = 0) -> Staircase:
    """Uniform noise on the measured motor angle [rad]."""
    law, values = WhiteNoise(distribution="uniform", seed=seed), []
    state = law.memory().initial
    for _ in range(round(DURATION / NOISE_PERIOD)):
        values.append(NOISE * float(law.value(state)))
        state = law.advance(state)
    return Staircase(times=tuple(NOISE_PERIOD * k for k in range(len(values))), values=tuple(values))


def move(plant: Actuator, error: Staircase | None = None, progress: Callable[[float], None] | None = None) -> Run:
    """Simulate the 8 s of the example; the controller starts at rest with the first measured angle."""
    step = {"reference": Step(time=0.5, after=COMMAND / RATIO)}
    if error is None:
        return simulate(plant, DURATION, inputs=step, resolution=RESOLUTION, progress=progress)
    first = error.values[0]
    start = {
        "controller.speed_from.filtered_position": first,
        "controller.speed.integral": SPEED_GAIN * 3.0 * first,  # so that the speed law's output is zero
    }
    inputs = {**step, "motor_angle_error": error}
    return simulate(plant, DURATION, inputs=inputs, start=start, resolution=NOISE_PERIOD, progress=progress)


def rod(run: Run) -> np.ndarray:
    """Position of the rod [m], in front of the spring to the load."""
    return run["rod.angle"] / TURNS


class ActuatorCheck(NamedTuple):
    """Runs without and with noise, with the published run."""

    theirs: Recorded
    clean: Run
    noisy: Run

    def deviation(self) -> np.ndarray:
        """Deviation without noise from the published position, at its output points [m]."""
        return np.interp(self.theirs.time, self.clean.t, rod(self.clean)) - self.theirs.position

    def moved(self) -> np.ndarray:
        """Effect of the noise on the position [m], at the points of the run with noise."""
        return rod(self.noisy) - np.interp(self.noisy.t, self.clean.t, rod(self.clean))

    def rows(self) -> list[Deviation]:
        """Rows of the table."""
        count = len(self.theirs.time)
        return [
            Deviation(
                what=f"{what}, of the travel", unit="mm", theirs=1e3 * TRAVEL, deviation=1e3 * most, allowed=ALLOWED
            )
            for what, most in (
                (f"rod against Dymola's, {count} outputs", float(np.abs(self.deviation()).max())),
                ("rod with noise against without", float(np.abs(self.moved()).max())),
            )
        ]


def check_actuator(theirs: Recorded, progress: Callable[[float], None]) -> ActuatorCheck:
    """Run it without and with noise; `progress` is called with the share that is done."""
    plant = actuator_with_noise()
    clean = move(plant)
    progress(0.2)
    noisy = move(plant, noise(), lambda time: progress(0.2 + 0.8 * time / DURATION))
    return ActuatorCheck(theirs, clean, noisy)
