"""Pictures of a frequency-response study: responses with their mask, cases side by side, what disturbs a loop."""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import control
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from actuator import ModeModels, Spectrum
from actuator.linear.bode import to_db
from actuator.linear.margins.sensitivity import Peak, Sensitivities
from actuator.plots.bode import (
    CUT,
    bode_panels,
    draw_bode,
    draw_envelope,
    finish_bode,
    finish_frequency,
    mode_style,
    name_cut,
    plot_modes,
)
from actuator.plots.response import FAILED, READING, STILL, draw_responses
from actuator.plots.style import legend_below, shown_as
from studies.frequency.mask import Mask
from studies.frequency.plan import Place
from studies.frequency.study import CaseResponse

ANGLE = shown_as("rad")
LIMIT_COLOR = PEAK_COLOR = "#c0392b"
STYLES = ("-", "--", "-.", ":")  # of limits, or of amplitudes
LEAST_DB, LEAST_SENSITIVITY_DB = -40.0, -60.0  # that are shown of places side by side, and of a sensitivity
LEFT = 10.0  # Hz, up to which the words about a peak stand to its right
MOST_AMPLITUDES = len(STYLES)  # in a comparison
ABREAST = 3  # places in a picture


def plot_family(study: CaseResponse, mask: Mask, stroke: float, measured: Sequence[Spectrum] = ()) -> Figure:
    """The amplitude family in front of the linear envelope, with the limits and what was measured on hardware."""
    figure = study.family.plot(study.linear.closed, measured)
    gain, phase = figure.axes
    _draw_limits(gain, phase, mask, stroke)
    for legend in list(figure.legends):
        legend.remove()
    _legend(figure, (gain, phase))
    return figure


def abreast(places: Iterable[Place]) -> dict[str, list[Place]]:
    """Places that are drawn side by side, by the name of their picture; none where there is a single place."""
    every = list(places)
    rows = [every[k : k + ABREAST] for k in range(0, len(every), ABREAST)] if len(every) > 1 else []
    return {f"places_{k}": row for k, row in enumerate(rows, start=1)}


def plot_places(study: CaseResponse, places: Sequence[Place], mask: Mask, stroke: float) -> Figure:
    """The amplitude family at each place, side by side, in front of its linear envelope, with the limits."""
    figure = Figure(figsize=(1.5 + 3.6 * max(len(places), 2), 7), layout="constrained")
    panels = bode_panels(figure, len(places))
    ends = []
    for (gain, phase), place in zip(panels.T, places, strict=True):
        where = {"set": place.corner, "load": place.bias}
        draw_responses(gain, phase, study.family, study.closed.get(place), **where)
        _draw_limits(gain, phase, mask, stroke)
        gain.set_title(study.label(place), fontsize="medium")
        ends.append(gain.get_ylim())
    panels[0, 0].set_ylim(max(min(low for low, _ in ends), LEAST_DB), max(high for _, high in ends))
    for axes in panels.flat:
        axes.label_outer()
    figure.suptitle(f"load angle over reference; {READING}", fontsize="medium")
    _legend(figure, panels.flat)
    return figure


def _draw_limits(gain: Axes, phase: Axes, mask: Mask, stroke: float) -> None:
    for k, limit in enumerate(mask.limits):
        dense = np.geomspace(limit.frequencies[0], limit.frequencies[-1], 100)
        label = f"limits at {ANGLE.text(limit.amplitude * stroke)}"
        for side, axes, scale in (
            ("gain_low_db", gain, 1.0),
            ("gain_high_db", gain, 1.0),
            ("phase_low", phase, ANGLE.scale),
            ("phase_high", phase, ANGLE.scale),
        ):
            if getattr(limit, side):
                style = STYLES[k % len(STYLES)]
                axes.plot(dense, scale * limit.at(side, dense), style, color=LIMIT_COLOR, linewidth=1.4, label=label)


def _legend(figure: Figure, panels: Iterable[Axes]) -> None:
    """One for all panels: each label once, of an amplitude that moves in any of them the one with its line."""
    handles: dict[str, Artist] = {}
    for axes in panels:
        handles |= {label: handle for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)}
    for label, handle in list(handles.items()):
        # what has no line here has one elsewhere, or is no amplitude
        if handle.get_gid() == CUT or handle.get_gid() in handles:
            del handles[label]
    figure.legend(
        handles.values(), handles.keys(), loc="outside lower center", ncols=4, fontsize="small", frameon=False
    )


