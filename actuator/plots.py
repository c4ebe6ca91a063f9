"""Pictures of runs and loops, drawn on figures that need no display."""

from collections.abc import Mapping, Sequence
from typing import Any

import control
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import MultipleLocator

from actuator.loop_margins import margins
from actuator.parameters import require_known
from actuator.run import BACKWARD, FORWARD, FREE, STUCK, Run

MODE_COLORS = {STUCK: "#4d4d4d", FORWARD: "#3b75af", BACKWARD: "#e1812c", FREE: "#d9d9d9"}
LINE_COLORS = {"stuck": "#4d4d4d", "forward": "#3b75af", "backward": "#e1812c"}
LINE_STYLES = {"backward": (0, (4, 3))}  # both directions often lie on each other
LEGEND_ABOVE: dict[str, Any] = {
    "loc": "lower right",
    "bbox_to_anchor": (1, 0.97),
    "fontsize": "small",
    "frameon": False,
}
RIBBON_HEIGHT = 0.28  # inch per contact
DEGREES = 180 / np.pi


def plot_run(run: Run, names: Sequence[str], *, span: tuple[float, float] | None = None) -> Figure:
    """Signals over time, signals of one unit in one panel, above a ribbon of the contact modes.

    Angles are drawn in degrees. `span` is the time window [s]; None for all.
    """
    by_unit: dict[str, list[str]] = {}
    require_known(names, run.signals, "signal")
    for name in names:
        by_unit.setdefault(run.units[name], []).append(name)
    ratios = [1.6] * len(by_unit) + [RIBBON_HEIGHT * len(run.modes) + 0.15]
    figure = Figure(figsize=(9, sum(ratios) + 1.2), layout="constrained")
    axes = figure.subplots(len(ratios), 1, sharex=True, height_ratios=ratios, squeeze=False)[:, 0]
    start, end = span or (run.t[0], run.t[-1])
    seen = (run.t >= start) & (run.t <= end)
    for panel, (unit, group) in zip(axes, by_unit.items(), strict=False):
        scale, shown = (DEGREES, "deg") if unit == "rad" else (1.0, unit)
        for name in group:
            panel.plot(run.t[seen], scale * run[name][seen], label=_words(name), linewidth=1.2)
        panel.set_ylabel(shown)
        panel.grid(alpha=0.3)
        panel.legend(**LEGEND_ABOVE, ncols=len(group))
    draw_ribbon(axes[-1], run)
    axes[-1].set_xlabel("time in s")
    axes[-1].set_xlim(start, end)
    return figure


def draw_ribbon(axes: Axes, run: Run) -> None:
    """One bar per contact, colored by its mode."""
    for row, contact in enumerate(run.modes):
        inside = [change for change in run.changes if change.contact == contact]
        times = [run.t[0], *(change.time for change in inside), run.t[-1]]
        labels = [inside[0].before if inside else str(run.modes[contact][0]), *(change.after for change in inside)]
        for mode, color in MODE_COLORS.items():
            spans = [
                (start, end - start)
                for start, end, label in zip(times, times[1:], labels, strict=False)
                if label == mode
            ]
            axes.broken_barh(spans, (row - 0.4, 0.8), facecolors=color, linewidth=0)
    axes.set_yticks(range(len(run.modes)), [_words(name.removeprefix("gear.")) for name in run.modes])
    axes.invert_yaxis()
    patches = [Patch(color=color, label=mode) for mode, color in MODE_COLORS.items()]
    axes.legend(handles=patches, **LEGEND_ABOVE, ncols=len(patches))


def plot_bode(loops: Mapping[str, control.StateSpace], title: str, frequencies_hz: np.ndarray | None = None) -> Figure:
    """Bode plot of a loop transfer in each contact mode, with its margins in the legend."""
    f = np.logspace(-2, 4, 1500) if frequencies_hz is None else frequencies_hz
    figure = Figure(figsize=(9, 5.6), layout="constrained")
    gain, phase = figure.subplots(2, 1, sharex=True)
    for mode, loop in loops.items():
        hertz = f[2 * f * loop.dt < 1] if loop.dt else f
        response = loop(np.exp(2j * np.pi * hertz * loop.dt) if loop.dt else 2j * np.pi * hertz)
        found = margins(loop)
        color, style = LINE_COLORS.get(mode), LINE_STYLES.get(mode, "-")
        if abs(response).max() < 1e-6:  # noqa: PLR2004 - a stuck gear passes nothing on
            gain.plot([], [], color=color, label=f"{mode}: nothing passes")
            continue
        label = f"{mode}: gain margin {found.gain_db:.1f} dB, phase margin {np.degrees(found.phase_rad):.0f} deg"
        gain.semilogx(hertz, 20 * np.log10(abs(response)), color=color, linestyle=style, label=label)
        angle = np.degrees(np.unwrap(np.angle(response)))
        angle -= 360 * np.round((angle[0] + 90) / 360)  # a loop starts between +90 and -270 deg
        phase.semilogx(hertz, angle, color=color, linestyle=style)
        if np.isfinite(found.phase_rad):
            gain.axvline(found.phase_frequency / (2 * np.pi), color=color, linestyle=":", linewidth=0.8)
    gain.axhline(0, color="k", linewidth=0.8)
    phase.axhline(-180, color="k", linewidth=0.8)
    gain.set_ylim(bottom=max(gain.get_ylim()[0], -120))
    gain.set_ylabel("gain in dB")
    phase.set_ylabel("phase in deg")
    phase.set_xlabel("frequency in Hz")
    phase.yaxis.set_major_locator(MultipleLocator(90))
    for axes in (gain, phase):
        axes.grid(alpha=0.3, which="both")
    if gain.get_legend_handles_labels()[0]:
        gain.legend(fontsize="small", loc="lower left")
    gain.set_title(title, fontsize="medium")
    return figure


def _words(name: str) -> str:
    return name.replace("_", " ").replace(".", " ")
