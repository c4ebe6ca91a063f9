"""A judgment as findings: sentences, report.html with the pictures inside, the pictures, result.json."""

import math
from collections.abc import Mapping
from dataclasses import asdict
from functools import partial
from typing import TYPE_CHECKING, Any

from actuator.diagnosis.countermeasures import Remedy, format_remedy
from actuator.orbits.sampled import PeriodicOrbit
from actuator.plots.bode import plot_loops
from actuator.plots.runs import plot_run
from actuator.stiction.margins import MOST
from gear.quantities.roles import FrictionMemory
from studies.findings import Findings, render, replace_nonfinite, versions
from studies.judge.study import Insight, Judgment

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STEP_VIEW = 1.5  # s of the step that are shown
CYCLES_VIEW = 3.5  # periods of a cycle that are shown


def case_findings(judgment: Judgment) -> Findings:
    """All that is known of one case."""
    result = result_of(judgment)
    return Findings(
        pictures=figures(judgment), result=result, text=sentences(judgment), page=partial(_html, judgment, result)
    )


def sentences(judgment: Judgment) -> list[str]:
    """Verdict, margins, causes and the best countermeasure."""
    hunting, insight = judgment.hunting, judgment.insight
    text = [f"verdict: {hunting.verdict} ({hunting.reason})"]
    if hunting.cycles:
        text.append(
            f"period {hunting.period_s:.4g} s, amplitude {hunting.amplitude_rad * 1e3:.4g} mrad at the load, "
            f"stuck for {hunting.stick_fraction:.0%} of the time"
        )
    for kind, margin in insight.margins.items():
        no = (
            f"no factor up to {MOST:g} makes it hunt"
            if margin.factor
            else f"no factor down to 1/{MOST:g} ends the hunting"
        )
        known = f"{margin.db:+.1f} dB (factor {margin.factor:.3g})"
        text.append(f"{kind} margin: {known if math.isfinite(margin.db) else no}")
    for what, why in insight.missing.items():
        text.append(f"{'margins, causes and countermeasures' if what == 'all' else what} not computed: {why}")
    if insight.causes:
        text.append(insight.causes.sentence())
    if insight.remedies:
        best = insight.remedies.ranked[0]
        text.append(f"best countermeasure: {' '.join((best.name, best.setting)).strip()} ({best.outcome})")
    return text


def figures(judgment: Judgment) -> "dict[str, Figure]":
    """The pictures of a judgment by name."""
    run, hunting = judgment.run, judgment.hunting
    signals = [name for name in ("motor_angle_at_load", "load_angle", "reference", "current") if name in run.signals]
    end = float(run.t[-1])
    found = {"step": plot_run(run, signals, span=(0.0, min(STEP_VIEW, end)))}
    error = [name for name in ("position_error", "current", "motor_torque") if name in run.signals]
    # a run that comes to rest is shown from the start: its last half is rounding
    since = end - CYCLES_VIEW * hunting.period_s if hunting.cycles else 0.0
    found["hunting"] = plot_run(run, error, span=(max(0.0, since), end))
    names = next((list(model.loops) for model in judgment.models if model.loops), [])
    for name in names:
        loops = {model.mode: model.loops[name] for model in judgment.models if model.loops}
        found[f"bode_{name}"] = plot_loops(loops, f"Loop transfer, opened at {name.replace('_', ' ')}")
    insight = judgment.insight
    if insight.orbit is not None:
        found["orbit"] = insight.orbit.plot()
    for name, part in (("causes", insight.causes), ("remedies", insight.remedies)):
        if part is not None:
            found[name] = part.plot()
    return found


def result_of(judgment: Judgment) -> dict[str, Any]:
    """Everything that is a number, for machines; null where there is none (no cycle, no crossing)."""
    case, run = judgment.case, judgment.run
    return replace_nonfinite(
        {
            "case": case.name,
            "title": case.title,
            "hunting": {**asdict(judgment.hunting), "amplitude_deg": math.degrees(judgment.hunting.amplitude_rad)},
            "margins": {
                name: {
                    model.mode: {**asdict(found), "gain_db": found.gain_db, "phase_deg": math.degrees(found.phase_rad)}
                    for model in judgment.models
                    for loop, found in model.margins.items()
                    if loop == name
                }
                for name in dict.fromkeys(loop for model in judgment.models for loop in model.margins)
            },
            "not_linearized": {model.mode: model.reason for model in judgment.models if model.reason},
            **_insight(judgment.insight),
            "simulation": {
                **run.statistics._asdict(),
                "real_time_factor": run.statistics.simulated_s / run.statistics.wall_s,
                "mode_changes": len(run.changes),
            },
            "parameters": {p.name: {"value": p.default, "unit": p.unit} for p in run.system.parameters},
            "versions": versions(),
        }
    )


def _insight(insight: Insight) -> dict[str, Any]:
    """Orbit, margins against hunting, causes and remedies as numbers."""
    orbit, causes, remedies = insight.orbit, insight.causes, insight.remedies
    return {
        "orbit": None if orbit is None else _orbit(orbit),
        "hunting_margins": {
            kind: {"factor": margin.factor, "db": margin.db, "parameters": margin.parameters}
            for kind, margin in insight.margins.items()
        },
        "causes": None
        if causes is None
        else {
            "sentence": causes.sentence(),
            "energy_per_period_J": causes.energy.elements if causes.energy else None,
            "without": {each.cause: {"change": each.change, **asdict(each.hunting)} for each in causes.counterfactuals},
        },
        "remedies": None if remedies is None else [_remedy(each) for each in remedies.ranked],
        "missing": insight.missing,
    }


def _orbit(orbit: PeriodicOrbit) -> dict[str, Any]:
    creeps = orbit.system.signals_having(FrictionMemory)  # then nothing ever sticks
    found = {
        "period_s": orbit.period,
        "amplitude_rad": orbit.load_amplitude,
        "motor_amplitude_rad": orbit.motor_amplitude,
        "stick_fraction": None if creeps else orbit.stick_fraction,
        "residual": orbit.residual,
        "stable": orbit.stable,
        "multipliers": [{"real": float(mu.real), "imaginary": float(mu.imag)} for mu in orbit.multipliers],
        "events": [event._asdict() for event in orbit.events],
    }
    if orbit.trivial_error is not None:
        found["error_of_trivial_multiplier"] = float(orbit.trivial_error)
    return found


def _remedy(remedy: Remedy) -> dict[str, Any]:
    found = remedy.hunting
    return {
        "name": remedy.name,
        "setting": remedy.setting,
        "does": remedy.outcome,
        "error_rad": remedy.error,
        "predicted_error_rad": remedy.predicted_error,
        "amplitude_rad": found.amplitude_rad,
        "mean_loss_W": found.duty.mean_loss,
        "stiction_factor": remedy.stiction_factor,
    }


def _html(judgment: Judgment, result: dict[str, Any], pictures: Mapping[str, str]) -> str:
    table = judgment.insight.remedies
    return render(
        "report.html",
        {"margin": _format},
        case=judgment.case,
        hunting=judgment.hunting,
        models=judgment.models,
        run=judgment.run,
        result=result,
        insight=judgment.insight,
        remedies=[format_remedy(each) for each in (table.before, *table.ranked)] if table else [],
        pictures=pictures,
        ratio=judgment.case.actuator.gear.ratio(),
        most=MOST,
    )


def _format(value: float, digits: int = 3) -> str:
    """A number for a table; a dash where there is no crossing."""
    return f"{value:.{digits}g}" if math.isfinite(value) else "–"
