"""Pictures of bench tests and of what a drive can do, drawn on figures that need no display."""

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from actuator.plots.style import LOAD_SPEED, PLAY, colors_over, legend_below, shown_as, words_of

if TYPE_CHECKING:
    from actuator.parts.torque_speed import TorqueSpeedCurve
    from actuator.response.bench.free_play import BackDriving, FreePlay
    from actuator.response.bench.long import RateTest, SoakTest
    from actuator.response.bench.slow import StaircaseTest, TriangleTest
    from actuator.response.bench.steps import StepTest

ANGLE = shown_as("rad")
BEHIND = 1.15  # part of the torque that drives back, up to which is shown


def plot_free_play(found: "FreePlay") -> Figure:
    """Angle over torque, with both flanks extrapolated to no torque."""
    figure = Figure(figsize=(7, 5), layout="constrained")
    axes = figure.subplots()
    middle = float(found.angle.mean())
    axes.plot(found.torque, PLAY.scale * (found.angle - middle), linewidth=1.2)
    rising = np.gradient(found.torque) > 0
    for sign in (1, -1):
        flank = (sign * found.torque > found.torque.max() / 2) & (rising == (sign > 0))
        slope, offset = np.polyfit(found.torque[flank], found.angle[flank], 1)
        ends = np.array([0.0, sign * found.torque.max()])
        axes.plot(ends, PLAY.scale * (offset + slope * ends - middle), "--", color="k", linewidth=0.8)
    axes.axvline(0, color="k", linewidth=0.8)
    axes.set_xlabel("torque on the load in N m")
    axes.set_ylabel(PLAY.label("load angle"))
    axes.set_title(
        f"free play {PLAY.text(found.width_rad)}, lost motion {PLAY.text(found.lost_motion_rad)}, "
        f"{found.stiffness:.4g} N m/rad",
        fontsize="medium",
    )
    axes.grid(alpha=0.3)
    return figure


def plot_back_driving(found: "BackDriving") -> Figure:
    """Motion of motor and load over the torque."""
    figure = Figure(figsize=(7, 4), layout="constrained")
    axes = figure.subplots()
    run = found.run
    base = run["load_torque"][0]
    # behind the onset both angles grow without bound
    shown = abs(run["load_torque"] - base) <= (np.inf if found.locks else BEHIND * abs(found.torque))
    for name in ("motor_angle_at_load", "load_angle"):
        moved = ANGLE.scale * (run[name] - run[name][0])[shown]
        axes.plot(run["load_torque"][shown] - base, moved, label=words_of(name), linewidth=1.2)
    if not found.locks:
        axes.axvline(found.torque, color="#e1812c", linewidth=1)
    words = f"locks up to {found.highest:.4g} N m" if found.locks else f"is driven back by {found.torque:.4g} N m"
    axes.set_title(f"the motor {words}", fontsize="medium")
    axes.set_xlabel("torque on the load in N m")
    axes.set_ylabel(ANGLE.label("angle"))
    axes.grid(alpha=0.3)
    axes.legend(fontsize="small")
    return figure


def plot_steps(test: "StepTest") -> Figure:
    """All steps over their sizes, with the band in which they have settled."""
    figure = Figure(figsize=(9, 5), layout="constrained")
    axes = figure.subplots()
    for step in test.steps:
        run = step.run
        moved = 1 + (run["load_angle"] - run["reference"][-1]) / step.size_rad
        label = (
            f"{ANGLE.text(step.size_rad)}: overshoot {step.overshoot:.0%}, rise {1e3 * step.rise_s:.0f} ms, "
            f"settled {_seconds(step.settling_s)}"
        )
        axes.plot(run.t, moved, linewidth=1.2, label=label)
    axes.axhspan(0.98, 1.02, color="#e8e8e8", label="2 % of the step")
    axes.set_xlabel("time in s")
    axes.set_ylabel("load angle over step, from the old reference")
    axes.grid(alpha=0.3)
    legend_below(figure, axes, 2)
    return figure


def _seconds(time: float) -> str:
    return f"{time:.2f} s" if np.isfinite(time) else "never"


