"""Signals over time above a ribbon of the contact modes, drawn on figures that need no display."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from matplotlib.patches import Patch

from actuator.plots.style import ABOVE, MODE_COLORS, shown_as, words_of
from gear.quantities import require_known

if TYPE_CHECKING:
    from actuator.simulation.run import Run

PANEL, RIBBON, EDGES = 1.6, 0.28, 1.35  # inch: a panel, the ribbon per contact, all else

Spans = list[tuple[float, float, str]]  # start and duration [s], mode


def plot_run(run: "Run", names: Sequence[str], *, span: tuple[float, float] | None = None) -> Figure:
    """Signals over time above a ribbon of the contact modes; `span` is the time window [s], None for all."""
    start, end = span or (run.t[0], run.t[-1])
    seen = (run.t >= start) & (run.t <= end)
    require_known(names, run.signals, "signal")
    signals = {name: (run.units[name], run[name][seen]) for name in names}
    figure = Figure(figsize=(9, height_of(signals, run.modes)), layout="constrained")
    draw_signals(figure, run.t[seen], signals, {contact: _spans(run, contact) for contact in run.modes})
    figure.axes[-1].set_xlim(start, end)
    return figure


def _spans(run: "Run", contact: str) -> Spans:
    """When a contact was in which mode."""
    changes = [change for change in run.changes if change.contact == contact]
    times = [run.t[0], *(change.time for change in changes), run.t[-1]]
    labels = [changes[0].before if changes else str(run.modes[contact][0]), *(change.after for change in changes)]
    return [(start, end - start, label) for start, end, label in zip(times, times[1:], labels, strict=False)]


def height_of(signals: Mapping[str, tuple[str, np.ndarray]], contacts: Mapping | Sequence) -> float:
    """Of a figure of signals and contacts [inch]."""
    return PANEL * len({unit for unit, _ in signals.values()}) + RIBBON * len(contacts) + EDGES


def draw_signals(
    figure: Figure | SubFigure,
    time: np.ndarray,
    signals: Mapping[str, tuple[str, np.ndarray]],
    contacts: Mapping[str, Spans],
) -> None:
    """Signals by name, each with its SI unit and values: those of one unit in one panel; and the ribbon."""
    by_unit: dict[str, list[str]] = {}
    for name, (unit, _) in signals.items():
        by_unit.setdefault(unit, []).append(name)
    ratios = [PANEL] * len(by_unit) + [RIBBON * len(contacts) + 0.15]
    *panels, ribbon = figure.subplots(len(ratios), 1, sharex=True, height_ratios=ratios, squeeze=False)[:, 0]
    for panel, (unit, group) in zip(panels, by_unit.items(), strict=True):
        shown = shown_as(unit)
        for name in group:
            panel.plot(time, shown.scale * signals[name][1], label=words_of(name), linewidth=1.2)
        panel.set_ylabel(shown.unit)
        panel.grid(alpha=0.3)
        panel.legend(**ABOVE, ncols=len(group))
    _draw_ribbon(ribbon, contacts)


def _draw_ribbon(axes: Axes, contacts: Mapping[str, Spans]) -> None:
    """One bar per contact, colored by its mode."""
    for row, spans in enumerate(contacts.values()):
        for mode, color in MODE_COLORS.items():
            bars = [(start, duration) for start, duration, label in spans if label == mode]
            axes.broken_barh(bars, (row - 0.4, 0.8), facecolors=color, linewidth=0)
    axes.set_yticks(range(len(contacts)), [words_of(name) for name in contacts])
    axes.invert_yaxis()
    patches = [Patch(color=color, label=mode) for mode, color in MODE_COLORS.items()]
    axes.legend(handles=patches, **ABOVE, ncols=len(patches))
    axes.set_xlabel("time in s")
