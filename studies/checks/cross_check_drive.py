"""Comparison of a 2.2 kW PMSM drive, machine and control, with motulator.

The published example "2.2-kW interior PMSM, current-vector control" of motulator 0.18.0 (MIT licence), with measured
rotor position, a stiff link of 540 V and an averaged inverter: 1500 rpm from 0.2 s on, 14 N m from 0.6 s on.

Machine: the motor and inverter of this project are driven by the recorded duty ratios and load torque. Those of
sample k act from k + 1 to k + 2, as the drive has a computation delay of one period.

Drive: the sampled cascade of this project, with the same bandwidths, limits and delay. Differences: it filters its
torque reference and then limits it, while motulator filters the limited current reference, so it is briefly faster
where the limit is reached; and one current law for both axes cancels the pole of the winding, while motulator controls
flux linkages with two degrees of freedom.
"""

import math
from functools import lru_cache
from typing import NamedTuple

import casadi as ca
import numpy as np

from actuator import PMSM, Actuator, Inverter, Run, Step, simulate
from actuator.parts.park import to_axes
from controllers import PI, Cascade, LowPass, PositionObserver, Sampling
from gear import Shaft, Transmission
from studies.checks.cross_check_record import (
    LOAD,
    LOAD_TIME,
    PERIOD,
    SIGNALS,
    SPEED,
    SPEED_TIME,
    Excerpt,
    Recorded,
    key_figures,
)
from studies.checks.deviation import Deviation

INERTIA = 0.015  # kg m^2, in total
COUPLING = 1e-4  # kg m^2, the part of it assigned to the only shaft of the gear
MOTOR = PMSM(
    pole_pairs=3,
    resistance=3.6,
    inductance_d=0.036,
    inductance_q=0.051,
    flux=0.545,
    inertia=INERTIA - COUPLING,
)
INVERTER = Inverter(dc_voltage=540.0, current_limit=1.5 * math.sqrt(2) * 4.3)
DURATION = 1.2  # s
CURRENT_BANDWIDTH, REFERENCE_BANDWIDTH, SPEED_BANDWIDTH, OBSERVER_BANDWIDTH = (
    2 * math.pi * hertz for hertz in (200.0, 100.0, 4.0, 400.0)
)
STEPS = 2  # Runge-Kutta steps per period; twice as many change the currents by less than 1e-7 of their peaks
MACHINE_ALLOWED, DRIVE_ALLOWED = 1e-3, 3e-2  # of the peaks, of the key figures


# -- the machine ------------------------------------------------------------------------------------------


@lru_cache(maxsize=1)
def _one_period() -> ca.Function:
    """(state, duties and load torque) -> state a period later."""
    x, u = ca.SX.sym("x", 4), ca.SX.sym("u", 4)

    def flow(state: ca.SX) -> ca.SX:
        currents, speed, electrical = [state[0], state[1]], state[2], MOTOR.pole_pairs * state[3]
        asked = to_axes([INVERTER.dc_voltage * u[k] for k in range(3)], electrical)
        rates = MOTOR.derivatives(currents, INVERTER.terminal_voltages(asked, currents, electrical), speed)
        return ca.vertcat(*rates, (MOTOR.torque(currents) - u[3]) / INERTIA, speed)

    after, h = x, PERIOD / STEPS
    for _ in range(STEPS):
        k1 = flow(after)
        k2 = flow(after + h / 2 * k1)
        k3 = flow(after + h / 2 * k2)
        k4 = flow(after + h * k3)
        after += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return ca.Function("one_period", [x, u], [after])


def driven_machine(excerpt: Excerpt) -> dict[str, np.ndarray]:
    """What the machine does with the recorded duty ratios and load torque, at the known samples."""
    inputs = np.vstack([excerpt.duties, excerpt.load])
    states = _one_period().mapaccum(inputs.shape[1])(excerpt.start, inputs).full()
    direct, quadrature, speed, _ = np.column_stack([excerpt.start, states])[:, excerpt.samples]
    torque = np.array([float(MOTOR.torque([d, q])) for d, q in zip(direct, quadrature, strict=True)])
    return dict(zip(SIGNALS, (direct, quadrature, torque, speed), strict=True))


