"""What the load feels of an actuator that is hardly moved: free play, and the torque that drives it back."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from actuator.actuator import Actuator
from actuator.response.bench.bench import Numbers
from actuator.simulation.run import Run
from actuator.simulation.signals import Ramp, Table
from actuator.simulation.simulate import simulate
from actuator.stiction.standstill import rest_state
from actuator.system.hybrid import HybridSystem

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LOADED = 0.5  # part of the largest torque above which the play is taken up
RETURNS = 0.2  # part of its motion within which a load comes back
AROUND = 3  # times the load goes to and fro; the last counts
STANDS = 1e-6  # rad/s at the motor, below which it stands
TURNED = 1e-2  # rad at the motor, after which it is driven back


@dataclass(frozen=True, kw_only=True)
class FreePlay:
    """How far the load moves before anything pushes back.

    Attributes
    ----------
    width_rad : float
        Between the two flanks, each extrapolated from where it is loaded to no torque.
    lost_motion_rad : float
        Width of the loop of angle over torque at no torque: free play and what friction holds.
    stiffness : float
        Of the loaded flanks, their mean [N m/rad].
    run : Run
        The last of the cycles that were run, and those before.
    """

    width_rad: float
    lost_motion_rad: float
    stiffness: float
    torque: np.ndarray = field(repr=False)
    angle: np.ndarray = field(repr=False)
    run: Run = field(repr=False)

    @property
    def numbers(self) -> Numbers:
        """By name, with their units."""
        return {
            "free play": (self.width_rad, "rad"),
            "lost motion": (self.lost_motion_rad, "rad"),
            "stiffness of the gear": (self.stiffness, "N m/rad"),
        }

    def plot(self) -> "Figure":
        """Angle over torque, with both flanks extrapolated."""
        from actuator.plots.bench import plot_free_play

        return plot_free_play(self)


def free_play(
    plant: Actuator | HybridSystem,
    *,
    torque: float,
    period: float = 4.0,
    inputs: Mapping[str, float] | None = None,
    parameters: Mapping[str, float] | None = None,
    compiled: bool | None = None,
) -> FreePlay:
    """Turn the load to and fro with a slow triangle of torque, and take the play between its flanks.

    Parameters
    ----------
    plant : Actuator or HybridSystem
        `block_motor(actuator)` for the play of the gear; with its controller, for what that makes of it.
    torque : float
        Largest, on top of what `inputs` has [N m]; it should take up the play and overcome the friction behind it.
    period : float
        [s].
    inputs, parameters, compiled
        As for `simulate`.

    Raises
    ------
    ValueError
        Where the angle runs away: a load that nothing holds has no play.
    """
    base = dict(inputs or {}).get("load_torque", 0.0)
    times = tuple(period * k / 4 for k in (0, *range(1, 4 * AROUND, 2), 4 * AROUND))
    signs = (0, *(1 if k % 2 == 0 else -1 for k in range(2 * AROUND)), 0)
    triangle = Table(times=times, values=tuple(base + torque * sign for sign in signs))
    run = simulate(
        plant,
        times[-1],
        inputs={**(inputs or {}), "load_torque": triangle},
        start=rest_state(plant, inputs, parameters),
        parameters=parameters,
        resolution=period / 2000,
        compiled=compiled,
    )
    late = run.t >= times[-1] - 1.25 * period  # from one crest, over the trough, to the next and to zero
    time, angle, pushed = run.t[late], run["load_angle"][late], run["load_torque"][late] - base
    rising = np.gradient(pushed, time) > 0
    ends, slopes = [], []
    for sign in (1, -1):
        flank = (sign * pushed > LOADED * torque) & (rising == (sign > 0))
        slope, offset = np.polyfit(pushed[flank], angle[flank], 1)
        ends.append(offset)
        slopes.append(slope)
    ago = float(np.interp(times[-1] - period, run.t, run["load_angle"]))
    if not (np.array(slopes) > 0).all() or abs(angle[-1] - ago) > RETURNS * np.ptp(angle):
        raise ValueError(
            f"free_play: the load does not come back, it is {np.degrees(abs(angle[-1] - ago)):.3g} deg farther in "
            "every cycle of the torque; block the motor (`block_motor`), or use less torque"
        )
    middle = [np.interp(0.0, *_sorted(pushed[part], angle[part])) for part in (rising, ~rising)]
    return FreePlay(
        width_rad=float(ends[0] - ends[1]),
        lost_motion_rad=float(abs(middle[0] - middle[1])),
        stiffness=float(1 / np.mean(slopes)),
        torque=pushed,
        angle=angle,
        run=run,
    )


def _sorted(by: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    order = np.argsort(by, kind="stable")
    return by[order], values[order]


@dataclass(frozen=True, kw_only=True)
class BackDriving:
    """The torque at the load that turns the motor.

    Attributes
    ----------
    torque : float
        [N m], with the sign of its direction; infinite where the gear locks up to the highest that was tried.
    highest : float
        That was tried [N m].
    run : Run
        The ramp.
    """

    torque: float
    highest: float
    run: Run = field(repr=False)

    @property
    def locks(self) -> bool:
        """Whether the motor stands up to the highest torque."""
        return math.isinf(self.torque)

    @property
    def numbers(self) -> Numbers:
        """By name, with their units."""
        return {"back-driving torque": (self.torque, "N m")}

    def plot(self) -> "Figure":
        """Motion of motor and load over the torque."""
        from actuator.plots.bench import plot_back_driving

        return plot_back_driving(self)


def back_driving(
    plant: Actuator | HybridSystem,
    *,
    highest: float,
    duration: float = 10.0,
    inputs: Mapping[str, float] | None = None,
    parameters: Mapping[str, float] | None = None,
    compiled: bool | None = None,
) -> BackDriving:
    """Ramp up the torque on the load until the motor turns.

    Parameters
    ----------
    plant : Actuator or HybridSystem
        Mostly `remove_drive(actuator)`.
    highest : float
        At which the ramp ends [N m], with a sign.
    duration : float
        Of the ramp [s].
    inputs, parameters, compiled
        As for `simulate`.
    """
    base = dict(inputs or {}).get("load_torque", 0.0)
    ramp = Ramp(start=base, slope=highest / duration)
    run = simulate(
        plant,
        duration,
        inputs={**(inputs or {}), "load_torque": ramp},
        start=rest_state(plant, inputs, parameters),
        parameters=parameters,
        resolution=duration / 4000,
        compiled=compiled,
    )
    turned = np.flatnonzero(abs(run["motor_angle"] - run["motor_angle"][0]) > TURNED)
    if not turned.size:
        return BackDriving(torque=math.copysign(math.inf, highest), highest=highest, run=run)
    standing = np.flatnonzero(abs(run["motor_speed"][: turned[0]]) < STANDS)
    last = standing[-1] if standing.size else 0
    return BackDriving(torque=float(run["load_torque"][last] - base), highest=highest, run=run)