def plot_beside(studies: Sequence[CaseResponse], amplitudes: Sequence[float]) -> Figure:
    """The same sines through every actuator: a color each, a line style per amplitude [rad]."""
    figure = Figure(figsize=(9, 7), layout="constrained")
    gain, phase = bode_panels(figure)[:, 0]
    for k, study in enumerate(studies):
        place = study.label(next(iter(study.checks)))
        name = ", ".join(part for part in (study.case.name, place) if part)
        hertz = study.family.data.frequency.values
        for amplitude, style in zip(amplitudes[:MOST_AMPLITUDES], STYLES, strict=False):
            response, moves = (study.family.select(name, amplitude=amplitude).values for name in ("response", "moves"))
            known = np.isfinite(response)
            moves = moves.astype(bool) & known
            word = "" if moves.any() else STILL if known.any() else FAILED
            line: dict[str, Any] = {
                "linestyle": style,
                "color": f"C{k}",
                "marker": ".",
                "label": f"{name}, {ANGLE.text(amplitude)}{word}",
            }
            draw_bode(gain, phase, hertz, response, known=moves, **line)
    finish_bode(gain, phase)
    gain.set_title(
        "load angle over reference; a line ends where nothing moves or a simulation failed", fontsize="medium"
    )
    legend_below(figure, gain, 2)
    return figure


def plot_sensitivities(found: Mapping[str, Sensitivities | None], title: str, directions: Mapping[str, str]) -> Figure:
    """|S| and |T| of every mode in which anything passes, in front of the envelope of all, the largest marked."""
    figure = Figure(figsize=(9, 6), layout="constrained")
    panels = figure.subplots(2, 1, sharex=True)
    passing = {mode: each for mode, each in found.items() if each is not None}
    for axes, index, name in (
        (panels[0], 0, "sensitivity |S| in dB"),
        (panels[1], 1, "complementary\nsensitivity |T| in dB"),
    ):
        curves = {mode: ((each.sensitivity, each.complementary)[index]) for mode, each in passing.items()}
        hertz = next(iter(passing.values())).frequencies / (2 * np.pi)
        sizes = to_db(np.array(list(curves.values())))
        draw_envelope(axes, hertz, sizes.min(axis=0), sizes.max(axis=0))
        for k, (mode, curve) in enumerate(curves.items()):
            axes.plot(hertz, to_db(curve), linewidth=1.2, label=mode, **mode_style(mode, k, directions))
        peaks = {mode: (each.sensitivity_peak, each.complementary_peak)[index] for mode, each in passing.items()}
        _mark(axes, peaks, ("$M_S$ = {:.3g}", "$M_T$ = {:.3g}")[index])
        axes.set_ylabel(name)
        axes.set_ylim(max(float(sizes.min()) - 4, LEAST_SENSITIVITY_DB), max(float(sizes.max()), 0.0) + 8)
        axes.grid(alpha=0.3, which="both")
    name_cut(panels[0], [mode for mode in found if mode not in passing])
    panels[0].set_title(title, fontsize="medium")
    finish_frequency(panels[1])
    legend_below(figure, panels[0], 3)
    return figure


def plot_compliance(
    models: ModeModels, compliance: Mapping[str, control.StateSpace], peaks: Mapping[str, Peak]
) -> Figure:
    """Load angle over load torque in every mode; the largest is marked, of what is in contact and of what flies."""
    title = "load angle over load torque, all loops closed"
    figure = plot_modes(compliance, title, "rad/(N m)", models.directions)
    gain = figure.axes[0]
    for equilibrium in (True, False):
        chosen = {model.name: peaks[model.name] for model in models if model.equilibrium == equilibrium}
        if any(each.value > 0 for each in chosen.values()):
            _mark(gain, chosen, "{:.3g} rad/(N m)")
    gain.set_ylim(top=gain.get_ylim()[1] + 10)
    return figure


def _mark(axes: Axes, peaks: Mapping[str, Peak], words: str) -> None:
    """A point at the largest of several peaks, with its value; none where there is no peak."""
    mode = max(peaks, key=lambda each: peaks[each].value)
    value, frequency = peaks[mode]
    if math.isnan(frequency):
        return
    hertz, height = frequency / (2 * math.pi), to_db(value)
    axes.plot([hertz], [height], "o", color=PEAK_COLOR, markersize=5, zorder=5)
    axes.annotate(
        f"{words.format(value)} at {hertz:.3g} Hz, {mode}", (hertz, height), xytext=(0, 7), textcoords="offset points",
        fontsize="small", color=PEAK_COLOR, ha="left" if hertz < LEFT else "right", zorder=6,
        bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1},
    )  # fmt: skip
