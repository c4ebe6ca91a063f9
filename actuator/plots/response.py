"""Pictures of measured frequency responses, drawn on figures that need no display."""

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import control
import numpy as np
import xarray
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from actuator.linear.bode import to_db
from actuator.plots.bode import (
    bode_panels,
    draw_bode,
    draw_modes,
    draw_points,
    finish_bode,
    finish_frequency,
    finish_phase,
)
from actuator.plots.style import colors_over, legend_below, shown_as, words_of

if TYPE_CHECKING:
    from actuator.response.frequency_response import FrequencyResponse
    from actuator.response.spectra import Spectrum
    from actuator.response.stiffness import DynamicStiffness

CLEAR = 0.9  # coherence from which a spectrum is shown over others
MOST_BELOW = 80.0  # dB below the largest that is shown
HARMONICS = (2, 3, 5)  # that get a panel of their own
STILL, FAILED = ": no motion", ": failed"
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
    gain, phase = bode_panels(figure)[:, 0]
    draw_responses(gain, phase, measured, linear, **where)
    for k, spectrum in enumerate(overlay):
        clear = spectrum.coherence >= CLEAR
        if clear.any():
            style = {"linestyle": "", "marker": ".", "markersize": 4, "color": f"C{k + 1}", "label": spectrum.label}
            draw_bode(gain, phase, spectrum.frequencies[clear], spectrum.response[clear], **style)
    output = str(where.get("output", measured.data.output.values[0]))
    gain.set_title(f"{words_of(output)} over {words_of(measured.given)}; {READING}", fontsize="medium")
    legend_below(figure, gain, 4)
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
    hertz = data.frequency.values
    if linear:
        span = 2 * np.pi * np.logspace(np.log10(hertz.min()), np.log10(hertz.max()), 400)
        draw_modes(gain, phase, linear, span)
    top, bottom = -np.inf, np.inf
    for amplitude, label, color in _amplitudes(data):
        at = {"amplitude": amplitude, **where}
        response = measured.select(**at).values
        settled, moves = (measured.select(name, **at).values.astype(bool) for name in ("settled", "moves"))
        known = np.isfinite(response)
        moves &= known
        if not moves.any():
            gain.plot([], [], color=color, label=label + (STILL if known.any() else FAILED), gid=label)
            continue
        draw_bode(gain, phase, hertz, response, known=moves, settled=settled, color=color, label=label)
        size = to_db(abs(response[moves]))
        top, bottom = max(top, size.max()), min(bottom, size.min())
    finish_bode(gain, phase)
    if np.isfinite(top):
        gain.set_ylim(max(top - MOST_BELOW, bottom - 6), top + 6)


def _amplitudes(data: xarray.Dataset) -> Iterator[tuple[float, str, np.ndarray]]:
    """Every amplitude with its label and color."""
    shown = shown_as(str(data.amplitude.attrs["units"]))
    for amplitude, color in zip(data.amplitude.values, colors_over(len(data.amplitude)), strict=True):
        yield float(amplitude), shown.text(amplitude), color


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
    for amplitude, label, color in _amplitudes(data):
        at = {"amplitude": amplitude, **where}
        settled, moves = (measured.select(name, **at).values.astype(bool) for name in ("settled", "moves"))
        sizes = abs(measured.select("harmonics", **at)).transpose("harmonic", "frequency").values
        base = np.where(moves, sizes[0], np.nan)
        parts = [sizes[k - 1] / base for k in shown]
        parts.append(measured.select("distortion", **at).values)
        words = label if moves.any() else label + STILL
        for panel, values in zip(panels.flat, parts, strict=False):
            draw_points(panel, data.frequency.values, 100 * values, settled, color=color, label=words)
    first = panels.flat[0]
    first.set_ylim(LEAST_PERCENT, max(first.get_ylim()[1], 100))
    first.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    for panel in panels[:, 0]:
        panel.set_ylabel("% of the fundamental")
    for panel in panels[-1]:
        finish_frequency(panel)
    legend_below(figure, first, 5)
    return figure


def plot_spectrum(spectrum: "Spectrum") -> Figure:
    """Gain, phase and coherence over frequency."""
    figure = Figure(figsize=(9, 7), layout="constrained")
    gain, phase, coherence = figure.subplots(3, 1, sharex=True, height_ratios=(2, 2, 1))
    draw_bode(gain, phase, spectrum.frequencies, spectrum.response)
    coherence.plot(spectrum.frequencies, spectrum.coherence, linewidth=1.2)
    finish_bode(gain, phase)
    phase.set_xlabel("")
    finish_frequency(coherence)
    coherence.set(ylabel="coherence", ylim=(0, 1.05))
    coherence.grid(alpha=0.3, which="both")
    gain.set_title(spectrum.label, fontsize="medium")
    return figure


def plot_stiffness(found: "DynamicStiffness", **where: Any) -> Figure:
    """Size and phase of the stiffness over frequency, a line per amplitude; open where it has not settled."""
    data = found.data.sel(where).isel({name: 0 for name in ("set", "load") if name not in where})
    figure = Figure(figsize=(9, 6.4), layout="constrained")
    size, phase = bode_panels(figure)[:, 0]
    for amplitude, label, color in _amplitudes(data):
        one = data.sel(amplitude=amplitude)
        moves, settled = one.moves.values.astype(bool), one.settled.values.astype(bool)
        if not moves.any():
            size.plot([], [], color=color, label=label + STILL)
            continue
        style = {"known": moves, "settled": settled, "color": color, "label": label}
        draw_bode(size, phase, one.frequency.values, one.stiffness.values, in_db=False, **style)
    size.set(yscale="log", ylabel=f"stiffness in {data.stiffness.attrs['units']}")
    size.grid(alpha=0.3, which="both")
    finish_phase(phase)
    size.set_title("dynamic stiffness at the load; open points have not settled", fontsize="medium")
    legend_below(figure, size, 4)
    return figure