def plot_triangle(test: "TriangleTest") -> Figure:
    """Load over reference, and load behind motor over motor."""
    figure = Figure(figsize=(9, 4.2), layout="constrained")
    left, right = figure.subplots(1, 2)
    run, late = test.run, test.run.t >= 0.75 * test.period_s
    reference, load, motor = (run[name][late] for name in ("reference", "load_angle", "motor_angle_at_load"))
    ends = ANGLE.scale * np.array([reference.min(), reference.max()])
    left.plot(ANGLE.scale * reference, ANGLE.scale * load, linewidth=1.0)
    left.plot(ends, ends, "k:", linewidth=0.8)
    left.set(xlabel=ANGLE.label("reference"), ylabel=ANGLE.label("load angle"))
    left.set_title(f"hysteresis {ANGLE.text(test.hysteresis_rad)}", fontsize="medium")
    right.plot(ANGLE.scale * motor, PLAY.scale * (load - motor), linewidth=1.0)
    right.set(xlabel=ANGLE.label("motor angle at the load"), ylabel=PLAY.label("load behind motor"))
    right.set_title(f"lost motion {PLAY.text(test.lost_motion_rad)}", fontsize="medium")
    for axes in (left, right):
        axes.xaxis.set_major_locator(MaxNLocator(5))
        axes.grid(alpha=0.3)
    return figure


def plot_staircase(test: "StaircaseTest") -> Figure:
    """Reference and load over time."""
    figure = Figure(figsize=(9, 4.2), layout="constrained")
    axes = figure.subplots()
    for name, color in (("reference", "#a0a0a0"), ("load_angle", "#3b75af")):
        axes.plot(test.run.t, ANGLE.scale * test.run[name], color=color, linewidth=1.2, label=words_of(name))
    axes.set(xlabel="time in s", ylabel=ANGLE.label("angle"))
    found = (
        f"{word} {ANGLE.text(value)}"
        for word, value in (("resolution", test.resolution_rad), ("threshold after the reversal", test.threshold_rad))
    )
    axes.set_title(", ".join(found), fontsize="medium")
    axes.grid(alpha=0.3)
    axes.legend(fontsize="small")
    return figure


def plot_rate(test: "RateTest") -> Figure:
    """Speed over time in the step, and over the torque on the way to the stall."""
    figure = Figure(figsize=(9, 4.2), layout="constrained")
    left, right = figure.subplots(1, 2)
    left.plot(test.rate_run.t, LOAD_SPEED.scale * test.rate_run["load_speed"], linewidth=1.0)
    left.axhline(LOAD_SPEED.scale * test.rate, color="#e1812c", linewidth=1.0)
    left.set(xlabel="time in s", ylabel=LOAD_SPEED.label("load speed"))
    left.set_title(f"rate {LOAD_SPEED.text(test.rate)}", fontsize="medium")
    right.plot(-test.stall_run["total_load_torque"], LOAD_SPEED.scale * test.stall_run["load_speed"], linewidth=1.0)
    stalls = np.isfinite(test.stall_torque)
    if stalls:
        right.axvline(test.stall_torque, color="#e1812c", linewidth=1.0)
    right.set(xlabel="torque against the motion in N m", ylabel=LOAD_SPEED.label("load speed"))
    right.set_title(f"stall at {test.stall_torque:.4g} N m" if stalls else "does not stall", fontsize="medium")
    for axes in (left, right):
        axes.grid(alpha=0.3)
    return figure


def plot_soak(test: "SoakTest") -> Figure:
    """Steps at all temperatures, and the position error while holding."""
    figure = Figure(figsize=(9, 6), layout="constrained")
    upper, lower = figure.subplots(2, 1)
    colors = colors_over(len(test.points), "plasma", 0.0, 0.8)
    for point, color in zip(test.points, colors, strict=True):
        upper.plot(
            point.step.run.t,
            ANGLE.scale * point.step.run["load_angle"],
            color=color,
            linewidth=1.2,
            label=f"{point.name}: {point.hold.verdict.verdict}",
        )
        run = point.hold.run
        lower.plot(run.t, ANGLE.scale * run["position_error"], color=color, linewidth=1.0)
    upper.set(xlabel="time in s", ylabel=ANGLE.label("load angle"))
    largest = max(float(abs(p.hold.run["position_error"][p.hold.run.t > 1]).max()) for p in test.points)
    lower.set_ylim(-1.2 * ANGLE.scale * largest, 1.2 * ANGLE.scale * largest)
    lower.set(xlabel="time in s", ylabel=ANGLE.label("position error"))
    for axes in (upper, lower):
        axes.grid(alpha=0.3)
    legend_below(figure, upper, 3)
    return figure


def plot_torque_speed(curve: "TorqueSpeedCurve", ax: Axes | None = None) -> Axes:
    """Torque over speed, on axes that are given or new ones."""
    ax = Figure(layout="constrained").subplots() if ax is None else ax
    ax.plot(curve.speeds, curve.torques)
    ax.set(xlabel="motor speed in rad/s", ylabel="torque in N m")
    ax.grid(alpha=0.3)
    return ax
