"""Pictures of a frequency-response study: responses with their mask, and cases side by side."""

import math
from collections.abc import Iterable, Sequence

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from actuator import Spectrum
from actuator.linear.bode import phase_of, to_db
from actuator.plots.response import FAILED, READING, STILL, draw_responses, plain_hertz
from studies.frequency.corners import Place
from studies.frequency.mask import Mask
from studies.frequency.study import Study

LIMIT_COLOR = "#c0392b"
STYLES = ("-", "--", "-.", ":")  # of limits, or of amplitudes
CUT = "nothing passes"  # what a legend says of modes that are not drawn
LEAST_DB = -40.0  # that is shown of places side by side
MOST_AMPLITUDES = len(STYLES)  # in a comparison


def plot_family(study: Study, mask: Mask, stroke: float, measured: Sequence[Spectrum] = ()) -> Figure:
    """The amplitude family in front of the linear envelope, with the limits and what was measured on hardware."""
    figure = study.family.plot(study.linear.closed, measured)
    gain, phase = figure.axes
    _draw_limits(gain, phase, mask, stroke)
    for legend in list(figure.legends):
        legend.remove()
    _legend(figure, (gain, phase))
    return figure


def plot_places(study: Study, places: Sequence[Place], mask: Mask, stroke: float) -> Figure:
    """The amplitude family at each place, side by side, in front of its linear envelope, with the limits."""
    figure = Figure(figsize=(1.5 + 3.6 * max(len(places), 2), 7), layout="constrained")
    panels = figure.subplots(2, len(places), sharex=True, sharey="row", squeeze=False, height_ratios=(3, 2))
    ends = []
    for (gain, phase), place in zip(panels.T, places, strict=True):
        where = {"set": place.corner, "load": place.bias}
        draw_responses(gain, phase, study.family, study.closed.get(place), **where)
        _draw_limits(gain, phase, mask, stroke)
        gain.set_title(study.words(place), fontsize="medium")
        ends.append(gain.get_ylim())
    panels[0, 0].set_ylim(max(min(low for low, _ in ends), LEAST_DB), max(high for _, high in ends))
    for axes in panels[:, 1:].flat:
        axes.set_ylabel("")
    figure.suptitle(f"load angle over reference; {READING}", fontsize="medium")
    _legend(figure, panels.flat)
    return figure


def _draw_limits(gain: Axes, phase: Axes, mask: Mask, stroke: float) -> None:
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


def _legend(figure: Figure, panels: Iterable[Axes]) -> None:
    """One for all panels: each label once, of an amplitude that moves in any of them the one with its line."""
    handles: dict[str, Artist] = {}
    for axes in panels:
        handles |= {label: handle for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)}
    for label in list(handles):
        moves_elsewhere = label.endswith((STILL, FAILED)) and label.rpartition(":")[0] in handles
        if moves_elsewhere or label.startswith(CUT):
            del handles[label]
    figure.legend(
        handles.values(), handles.keys(), loc="outside lower center", ncols=4, fontsize="small", frameon=False
    )


def plot_beside(studies: Sequence[Study], amplitudes: Sequence[float]) -> Figure:
    """The same sines through every actuator: a color each, a line style per amplitude [rad]."""
    figure = Figure(figsize=(9, 7), layout="constrained")
    gain, phase = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    for k, study in enumerate(studies):
        place = study.words(next(iter(study.checks)))
        name = ", ".join(part for part in (study.case.name, place) if part)
        hertz = study.family.data.frequency.values
        for amplitude, style in zip(amplitudes[:MOST_AMPLITUDES], STYLES, strict=False):
            response, moves = (study.family.select(name, amplitude=amplitude).values for name in ("response", "moves"))
            known = np.isfinite(response)
            moves = moves.astype(bool) & known
            word = "" if moves.any() else STILL if known.any() else FAILED
            label = f"{name}, {math.degrees(amplitude):.3g} deg{word}"
            size = np.full(len(hertz), np.nan)
            size[moves] = to_db(abs(response[moves]))
            angle = np.degrees(phase_of(response, moves))
            for axes, values in ((gain, size), (phase, angle)):
                axes.semilogx(hertz, values, style, color=f"C{k}", marker=".", linewidth=1.2, label=label)
    gain.set_ylabel("gain in dB")
    phase.set_ylabel("phase in deg")
    phase.set_xlabel("frequency in Hz")
    phase.yaxis.set_major_locator(MaxNLocator(nbins=7, steps=[1, 1.5, 3, 4.5, 9, 10]))
    plain_hertz(phase)
    for axes in (gain, phase):
        axes.grid(alpha=0.3, which="both")
    gain.set_title(
        "load angle over reference; a line ends where nothing moves or a simulation failed", fontsize="medium"
    )
    figure.legend(
        *gain.get_legend_handles_labels(), loc="outside lower center", ncols=2, fontsize="small", frameon=False
    )
    return figure
