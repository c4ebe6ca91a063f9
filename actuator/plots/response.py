"""Pictures of measured frequency responses, drawn on figures that need no display."""

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import control
import numpy as np
import xarray
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator, MultipleLocator, NullFormatter

from actuator.linear.bode import phase_of, to_db
from actuator.plots.linear import draw_modes
from actuator.plots.runs import DEGREES

if TYPE_CHECKING:
    from actuator.response.frequency_response import FrequencyResponse
    from actuator.response.record import Spectrum

CLEAR = 0.9  # coherence from which a spectrum is shown over others
MOST_BELOW = 80.0  # dB below the largest that is shown
HARMONICS = (2, 3, 5)  # that get a panel of their own
STILL = ": no motion"
FAILED = ": failed"
READING = "open points have not settled, a line ends where nothing moves or a simulation failed"
LEAST_PERCENT = 0.01  # of the fundamental that is shown


def plot_responses(
    measured: "FrequencyResponse",
    linear: Mapping[str, control.StateSpace] | None = None,
    overlay: Sequence["Spectrum"] = (),
    **where: Any,
) -> Figure:
    """Gain and phase of every amplitude; points that do not settle are open, those that stand still are left out.

    Spectra are laid over it where they are coherent.
    """
    figure = Figure(figsize=(9, 7), layout="constrained")
    gain, phase = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    draw_responses(gain, phase, measured, linear, **where)
    for k, spectrum in enumerate(overlay):
        clear = spectrum.coherence >= CLEAR
        hertz, response = spectrum.frequencies[clear], spectrum.response[clear]
        if clear.any():
            angle = DEGREES * phase_of(response)
            for axes, values in ((gain, to_db(abs(response))), (phase, angle)):
                axes.plot(hertz, values, ".", color=f"C{k + 1}", markersize=4, label=spectrum.label)
    output = str(where.get("output", measured.data.output.values[0])).replace("_", " ")
    gain.set_title(f"{output} over {measured.given.replace('_', ' ')}; {READING}", fontsize="medium")
    figure.legend(
        *gain.get_legend_handles_labels(), loc="outside lower center", ncols=4, fontsize="small", frameon=False
    )
    return figure


def draw_responses(
    gain: Axes,
    phase: Axes,
    measured: "FrequencyResponse",
    linear: Mapping[str, control.StateSpace] | None = None,
    **where: Any,
) -> None:
    """Every amplitude on axes for gain and phase, in front of the envelope of linear models."""
    data = measured.data
    frequencies = data.frequency.values
    top, bottom = -np.inf, np.inf
    if linear:
        span = 2 * np.pi * np.logspace(np.log10(frequencies.min()), np.log10(frequencies.max()), 400)
        step = max(float(model.dt or 0) for model in linear.values())
        draw_modes(gain, phase, linear, span[span * step < np.pi], lines=False)
    for amplitude, label, color in _amplitudes(data):
        response = measured.select(amplitude=amplitude, **where).values
        settled = measured.select("settled", amplitude=amplitude, **where).values.astype(bool)
        known = np.isfinite(response)
        moves = measured.select("moves", amplitude=amplitude, **where).values.astype(bool) & known
        if not moves.any():
            gain.plot([], [], color=color, label=label + (STILL if known.any() else FAILED))
            continue
        size = np.where(moves, to_db(abs(response)), np.nan)
        angle = phase_of(response, moves)
        top, bottom = max(top, np.nanmax(size)), min(bottom, np.nanmin(size))
        for axes, values in ((gain, size), (phase, DEGREES * angle)):
            _draw_points(axes, frequencies, values, settled, color, label)
    if np.isfinite(top):
        gain.set_ylim(max(top - MOST_BELOW, bottom - 6), top + 6)
    gain.set_ylabel("gain in dB")
    phase.set_ylabel("phase in deg")
    phase.set_xlabel("frequency in Hz")
    phase.yaxis.set_major_locator(MaxNLocator(nbins=7, steps=[1, 1.5, 3, 4.5, 9, 10]))
    plain_hertz(phase)
    for axes in (gain, phase):
        axes.grid(alpha=0.3, which="both")


