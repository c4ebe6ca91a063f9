"""The pictures of a tuning."""

import math

import numpy as np
from matplotlib.figure import Figure

from actuator.plots.bode import bode_panels, draw_bode, finish_bode
from actuator.simulation.signals import Step
from actuator.simulation.simulate import simulate
from actuator.stiction.standstill import rest_state
from studies.tuning.check import BEFORE
from studies.tuning.loops import curves_at
from studies.tuning.measures import worst
from studies.tuning.modes import corner_modes, move_point
from studies.tuning.plant import loops_of, prepare_linear
from studies.tuning.result import Tuned
from studies.tuning.stiction import MOST
from studies.tuning.stiction import STEP as RUNG

VIEW, HOLD = 1.0, 12.0  # s of the step that are shown, and of the hold behind it
RED, GREEN = "#c0392b", "#2e8b57"


def steps_picture(tuned: Tuned) -> Figure:
    """The demanded step in the corner whose cycle was largest, before and after; and the hold behind it."""
    at = max(range(len(tuned.corners)), key=lambda k: tuned.before_checks[k].cycle)
    corner, size = tuned.corners[at], tuned.specification.demand.sine
    effort = "current" if "current" in {output.name for output in tuned.plant.system().outputs} else "motor_torque"
    figure = Figure(figsize=(9, 5.5), layout="constrained")
    panels = figure.subplots(2, 2, sharex="col", width_ratios=(1, 1.6))
    for label, design, color in (("before", tuned.before, RED), ("tuned", tuned.parameters, GREEN)):
        parameters = corner.parameters | dict(design)
        run = simulate(
            tuned.plant,
            HOLD,
            inputs={"reference": Step(time=BEFORE, after=size)},
            start=rest_state(tuned.plant, {"reference": 0.0}, parameters),
            parameters=parameters,
            resolution=2e-3,
        )
        for column, end in enumerate((VIEW, HOLD)):
            shown = run.t <= end
            panels[0, column].plot(run.t[shown], np.degrees(run["load_angle"][shown]), color=color, label=label)
            panels[1, column].plot(run.t[shown], run[effort][shown], color=color, label=label)
            if label == "before":
                panels[0, column].plot(
                    run.t[shown], np.degrees(run["reference"][shown]), color="#888888", lw=1, ls="--", label="reference"
                )
    panels[0, 0].set_ylabel("load angle in deg")
    panels[1, 0].set_ylabel("current in A" if effort == "current" else "motor torque in N m")
    for axes in panels[1]:
        axes.set_xlabel("time in s")
    for axes in panels.flat:
        axes.grid(alpha=0.3)
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, fontsize="small")
    figure.suptitle(f"Step of {math.degrees(size):.3g} deg at {corner.name}", fontsize="medium")
    return figure


def loops_picture(tuned: Tuned) -> Figure:
    """Loops in the corners that decide and both sliding directions, before and after."""
    linear = prepare_linear(tuned.original)
    figure = Figure(figsize=(9, 5.5), layout="constrained")
    opened = loops_of(linear.system())
    panels = bode_panels(figure, len(opened))
    names = {corner.name: corner for corner in tuned.corners}
    for corner in {m.corner for m in worst(tuned.design.measures).values()}:
        modes = corner_modes(linear, names[corner], 1.0, tuned.before)
        for mode in ("forward", "backward"):
            for label, gains, color in (("before", tuned.before, RED), ("tuned", tuned.design.gains, GREEN)):
                curves = curves_at(move_point(modes.points[mode], gains), gains)
                for column, at in enumerate(opened):
                    hertz, loop = curves.frequencies(at) / (2 * math.pi), curves.loop(at)
                    draw_bode(panels[0, column], panels[1, column], hertz, loop, color=color, linewidth=1, label=label)
    for column, at in enumerate(opened):
        panels[0, column].set_title(f"opened at {at.replace('_', ' ')}", fontsize="medium")
        panels[0, column].axhline(0, color="#888888", lw=1)
        panels[1, column].axhline(-180, color="#888888", lw=1)
        finish_bode(panels[0, column], panels[1, column])
    panels[0, 0].set_ylabel("loop gain in dB")
    panels[0, 0].set_ylim(-80, 120)
    handles = {label: handle for handle, label in zip(*panels[0, 0].get_legend_handles_labels(), strict=True)}
    panels[0, 1].legend(handles.values(), handles.keys(), fontsize="small")
    for axes in panels.flat:
        axes.label_outer()
    return figure


def margins_picture(tuned: Tuned) -> Figure:
    """Factor on breakaway friction at which hunting begins, in every corner, before and after."""
    count = len(tuned.corners)
    figure = Figure(figsize=(9, 1.4 + 0.34 * count), layout="constrained")
    axes = figure.subplots()
    for label, found, color, shift in (
        ("before", tuned.margins_before, RED, 0.2),
        ("tuned", tuned.margins, GREEN, -0.2),
    ):
        places = np.arange(count)[::-1] + shift
        widths = [each.rests or 0.0 for each in found]
        axes.barh(places, widths, height=0.36, color=color, label=label)
        for place, each in zip(places, found, strict=True):
            words = (
                f"> {MOST:g}"
                if each.hunts is None
                else f"{each.rests:.2f}"
                if each.rests
                else "hunts at the lowest factor"
            )
            axes.annotate(
                words, (each.rests or 0.0, place), xytext=(4, 0), textcoords="offset points", va="center", fontsize=8
            )
    demanded = tuned.specification.demand.stiction_margin
    axes.axvline(1.0, color="#888888", lw=1)
    axes.axvline(demanded, color="#222222", ls="--", lw=1, label=f"demanded, {demanded:g}")
    axes.set_yticks(np.arange(count)[::-1], [corner.name for corner in tuned.corners], fontsize="small")
    axes.set_xlabel(
        "factor on all breakaway friction up to which every step comes to rest;\n"
        f"hunting between factors less than {100 * (RUNG - 1):.0f} % apart can be missed"
    )
    axes.set_xlim(0, MOST * 1.1)
    figure.legend(loc="outside upper right", ncols=3, fontsize="small")
    return figure


def trade_off_picture(tuned: Tuned) -> Figure:
    """Stiffness of holding over the stiction margin."""
    figure = Figure(figsize=(7, 4), layout="constrained")
    axes = figure.subplots()
    margin, error = np.array(tuned.trade_off).T
    axes.plot(
        margin, np.degrees(error), "o-", color=GREEN, label="least on the linear models, in the corners that decide"
    )
    demand = tuned.specification.demand
    axes.plot(
        demand.stiction_margin,
        math.degrees(tuned.design.standing_error),
        "s",
        color="#222222",
        label="tuned, after simulation in every corner",
    )
    axes.axhline(math.degrees(demand.standing_error), color=RED, ls="--", lw=1, label="largest that is allowed")
    axes.set_xlabel("stiction margin that is demanded (factor on all breakaway friction)")
    axes.set_ylabel("standing error in deg")
    axes.set_ylim(0, None)
    axes.legend(fontsize="small")
    axes.grid(alpha=0.3)
    return figure
