"""A frequency-response study as files: report.html, pictures, result.json, tables as CSV, netCDF."""

import base64
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from actuator import Spectrum
from actuator.linear.margins.sensitivity import Sensitivities
from actuator.plots.bode import plot_modes
from studies.cache import program_fingerprint
from studies.findings import Findings, versions
from studies.frequency.mask import SIDES, LimitCheck
from studies.frequency.page import html
from studies.frequency.pictures import (
    abreast,
    plot_beside,
    plot_compliance,
    plot_family,
    plot_places,
    plot_sensitivities,
)
from studies.frequency.plan import PARTS, Plan
from studies.frequency.study import CaseResponse
from studies.frequency.tables import margin_rows, response_rows, stiffness_rows, write_netcdf, write_rows

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def study_findings(plan: Plan, studies: Sequence[CaseResponse], measured: Sequence[Spectrum] = ()) -> Findings:
    """Pictures, numbers, sentences and tables of one actuator, or of several side by side."""
    several = len(studies) > 1

    def named(label: str, name: str) -> str:
        return f"{label}_{name}" if several else name

    pictures: dict[str, Figure | bytes] = {}
    files_of: dict[str, dict[str, str]] = {}  # file of each picture of a case
    for study in studies:
        own: dict[str, Figure | bytes] = {**_pictures(plan, study, measured)}
        tests = {name: test["picture"] for name, test in study.tests.items() if test["picture"]}
        own |= {file_name(name): base64.b64decode(image) for name, image in tests.items()}
        files_of[study.case.name] = {name: named(study.case.name, name) for name in own}
        pictures |= {files_of[study.case.name][name]: picture for name, picture in own.items()}
    if several:
        pictures["beside"] = plot_beside(studies, _compared(plan))
    text, result = sentences(plan, studies), result_of(plan, studies)
    files: dict[str, str | Callable[[Path], None]] = {
        "responses.csv": lambda path: write_rows(path, response_rows(plan, studies)),
        "stiffness.csv": lambda path: write_rows(path, stiffness_rows(studies)),
        "margins.csv": lambda path: write_rows(path, margin_rows(studies)),
        "responses.nc": lambda path: write_netcdf(path, {s.case.name: s.family.data for s in studies}),
    }
    for word in ("powered", "unpowered"):
        found = {s.case.name: s.stiffness[word].data for s in studies if word in s.stiffness}
        if found:
            files[f"stiffness_{word}.nc"] = lambda path, found=found: write_netcdf(path, found)
    return Findings(
        pictures=pictures,
        result=result,
        text=text,
        files=files,
        page=lambda found: html(plan, studies, measured, result, text, (found, files_of)),
    )


def file_name(name: str) -> str:
    """File name of the picture of a bench test."""
    return "test_" + name.replace(" ", "_")


def _compared(plan: Plan) -> list[float]:
    """Amplitudes of a comparison [rad]: those of the mask."""
    return sorted({limit.amplitude * plan.stroke for limit in plan.mask.limits})


def _pictures(plan: Plan, study: CaseResponse, measured: Sequence[Spectrum]) -> "dict[str, Figure]":
    linear = study.linear
    found = {"family": plot_family(study, plan.mask, plan.stroke, measured), "harmonics": study.family.plot_harmonics()}
    for name, some in abreast(study.checks).items():
        found[name] = plot_places(study, some, plan.mask, plan.stroke)
    directions = linear.models.directions
    found["closed"] = plot_modes(linear.closed, "load angle over reference, all loops closed", directions=directions)
    found["compliance"] = plot_compliance(linear.models, linear.compliance, linear.compliance_peaks)
    for at, loops in linear.loops.items():
        words = at.replace("_", " ")
        if all(loop.ninputs == 1 for loop in loops.values()):
            found[f"loop_{at}"] = plot_modes(loops, f"loop opened at {words}", directions=directions)
        if any(linear.sensitivities[at].values()):
            found[f"sensitivity_{at}"] = plot_sensitivities(
                linear.sensitivities[at], f"loop opened at {words}", directions
            )
    return found | {f"stiffness_{word}": stiffness.plot() for word, stiffness in study.stiffness.items()}


