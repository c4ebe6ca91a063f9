"""A tuning as files: pictures, result.json, tables as CSV, and report.html with everything inside."""

import base64
import csv
import io
import math
import platform
from collections.abc import Callable
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from matplotlib.figure import Figure

from actuator.linear.gain_models import gain_model
from actuator.simulation.signals import Step
from actuator.simulation.simulate import simulate
from studies.cases import Case
from studies.kept import model_of
from studies.report import DPI, LIBRARIES, _version
from studies.tuning import Tuned
from studies.tuning_check import BEFORE, CornerCheck
from studies.tuning_measures import FREQUENCIES, INPUTS, OUTPUTS, Measure, corner_modes, moved, worst

VIEW, HOLD = 1.0, 12.0  # s of the step that are shown, and of the hold behind it
RED, GREEN = "#c0392b", "#2e8b57"
SHOWN = {"rad": (180 / math.pi, "deg"), "s": (1e3, "ms")}
BELOW = ("peak current", "overshoot", "slip")  # demanded to be at most


class TuningFiles(NamedTuple):
    """What `write_files` takes."""

    pictures: dict[str, Figure]
    result: dict[str, Any]
    text: list[str]
    files: dict[str, Callable[[Path], None]]


def tuning_files(tuned: Tuned, case: Case) -> TuningFiles:
    """Pictures, numbers, sentences and tables of a tuning."""
    pictures = {
        "step": _steps(tuned),
        "loops": _loops(tuned),
        "trade_off": _trade_off(tuned),
    }
    result = result_of(tuned, case)
    text = sentences(tuned)
    files = {
        "measures.csv": lambda path: _write(path, _measures_csv(tuned)),
        "corners.csv": lambda path: _write(path, _corners_csv(tuned)),
        "report.html": lambda path: _write(path, _html(tuned, case, result, text, pictures)),
    }
    return TuningFiles(pictures, result, text, files)


def sentences(tuned: Tuned) -> list[str]:
    """What came of it."""
    demand, last = tuned.specification.demand, tuned.rounds[-1]
    factor = demand.stiction_margin
    count = len(tuned.corners)
    hunting, now = (
        sum(check.hunts(1.0) or check.hunts(factor) for check in checks)
        for checks in (tuned.before_checks, last.checks)
    )
    slow, still_slow = (min(check.followed for check in checks) for checks in (tuned.before_checks, last.checks))
    gains = ", ".join(f"{name} {tuned.before[name]:.4g} -> {value:.4g}" for name, value in tuned.design.gains.items())
    dead = tuned.parameters["controller.speed.remedies.dead_band"]
    return [
        f"gains: {gains}; dead band of the integral {dead:.4g} rad/s, which lets the load rest up to "
        f"{math.degrees(tuned.design.standing_error):.3g} deg from its reference",
        f"hunting, simulated with breakaway friction up to {factor:g} times: in {hunting} of {count} corners before, "
        f"in {now} after",
        f"load over reference at {demand.bandwidth:g} Hz and {math.degrees(demand.sine):.3g} deg, in the worst corner: "
        f"{slow:.3f} before, {still_slow:.3f} after ({1 / math.sqrt(2):.3f} demanded)",
        *(
            f"{each.name}{f' ({each.corner}, {each.mode})' if each.mode else ''} decides: {each.cost}"
            for each in tuned.design.active
            if each.name != "slip"
        ),
    ]


def result_of(tuned: Tuned, case: Case) -> dict[str, Any]:
    """Everything that is a number."""
    parameters = {p.name: {"value": float(p.default), "unit": p.unit} for p in tuned.plant.system().parameters}
    return {
        "case": case.name,
        "title": tuned.specification.title,
        "model": model_of({name: p["value"] for name, p in parameters.items()}, case.name),
        "met": tuned.met,
        "demand": asdict(tuned.specification.demand),
        "gains": {"before": tuned.before, "start": tuned.start, "tuned": tuned.parameters},
        "standing_error": tuned.design.standing_error,
        "active": [{**each._asdict(), "cost": each.cost} for each in tuned.design.active],
        "rounds": [{"tightening": each.tightening, "gains": each.design.gains} for each in tuned.rounds],
        "linear": {
            when: {name: {k: v for k, v in m._asdict().items() if k != "slopes"} for name, m in worst(found).items()}
            for when, found in (("before", tuned.before_measures), ("tuned", tuned.design.measures))
        },
        "simulated": {
            "before": [asdict(check) for check in tuned.before_checks],
            "tuned": [asdict(check) for check in tuned.rounds[-1].checks],
        },
        "trade_off": [{"stiction_margin": a, "standing_error": b} for a, b in tuned.trade_off],
        "parameters": parameters,
        "versions": {"python": platform.python_version()} | {name: _version(name) for name in LIBRARIES},
    }


