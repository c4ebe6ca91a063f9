"""Pictures of what disturbs a loop: sensitivities and compliance per contact mode, with their peaks."""

import math
from collections.abc import Mapping

import control
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from actuator.linear.bode import to_db
from actuator.linear.margins.sensitivity import Peak, Sensitivities
from actuator.plots.linear import EDGE, LINE_COLORS, LINE_STYLES, MOST_NAMES, SHADE, plot_modes
from actuator.simulation.run import FREE

LEAST_DB = -60.0  # that is shown of a sensitivity
LEFT = 10.0  # Hz, up to which the words about a peak stand to its right
PEAK_COLOR = "#c0392b"


def plot_sensitivities(found: Mapping[str, Sensitivities | None], title: str) -> Figure:
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
        axes.fill_between(
            hertz, sizes.min(axis=0), sizes.max(axis=0), facecolor=SHADE, edgecolor=EDGE, linewidth=2,
            label="envelope of the linear modes",
        )  # fmt: skip
        for k, (mode, curve) in enumerate(curves.items()):
            axes.semilogx(hertz, to_db(curve), linewidth=1.2, label=mode, **_style(mode, k))
        peaks = {mode: (each.sensitivity_peak, each.complementary_peak)[index] for mode, each in passing.items()}
        _mark(axes, peaks, ("$M_S$ = {:.3g}", "$M_T$ = {:.3g}")[index])
        axes.set_ylabel(name)
        axes.set_ylim(max(float(sizes.min()) - 4, LEAST_DB), max(float(sizes.max()), 0.0) + 8)
        axes.grid(alpha=0.3, which="both")
    cut = [mode for mode in found if mode not in passing]
    if cut:
        names = ", ".join(cut) if len(cut) <= MOST_NAMES else f"{len(cut)} modes"
        panels[0].plot([], [], " ", label=f"nothing passes: {names}")
    panels[0].set_title(title, fontsize="medium")
    panels[1].set_xlabel("frequency in Hz")
    figure.legend(
        *panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=3, fontsize="small", frameon=False
    )
    return figure


def plot_compliance(models: Mapping[str, control.StateSpace], peaks: Mapping[str, Peak]) -> Figure:
    """Load angle over load torque in every mode; the largest is marked, of what is in contact and of what flies."""
    figure = plot_modes(models, "load angle over load torque, all loops closed", "rad/(N m)")
    gain = figure.axes[0]
    for flies in (False, True):
        chosen = {mode: each for mode, each in peaks.items() if (f", {FREE} " in mode) == flies}
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


def _style(mode: str, k: int) -> dict[str, object]:
    return {
        "color": LINE_COLORS.get(mode, f"C{(k + 2) % 10}"),
        "linestyle": LINE_STYLES.get(mode.partition(",")[0], "-"),
    }
