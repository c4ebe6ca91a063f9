"""Pictures of a frequency-response study: responses with their mask, and cases side by side."""

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter

from actuator import Spectrum
from studies.frequency_mask import Mask, phase_of
from studies.frequency_response import Study

LIMIT_COLOR = "#c0392b"
STYLES = ("-", "--", "-.", ":")  # of limits, or of amplitudes
MOST_AMPLITUDES = len(STYLES)  # in a comparison


def plot_family(study: Study, mask: Mask, stroke: float, measured: Sequence[Spectrum] = ()) -> Figure:
    """The amplitude family in front of the linear envelope, with the limits and what was measured on hardware."""
    figure = study.family.plot(study.linear.closed, measured)
    gain, phase = figure.axes
    for k, limit in enumerate(mask.limits):
        dense = np.geomspace(limit.frequencies[0], limit.frequencies[-1], 100)
        label = f"limits at {math.degrees(limit.amplitude * stroke):.3g} deg"
        for side, axes, scale in (
            ("gain_low_db", gain, 1.0),
            ("gain_high_db", gain, 1.0),
            ("phase_low", phase, 180 / math.pi),
            ("phase_high", phase, 180 / math.pi),
        ):
            if getattr(limit, side):
                style = STYLES[k % len(STYLES)]
                axes.plot(dense, scale * limit.at(side, dense), style, color=LIMIT_COLOR, linewidth=1.4, label=label)
    _scales(phase)
    for legend in list(figure.legends):
        legend.remove()
    handles = {label: handle for handle, label in zip(*gain.get_legend_handles_labels(), strict=True)}
    handles |= {label: handle for handle, label in zip(*phase.get_legend_handles_labels(), strict=True)}
    figure.legend(
        handles.values(), handles.keys(), loc="outside lower center", ncols=4, fontsize="small", frameon=False
    )
    return figure


def plot_beside(studies: Sequence[Study], amplitudes: Sequence[float]) -> Figure:
    """The same sines through every actuator: a color each, a line style per amplitude [rad]."""
    figure = Figure(figsize=(9, 6.4), layout="constrained")
    gain, phase = figure.subplots(2, 1, sharex=True)
    for k, study in enumerate(studies):
        hertz = study.family.data.frequency.values
        for amplitude, style in zip(amplitudes[:MOST_AMPLITUDES], STYLES, strict=False):
            response, moves = (study.family.select(name, amplitude=amplitude).values for name in ("response", "moves"))
            moves = moves.astype(bool) & np.isfinite(response)
            label = f"{study.case.name}, {math.degrees(amplitude):.3g} deg{'' if moves.any() else ': no motion'}"
            size = np.full(len(hertz), np.nan)
            size[moves] = 20 * np.log10(abs(response[moves]))
            angle = np.degrees(phase_of(response, moves))
            for axes, values in ((gain, size), (phase, angle)):
                axes.semilogx(hertz, values, style, color=f"C{k}", marker=".", linewidth=1.2, label=label)
    gain.set_ylabel("gain in dB")
    phase.set_ylabel("phase in deg")
    phase.set_xlabel("frequency in Hz")
    _scales(phase)
    for axes in (gain, phase):
        axes.grid(alpha=0.3, which="both")
    gain.set_title("load angle over reference, side by side", fontsize="medium")
    figure.legend(
        *gain.get_legend_handles_labels(), loc="outside lower center", ncols=2, fontsize="small", frameon=False
    )
    return figure


def _scales(phase: Axes) -> None:
    """Plain numbers of hertz, and round angles."""
    phase.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    phase.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    phase.xaxis.set_minor_formatter(NullFormatter())
    phase.yaxis.set_major_locator(MaxNLocator(nbins=7, steps=[1, 1.5, 3, 4.5, 9, 10]))
