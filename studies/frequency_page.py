"""The page of a frequency-response study: what its template shows, in words and round numbers."""

import math
from collections.abc import Callable, Mapping, Sequence
from datetime import UTC, datetime
from typing import Any

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined

from actuator import FrequencyResponse, LiftedMargins, Margins, Poles, Spectrum
from studies.frequency_mask import LimitCheck
from studies.frequency_response import PARTS, Plan, Study
from studies.frequency_tests import TESTS

SIDES = {
    "gain_low_db": ("gain, from below", 1.0, "dB"),
    "gain_high_db": ("gain, from above", 1.0, "dB"),
    "phase_low": ("phase, from below", 180 / math.pi, "deg"),
    "phase_high": ("phase, from above", 180 / math.pi, "deg"),
}
IN_WORDS = {"rad": (180 / math.pi, "deg"), "rad/s": (180 / math.pi, "deg/s")}
ROUNDING = 1e-12  # a number in a table that is none
LEAST_SHARE = 0.02  # of a state in a pole that is worth a word
MOST_STATES = 4


def html(  # noqa: PLR0913, PLR0917 - all there is to show
    plan: Plan,
    studies: Sequence[Study],
    measured: Sequence[Spectrum],
    result: dict[str, Any],
    text: list[str],
    pictures: tuple[Mapping[str, str], Mapping[str, str]],
) -> str:
    """The page; `pictures` are all of them in base64 by name, and what the names begin with by case."""
    found, prefixes = pictures
    environment = Environment(loader=PackageLoader("studies"), autoescape=True, undefined=StrictUndefined)
    point = ", ".join(f"{name} {value:.4g}" for name, value in {"reference": 0.0, **studies[0].inputs}.items())
    shown = []
    for study in studies:
        prefix = prefixes[study.case.name]
        own = {name.removeprefix(prefix): image for name, image in found.items() if name.startswith(prefix)}
        shown.append(_shown(plan, study, own, measured))
    return environment.get_template("frequency_response.html").render(
        shown=shown,
        beside=found.get("beside", ""),
        mask=plan.mask,
        limits=[_limit(plan, k) for k in range(len(plan.mask.limits))],
        loops=list(dict.fromkeys(at for study in studies for at in study.linear.loops)),
        tests=[_test(studies, name) for name in TESTS],
        parameters=_parameters(studies),
        assumed=_assumed(plan, studies),
        point=f"{point}; the reference in the middle of the stroke, other inputs as at the end of the case's scenario",
        result=result,
        text=text,
        made=datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"),
    )


def _shown(plan: Plan, study: Study, pictures: Mapping[str, str], measured: Sequence[Spectrum]) -> dict[str, Any]:
    linear = study.linear
    return {
        "name": study.case.name,
        "title": study.case.title,
        "model": study.model,
        "met": study.met,
        "kept": sum(check.met for check in study.checks),
        "rows": [_check(plan, check) for check in study.checks],
        "pictures": pictures,
        "measured": [spectrum.label for spectrum in measured],
        "notes": [
            *_notes(study.family, "reference", lambda size: f"{math.degrees(size):.3g} deg"),
            *(
                row
                for word, each in study.stiffness.items()
                for row in _notes(each.measured, f"load torque, {word}", lambda size: f"{size:.3g} N m")
            ),
        ],
        "modes": [model.name for model in linear.models],
        "unreachable": linear.models.unreachable,
        "missing_loops": linear.missing,
        "missing": study.missing,
        "margins": {at: _margins_of(linear.margins[at]) for at in linear.margins},
        "poles": {mode: _poles(found) for mode, found in linear.poles.items()},
    }


def _notes(family: FrequencyResponse, given: str, shown: Callable[[float], str]) -> list[list[str]]:
    """A row for every sine of which there is something to say."""
    note = family.data.note.isel(set=0, load=0)
    return [
        [given, shown(float(one.amplitude)), f"{float(one.frequency):.3g}", str(one.item()).partition(";")[0]]
        for one in (note[index] for index in map(tuple, np.argwhere(note.values != "")))
    ]


def _check(plan: Plan, check: LimitCheck) -> dict[str, Any]:
    what, scale, unit = SIDES[check.side]
    return {
        "amplitude": _amplitude(plan, check.amplitude),
        "limit": what,
        "slack": f"{scale * check.slack:+.2f} {unit}" if math.isfinite(check.slack) else "no motion",
        "at": f"{check.frequency:.3g} Hz",
        "points": check.points,
        "met": check.met,
    }


def _amplitude(plan: Plan, part: float) -> str:
    return f"{math.degrees(part * plan.stroke):.3g} deg ({100 * part:g} % of the stroke)"


def _limit(plan: Plan, k: int) -> list[str]:
    limit = plan.mask.limits[k]
    cells = [_amplitude(plan, limit.amplitude), ", ".join(f"{value:g}" for value in limit.frequencies)]
    for side, (_, scale, _) in SIDES.items():
        cells.append(", ".join(f"{scale * value:.4g}" for value in getattr(limit, side)) or "–")
    return cells


