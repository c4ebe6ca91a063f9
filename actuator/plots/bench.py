"""Pictures of bench tests and of stiffness, drawn on figures that need no display."""

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, MultipleLocator

from actuator.linear.bode import phase_of
from actuator.plots.response import plain_hertz
from actuator.plots.runs import DEGREES

if TYPE_CHECKING:
    from actuator.response.bench.free_play import BackDriving, FreePlay
    from actuator.response.bench.long import RateTest, SoakTest
    from actuator.response.bench.slow import StaircaseTest, TriangleTest
    from actuator.response.bench.steps import StepTest
    from actuator.response.stiffness import DynamicStiffness

ARCMIN = 60 * DEGREES
BEHIND = 1.15  # part of the torque that drives back, up to which is shown


def plot_stiffness(found: "DynamicStiffness", **where: Any) -> Figure:
    """Size and phase of the stiffness over frequency, a line per amplitude; open where it has not settled."""
    data = found.data.sel(where).isel({name: 0 for name in ("set", "load") if name not in where})
    figure = Figure(figsize=(9, 6.4), layout="constrained")
    size, phase = figure.subplots(2, 1, sharex=True)
    colors = colormaps["viridis"](np.linspace(0.05, 0.9, len(data.amplitude)))
    for amplitude, color in zip(data.amplitude.values, colors, strict=True):
        one = data.sel(amplitude=amplitude)
        moves, settled, hertz = one.moves.values.astype(bool), one.settled.values.astype(bool), one.frequency.values
        label = f"{amplitude:.3g} N m"
        if not moves.any():
            size.plot([], [], color=color, label=f"{label}: no motion")
            continue
        values = np.where(moves, one.stiffness.values, np.nan)
        for axes, row in ((size, abs(values)), (phase, DEGREES * phase_of(values, moves))):
            axes.plot(hertz, row, color=color, linewidth=1.2, label=label)
            axes.plot(hertz[settled], row[settled], "o", color=color, markersize=3)
            axes.plot(hertz[~settled], row[~settled], "o", color=color, markersize=4, mfc="w")
    size.set(xscale="log", yscale="log", ylabel="stiffness in N m/rad")
    plain_hertz(phase)
    phase.set(ylabel="phase in deg", xlabel="frequency in Hz")
    phase.yaxis.set_major_locator(MultipleLocator(45))
    for axes in (size, phase):
        axes.grid(alpha=0.3, which="both")
    size.set_title("dynamic stiffness at the load; open points have not settled", fontsize="medium")
    figure.legend(
        *size.get_legend_handles_labels(), loc="outside lower center", ncols=4, fontsize="small", frameon=False
    )
    return figure


def plot_free_play(found: "FreePlay") -> Figure:
    """Angle over torque, with both flanks extrapolated to no torque."""
    figure = Figure(figsize=(7, 5), layout="constrained")
    axes = figure.subplots()
    middle = float(found.angle.mean())
    axes.plot(found.torque, ARCMIN * (found.angle - middle), linewidth=1.2)
    rising = np.gradient(found.torque) > 0
    for sign in (1, -1):
        flank = (sign * found.torque > found.torque.max() / 2) & (rising == (sign > 0))
        slope, offset = np.polyfit(found.torque[flank], found.angle[flank], 1)
        ends = np.array([0.0, sign * found.torque.max()])
        axes.plot(ends, ARCMIN * (offset + slope * ends - middle), "--", color="k", linewidth=0.8)
    axes.axvline(0, color="k", linewidth=0.8)
    axes.set_xlabel("torque on the load in N m")
    axes.set_ylabel("load angle in arcmin")
    axes.set_title(
        f"free play {ARCMIN * found.width_rad:.3g} arcmin, lost motion {ARCMIN * found.lost_motion_rad:.3g} arcmin, "
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
        moved = DEGREES * (run[name] - run[name][0])[shown]
        axes.plot(run["load_torque"][shown] - base, moved, label=name.replace("_", " "), linewidth=1.2)
    if not found.locks:
        axes.axvline(found.torque, color="#e1812c", linewidth=1)
    words = f"locks up to {found.highest:.4g} N m" if found.locks else f"is driven back by {found.torque:.4g} N m"
    axes.set_title(f"the motor {words}", fontsize="medium")
    axes.set_xlabel("torque on the load in N m")
    axes.set_ylabel("angle in deg")
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
            f"{DEGREES * step.size_rad:.3g} deg: overshoot {step.overshoot:.0%}, rise {1e3 * step.rise_s:.0f} ms, "
            f"settled {_seconds(step.settling_s)}"
        )
        axes.plot(run.t, moved, linewidth=1.2, label=label)
    axes.axhspan(0.98, 1.02, color="#e8e8e8", label="2 % of the step")
    axes.set_xlabel("time in s")
    axes.set_ylabel("load angle over step, from the old reference")
    axes.grid(alpha=0.3)
    figure.legend(loc="outside lower center", ncols=2, fontsize="small", frameon=False)
    return figure


