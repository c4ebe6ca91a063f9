"""Pictures of periodic orbits, drawn on figures that need no display."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Patch

from actuator.orbits.orbit import Orbit
from actuator.plots.runs import DEGREES, LEGEND_ABOVE, MODE_COLORS, RIBBON_HEIGHT
from actuator.simulation.run import contact_labels
from gear.quantities import require_known

if TYPE_CHECKING:
    from actuator.continuation.bifurcations import Branch


def plot_orbit(orbit: Orbit, names: Sequence[str]) -> Figure:
    """Outputs over one period, a panel per unit, a ribbon of contact modes, and the multipliers in the unit circle."""
    units = {quantity.name: quantity.unit for quantity in orbit.system.outputs}
    require_known(names, units, "output")
    by_unit: dict[str, list[str]] = {}
    for name in names:
        by_unit.setdefault(units[name], []).append(name)
    contacts = list(contact_labels(orbit.system, orbit.modes))
    ratios = [1.6] * len(by_unit) + [RIBBON_HEIGHT * len(contacts) + 0.15]
    figure = Figure(figsize=(12, sum(ratios) + 1.2), layout="constrained")
    left, right = figure.subfigures(1, 2, width_ratios=(2.6, 1))  # pyright: ignore[reportGeneralTypeIssues]
    axes = left.subplots(len(ratios), 1, sharex=True, height_ratios=ratios, squeeze=False)[:, 0]
    time, signals = orbit.path[0], orbit.signals(names)
    for panel, (unit, group) in zip(axes, by_unit.items(), strict=False):
        scale, shown = (DEGREES, "deg") if unit == "rad" else (1.0, unit)
        for name in group:
            panel.plot(time, scale * signals[name], label=name.replace("_", " ").replace(".", " "), linewidth=1.2)
        panel.set_ylabel(shown)
        panel.grid(alpha=0.3)
        panel.legend(**LEGEND_ABOVE, ncols=len(group))
    _ribbon(axes[-1], orbit, contacts)
    axes[-1].set_xlabel("time in s")
    axes[-1].set_xlim(0, orbit.period)
    _circle(right.subplots(), orbit)
    return figure


def _ribbon(axes: Axes, orbit: Orbit, contacts: Sequence[str]) -> None:
    """One bar per contact, colored by its mode."""
    ends = np.cumsum([segment.duration for segment in orbit.segments])
    labels = [contact_labels(orbit.system, segment.modes) for segment in orbit.segments]
    for row, contact in enumerate(contacts):
        for end, segment, names in zip(ends, orbit.segments, labels, strict=True):
            span = [(end - segment.duration, segment.duration)]
            axes.broken_barh(span, (row - 0.4, 0.8), facecolors=MODE_COLORS[names[contact]], linewidth=0)
    axes.set_yticks(range(len(contacts)), [name.removeprefix("gear.").replace(".", " ") for name in contacts])
    axes.invert_yaxis()
    patches = [Patch(color=color, label=mode) for mode, color in MODE_COLORS.items()]
    axes.legend(handles=patches, **LEGEND_ABOVE, ncols=len(patches))


def _circle(axes: Axes, orbit: Orbit) -> None:
    """Floquet multipliers and the unit circle."""
    axes.add_patch(Circle((0, 0), 1, fill=False, color="k", linewidth=0.8))
    axes.plot(np.real(orbit.multipliers), np.imag(orbit.multipliers), "o", markersize=5, label="multipliers")
    axes.plot([orbit.trivial.real], [orbit.trivial.imag], "+", color="k", label="shift in time")
    reach = max(1.2, 1.1 * float(abs(orbit.multipliers).max(initial=1.0)))
    axes.set(xlim=(-reach, reach), ylim=(-reach, reach), aspect="equal", xlabel="real", ylabel="imaginary")
    verdict = "stable" if orbit.stable else "unstable"
    largest = abs(orbit.multipliers).max()
    axes.set_title(f"{verdict}, period {orbit.period:.6g} s\nlargest multiplier {largest:.4g}", fontsize="medium")
    axes.grid(alpha=0.3)
    axes.legend(fontsize="small", loc="lower left")


def plot_branch(branch: "Branch") -> Figure:
    """Amplitude, period and the largest multiplier over the parameter; unstable orbits open, the end marked."""
    figure = Figure(figsize=(8, 7), layout="constrained")
    axes = figure.subplots(3, 1, sharex=True)
    rows = {
        "amplitude in deg": [DEGREES * orbit.load_amplitude for orbit in branch.orbits],
        "period in s": [orbit.period for orbit in branch.orbits],
        "largest multiplier": [abs(orbit.multipliers).max() for orbit in branch.orbits],
    }
    for panel, (label, values) in zip(axes, rows.items(), strict=True):
        stable = branch.stable
        panel.plot(branch.values, values, color="#3b75af", linewidth=1.0)
        panel.plot(branch.values[stable], np.array(values)[stable], "o", color="#3b75af", markersize=4, label="stable")
        panel.plot(branch.values[~stable], np.array(values)[~stable], "o", color="#3b75af", mfc="w", label="unstable")
        panel.axvline(branch.end.value, color="#e1812c", linewidth=1.0, label=f"{branch.end.kind}")
        panel.set_ylabel(label)
        panel.grid(alpha=0.3)
    axes[0].legend(**LEGEND_ABOVE, ncols=3)
    axes[-1].set_xlabel(branch.parameter)
    return figure
