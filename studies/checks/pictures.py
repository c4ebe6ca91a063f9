"""Pictures of the checks: the figures of the gear paper, and both cross-checks beside their published results."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from matplotlib.figure import Figure

from actuator.plots.style import words_of
from studies.checks.cross_check_actuator import ALLOWED, TRAVEL, ActuatorCheck, rod
from studies.checks.cross_check_drive import MACHINE_ALLOWED, DriveCheck, signals_of
from studies.checks.cross_check_record import PERIOD, SIGNALS

if TYPE_CHECKING:
    import xarray

COLORS = ("#4d4d4d", "#3b75af", "#e1812c", "#5a8f3c")
QUADRANTS = {(1, 1): 1, (1, -1): 2, (-1, 1): 3, (-1, -1): 4}  # (sign of v, sign of F_n)


class RigCurve(NamedTuple):
    """The test rig over the load on one flank."""

    normal: np.ndarray  # N
    friction: np.ndarray  # N m on wheel A
    deflection: np.ndarray  # m
    train: np.ndarray  # m, with what bends behind the mesh


def plot_elasticities(data: "xarray.Dataset", springs: Sequence[str]) -> Figure:
    """Force and stiffness over deflection of elasticity laws, with and without backlash."""
    figure = Figure(figsize=(9, 4.2), layout="constrained")
    panels = figure.subplots(1, 2)
    for axes, what, scale, label in zip(
        panels, ("force", "stiffness"), (1, 1e-6), ("normal force in N", "stiffness in N/um"), strict=True
    ):
        for name, color in zip(springs, COLORS, strict=False):
            for law, style in ((name, "-"), (f"{name}, backlash", "--")):
                one = data.sel(law=law)
                axes.plot(1e6 * one.deflection, scale * one[what], color=color, linestyle=style, label=law)
        axes.set_xlabel("mesh deflection in um")
        axes.set_ylabel(label)
        axes.grid(alpha=0.3)
    panels[0].legend(fontsize="x-small")
    return figure


def plot_deformation(curves: Mapping[str, Sequence[RigCurve]]) -> Figure:
    """Deformation and stiffness over the normal force, by speed; both flanks, with only the gap between them."""
    figure = Figure(figsize=(9, 4.2), layout="constrained")
    deformation, stiffness = figure.subplots(1, 2)
    for (label, flanks), color, style in zip(curves.items(), COLORS[1:], ("-", "--"), strict=False):
        for k, (normal, _, deflection, train) in enumerate(flanks):
            for axes, y, line, what in (
                (deformation, 1e6 * deflection, style, ", mesh"),
                (deformation, 1e6 * train, ":", ", with train"),
                (stiffness, 1e-6 * np.gradient(normal, deflection), style, ""),
            ):
                axes.plot(normal, y, color=color, linestyle=line, label="" if k else label + what)
    for axes, what in ((deformation, "deformation in um"), (stiffness, "stiffness in N/um")):
        axes.set(xlabel="normal force in N", ylabel=what)
        axes.grid(alpha=0.3)
        axes.legend(fontsize="small")
    return figure


def plot_friction(curves: Mapping[str, Sequence[RigCurve]]) -> Figure:
    """Friction torque over the normal force in all quadrants, by speed."""
    figure = Figure(figsize=(9, 4.2), layout="constrained")
    axes = figure.subplots()
    for (label, flanks), color in zip(curves.items(), COLORS[1:], strict=False):
        normal, friction, *_ = (np.concatenate(each) for each in zip(*flanks, strict=True))
        axes.plot(normal, friction, color=color, label=label)
    axes.set(xlabel="normal force in N", ylabel="T_A + T_B r_A/r_B in N m")
    axes.grid(alpha=0.3)
    axes.legend(fontsize="small")
    for (speed, flank), quadrant in QUADRANTS.items():
        place = (flank * 300, speed * 0.02)
        axes.annotate(f"quadrant {quadrant}", place, ha="center", color="#8c8c8c", fontsize="small")
    return figure


def plot_rod(check: ActuatorCheck) -> Figure:
    """Both positions, and their deviations."""
    figure = Figure(figsize=(9, 6), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True)
    above.plot(check.clean.t, 1e3 * rod(check.clean), color=COLORS[1], label="here, without noise")
    above.plot(
        check.theirs.time, 1e3 * check.theirs.position, ".", color=COLORS[0], markersize=4, label="Dymola, with noise"
    )
    above.set_ylabel("rod position in mm")
    above.legend(loc="lower right", fontsize="small")
    below.plot(check.noisy.t, 1e6 * check.moved(), color=COLORS[2], lw=0.5, label="here, with noise less without")
    below.plot(check.theirs.time, 1e6 * check.deviation(), ".", color=COLORS[0], markersize=4, label="here less Dymola")
    for side in (-1, 1):
        label = f"limit: {100 * ALLOWED:g} % of {1e3 * TRAVEL:.4g} mm" if side > 0 else None
        below.axhline(side * 1e6 * ALLOWED * TRAVEL, color=COLORS[0], linestyle="--", lw=0.8, label=label)
    below.set_ylabel("deviation in um")
    below.set_xlabel("time in s")
    below.legend(loc="lower right", fontsize="small", bbox_to_anchor=(1.0, 0.08))
    for axes in (above, below):
        axes.grid(alpha=0.3)
    return figure


def plot_machine(check: DriveCheck) -> Figure:
    """Signals over their peaks and their deviations, per excerpt."""
    excerpts = check.theirs.excerpts
    figure = Figure(figsize=(9, 6), layout="constrained")
    panels = figure.subplots(2, len(excerpts), sharex="col", sharey="row", squeeze=False)
    for k, excerpt in enumerate(excerpts):
        time = 1e3 * (excerpt.begin + PERIOD * excerpt.samples)
        above, below = panels[:, k]
        for (name, peak), color in zip(check.theirs.peaks.items(), COLORS, strict=True):
            above.plot(
                time, check.machine[k][name] / peak, color=color, label=f"{words_of(name)}, {peak:.4g} {SIGNALS[name]}"
            )
            few = slice(None, None, max(1, len(time) // 80))
            above.plot(time[few], excerpt.signals[name][few] / peak, "o", color=color, markersize=3, fillstyle="none")
            below.plot(time, 1e6 * check.errors(name)[k] / peak, color=color, label=words_of(name))
        below.set_xlabel("time in ms")
        for axes in (above, below):
            axes.grid(alpha=0.3)
    panels[0, 0].set_ylabel("signal over its peak")
    panels[1, 0].set_ylabel(f"deviation in 1e-6\nof the peak (limit {1e6 * MACHINE_ALLOWED:g})")
    panels[0, -1].legend(title="peaks (circles: motulator)", fontsize="small", title_fontsize="small")
    panels[1, 0].legend(fontsize="small")
    return figure


def plot_drive(check: DriveCheck) -> Figure:
    """Speed, torque and currents of both drives, and their deviations."""
    ours, theirs = signals_of(check.run), check.theirs
    figure = Figure(figsize=(9, 7.5), layout="constrained")
    speed, torque, current, error = figure.subplots(4, 1, sharex=True)
    for axes, names, label in (
        (speed, ("speed",), "speed in rad/s"),
        (torque, ("torque",), "torque in N m"),
        (current, ("current_d", "current_q"), "current in A"),
    ):
        for name in names:
            color = COLORS[list(SIGNALS).index(name)]
            axes.plot(check.run.t, ours[name], color=color, label=f"{words_of(name)}, here")
            axes.plot(
                theirs.time,
                theirs.curves[name],
                "--",
                color=color,
                lw=2.5,
                alpha=0.5,
                label=f"{words_of(name)}, motulator",
            )
        axes.set_ylabel(label)
    for (name, peak), color in zip(theirs.peaks.items(), COLORS, strict=True):
        between = np.interp(theirs.time, check.run.t, ours[name]) - theirs.curves[name]
        error.plot(theirs.time, 100 * between / peak, color=color, label=words_of(name))
    error.set_yscale("symlog", linthresh=1.0)
    error.set_ylabel("deviation in %\nof the peak")
    error.set_xlabel("time in s")
    for axes in (speed, torque, current, error):
        axes.grid(alpha=0.3)
        axes.legend(fontsize="small", loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure
