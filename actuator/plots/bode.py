"""Bode plots: gain and phase of models, loops and measured responses, drawn on figures that need no display.

All of them are made of the same pieces: `bode_panels`, any number of `draw_bode` and `draw_modes`, `finish_bode`.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import control
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter

from actuator.linear.bode import FREQUENCIES, bode_of, envelope, passes, phase_of, to_db
from actuator.linear.margins.crossings import margins
from actuator.plots.style import DEGREES, MODE_COLORS, legend_below
from actuator.system.contact_modes import BACKWARD

FLOOR_DB = -120.0
SHADE, EDGE = "#e8e8e8", "#c4c4c4"
MOST_NAMES = 2
CUT = "nothing passes"
FEW_DECADES = 4.0  # of frequency up to which 2 and 5 have a number, too
DASHED = (0, (4, 3))  # both directions often lie on each other


def bode_panels(figure: Figure, columns: int = 1) -> np.ndarray:
    """Panels for gain, above, and phase, (2, columns)."""
    return figure.subplots(2, columns, sharex=True, sharey="row", squeeze=False, height_ratios=(3, 2))


def draw_bode(  # noqa: PLR0913 - a response and how it looks
    gain: Axes,
    phase: Axes,
    hertz: np.ndarray,
    response: np.ndarray,
    *,
    known: np.ndarray | None = None,
    settled: np.ndarray | None = None,
    in_db: bool = True,
    **line: Any,
) -> None:
    """A response over frequency [Hz], where it is known; with `settled` its points, open where they have not."""
    known = np.isfinite(response) if known is None else known & np.isfinite(response)
    size = np.where(known, to_db(abs(response)) if in_db else abs(response), np.nan)
    for axes, values in ((gain, size), (phase, DEGREES * phase_of(response, known))):
        if settled is None:
            axes.plot(hertz, values, **{"linewidth": 1.2, **line})
        else:
            draw_points(axes, hertz, values, settled, **line)


def draw_points(axes: Axes, hertz: np.ndarray, values: np.ndarray, settled: np.ndarray, **line: Any) -> None:
    """A line over frequency with its points, open where they have not settled."""
    axes.plot(hertz, values, linewidth=1.2, **line)
    axes.plot(hertz[settled], values[settled], "o", color=line["color"], markersize=3)
    axes.plot(hertz[~settled], values[~settled], "o", color=line["color"], markersize=4, mfc="w")


def finish_bode(gain: Axes, phase: Axes, unit: str = "") -> None:
    """Labels, grid and ticks of a gain in dB, of a unit where it has one, and a phase in deg."""
    gain.set_ylabel(f"gain in dB{f' of {unit}' if unit else ''}")
    gain.set_ylim(bottom=max(gain.get_ylim()[0], FLOOR_DB))
    gain.grid(alpha=0.3, which="both")
    finish_phase(phase)


def finish_phase(axes: Axes) -> None:
    """Labels, grid and ticks, at parts of a turn, of a phase over frequency."""
    axes.set_ylabel("phase in deg")
    axes.yaxis.set_major_locator(MaxNLocator(nbins=7, steps=[1, 1.5, 3, 4.5, 9, 10]))
    axes.grid(alpha=0.3, which="both")
    finish_frequency(axes)


def finish_frequency(axes: Axes) -> None:
    """The axis of frequency, in plain numbers: over few decades 0.2, 0.5, 1, 2, ..."""
    axes.set_xlabel("frequency in Hz")
    axes.set_xscale("log")
    low, high = axes.get_xlim()
    few = high < low * 10**FEW_DECADES  # nothing drawn: limits of no meaning, which may be negative
    axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5) if few else (1,)))
    axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axes.xaxis.set_minor_formatter(NullFormatter())


# -- models per contact mode --------------------------------------------------------------------------------


def plot_modes(
    models: Mapping[str, control.StateSpace], title: str, unit: str = "", directions: Mapping[str, str] | None = None
) -> Figure:
    """Gain and phase of every mode in which anything passes, in front of the envelope of all.

    `directions` of the output by mode choose the dashes.
    """
    figure = Figure(figsize=(9, 6), layout="constrained")
    gain, phase = bode_panels(figure)[:, 0]
    draw_modes(gain, phase, models, directions=directions or {})
    finish_bode(gain, phase, unit)
    legend_below(figure, gain, 3)
    gain.set_title(title, fontsize="medium")
    return figure


def draw_modes(
    gain: Axes,
    phase: Axes,
    models: Mapping[str, control.StateSpace],
    frequencies: np.ndarray = FREQUENCIES,
    *,
    directions: Mapping[str, str] | None = None,
) -> None:
    """The envelope of all modes over frequency [rad/s]; with their directions a line per mode, too."""
    step = max(float(model.dt or 0) for model in models.values())
    frequencies = frequencies[frequencies * step < np.pi]
    passing = {name: model for name, model in models.items() if passes(model)}
    hertz = frequencies / (2 * np.pi)
    if passing:
        band = envelope(passing, frequencies)
        draw_envelope(gain, hertz, to_db(band.gain_low), to_db(band.gain_high))
        draw_envelope(phase, hertz, DEGREES * band.phase_low, DEGREES * band.phase_high)
    name_cut(gain, [name for name in models if name not in passing])
    for k, (name, model) in enumerate(passing.items() if directions is not None else ()):
        size, angle = bode_of(model, frequencies)
        style = mode_style(name, k, directions or {})
        gain.plot(hertz, to_db(size), linewidth=1.2, label=name, **style)
        phase.plot(hertz, DEGREES * angle, linewidth=1.2, **style)


def draw_envelope(axes: Axes, hertz: np.ndarray, low: np.ndarray, high: np.ndarray) -> None:
    """Between which values all modes lie, with an edge, as they often lie on each other."""
    label = "envelope of the linear modes"
    axes.fill_between(hertz, low, high, facecolor=SHADE, edgecolor=EDGE, linewidth=2, label=label)


def name_cut(axes: Axes, modes: Sequence[str]) -> None:
    """An entry of the legend for modes that have no line."""
    if modes:
        which = ", ".join(modes) if len(modes) <= MOST_NAMES else f"{len(modes)} modes"
        axes.plot([], [], " ", label=f"{CUT}: {which}", gid=CUT)


def mode_style(mode: str, k: int, directions: Mapping[str, str]) -> dict[str, Any]:
    """Color and line of a contact mode, the k-th in a picture."""
    dashed = directions.get(mode, mode) == BACKWARD
    return {"color": MODE_COLORS.get(mode, f"C{(k + 2) % 10}"), "linestyle": DASHED if dashed else "-"}


def plot_loops(loops: Mapping[str, control.StateSpace], title: str) -> Figure:
    """Bode plot of a loop transfer in each contact mode, with its margins in the legend."""
    figure = Figure(figsize=(9, 5.6), layout="constrained")
    gain, phase = bode_panels(figure)[:, 0]
    for k, (mode, loop) in enumerate(loops.items()):
        style = mode_style(mode, k, {})
        if not passes(loop):
            gain.plot([], [], color=style["color"], label=f"{mode}: {CUT}")
            continue
        found = margins(loop)
        frequencies = FREQUENCIES[FREQUENCIES * float(loop.dt or 0) < np.pi]
        size, angle = bode_of(loop, frequencies)
        label = f"{mode}: gain margin {found.gain_db:.1f} dB, phase margin {DEGREES * found.phase_rad:.0f} deg"
        gain.plot(frequencies / (2 * np.pi), to_db(size), label=label, **style)
        phase.plot(frequencies / (2 * np.pi), DEGREES * angle, **style)
        if np.isfinite(found.phase_rad):
            gain.axvline(found.phase_frequency / (2 * np.pi), color=style["color"], linestyle=":", linewidth=0.8)
    gain.axhline(0, color="k", linewidth=0.8)
    phase.axhline(-180, color="k", linewidth=0.8)
    finish_bode(gain, phase)
    if gain.get_legend_handles_labels()[0]:
        gain.legend(fontsize="small", loc="lower left")
    gain.set_title(title, fontsize="medium")
    return figure