def plain_hertz(axes: Axes) -> None:
    """Plain numbers of hertz: 0.2, 0.5, 1, 2, ..."""
    axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axes.xaxis.set_minor_formatter(NullFormatter())


def _amplitudes(data: xarray.Dataset) -> Iterator[tuple[float, str, np.ndarray]]:
    """Every amplitude with its label and color."""
    unit = str(data.amplitude.attrs["units"])
    scale, shown = (DEGREES, "deg") if unit == "rad" else (1.0, unit)
    colors = colormaps["viridis"](np.linspace(0.05, 0.9, len(data.amplitude)))
    for amplitude, color in zip(data.amplitude.values, colors, strict=True):
        yield float(amplitude), f"{scale * amplitude:.3g} {shown}", color


def _draw_points(  # noqa: PLR0913, PLR0917 - a line and how it looks
    axes: Axes, frequencies: np.ndarray, values: np.ndarray, settled: np.ndarray, color: np.ndarray, label: str
) -> None:
    """A line with its points, open where they have not settled."""
    axes.semilogx(frequencies, values, color=color, linewidth=1.2, label=label)
    axes.plot(frequencies[settled], values[settled], "o", color=color, markersize=3)
    axes.plot(frequencies[~settled], values[~settled], "o", color=color, markersize=4, mfc="w")


def plot_harmonics(measured: "FrequencyResponse", **where: Any) -> Figure:
    """The second, third and fifth harmonic over the fundamental, and all of them, a line per amplitude."""
    data = measured.data
    figure = Figure(figsize=(9, 6.4), layout="constrained")
    panels = figure.subplots(2, 2, sharex=True, sharey=True)
    shown = [k for k in HARMONICS if k in data.harmonic]
    names = [*(f"harmonic {k}" for k in shown), f"all harmonics up to {int(data.harmonic.max())} (distortion)"]
    for panel, name in zip(panels.flat, names, strict=False):
        panel.set_title(name, fontsize="medium")
        panel.set_yscale("log")
        panel.grid(alpha=0.3, which="both")
    for panel in panels.flat[len(names) :]:
        panel.remove()
    frequencies = data.frequency.values
    for amplitude, label, color in _amplitudes(data):
        at = {"amplitude": amplitude, **where}
        settled, moves = (measured.select(name, **at).values.astype(bool) for name in ("settled", "moves"))
        sizes = abs(measured.select("harmonics", **at)).transpose("harmonic", "frequency").values
        base = np.where(moves, sizes[0], np.nan)
        parts = [sizes[k - 1] / base for k in shown]
        parts.append(measured.select("distortion", **at).values)
        words = label if moves.any() else label + STILL
        for panel, values in zip(panels.flat, parts, strict=False):
            _draw_points(panel, frequencies, 100 * values, settled, color, words)
    first = panels.flat[0]
    first.set_ylim(LEAST_PERCENT, max(first.get_ylim()[1], 100))
    for panel in panels[:, 0]:
        panel.set_ylabel("% of the fundamental")
    first.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    for panel in panels[-1]:
        panel.set_xlabel("frequency in Hz")
        plain_hertz(panel)
    figure.legend(
        *first.get_legend_handles_labels(), loc="outside lower center", ncols=5, fontsize="small", frameon=False
    )
    return figure


def plot_spectrum(spectrum: "Spectrum") -> Figure:
    """Gain, phase and coherence over frequency."""
    figure = Figure(figsize=(9, 7), layout="constrained")
    panels = figure.subplots(3, 1, sharex=True, height_ratios=(2, 2, 1))
    phase = DEGREES * phase_of(spectrum.response)
    rows = (to_db(abs(spectrum.response)), phase, spectrum.coherence)
    for axes, values, label in zip(panels, rows, ("gain in dB", "phase in deg", "coherence"), strict=True):
        axes.semilogx(spectrum.frequencies, values, linewidth=1.2)
        axes.set_ylabel(label)
        axes.grid(alpha=0.3, which="both")
    panels[1].yaxis.set_major_locator(MultipleLocator(90))
    panels[2].set_ylim(0, 1.05)
    panels[2].set_xlabel("frequency in Hz")
    panels[0].set_title(spectrum.label, fontsize="medium")
    return figure