def _seconds(time: float) -> str:
    return f"{time:.2f} s" if np.isfinite(time) else "never"


def plot_triangle(test: "TriangleTest") -> Figure:
    """Load over reference, and load behind motor over motor."""
    figure = Figure(figsize=(9, 4.2), layout="constrained")
    left, right = figure.subplots(1, 2)
    run, late = test.run, test.run.t >= 0.75 * test.period_s
    reference, load, motor = (DEGREES * run[name][late] for name in ("reference", "load_angle", "motor_angle_at_load"))
    left.plot(reference, load, linewidth=1.0)
    left.plot([reference.min(), reference.max()], [reference.min(), reference.max()], "k:", linewidth=0.8)
    left.set(xlabel="reference in deg", ylabel="load angle in deg")
    left.set_title(f"hysteresis {DEGREES * test.hysteresis_rad:.3g} deg", fontsize="medium")
    right.plot(motor, 60 * (load - motor), linewidth=1.0)
    right.set(xlabel="motor angle at the load in deg", ylabel="load behind motor in arcmin")
    right.set_title(f"lost motion {ARCMIN * test.lost_motion_rad:.3g} arcmin", fontsize="medium")
    for axes in (left, right):
        axes.xaxis.set_major_locator(MaxNLocator(5))
        axes.grid(alpha=0.3)
    return figure


def plot_staircase(test: "StaircaseTest") -> Figure:
    """Reference and load over time."""
    figure = Figure(figsize=(9, 4.2), layout="constrained")
    axes = figure.subplots()
    for name, color in (("reference", "#a0a0a0"), ("load_angle", "#3b75af")):
        axes.plot(test.run.t, DEGREES * test.run[name], color=color, linewidth=1.2, label=name.replace("_", " "))
    axes.set(xlabel="time in s", ylabel="angle in deg")
    found = (
        f"{word} {DEGREES * value:.3g} deg"
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
    left.plot(test.rate_run.t, DEGREES * test.rate_run["load_speed"], linewidth=1.0)
    left.axhline(DEGREES * test.rate, color="#e1812c", linewidth=1.0)
    left.set(xlabel="time in s", ylabel="load speed in deg/s")
    left.set_title(f"rate {DEGREES * test.rate:.3g} deg/s", fontsize="medium")
    right.plot(-test.stall_run["total_load_torque"], DEGREES * test.stall_run["load_speed"], linewidth=1.0)
    stalls = np.isfinite(test.stall_torque)
    if stalls:
        right.axvline(test.stall_torque, color="#e1812c", linewidth=1.0)
    right.set(xlabel="torque against the motion in N m", ylabel="load speed in deg/s")
    right.set_title(f"stall at {test.stall_torque:.4g} N m" if stalls else "does not stall", fontsize="medium")
    for axes in (left, right):
        axes.grid(alpha=0.3)
    return figure


def plot_soak(test: "SoakTest") -> Figure:
    """Steps at all temperatures, and the position error while holding."""
    figure = Figure(figsize=(9, 6), layout="constrained")
    upper, lower = figure.subplots(2, 1)
    colors = colormaps["plasma"](np.linspace(0, 0.8, len(test.points)))
    for point, color in zip(test.points, colors, strict=True):
        upper.plot(
            point.step.run.t,
            DEGREES * point.step.run["load_angle"],
            color=color,
            linewidth=1.2,
            label=f"{point.name}: {point.hold.verdict.verdict}",
        )
        run = point.hold.run
        lower.plot(run.t, DEGREES * run["position_error"], color=color, linewidth=1.0)
    upper.set(xlabel="time in s", ylabel="load angle in deg")
    largest = max(float(abs(p.hold.run["position_error"][p.hold.run.t > 1]).max()) for p in test.points)
    lower.set_ylim(-1.2 * DEGREES * largest, 1.2 * DEGREES * largest)
    lower.set(xlabel="time in s", ylabel="position error in deg")
    for axes in (upper, lower):
        axes.grid(alpha=0.3)
    figure.legend(loc="outside lower center", ncols=3, fontsize="small", frameon=False)
    return figure
