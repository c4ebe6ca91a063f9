"""Pictures of linear models, drawn on figures that need no display."""

from collections.abc import Mapping

import control
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from actuator.linear.bode import FREQUENCIES, bode_of, envelope, passes, phase_of, to_db
from actuator.linear.margins.crossings import margins
from actuator.plots.runs import DEGREES

LINE_COLORS = {"stuck": "#4d4d4d", "forward": "#3b75af", "backward": "#e1812c"}
LINE_STYLES = {"backward": (0, (4, 3))}  # both directions often lie on each other
FLOOR_DB = -120.0
SHADE, EDGE = "#e8e8e8", "#c4c4c4"
MOST_NAMES = 2


def plot_modes(models: Mapping[str, control.StateSpace], title: str, unit: str = "") -> Figure:
    """Gain and phase of every mode in which anything passes, in front of the envelope of all."""
    figure = Figure(figsize=(9, 6), layout="constrained")
    gain, phase = figure.subplots(2, 1, sharex=True)
    step = max(float(model.dt or 0) for model in models.values())
    frequencies = FREQUENCIES[FREQUENCIES * step < np.pi]
    draw_modes(gain, phase, models, frequencies)
    gain.set_ylabel(f"gain in dB{f' of {unit}' if unit else ''}")
    phase.set_ylabel("phase in deg")
    phase.set_xlabel("frequency in Hz")
    phase.yaxis.set_major_locator(MultipleLocator(90))
    gain.set_ylim(bottom=max(gain.get_ylim()[0], FLOOR_DB))
    for axes in (gain, phase):
        axes.grid(alpha=0.3, which="both")
    figure.legend(
        *gain.get_legend_handles_labels(), loc="outside lower center", ncols=3, fontsize="small", frameon=False
    )
    gain.set_title(title, fontsize="medium")
    return figure


def draw_modes(
    gain: Axes, phase: Axes, models: Mapping[str, control.StateSpace], frequencies: np.ndarray, *, lines: bool = True
) -> None:
    """The envelope of all modes, and a line per mode."""
    open_modes = {name: model for name, model in models.items() if passes(model)}
    hertz = frequencies / (2 * np.pi)
    if open_modes:
        band = envelope(open_modes, frequencies)
        for axes, low, high in (
            (gain, to_db(band.gain_low), to_db(band.gain_high)),
            (phase, DEGREES * band.phase_low, DEGREES * band.phase_high),
        ):
            # with an edge: modes often lie on each other
            axes.fill_between(
                hertz, low, high, facecolor=SHADE, edgecolor=EDGE, linewidth=2, label="envelope of the linear modes"
            )
    closed = [name for name in models if name not in open_modes]
    if closed:
        which = ", ".join(closed) if len(closed) <= MOST_NAMES else f"{len(closed)} modes"
        gain.plot([], [], " ", label=f"nothing passes: {which}")
    for k, (name, model) in enumerate(open_modes.items() if lines else ()):
        color = LINE_COLORS.get(name, f"C{(k + 2) % 10}")
        style = LINE_STYLES.get(name.partition(",")[0], "-")
        size, angle = bode_of(model, frequencies)
        gain.semilogx(hertz, to_db(size), color=color, linestyle=style, linewidth=1.2, label=name)
        phase.semilogx(hertz, DEGREES * angle, color=color, linestyle=style, linewidth=1.2)


def plot_bode(loops: Mapping[str, control.StateSpace], title: str, frequencies_hz: np.ndarray | None = None) -> Figure:
    """Bode plot of a loop transfer in each contact mode, with its margins in the legend."""
    f = np.logspace(-2, 4, 1500) if frequencies_hz is None else frequencies_hz
    figure = Figure(figsize=(9, 5.6), layout="constrained")
    gain, phase = figure.subplots(2, 1, sharex=True)
    for mode, loop in loops.items():
        hertz = f[2 * f * loop.dt < 1] if loop.dt else f
        response = loop(np.exp(2j * np.pi * hertz * loop.dt) if loop.dt else 2j * np.pi * hertz)
        found = margins(loop)
        color, style = LINE_COLORS.get(mode), LINE_STYLES.get(mode, "-")
        if abs(response).max() < 1e-6:  # noqa: PLR2004 - a stuck gear passes nothing on
            gain.plot([], [], color=color, label=f"{mode}: nothing passes")
            continue
        label = f"{mode}: gain margin {found.gain_db:.1f} dB, phase margin {np.degrees(found.phase_rad):.0f} deg"
        gain.semilogx(hertz, to_db(abs(response)), color=color, linestyle=style, label=label)
        phase.semilogx(hertz, DEGREES * phase_of(response), color=color, linestyle=style)
        if np.isfinite(found.phase_rad):
            gain.axvline(found.phase_frequency / (2 * np.pi), color=color, linestyle=":", linewidth=0.8)
    gain.axhline(0, color="k", linewidth=0.8)
    phase.axhline(-180, color="k", linewidth=0.8)
    gain.set_ylim(bottom=max(gain.get_ylim()[0], -120))
    gain.set_ylabel("gain in dB")
    phase.set_ylabel("phase in deg")
    phase.set_xlabel("frequency in Hz")
    phase.yaxis.set_major_locator(MultipleLocator(90))
    for axes in (gain, phase):
        axes.grid(alpha=0.3, which="both")
    if gain.get_legend_handles_labels()[0]:
        gain.legend(fontsize="small", loc="lower left")
    gain.set_title(title, fontsize="medium")
    return figure
