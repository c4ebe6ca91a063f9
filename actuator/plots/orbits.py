"""Pictures of periodic orbits, of their families and of what describing functions predict; they need no display."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from actuator.describing.describing import TRUSTED
from actuator.plots.runs import draw_signals, height_of
from actuator.plots.style import ABOVE, shown_as
from actuator.system.contact_modes import contact_labels
from gear.quantities import require_known

if TYPE_CHECKING:
    from actuator.continuation.bifurcations import Branch
    from actuator.describing.check import DescribingCheck
    from actuator.orbits.orbit import Orbit

SPAN = 1e3  # of frequency, below and above that of the orbit, over which a loop is drawn


def plot_orbit(orbit: "Orbit", names: Sequence[str]) -> Figure:
    """Outputs over one period, a panel per unit, a ribbon of contact modes, and the multipliers in the unit circle."""
    units = {quantity.name: quantity.unit for quantity in orbit.system.outputs}
    require_known(names, units, "output")
    signals = {name: (units[name], values) for name, values in orbit.signals(names).items()}
    contacts: dict[str, list[tuple[float, float, str]]] = {}
    began = 0.0
    for segment in orbit.segments:
        for contact, mode in contact_labels(orbit.system, segment.modes).items():
            contacts.setdefault(contact, []).append((began, segment.duration, mode))
        began += segment.duration
    figure = Figure(figsize=(12, height_of(signals, contacts)), layout="constrained")
    left, right = figure.subfigures(1, 2, width_ratios=(2.6, 1))  # pyright: ignore[reportGeneralTypeIssues]
    draw_signals(left, orbit.path[0], signals, contacts)
    left.axes[-1].set_xlim(0, orbit.period)
    _draw_multipliers(right.subplots(), orbit)
    return figure


def _draw_multipliers(axes: Axes, orbit: "Orbit") -> None:
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
    angle = shown_as("rad")
    rows = {
        angle.label("amplitude"): [angle.scale * orbit.load_amplitude for orbit in branch.orbits],
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
    axes[0].legend(**ABOVE, ncols=3)
    axes[-1].set_xlabel(branch.parameter)
    return figure


def plot_describing_functions(check: "DescribingCheck") -> Figure:
    """The loop and -1/N over the complex plane, and the harmonics of the orbit's load speed."""
    figure = Figure(figsize=(11, 4.5), layout="constrained")
    plane, bars = figure.subplots(1, 2)
    first = 2 * np.pi / check.orbit.period
    loop = np.array([complex(check.loop(1j * w)) for w in first * np.geomspace(1 / SPAN, SPAN, 500)])
    plane.plot(np.real(loop), np.imag(loop), label="loop, all contacts sliding")
    plane.plot([-abs(loop).max(), 0], [0, 0], label="-1/N of the friction")
    for cycle in check.cycles:
        at: complex = complex(check.loop(2j * np.pi / cycle.period))
        plane.plot([at.real], [at.imag], "o", label=f"predicted, {'stable' if cycle.stable else 'unstable'}")
    plane.set(xlabel="real, in rad/s per N m", ylabel="imaginary", title="describing function")
    bars.bar(np.arange(1, len(check.harmonics) + 1), check.harmonics / check.harmonics[0])
    bars.axhline(TRUSTED, color="k", linewidth=0.8, label="nearly a sine below")
    bars.set(xlabel="harmonic", ylabel="over the first", title="load speed of the exact orbit")
    for axes in (plane, bars):
        axes.grid(alpha=0.3)
        axes.legend(fontsize="small")
    return figure
