"""Pictures of a robustness study: what its measures depend on, and every actuator of the production."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from studies.robustness.robustness import Robustness

SHOWN = 12  # parameters


def plot_influences(found: Robustness, labels: Mapping[str, str]) -> Figure:
    """Total and first-order indices, a bar per parameter; `labels` say what each measure is."""
    figure = Figure(figsize=(9, 3.8), layout="constrained")
    panels = figure.subplots(1, len(found.influences), squeeze=False)[0]
    for axes, (measure, rows) in zip(panels, found.influences.items(), strict=True):
        shown = rows[:SHOWN][::-1]
        at = np.arange(len(shown))
        axes.barh(at + 0.2, [row.total for row in shown], 0.4, xerr=[row.total_within for row in shown], label="total")
        axes.barh(
            at - 0.2, [row.alone for row in shown], 0.4, xerr=[row.alone_within for row in shown], label="first order"
        )
        axes.set_yticks(at, [row.parameter for row in shown], fontsize="small")
        axes.set_xlabel(f"share of the variance of\n{labels[measure]}")
        most = max(row.total + row.total_within for row in rows)
        axes.set_xlim(0, max(1.25, 1.05 * most))
        axes.grid(alpha=0.3, axis="x")
        if not any(row.total for row in rows):
            axes.text(0.5, 0.5, "does not vary", ha="center", transform=axes.transAxes)
    panels[0].legend(fontsize="small", loc="lower right")
    return figure


def plot_scatter(found: Robustness, labels: Mapping[str, bool], happens: Callable[[Mapping[str, Any]], bool]) -> Figure:
    """Every actuator over the two parameters with the largest indices, marked by whether something happens."""
    rows = max(found.influences.values(), key=lambda rows: rows[0].total)
    names = [row.parameter for row in rows[:2]]
    names = names if len(names) == 2 else names * 2  # noqa: PLR2004 - two axes
    figure = Figure(figsize=(6, 4.2), layout="constrained")
    axes = figure.subplots()
    for (label, marks), style in zip(labels.items(), "ox", strict=True):
        chosen = [p for p, result in zip(found.points, found.results, strict=True) if happens(result) == marks]
        if chosen:
            axes.plot([p[names[0]] for p in chosen], [p[names[1]] for p in chosen], style, ms=5, label=label)
    axes.set_xlabel(f"factor on {names[0]}")
    axes.set_ylabel(f"factor on {names[1]}")
    axes.legend(fontsize="small")
    axes.grid(alpha=0.3)
    return figure