def sentences(plan: Plan, studies: Sequence[CaseResponse]) -> list[str]:
    """The findings in sentences."""
    found = []
    for study in studies:
        name = study.case.name
        for place, checks in study.checks.items():
            at = ", ".join(part for part in (name, study.label(place)) if part)
            missed = "; ".join(_missed(plan, check) for check in checks if not check.met)
            found.append(f"{at}: the mask is {f'missed: {missed}' if missed else 'kept'}.")
        thresholds = study.tests["threshold"]["numbers"].values()
        if thresholds:
            each = ", ".join(
                f"{math.degrees(value):.3g} deg at {frequency:.3g} Hz"
                for (value, _), frequency in zip(thresholds, plan.threshold_frequencies, strict=True)
            )
            found.append(f"{name}: no contact slides below a reference amplitude of {each}.")
        if study.tests["hold"]["words"]:
            found.append(f"{name}, held after a step of 2 %: {study.tests['hold']['words']}.")
        if study.family.notes:
            settled, failed = study.family.data.settled.values.astype(bool), _failed(study)
            for count, words in ((~settled & ~failed).sum(), "did not settle"), (failed.sum(), "failed"):
                if count:
                    found.append(f"{name}: {count} of {settled.size} sines {words}.")
    return found


def _failed(study: CaseResponse) -> np.ndarray:
    """Sines whose simulation failed."""
    return ~np.isfinite(study.family.data.response.isel(output=0).values)


def _missed(plan: Plan, check: LimitCheck) -> str:
    side = SIDES[check.side]
    at = f"{math.degrees(check.amplitude * plan.stroke):.3g} deg and {check.frequency:.3g} Hz"
    by = check.nothing or f"by {-side.scale * check.slack:.2g} {side.unit}"
    return f"{side.label}, at {at}, {by}"


# -- numbers ----------------------------------------------------------------------------------------------


def result_of(plan: Plan, studies: Sequence[CaseResponse]) -> dict[str, Any]:
    """All numbers, for result.json; null where there is none."""
    return {
        "plan": {
            "stroke_rad": plan.stroke,
            "amplitudes": list(plan.all_amplitudes),
            "frequencies_Hz": sorted(plan.frequencies),
            "torque_parts": list(PARTS),
            "torque_frequencies_Hz": list(plan.torque_frequencies),
            "biases_Nm": list(plan.all_biases),
        },
        "mask": {
            "title": plan.mask.title,
            "limits": [
                {
                    "amplitude": limit.amplitude,
                    "frequencies_Hz": list(limit.frequencies),
                    **{side: list(getattr(limit, side)) for side in SIDES if getattr(limit, side)},
                }
                for limit in plan.mask.limits
            ],
        },
        "cases": {study.case.name: _result(study) for study in studies},
        "source": program_fingerprint(),
        "versions": versions(),
    }


def _result(study: CaseResponse) -> dict[str, Any]:
    linear = study.linear
    return {
        "title": study.case.title,
        "model": study.model,
        "met": study.met,
        "corners": study.sets,
        "checks": [
            {**place._asdict(), **check._asdict(), "met": check.met}
            for place, checks in study.checks.items()
            for check in checks
        ],
        "operating_point": dict(study.inputs) | {"reference": 0.0},
        "largest_torque_Nm": study.torque,
        "modes": {model.name: model.contacts for model in linear.models},
        "unreachable": dict(linear.models.unreachable),
        "margins": {
            at: {mode: found.numbers() for mode, found in modes.items()} for at, modes in linear.margins.items()
        },
        "sensitivity": {
            at: {mode: each and _peaks(each) for mode, each in modes.items()}
            for at, modes in linear.sensitivities.items()
        },
        "largest_compliance": {
            mode: {"rad_per_Nm": each.value, "frequency": each.frequency}
            for mode, each in linear.compliance_peaks.items()
        },
        "poles": {
            mode: [
                {
                    "real": pole.value.real,
                    "imaginary": pole.value.imag,
                    "damping": pole.damping,
                    "participation": dict(pole.participation),
                }
                for pole in poles
            ]
            for mode, poles in linear.poles.items()
        },
        "tests": {
            name: {"reason": test["reason"]}
            if test["reason"]
            else {key: {"value": value, "unit": unit} for key, (value, unit) in test["numbers"].items()}
            | ({"words": test["words"]} if test["words"] else {})
            for name, test in study.tests.items()
        },
        "notes": [*study.family.notes, *(note for each in study.stiffness.values() for note in each.measured.notes)],
        "missing": {**linear.missing, **study.missing},
        "parameters": {name: {"value": value, "unit": unit} for name, (value, unit) in study.parameters.items()},
    }


def _peaks(found: Sensitivities) -> dict[str, Any]:
    """Peaks of S and T, with their frequencies [rad/s]."""
    return {"S": found.sensitivity_peak._asdict(), "T": found.complementary_peak._asdict()}