def _margins_of(by_mode: Mapping[str, Margins | LiftedMargins]) -> list[dict[str, Any]]:
    """A row per mode; one for all through which nothing passes."""
    cut = [mode for mode, found in by_mode.items() if _is_cut(found)]
    rows = [_margin(found, mode) for mode, found in by_mode.items() if mode not in cut]
    nothing = {"mode": "; ".join(cut), "closed": "nothing passes", "cells": ["–"] * 5, "gains": "–", "phases": "–"}
    return rows + ([nothing] if cut else [])


def _is_cut(found: Margins | LiftedMargins) -> bool:
    crossings = isinstance(found, Margins) and (found.gain_crossings or found.phase_crossings)
    return found.stable and found.peak_sensitivity == 1.0 and not crossings and math.isinf(found.phase_rad)


def _margin(found: Margins | LiftedMargins, mode: str) -> dict[str, Any]:
    closed = "stable" if found.stable else "unstable"
    if isinstance(found, LiftedMargins):
        low, high = (
            20 * math.log10(value) if value > 0 else -math.inf for value in (found.lower_gain, found.upper_gain)
        )
        gain = f"{_number(low)} to {_number(high)}"
        cells = [gain, _number(math.degrees(found.phase_rad)), "–", "–", _number(found.peak_sensitivity)]
        return {
            "mode": mode,
            "closed": closed,
            "cells": cells,
            "gains": "of all values in a period at once",
            "phases": "",
        }
    cells = [
        _number(found.gain_db),
        _number(found.phase_deg),
        _number(1e3 * found.delay_s),
        _number(found.disk.size),
        _number(found.peak_sensitivity),
    ]
    gains = "; ".join(
        f"{c.frequency / (2 * math.pi):.4g} Hz: {math.degrees(c.phase_rad):.1f}°, {1e3 * c.delay_s:.3g} ms"
        for c in found.gain_crossings
    )
    phases = "; ".join(
        f"{c.frequency / (2 * math.pi):.4g} Hz: {20 * math.log10(c.gain):+.1f} dB" for c in found.phase_crossings
    )
    return {"mode": mode, "closed": closed, "cells": cells, "gains": gains or "–", "phases": phases or "–"}


def _poles(found: Poles) -> list[dict[str, str]]:
    rows = []
    for pole in found:
        ranked = sorted(pole.participation.items(), key=lambda pair: -pair[1])[:MOST_STATES]
        value = f"{pole.value.real:.4g}" + (f" ± {abs(pole.value.imag):.4g} i" if pole.value.imag else "")
        if math.isinf(pole.value.real):
            value = "delay"
        rows.append(
            {
                "value": value,
                "frequency": _number(pole.frequency / (2 * math.pi)),
                "damping": _number(pole.damping),
                "belongs": ", ".join(f"{name} {share:.0%}" for name, share in ranked if share > LEAST_SHARE),
            }
        )
    return rows


def _test(studies: Sequence[Study], name: str) -> dict[str, Any]:
    """The numbers of one test, a column per case."""
    tables = [study.tests[name]["numbers"] for study in studies]
    units = {key: unit for table in tables for key, (_, unit) in table.items()}
    rows = []
    for key, unit in units.items():
        scale, word = IN_WORDS.get(unit, (1.0, unit))
        values = [
            _number(scale * table[key][0], "never" if unit == "s" else "none") if key in table else ""
            for table in tables
        ]
        rows.append([key, *values, "" if word == "-" else word])
    return {
        "name": name,
        "rows": rows,
        "words": {study.case.name: study.tests[name]["words"] for study in studies},
        "reasons": {study.case.name: study.tests[name]["reason"] for study in studies},
    }


def _parameters(studies: Sequence[Study]) -> list[dict[str, Any]]:
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


def _assumed(plan: Plan, studies: Sequence[Study]) -> list[str]:
    sampled = {study.case.name: study.case.actuator.sampling is not None for study in studies}
    return [
        f"Stroke of {math.degrees(plan.stroke):.4g} deg from end to end; amplitudes are peak values, in parts of it.",
        "Gear contacts after F. L. J. van der Linden with friction averaged over the path of contact, true sticking, "
        "and teeth that push and never pull.",
        "Averaged inverter; controllers "
        + ", ".join(f"{'sampled' if is_so else 'in continuous time'} ({name})" for name, is_so in sampled.items())
        + "; decoupling with the motor parameters given.",
        "Linear models take sensors to read between their counts, without noise; the simulations take them as "
        "they are.",
        "A sine is settled where two measurements in a row agree within 0.05 % of the fundamental; it starts at "
        "rest, at its crest. Phase and gain are those of the fundamental.",
        "Torques on the load: "
        + "; ".join(
            f"{', '.join(f'{part * study.torque:.3g}' for part in PARTS)} N m ({study.case.name}, of "
            f"{study.torque:.4g} N m at most)"
            for study in studies
        )
        + ". Unpowered: open circuit, no torque from the motor.",
        "Temperatures act only on laws that have an oil; other friction is that of the stated case.",
        "Mask limits are held at measured points only.",
    ]


def _number(value: float, infinite: str = "–") -> str:
    """A number for a table; a word where it is infinite, a dash where there is none."""
    if math.isnan(value):
        return "–"
    if not math.isfinite(value):
        return infinite
    return f"{value:.4g}" if abs(value) > ROUNDING else "0"
