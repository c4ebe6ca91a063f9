"""A tuning as files: pictures, result.json, tables as CSV, and report.html with the pictures inside."""

import csv
import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from functools import partial
from typing import Any

from actuator.verdict.verdict import REST
from gear.quantities.roles import InLoop
from studies.cache import fingerprint
from studies.cases import Case
from studies.findings import Findings, render, versions
from studies.specification import Criterion
from studies.tuning.check import CornerCheck
from studies.tuning.design import Active
from studies.tuning.measures import Measure, worst
from studies.tuning.pictures import loops_picture, margins_picture, steps_picture, trade_off_picture
from studies.tuning.plant import dead_band_of
from studies.tuning.result import Tuned
from studies.tuning.stiction import ACCURACY, MOST, STEP, StictionMargin, least_margin

SHOWN = {"rad": (180 / math.pi, "deg"), "s": (1e3, "ms")}


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
    """The findings in sentences."""
    demand, last = tuned.specification.demand, tuned.rounds[-1]
    factor = demand.stiction_margin
    count = len(tuned.corners)
    hunting, now = (
        sum(check.hunts(1.0) or check.hunts(factor) for check in checks)
        for checks in (tuned.before_checks, last.checks)
    )
    slow, still_slow = (min(check.followed for check in checks) for checks in (tuned.before_checks, last.checks))
    unsettled = [
        f"{when} tuning at {check.corner}"
        for when, checks in (("before", tuned.before_checks), ("after", last.checks))
        for check in checks
        if not check.settled
    ]
    gains = ", ".join(f"{name} {tuned.before[name]:.4g} -> {value:.4g}" for name, value in tuned.design.gains.items())
    dead = dead_band_of(tuned.original)
    (loop,) = [each.role(InLoop) for each in tuned.plant.system().parameters if each.name == dead]
    unit = "rad/s of the motor" if loop and loop.loop == "speed" else "rad"
    return [
        f"gains: {gains}; dead band of the integral {tuned.parameters[dead]:.4g} {unit}, which allows a standing error "
        f"of {math.degrees(tuned.design.standing_error):.3g} deg at the load",
        f"corners that hunt or are undecided in simulations with up to {factor:g} times the breakaway friction: "
        f"{hunting} of {count} before tuning, {now} after",
        "hunting (or an undecided step) begins, with one factor on all breakaway friction, "
        f"{_describe_margin(tuned.margins_before)} before tuning, {_describe_margin(tuned.margins)} after; factors are "
        f"tried upward from the lowest in steps of {100 * (STEP - 1):.0f} % (hunting in a narrower window can be "
        f"missed), then bisected to {100 * (ACCURACY - 1):.0f} %",
        f"load over reference at {demand.bandwidth:g} Hz and {math.degrees(demand.sine):.3g} deg, in the worst corner: "
        f"{slow:.3f} before tuning, {still_slow:.3f} after ({1 / math.sqrt(2):.3f} demanded)",
        *([f"sines that failed or did not settle: {'; '.join(unsettled)}"] if unsettled else []),
        *(
            f"{each.name}{f' ({each.corner}, {each.mode})' if each.mode else ''} is active: {each.cost}"
            for each in tuned.design.active
            if each.criterion is not Criterion.SLIP
        ),
    ]


def _describe_margin(found: Sequence[StictionMargin]) -> str:
    least = least_margin(found)
    return f"in no corner up to factor {MOST:g}" if least.hunts is None else f"{least.label} ({least.corner})"


def result_of(tuned: Tuned, case: Case) -> dict[str, Any]:
    """Everything that is a number."""
    parameters = {p.name: {"value": float(p.default), "unit": p.unit} for p in tuned.plant.system().parameters}
    return {
        "case": case.name,
        "title": tuned.specification.title,
        "model": fingerprint(tuned.plant),
        "met": tuned.met,
        "demand": asdict(tuned.specification.demand),
        "gains": {"before": tuned.before, "start": tuned.start, "tuned": tuned.parameters},
        "standing_error": tuned.design.standing_error,
        "active": [_without(each, "criterion") | {"cost": each.cost} for each in tuned.design.active],
        "rounds": [{"tightening": each.tightening, "gains": each.design.gains} for each in tuned.rounds],
        "linear": {
            when: {name: _without(m, "criterion", "slopes") for name, m in worst(found).items()}
            for when, found in (("before", tuned.before_measures), ("tuned", tuned.design.measures))
        },
        "simulated": {
            "before": [_check_numbers(check) for check in tuned.before_checks],
            "tuned": [_check_numbers(check) for check in tuned.rounds[-1].checks],
        },
        "stiction_margins": {
            when: [each._asdict() for each in found]
            for when, found in (("before", tuned.margins_before), ("tuned", tuned.margins))
        },
        "trade_off": [{"stiction_margin": a, "standing_error": b} for a, b in tuned.trade_off],
        "parameters": parameters,
        "versions": versions(),
    }


def _without(row: Measure | Active, *names: str) -> dict[str, Any]:
    return {key: value for key, value in row._asdict().items() if key not in names}


def _check_numbers(check: CornerCheck) -> dict[str, Any]:
    return {**asdict(check), "verdicts": {case.label: verdict for case, verdict in check.verdicts.items()}}


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
    cases = list(tuned.before_checks[0].verdicts)
    measured = ("cycle", "standing_error", "followed", "settled", "overshoot", "peak_current", "peak_torque")
    units = ("_rad", "_rad", "", "", "", "_A", "_Nm")
    heads = [name + unit for name, unit in zip(measured, units, strict=True)]
    out.writerow(
        ["design", "corner", *(case.label for case in cases), *heads, "rests_up_to_factor", "hunts_from_factor"]
    )
    designs = (
        ("before", tuned.before_checks, tuned.margins_before),
        ("tuned", tuned.rounds[-1].checks, tuned.margins),
    )
    for label, checks, margins in designs:
        for check, margin in zip(checks, margins, strict=True):
            verdicts = [check.verdicts[case] for case in cases]
            numbers = [getattr(check, name) for name in measured]
            out.writerow([label, check.corner, *verdicts, *numbers, margin.rests, margin.hunts])
    return rows.getvalue()


def _html(tuned: Tuned, case: Case, result: dict[str, Any], text: list[str], pictures: Mapping[str, str]) -> str:
    before, after = worst(tuned.before_measures), worst(tuned.design.measures)
    factor = tuned.specification.demand.stiction_margin
    return render(
        "tuning.html",
        tuned=tuned,
        case=case,
        result=result,
        text=text,
        pictures=pictures,
        lines=[_line(before[name], m) for name, m in after.items() if m.criterion is not Criterion.SLIP],
        corners=[
            (a.corner, _corner_cells(a, factor, x), _corner_cells(b, factor, y))
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
    # the model has to meet the tightened limit; the demand itself is shown
    return {
        "name": after.name,
        "unit": "" if unit == "-" else unit,
        "sign": "<=" if after.criterion.upper else ">=",
        "limit": f"{before.limit * factor:.4g}",
        "before": _number(before.value * factor),
        "before_met": before.met,
        "after": _number(after.value * factor),
        "met": after.slack >= -1e-3,  # noqa: PLR2004 - as the optimization ends
        "where": f"{after.corner}, {after.mode}",
    }


def _number(value: float) -> str:
    return "none" if math.isinf(value) else f"{value:.4g}"


def _corner_cells(check: CornerCheck, factor: float, margin: StictionMargin) -> dict[str, Any]:
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