# -- the drive --------------------------------------------------------------------------------------------


def drive() -> Actuator:
    """A speed drive of this project with the other's bandwidths, limits and delay."""
    speed = PI(
        proportional=2 * SPEED_BANDWIDTH * INERTIA,
        integral=SPEED_BANDWIDTH**2 * INERTIA,
        setpoint_weight=0.5,
        back_calculation=SPEED_BANDWIDTH,
    )
    current = PI.for_winding(
        resistance=MOTOR.resistance,
        inductance=(MOTOR.inductance_d + MOTOR.inductance_q) / 2,
        bandwidth=CURRENT_BANDWIDTH,
    )
    return Actuator(
        motor=MOTOR,
        inverter=INVERTER,
        gear=Transmission(shafts={"rotor": Shaft(inertia=COUPLING)}, input="rotor", output="rotor"),
        controller=Cascade(
            position=None,
            speed=speed,
            current=current,
            speed_limit=1000.0,  # far away
            speed_from=PositionObserver(bandwidth=OBSERVER_BANDWIDTH),
            torque_filters={"reference": LowPass(frequency=REFERENCE_BANDWIDTH)},
            current_demand="MTPA",
        ),
        sampling=Sampling(current=PERIOD, speed=PERIOD, delay=1),
        name="2.2 kW drive",
    )


def move() -> Run:
    """Simulate the 1.2 s of the example."""
    inputs = {
        "speed_reference": Step(time=SPEED_TIME, after=SPEED),
        "load_torque": Step(time=LOAD_TIME, after=-LOAD),
    }
    return simulate(drive(), DURATION, inputs=inputs, resolution=PERIOD)


def signals_of(run: Run) -> dict[str, np.ndarray]:
    """Signals of a run by the names of SIGNALS."""
    names = ("motor.current_d", "motor.current_q", "motor_torque", "motor_speed")
    return {name: run[signal] for name, signal in zip(SIGNALS, names, strict=True)}


# -- both -------------------------------------------------------------------------------------------------


class DriveCheck(NamedTuple):
    """The machine on recorded voltages, and the drive, with the published run."""

    theirs: Recorded
    machine: list[dict[str, np.ndarray]]  # per excerpt
    run: Run

    def rows(self) -> list[Deviation]:
        """Rows of the table."""
        machine = [
            Deviation(
                what=f"machine on recorded voltages: {name}, {self._count()} samples",
                unit=unit,
                theirs=self.theirs.peaks[name],
                deviation=max(float(np.abs(error).max()) for error in self.errors(name)),
                allowed=MACHINE_ALLOWED,
            )
            for name, unit in SIGNALS.items()
        ]
        ours = key_figures(self.run.t, signals_of(self.run))
        return machine + [
            Deviation(
                what=f"drive: {name}",
                unit="rad/s" if name == "speed dip" else "A",
                theirs=value,
                deviation=ours[name] - value,
                allowed=DRIVE_ALLOWED,
            )
            for name, value in self.theirs.key_figures.items()
        ]

    def _count(self) -> int:
        return sum(len(excerpt.samples) for excerpt in self.theirs.excerpts)

    def errors(self, name: str) -> list[np.ndarray]:
        """Of the machine, less theirs, per excerpt."""
        return [
            ours[name] - excerpt.signals[name] for ours, excerpt in zip(self.machine, self.theirs.excerpts, strict=True)
        ]


def check_drive(theirs: Recorded) -> DriveCheck:
    """The machine on recorded voltages, and the drive."""
    return DriveCheck(theirs, [driven_machine(excerpt) for excerpt in theirs.excerpts], move())
