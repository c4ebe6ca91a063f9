"""Pictures of why something hunts and of what helps."""

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from actuator.plots.style import CYCLE
from actuator.verdict.verdict import Verdict

if TYPE_CHECKING:
    from actuator.diagnosis.causes import Causes
    from actuator.diagnosis.countermeasures import RemedyTable
    from actuator.diagnosis.cycle_energy import CycleEnergy

VERDICT_COLORS = {
    Verdict.REST: "#2e8b57",
    Verdict.HUNTING: "#c0392b",
    Verdict.LIMIT_CYCLE: "#e1812c",
    Verdict.QUANTIZER: "#8e6bb0",
    Verdict.DIVERGING: "#4d4d4d",
    Verdict.IRREGULAR: "#d9b44a",
    Verdict.UNDECIDED: "#f2dfa5",
    Verdict.FAILED: "#ffffff",
}
GIVES, TAKES = "#c0392b", "#3b75af"
ROW = 0.32  # inch per bar
ROOM = 0.4  # of the longest bar, for the words behind it


def plot_energy(energy: "CycleEnergy") -> Figure:
    """Energy of each element as bars."""
    figure = Figure(figsize=(8, 1.2 + ROW * len(energy.shown())), layout="constrained")
    draw_energy(figure.subplots(), energy)
    return figure


def draw_energy(axes: Axes, energy: "CycleEnergy") -> None:
    """Energy of each element as bars, the largest giver on top."""
    shown = energy.shown()
    values = 1e3 * np.array(list(shown.values()))
    axes.barh(range(len(shown)), values, color=[GIVES if value > 0 else TAKES for value in values])
    axes.set_yticks(range(len(shown)), list(shown))
    axes.invert_yaxis()
    axes.axvline(0, color="black", linewidth=0.8)
    axes.set_xlabel("energy given to the mechanics per period in mJ")
    axes.grid(axis="x", alpha=0.3)


def plot_causes(causes: "Causes") -> Figure:
    """Energies above, amplitude with each cause removed below."""
    rows = [len(causes.energy.shown()) if causes.energy else 0, 1 + len(causes.counterfactuals)]
    panels = [count for count in rows if count]
    figure = Figure(figsize=(8, 1.3 * len(panels) + ROW * sum(panels)), layout="constrained")
    axes = list(figure.subplots(len(panels), 1, height_ratios=[count + 1 for count in panels], squeeze=False)[:, 0])
    if causes.energy:
        draw_energy(axes[0], causes.energy)
    below = axes[-1]
    named = [("nothing removed", causes.hunting), *((f"without {c.cause}", c.hunting) for c in causes.counterfactuals)]
    for row, (_, hunting) in enumerate(named):
        size = CYCLE.scale * hunting.amplitude_rad if hunting.cycles else 0.0
        below.barh(row, size, color=VERDICT_COLORS[hunting.verdict])
        below.annotate(f" {hunting.verdict}", (size, row), va="center", fontsize="small")
    below.set_yticks(range(len(named)), [name for name, _ in named])
    below.invert_yaxis()
    below.set_xlabel(CYCLE.label("amplitude at the load"))
    below.margins(x=0.3)
    below.set_xlim(left=0)
    below.grid(axis="x", alpha=0.3)
    return figure


def plot_remedies(table: "RemedyTable") -> Figure:
    """Largest error and heat of every remedy, the best on top."""
    rows = [table.before, *table.ranked]
    figure = Figure(figsize=(9, 1.4 + ROW * len(rows)), layout="constrained")
    panels = figure.subplots(1, 3, sharey=True, width_ratios=[2, 1, 1])
    colors = [VERDICT_COLORS[Verdict.REST if row.excited else row.hunting.verdict] for row in rows]
    columns = (
        (CYCLE.label("largest error"), [CYCLE.scale * row.error for row in rows]),
        ("mean loss in W", [row.hunting.duty.mean_loss for row in rows]),
        ("stiction factor", [row.stiction_factor for row in rows]),
    )
    for axes, (label, values) in zip(panels, columns, strict=True):
        bars = axes.barh(range(len(rows)), np.nan_to_num(values), color=colors)
        axes.set_xlabel(label)
        axes.grid(axis="x", alpha=0.3)
        if axes is panels[0]:  # a row without a bar has no error, or no verdict
            axes.bar_label(bars, [row.outcome for row in rows], padding=3, fontsize="small")
            axes.set_xlim(0, (1 + ROOM) * max(np.nan_to_num(values)) or 1.0)
    panels[0].set_yticks(range(len(rows)), [f"{row.name} {row.setting}".strip() for row in rows])
    panels[0].invert_yaxis()
    seen = [verdict for verdict, color in VERDICT_COLORS.items() if color in colors]
    patches = [Patch(color=VERDICT_COLORS[verdict], label=verdict) for verdict in seen]
    figure.legend(handles=patches, loc="outside upper right", ncols=len(seen), fontsize="small", frameon=False)
    return figure
