"""Pictures of runs and loops, drawn on figures that need no display."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from actuator.simulation.run import BACKWARD, FORWARD, FREE, STUCK, Run
from gear.quantities import require_known

MODE_COLORS = {STUCK: "#4d4d4d", FORWARD: "#3b75af", BACKWARD: "#e1812c", FREE: "#d9d9d9"}
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


def _words(name: str) -> str:
    return name.replace("_", " ").replace(".", " ")
