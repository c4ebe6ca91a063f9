"""The page of a frequency-response study: what its template shows, in sentences and rounded numbers."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from actuator import FrequencyResponse, LiftedMargins, Margins, Poles, Sensors, Spectrum
from actuator.linear.bode import to_db
from actuator.linear.margins.sensitivity import Peak, Sensitivities
from actuator.system.hybrid import EventKind
from actuator.system.hybrid import Place as ContactPlace
from studies.findings import render
from studies.frequency.bench import TESTS
from studies.frequency.mask import SIDES, LimitCheck
from studies.frequency.pictures import abreast
from studies.frequency.plan import PARTS, Place, Plan
from studies.frequency.study import CaseResponse

LEAST_COMPLIANCE = 1e-12  # rad/(N m), below is zero
SHOWN_UNITS = {"rad": (180 / math.pi, "deg"), "rad/s": (180 / math.pi, "deg/s")}


def html(  # noqa: PLR0913, PLR0917 - all there is to show
    plan: Plan,
    studies: Sequence[CaseResponse],
    measured: Sequence[Spectrum],
    result: dict[str, Any],
    text: list[str],
    pictures: tuple[Mapping[str, str], Mapping[str, Mapping[str, str]]],
) -> str:
    """Render the page; `pictures` are all pictures in base64 by file, and the file of each by case and name."""
    found, files = pictures
    shown = []
    for study in studies:
        own = {name: found[file] for name, file in files[study.case.name].items()}
        shown.append(_shown(plan, study, own, measured))
    return render(
        "frequency_response.html",
        shown=shown,
        beside=found.get("beside", ""),
        several=any(len(study.checks) > 1 for study in studies),
        places=sorted({name for study in studies for name in abreast(study.checks)}),
        mask=plan.mask,
        limits=[_limit(plan, k) for k in range(len(plan.mask.limits))],
        loops=list(dict.fromkeys(at for study in studies for at in study.linear.loops)),
        lifted=any(
            loop.ninputs > 1 for study in studies for modes in study.linear.loops.values() for loop in modes.values()
        ),
        tests=[_test(studies, name) for name in TESTS],
        parameters=_parameters(studies),
        assumed=list_assumptions(plan, studies),
        result=result,
        text=text,
    )


def _shown(
    plan: Plan, study: CaseResponse, pictures: Mapping[str, str], measured: Sequence[Spectrum]
) -> dict[str, Any]:
    linear = study.linear
    return {
        "name": study.case.name,
        "title": study.case.title,
        "model": study.model,
        "met": study.met,
        "kept": sum(check.met for checks in study.checks.values() for check in checks),
        "rows": [
            {"place": study.label(place)} | _check(plan, check)
            for place, checks in study.checks.items()
            for check in checks
        ],
        "where": f"{first[0].upper()}{first[1:]}. " if (first := study.label(next(iter(study.checks)))) else "",
        "point": ", ".join(f"{name} {value:.4g}" for name, value in {"reference": 0.0, **study.inputs}.items()),
        "corners": _corners(study),
        "pictures": pictures,
        "measured": [spectrum.label for spectrum in measured],
        "notes": [
            *_notes(study, study.family, "reference", lambda size: f"{math.degrees(size):.3g} deg"),
            *(
                row
                for word, each in study.stiffness.items()
                for row in _notes(study, each.measured, f"load torque, {word}", lambda size: f"{size:.3g} N m")
            ),
        ],
        "modes": [model.name for model in linear.models],
        "unreachable": linear.models.unreachable,
        "missing_loops": linear.missing,
        "missing": study.missing,
        "margins": {at: margins_of(linear.margins[at], linear.sensitivities[at]) for at in linear.margins},
        "yields": [
            [mode, format_peak(each), number(1 / each.value)]
            for mode, each in linear.compliance_peaks.items()
            if each.value > LEAST_COMPLIANCE
        ],
        "poles": {mode: poles_of(found) for mode, found in linear.poles.items()},
    }


def _notes(
    study: CaseResponse, family: FrequencyResponse, given: str, shown: Callable[[float], str]
) -> list[list[str]]:
    """A row for all sines of one amplitude at one place with the same note."""
    note = family.data.note
    rows: dict[tuple[str, ...], list[float]] = {}
    for index in map(tuple, np.argwhere(note.values != "")):
        one = note[index]
        corner = str(one["set"].item())
        place = study.label(Place(corner, float(one["load"]))) if corner else study.label(next(iter(study.checks)))
        failed = not np.isfinite(family.data.response.isel(output=0)[index].item())
        matter = str(one.item()).partition(";" if failed else ":")[0]
        rows.setdefault((given, place, shown(float(one["amplitude"])), matter), []).append(float(one["frequency"]))
    return [[*key[:3], ", ".join(f"{value:.3g}" for value in sorted(hertz)), key[3]] for key, hertz in rows.items()]


def _corners(study: CaseResponse) -> dict[str, Any]:
    """The parameters that the corners change: a row per parameter, a column per corner."""
    changed = {name: None for changes in study.sets.values() for name in changes}
    known = study.parameters
    return {
        "names": list(study.sets),
        "rows": [
            [name, *(f"{changes.get(name, known[name][0]):.6g}" for changes in study.sets.values()), known[name][1]]
            for name in changed
        ],
    }


def _check(plan: Plan, check: LimitCheck) -> dict[str, Any]:
    side = SIDES[check.side]
    return {
        "amplitude": _amplitude(plan, check.amplitude),
        "limit": side.label,
        "slack": check.nothing or f"{side.scale * check.slack:+.2f} {side.unit}",
        "at": f"{check.frequency:.3g} Hz",
        "points": check.points,
        "met": check.met,
    }


def _amplitude(plan: Plan, part: float) -> str:
    return f"{math.degrees(part * plan.stroke):.3g} deg ({100 * part:g} % of the stroke)"


def _limit(plan: Plan, k: int) -> list[str]:
    limit = plan.mask.limits[k]
    cells = [_amplitude(plan, limit.amplitude), ", ".join(f"{value:g}" for value in limit.frequencies)]
    for name, side in SIDES.items():
        cells.append(", ".join(f"{side.scale * value:.4g}" for value in getattr(limit, name)) or "–")
    return cells


def _test(studies: Sequence[CaseResponse], name: str) -> dict[str, Any]:
    """The numbers of one test, a column per case."""
    tables = [study.tests[name]["numbers"] for study in studies]
    units = {key: unit for table in tables for key, (_, unit) in table.items()}
    rows = []
    for key, unit in units.items():
        scale, word = SHOWN_UNITS.get(unit, (1.0, unit))
        values = [
            number(scale * table[key][0], "never" if unit == "s" else "none") if key in table else ""
            for table in tables
        ]
        rows.append([key, *values, "" if word == "-" else word])
    return {
        "name": name,
        "rows": rows,
        "words": {study.case.name: study.tests[name]["words"] for study in studies},
        "reasons": {study.case.name: study.tests[name]["reason"] for study in studies},
    }


def _parameters(studies: Sequence[CaseResponse]) -> list[dict[str, Any]]:
    tables = [study.parameters for study in studies]
    units = {name: unit for table in tables for name, (_, unit) in table.items()}
    rows = []
    for name, unit in units.items():
        values = [table[name][0] if name in table else None for table in tables]
        rows.append(
            {
                "name": name,
                "values": ["–" if value is None else f"{value:.6g}" for value in values],
                "unit": unit,
                "differs": len(set(values)) > 1,
            }
        )
    return rows


def list_assumptions(plan: Plan, studies: Sequence[CaseResponse]) -> list[str]:
    """The assumptions that apply, with the names of the cases where they do not apply to all."""

    def where(has: Callable[[CaseResponse], Any]) -> str | None:
        names = [study.case.name for study in studies if has(study)]
        if len(names) == len(studies):
            return ""
        return f" ({', '.join(names)})" if names else None

    sentences = [
        (
            "Tooth contacts after F. L. J. van der Linden, with friction averaged over the path of contact",
            where(lambda study: any(mesh.friction for mesh in study.case.actuator.gear.meshes.values())),
        ),
        (
            "Teeth with backlash push but do not pull",
            where(
                lambda study: any(
                    event.kind is EventKind.GAP and event.place is ContactPlace.MESH
                    for event in study.case.actuator.system().events
                )
            ),
        ),
        (
            "Contacts stick with zero slip speed, and break away at their breakaway friction",
            where(lambda study: study.case.actuator.system().contacts),
        ),
        ("Averaged inverter", where(lambda study: study.case.actuator.inverter is not None)),
        (
            "Decoupling with the true motor parameters",
            where(lambda study: _is_decoupled(study.case.actuator)),
        ),
        ("Controllers in continuous time", where(lambda study: study.case.actuator.sampling is None)),
        ("Controllers sampled", where(lambda study: study.case.actuator.sampling is not None)),
        (
            "Linear models neglect quantization and noise of the sensors; the simulations include them",
            where(lambda study: study.case.actuator.sensors != Sensors()),
        ),
        ("Unpowered: no torque from the motor", where(lambda study: "unpowered" in study.stiffness)),
        (
            "Unpowered: the winding is open",
            where(
                lambda study: "unpowered" in study.stiffness and study.case.actuator.motor.driven_by == "voltage",
            ),
        ),
        (
            "Temperatures act on laws with an oil; other parameters change only as the corners state",
            where(lambda study: len(study.sets) > 1),
        ),
        (
            "Corners and bias loads apply to the reference sines; linear models, loops, margins, stiffness and bench "
            "tests (except the one in every corner) are those of the actuator as it is",
            where(lambda study: len(study.checks) > 1),
        ),
    ]
    return [
        f"Stroke of {math.degrees(plan.stroke):.4g} deg from end to end; amplitudes are peak values, relative to it.",
        "A sine starts at rest, at its crest, and is settled when two successive measurements agree within 0.05 % of "
        "the fundamental. Gain and phase are those of the fundamental.",
        "Torques on the load: "
        + "; ".join(
            f"{', '.join(f'{part * study.torque:.3g}' for part in PARTS)} N m ({study.case.name}, of "
            f"{study.torque:.4g} N m at most)"
            for study in studies
        )
        + ".",
        "Mask limits are checked at measured points only.",
        *(f"{sentence}{names}." for sentence, names in sentences if names is not None),
    ]


ZERO = 1e-12  # a smaller number in a table is zero
LEAST_SHARE = 0.02  # participation of a state that is listed
MOST_STATES = 4


def margins_of(
    by_mode: Mapping[str, Margins | LiftedMargins], curves: Mapping[str, Sensitivities | None]
) -> list[dict[str, Any]]:
    """A row per mode; one row for all modes with zero loop gain."""
    cut = [mode for mode in by_mode if curves[mode] is None]
    rows = [_margin(by_mode[mode], mode, each) for mode, each in curves.items() if each is not None]
    nothing = {"mode": "; ".join(cut), "closed": "loop gain is zero", "cells": ["–"] * 6, "gains": "–", "phases": "–"}
    return rows + ([nothing] if cut else [])


def format_peak(peak: Peak) -> str:
    """The value with its frequency; without a peak the value alone."""
    where = "" if math.isnan(peak.frequency) else f" at {peak.frequency / (2 * math.pi):.3g} Hz"
    return f"{peak.value:.3g}{where}"


def _margin(found: Margins | LiftedMargins, mode: str, curves: Sensitivities) -> dict[str, Any]:
    peaks = [format_peak(curves.sensitivity_peak), format_peak(curves.complementary_peak)]
    closed = "stable" if found.stable else "unstable"
    cells = [
        " to ".join(map(number, found.range_db)),
        number(found.phase_deg),
        "–" if found.delay_s is None else number(1e3 * found.delay_s),
        "–" if found.disk is None else number(found.disk.size),
        *peaks,
    ]
    if found.gain_crossings is None or found.phase_crossings is None:
        gains, phases = "of all values in a period together", ""
        return {"mode": mode, "closed": closed, "cells": cells, "gains": gains, "phases": phases}
    gains = "; ".join(
        f"{c.frequency / (2 * math.pi):.4g} Hz: {math.degrees(c.phase_rad):.1f}°, {1e3 * c.delay_s:.3g} ms"
        for c in found.gain_crossings
    )
    phases = "; ".join(f"{c.frequency / (2 * math.pi):.4g} Hz: {to_db(c.gain):+.1f} dB" for c in found.phase_crossings)
    return {"mode": mode, "closed": closed, "cells": cells, "gains": gains or "–", "phases": phases or "–"}


def poles_of(found: Poles) -> list[dict[str, str]]:
    """A row per pole, with the states that participate in it."""
    rows = []
    for pole in found:
        ranked = sorted(pole.participation.items(), key=lambda pair: -pair[1])[:MOST_STATES]
        value = f"{pole.value.real:.4g}" + (f" ± {abs(pole.value.imag):.4g} i" if pole.value.imag else "")
        if math.isinf(pole.value.real):
            value = "delay"
        rows.append(
            {
                "value": value,
                "frequency": number(pole.frequency / (2 * math.pi)),
                "damping": number(pole.damping),
                "belongs": ", ".join(f"{name} {share:.0%}" for name, share in ranked if share > LEAST_SHARE),
            }
        )
    return rows


def number(value: float, infinite: str = "–") -> str:
    """A number for a table; a dash for nan, `infinite` where it is not finite."""
    if math.isnan(value):
        return "–"
    if not math.isfinite(value):
        return infinite
    return f"{value:.4g}" if abs(value) > ZERO else "0"


def _is_decoupled(actuator: Any) -> bool:
    control = None if actuator.controller is None else actuator.controller.current_control()
    return control is not None and control.decoupling
