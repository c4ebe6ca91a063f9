"""A frequency-response study as files: report.html, pictures, result.json, tables as CSV, netCDF."""

import base64
import math
import platform
from collections.abc import Callable, Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from matplotlib.figure import Figure

from actuator import LiftedMargins, Margins, Spectrum
from actuator.linear.plots import plot_modes
from studies.frequency_mask import LimitCheck
from studies.frequency_page import SIDES, html
from studies.frequency_pictures import plot_beside, plot_family
from studies.frequency_response import PARTS, Plan, Study, source
from studies.frequency_tables import margin_rows, response_rows, stiffness_rows, write_netcdf, write_rows
from studies.report import LIBRARIES, _version


class StudyFiles(NamedTuple):
    """What `write_files` takes."""

    pictures: dict[str, Figure]
    result: dict[str, Any]
    text: list[str]
    files: dict[str, Callable[[Path], None]]


def study_files(plan: Plan, studies: Sequence[Study], measured: Sequence[Spectrum] = ()) -> StudyFiles:
    """Pictures, numbers, sentences and tables of one study, or of several side by side."""
    several = len(studies) > 1

    def named(label: str, name: str) -> str:
        return f"{label}_{name}" if several else name

    pictures: dict[str, Figure] = {}
    images: dict[str, bytes] = {}
    for study in studies:
        label = study.case.name
        pictures |= {named(label, name): figure for name, figure in _pictures(plan, study, measured).items()}
        tests = {name: test["picture"] for name, test in study.tests.items() if test["picture"]}
        images |= {f"{named(label, file_name(name))}.png": base64.b64decode(image) for name, image in tests.items()}
    if several:
        pictures["beside"] = plot_beside(studies, _compared(plan))
    text = sentences(plan, studies)
    result = result_of(plan, studies)

    def page(path: Path) -> None:
        """The pictures are in its folder already."""
        found = {each.stem: base64.b64encode(each.read_bytes()).decode() for each in path.parent.glob("*.png")}
        prefixes = {study.case.name: named(study.case.name, "") for study in studies}
        path.write_text(html(plan, studies, measured, result, text, (found, prefixes)), encoding="utf-8")

    files: dict[str, Callable[[Path], None]] = {
        **{name: partial(_write_image, image) for name, image in images.items()},
        "report.html": page,
        "responses.csv": lambda path: write_rows(path, response_rows(plan, studies)),
        "stiffness.csv": lambda path: write_rows(path, stiffness_rows(studies)),
        "margins.csv": lambda path: write_rows(path, margin_rows(studies)),
        "responses.nc": lambda path: write_netcdf(path, {s.case.name: s.family.data for s in studies}),
    }
    for word in ("powered", "unpowered"):
        found = {s.case.name: s.stiffness[word].data for s in studies if word in s.stiffness}
        if found:
            files[f"stiffness_{word}.nc"] = lambda path, found=found: write_netcdf(path, found)
    return StudyFiles(pictures, result, text, files)


def _write_image(image: bytes, path: Path) -> None:
    path.write_bytes(image)


def file_name(name: str) -> str:
    """Of the picture of a bench test."""
    return "test_" + name.replace(" ", "_")


def _compared(plan: Plan) -> list[float]:
    """Amplitudes of a comparison [rad]: those of the mask."""
    return sorted({limit.amplitude * plan.stroke for limit in plan.mask.limits})


def _pictures(plan: Plan, study: Study, measured: Sequence[Spectrum]) -> dict[str, Figure]:
    linear = study.linear
    found = {
        "family": plot_family(study, plan.mask, plan.stroke, measured),
        "closed": plot_modes(linear.closed, "load angle over reference, all loops closed"),
        "compliance": plot_modes(linear.compliance, "load angle over load torque, all loops closed", "rad/(N m)"),
    }
    for at, loops in linear.loops.items():
        if all(loop.ninputs == 1 for loop in loops.values()):
            found[f"loop_{at}"] = plot_modes(loops, f"loop opened at {at.replace('_', ' ')}")
    return found | {f"stiffness_{word}": stiffness.plot() for word, stiffness in study.stiffness.items()}


def sentences(plan: Plan, studies: Sequence[Study]) -> list[str]:
    """What came of it."""
    found = []
    for study in studies:
        name = study.case.name
        missed = [check for check in study.checks if not check.met]
        words = "; ".join(_missed(plan, check) for check in missed)
        found.append(f"{name}: the mask is {'kept' if not missed else f'missed: {words}'}.")
        thresholds = study.tests["threshold"]["numbers"]
        if thresholds:
            each = ", ".join(
                f"{math.degrees(value):.3g} deg at {key.removeprefix('threshold at ')}"
                for key, (value, _) in thresholds.items()
            )
            found.append(f"{name}: no contact slides below {each} (amplitude of the sine of the reference).")
        if study.tests["hold"]["words"]:
            found.append(f"{name}, held after a step of 2 %: {study.tests['hold']['words']}.")
        if study.family.notes:
            settled = study.family.data.settled
            found.append(f"{name}: {int((~settled.astype(bool)).sum())} of {settled.size} sines have not settled.")
    return found


def _missed(plan: Plan, check: LimitCheck) -> str:
    what, scale, unit = SIDES[check.side]
    at = f"{math.degrees(check.amplitude * plan.stroke):.3g} deg and {check.frequency:.3g} Hz"
    by = f"by {-scale * check.slack:.2g} {unit}" if math.isfinite(check.slack) else "nothing moves"
    return f"{what}, at {at}, {by}"


# -- numbers ----------------------------------------------------------------------------------------------


def result_of(plan: Plan, studies: Sequence[Study]) -> dict[str, Any]:
    """Everything that is a number, for machines; null where there is none."""
    return {
        "plan": {
            "stroke_rad": plan.stroke,
            "amplitudes": list(plan.all_amplitudes),
            "frequencies_Hz": sorted(plan.frequencies),
            "torque_parts": list(PARTS),
            "torque_frequencies_Hz": list(plan.torque_frequencies),
            "temperatures_K": list(plan.temperatures),
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
        "source": source(),
        "versions": {"python": platform.python_version()} | {name: _version(name) for name in LIBRARIES},
    }


def _result(study: Study) -> dict[str, Any]:
    linear = study.linear
    return {
        "title": study.case.title,
        "model": study.model,
        "met": study.met,
        "checks": [{**check._asdict(), "met": check.met} for check in study.checks],
        "operating_point": dict(study.inputs) | {"reference": 0.0},
        "largest_torque_Nm": study.torque,
        "modes": {model.name: model.contacts for model in linear.models},
        "unreachable": dict(linear.models.unreachable),
        "margins": {
            at: {mode: _margin_numbers(found) for mode, found in modes.items()} for at, modes in linear.margins.items()
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


def _margin_numbers(found: Margins | LiftedMargins) -> dict[str, Any]:
    if isinstance(found, LiftedMargins):
        return asdict(found)
    return {"gain_db": found.gain_db, **asdict(found)}
