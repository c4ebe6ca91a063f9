"""A tuning as files: pictures, result.json, tables as CSV, and report.html with everything inside."""

import csv
import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from functools import partial
from typing import Any

from actuator.verdict.verdict import REST
from studies.cache import actuator_of
from studies.cases import Case
from studies.findings import Findings, rendered, versions
from studies.tuning.check import CornerCheck
from studies.tuning.measures import Measure, worst
from studies.tuning.pictures import loops_picture, margins_picture, steps_picture, trade_off_picture
from studies.tuning.plant import dead_band_of
from studies.tuning.stiction import ACCURACY, MOST, STEP, StictionMargin, least_margin
from studies.tuning.study import Tuned

SHOWN = {"rad": (180 / math.pi, "deg"), "s": (1e3, "ms")}
BELOW = ("peak current", "peak torque", "overshoot", "slip")  # demanded to be at most


def tuning_findings(tuned: Tuned, case: Case) -> Findings:
    """Pictures, numbers, sentences and tables of a tuning."""
    pictures = {
        "step": steps_picture(tuned),
        "margins": margins_picture(tuned),
        "loops": loops_picture(tuned),
        "trade_off": trade_off_picture(tuned),
    }
    result, text = result_of(tuned, case), sentences(tuned)
    return Findings(
        pictures=pictures,
        result=result,
        text=text,
        files={"measures.csv": _measures_csv(tuned), "corners.csv": _corners_csv(tuned)},
        page=partial(_html, tuned, case, result, text),
    )


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
    unsettled = [
        f"{when} at {check.corner}"
        for when, checks in (("before", tuned.before_checks), ("after", last.checks))
        for check in checks
        if not check.settled
    ]
    gains = ", ".join(f"{name} {tuned.before[name]:.4g} -> {value:.4g}" for name, value in tuned.design.gains.items())
    dead = dead_band_of(tuned.original)
    unit = "rad/s of the motor" if ".speed." in dead else "rad"
    return [
        f"gains: {gains}; dead band of the integral {tuned.parameters[dead]:.4g} {unit}, which lets the load rest up "
        f"to {math.degrees(tuned.design.standing_error):.3g} deg from its reference",
        f"hunting or undecided, simulated with breakaway friction up to {factor:g} times: in {hunting} of {count} "
        f"corners before, in {now} after",
        "the steps begin to hunt or not to decide, with one factor on all breakaway friction, "
        f"{_begins(tuned.margins_before)} before, {_begins(tuned.margins)} after; tried from the lowest factor in "
        f"steps of {100 * (STEP - 1):.0f} % (hunting in a narrower window can be missed), then by bisection to "
        f"{100 * (ACCURACY - 1):.0f} %",
        f"load over reference at {demand.bandwidth:g} Hz and {math.degrees(demand.sine):.3g} deg, in the worst corner: "
        f"{slow:.3f} before, {still_slow:.3f} after ({1 / math.sqrt(2):.3f} demanded)",
        *([f"of these sines have failed or not settled: {'; '.join(unsettled)}"] if unsettled else []),
        *(
            f"{each.name}{f' ({each.corner}, {each.mode})' if each.mode else ''} decides: {each.cost}"
            for each in tuned.design.active
            if each.name != "slip"
        ),
    ]


def _begins(found: Sequence[StictionMargin]) -> str:
    least = least_margin(found)
    return f"in no corner up to factor {MOST:g}" if least.hunts is None else f"{least.words} ({least.corner})"


def result_of(tuned: Tuned, case: Case) -> dict[str, Any]:
    """Everything that is a number."""
    parameters = {p.name: {"value": float(p.default), "unit": p.unit} for p in tuned.plant.system().parameters}
    return {
        "case": case.name,
        "title": tuned.specification.title,
        "model": actuator_of(tuned.plant),
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
        "stiction_margins": {
            when: [each._asdict() for each in found]
            for when, found in (("before", tuned.margins_before), ("tuned", tuned.margins))
        },
        "trade_off": [{"stiction_margin": a, "standing_error": b} for a, b in tuned.trade_off],
        "parameters": parameters,
        "versions": versions(),
    }


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
    measured = ("cycle", "standing_error", "followed", "settled", "overshoot", "peak_current", "peak_torque")
    units = ("_rad", "_rad", "", "", "", "_A", "_Nm")
    heads = [name + unit for name, unit in zip(measured, units, strict=True)]
    out.writerow(["design", "corner", *names, *heads, "rests_up_to_factor", "hunts_from_factor"])
    designs = (
        ("before", tuned.before_checks, tuned.margins_before),
        ("tuned", tuned.rounds[-1].checks, tuned.margins),
    )
    for label, checks, margins in designs:
        for check, margin in zip(checks, margins, strict=True):
            verdicts = [check.verdicts[name] for name in names]
            numbers = [getattr(check, name) for name in measured]
            out.writerow([label, check.corner, *verdicts, *numbers, margin.rests, margin.hunts])
    return rows.getvalue()


def _html(tuned: Tuned, case: Case, result: dict[str, Any], text: list[str], pictures: Mapping[str, str]) -> str:
    before, after = worst(tuned.before_measures), worst(tuned.design.measures)
    factor = tuned.specification.demand.stiction_margin
    return rendered(
        "tuning.html",
        tuned=tuned,
        case=case,
        result=result,
        text=text,
        pictures=pictures,
        lines=[_line(before[name], after[name]) for name in after if name != "slip"],
        corners=[
            (a.corner, _simulated(a, factor, x), _simulated(b, factor, y))
            for a, b, x, y in zip(
                tuned.before_checks, tuned.rounds[-1].checks, tuned.margins_before, tuned.margins, strict=True
            )
        ],
        effort="torque, N m" if math.isnan(tuned.rounds[-1].checks[0].peak_current) else "current, A",
        sampled=tuned.original.sampling is not None,
        accuracy=f"{100 * (ACCURACY - 1):.0f} %",
        rung=f"{100 * (STEP - 1):.0f} %",
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
        "before": _number(before.value * factor),
        "before_met": before.met,
        "after": _number(after.value * factor),
        "met": after.slack >= -1e-3,  # noqa: PLR2004 - as the optimization ends
        "where": f"{after.corner}, {after.mode}",
    }


def _number(value: float) -> str:
    return "none" if math.isinf(value) else f"{value:.4g}"


def _simulated(check: CornerCheck, factor: float, margin: StictionMargin) -> dict[str, Any]:
    bad = sorted({verdict for verdict in check.verdicts.values() if verdict != REST})
    return {
        "verdict": ", ".join(bad) or REST,
        "good": not (check.hunts(1.0) or check.hunts(factor)),
        "cycle": f"{math.degrees(check.cycle):.3g}" if check.cycle else "",
        "error": f"{math.degrees(check.standing_error):.3g}",
        "followed": f"{check.followed:.3f}{'' if check.settled else ', not settled'}",
        "follows": check.followed >= 1 / math.sqrt(2),
        "overshoot": f"{100 * max(check.overshoot, 0.0):.1f}",
        "effort": f"{check.peak_torque if math.isnan(check.peak_current) else check.peak_current:.3g}",
        "margin": f"> {MOST:g}" if margin.hunts is None else f"{margin.rests:.2f}" if margin.rests else "none",
    }