# -- pictures ---------------------------------------------------------------------------------------------


def _steps(tuned: Tuned) -> Figure:
    """The demanded step in the corner whose cycle was largest, before and after; and the hold behind it."""
    at = max(range(len(tuned.corners)), key=lambda k: tuned.before_checks[k].cycle)
    corner, size = tuned.corners[at], tuned.specification.demand.sine
    figure = Figure(figsize=(9, 5.5), layout="constrained")
    panels = figure.subplots(2, 2, sharex="col", width_ratios=(1, 1.6))
    for label, design, color in (("before", tuned.before, RED), ("tuned", tuned.parameters, GREEN)):
        run = simulate(
            tuned.plant,
            HOLD,
            inputs={"reference": Step(time=BEFORE, after=size)},
            parameters=corner.parameters | dict(design),
            resolution=2e-3,
        )
        for column, end in enumerate((VIEW, HOLD)):
            shown = run.t <= end
            panels[0, column].plot(run.t[shown], np.degrees(run["load_angle"][shown]), color=color, label=label)
            panels[1, column].plot(run.t[shown], run["current"][shown], color=color, label=label)
            if label == "before":
                panels[0, column].plot(
                    run.t[shown], np.degrees(run["reference"][shown]), color="#888888", lw=1, ls="--", label="reference"
                )
    panels[0, 0].set_ylabel("load angle in deg")
    panels[1, 0].set_ylabel("current in A")
    for axes in panels[1]:
        axes.set_xlabel("time in s")
    for axes in panels.flat:
        axes.grid(alpha=0.3)
    panels[0, 0].legend(loc="center right", fontsize="small")
    figure.suptitle(f"Step of {math.degrees(size):.3g} deg at {corner.name}", fontsize="medium")
    return figure


def _loops(tuned: Tuned) -> Figure:
    """Loops in all corners and sliding directions, before and after."""
    from studies.tuning import without_dead_band

    linear = without_dead_band(tuned.original)
    figure = Figure(figsize=(9, 5.5), layout="constrained")
    panels = figure.subplots(2, 2, sharex=True, sharey="row")
    hertz = FREQUENCIES / (2 * math.pi)
    names = {corner.name: corner for corner in tuned.corners}
    shown = {m.corner for m in worst(tuned.design.measures).values()}
    for corner in shown:
        modes = corner_modes(linear, names[corner], 1.0, tuned.before)
        for mode in ("forward", "backward"):
            for label, gains, color in (("before", tuned.before, RED), ("tuned", tuned.design.gains, GREEN)):
                model = gain_model(moved(modes.points[mode], gains), tuple(gains), INPUTS, OUTPUTS)
                for column, at in enumerate(("speed_reference", "torque_reference")):
                    loop = model.loop(at, FREQUENCIES).value
                    panels[0, column].semilogx(hertz, 20 * np.log10(abs(loop)), color=color, lw=1, label=label)
                    phase = np.degrees(np.unwrap(np.angle(loop)))
                    panels[1, column].semilogx(hertz, phase - 360 * np.ceil((phase[0] - 90) / 360), color=color, lw=1)
    for column, at in enumerate(("speed reference", "torque reference")):
        panels[0, column].set_title(f"opened at {at}", fontsize="medium")
        panels[0, column].axhline(0, color="#888888", lw=1)
        panels[1, column].axhline(-180, color="#888888", lw=1)
        panels[1, column].set_xlabel("frequency in Hz")
    panels[0, 0].set_ylabel("loop gain in dB")
    panels[1, 0].set_ylabel("phase in deg")
    panels[0, 0].set_ylim(-80, 120)
    handles = {label: handle for handle, label in zip(*panels[0, 0].get_legend_handles_labels(), strict=True)}
    panels[0, 1].legend(handles.values(), handles.keys(), fontsize="small")
    for axes in panels.flat:
        axes.grid(alpha=0.3)
    return figure


def _trade_off(tuned: Tuned) -> Figure:
    """Stiffness of holding over the stiction margin."""
    figure = Figure(figsize=(7, 4), layout="constrained")
    axes = figure.subplots()
    margin, error = np.array(tuned.trade_off).T
    axes.plot(margin, np.degrees(error), "o-", color=GREEN, label="least that meets all other demands")
    demand = tuned.specification.demand
    axes.plot(
        demand.stiction_margin,
        math.degrees(tuned.design.standing_error),
        "s",
        color="#222222",
        label="tuned, after simulation in every corner",
    )
    axes.axhline(math.degrees(demand.standing_error), color=RED, ls="--", lw=1, label="largest that is allowed")
    axes.set_xlabel("stiction margin (factor on all breakaway friction without hunting)")
    axes.set_ylabel("standing error in deg")
    axes.set_ylim(0, None)
    axes.legend(fontsize="small")
    axes.grid(alpha=0.3)
    return figure


# -- tables -----------------------------------------------------------------------------------------------


def _write(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8", newline="")


def _measures_csv(tuned: Tuned) -> str:
    rows = io.StringIO()
    out = csv.writer(rows)
    out.writerow(["design", "corner", "mode", "measure", "value", "limit", "unit", "slack"])
    for label, found in (("before", tuned.before_measures), ("tuned", tuned.design.measures)):
        out.writerows([label, m.corner, m.mode, m.name, m.value, m.limit, m.unit, m.slack] for m in found)
    return rows.getvalue()


def _corners_csv(tuned: Tuned) -> str:
    rows = io.StringIO()
    out = csv.writer(rows)
    names = list(tuned.before_checks[0].verdicts)
    out.writerow(
        ["design", "corner", *names, "cycle_rad", "standing_error_rad", "followed", "overshoot", "peak_current_A"]
    )
    for label, checks in (("before", tuned.before_checks), ("tuned", tuned.rounds[-1].checks)):
        for c in checks:
            verdicts = [c.verdicts[name] for name in names]
            out.writerow(
                [label, c.corner, *verdicts, c.cycle, c.standing_error, c.followed, c.overshoot, c.peak_current]
            )
    return rows.getvalue()


def _html(tuned: Tuned, case: Case, result: dict[str, Any], text: list[str], pictures: dict[str, Figure]) -> str:
    environment = Environment(loader=PackageLoader("studies"), autoescape=True, undefined=StrictUndefined)
    before, after = worst(tuned.before_measures), worst(tuned.design.measures)
    factor = tuned.specification.demand.stiction_margin
    return environment.get_template("tuning.html").render(
        tuned=tuned,
        case=case,
        result=result,
        text=text,
        pictures={name: _encoded(figure) for name, figure in pictures.items()},
        lines=[_line(before[name], after[name]) for name in after if name != "slip"],
        corners=[
            (a.corner, _simulated(a, factor), _simulated(b, factor))
            for a, b in zip(tuned.before_checks, tuned.rounds[-1].checks, strict=True)
        ],
        made=datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"),
        floor=1 / math.sqrt(2),
    )


def _line(before: Measure, after: Measure) -> dict[str, Any]:
    factor, unit = SHOWN.get(after.unit, (1.0, after.unit))
    # a tightened limit is held against the model; the demand itself is shown
    return {
        "name": after.name,
        "unit": "" if unit == "-" else unit,
        "sign": "<=" if after.name in BELOW else ">=",
        "limit": f"{before.limit * factor:.4g}",
        "before": f"{before.value * factor:.4g}",
        "before_met": before.met,
        "after": f"{after.value * factor:.4g}",
        "met": after.slack >= -1e-3,  # noqa: PLR2004 - as the optimization ends
        "where": f"{after.corner}, {after.mode}",
    }


def _simulated(check: CornerCheck, factor: float) -> dict[str, Any]:
    bad = sorted({verdict for verdict in check.verdicts.values() if verdict != "rest"})
    return {
        "verdict": ", ".join(bad) or "rest",
        "good": not (check.hunts(1.0) or check.hunts(factor)),
        "cycle": f"{math.degrees(check.cycle):.3g}" if check.cycle else "",
        "error": f"{math.degrees(check.standing_error):.3g}",
        "followed": f"{check.followed:.3f}",
        "follows": check.followed >= 1 / math.sqrt(2),
        "current": f"{check.peak_current:.3g}",
    }


def _encoded(figure: Figure) -> str:
    memory = io.BytesIO()
    figure.savefig(memory, format="png", dpi=DPI)
    return base64.b64encode(memory.getvalue()).decode()
