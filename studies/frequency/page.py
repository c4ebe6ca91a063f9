"""The page of a frequency-response study: what its template shows, in words and round numbers."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from actuator import FrequencyResponse, LiftedMargins, Margins, Poles, Sensors, Spectrum
from actuator.linear.bode import to_db
from actuator.linear.margins.sensitivity import Peak, Sensitivities
from gear import Backlash
from studies.findings import rendered
from studies.frequency.bench import TESTS
from studies.frequency.corners import Place
from studies.frequency.mask import LimitCheck
from studies.frequency.plan import PARTS, Plan
from studies.frequency.study import Study

SIDES = {
    "gain_low_db": ("gain, from below", 1.0, "dB"),
    "gain_high_db": ("gain, from above", 1.0, "dB"),
    "phase_low": ("phase, from below", 180 / math.pi, "deg"),
    "phase_high": ("phase, from above", 180 / math.pi, "deg"),
}
LEAST = 1e-12  # rad/(N m) of a load that yields at all
IN_WORDS = {"rad": (180 / math.pi, "deg"), "rad/s": (180 / math.pi, "deg/s")}


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
    shown = []
    for study in studies:
        prefix = prefixes[study.case.name]
        own = {name.removeprefix(prefix): image for name, image in found.items() if name.startswith(prefix)}
        shown.append(_shown(plan, study, own, measured))
    return rendered(
        "frequency_response.html",
        shown=shown,
        beside=found.get("beside", ""),
        several=any(len(study.checks) > 1 for study in studies),
        places=sorted({name for each in shown for name in each["pictures"] if name.startswith("places_")}),
        mask=plan.mask,
        limits=[_limit(plan, k) for k in range(len(plan.mask.limits))],
        loops=list(dict.fromkeys(at for study in studies for at in study.linear.loops)),
        lifted=any(
            loop.ninputs > 1 for study in studies for modes in study.linear.loops.values() for loop in modes.values()
        ),
        tests=[_test(studies, name) for name in TESTS],
        parameters=_parameters(studies),
        assumed=_assumed(plan, studies),
        result=result,
        text=text,
    )


def _shown(plan: Plan, study: Study, pictures: Mapping[str, str], measured: Sequence[Spectrum]) -> dict[str, Any]:
    linear = study.linear
    return {
        "name": study.case.name,
        "title": study.case.title,
        "model": study.model,
        "met": study.met,
        "kept": sum(check.met for checks in study.checks.values() for check in checks),
        "rows": [
            {"place": study.words(place)} | _check(plan, check)
            for place, checks in study.checks.items()
            for check in checks
        ],
        "where": f"{first.capitalize()}. " if (first := study.words(next(iter(study.checks)))) else "",
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
            [mode, at_peak(each), number(1 / each.value)] for mode, each in linear.yields.items() if each.value > LEAST
        ],
        "poles": {mode: poles_of(found) for mode, found in linear.poles.items()},
    }


def _notes(study: Study, family: FrequencyResponse, given: str, shown: Callable[[float], str]) -> list[list[str]]:
    """A row for all sines of one amplitude at one place of which there is the same to say."""
    note = family.data.note
    rows: dict[tuple[str, ...], list[float]] = {}
    for index in map(tuple, np.argwhere(note.values != "")):
        one = note[index]
        corner = str(one["set"].item())
        place = study.words(Place(corner, float(one["load"]))) if corner else study.words(next(iter(study.checks)))
        matter = str(one.item()).partition(":" if "not settled" in one.item() else ";")[0]
        rows.setdefault((given, place, shown(float(one["amplitude"])), matter), []).append(float(one["frequency"]))
    return [[*key[:3], ", ".join(f"{value:.3g}" for value in sorted(hertz)), key[3]] for key, hertz in rows.items()]


def _corners(study: Study) -> dict[str, Any]:
    """What the corners change: a row per parameter, a column per corner."""
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
    what, scale, unit = SIDES[check.side]
    return {
        "amplitude": _amplitude(plan, check.amplitude),
        "limit": what,
        "slack": check.nothing or f"{scale * check.slack:+.2f} {unit}",
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


def _test(studies: Sequence[Study], name: str) -> dict[str, Any]:
    """The numbers of one test, a column per case."""
    tables = [study.tests[name]["numbers"] for study in studies]
    units = {key: unit for table in tables for key, (_, unit) in table.items()}
    rows = []
    for key, unit in units.items():
        scale, word = IN_WORDS.get(unit, (1.0, unit))
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
    """Only of what there is; of what not every case has, with the names of those that do."""

    def where(has: Callable[[Study], Any]) -> str | None:
        names = [study.case.name for study in studies if has(study)]
        if len(names) == len(studies):
            return ""
        return f" ({', '.join(names)})" if names else None

    sentences = [
        (
            "Contacts of teeth after F. L. J. van der Linden, with friction averaged over the path of contact",
            where(lambda study: any(mesh.friction for mesh in study.case.actuator.gear.meshes.values())),
        ),
        (
            "Teeth with backlash push and never pull",
            where(
                lambda study: any(isinstance(m.elasticity, Backlash) for m in study.case.actuator.gear.meshes.values())
            ),
        ),
        (
            "Contacts truly stick, and slide off at their breakaway",
            where(lambda study: any(mode.endswith(".motion") for mode in study.case.actuator.system().modes)),
        ),
        ("Averaged inverter", where(lambda study: study.case.actuator.inverter is not None)),
        (
            "Decoupling with the motor parameters given",
            where(lambda study: _is_decoupled(study.case.actuator)),
        ),
        ("Controllers in continuous time", where(lambda study: study.case.actuator.sampling is None)),
        ("Controllers sampled", where(lambda study: study.case.actuator.sampling is not None)),
        (
            "Linear models take sensors to read between their counts, without noise; the simulations take them as they "
            "are",
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
            "Temperatures act on laws that have an oil, and otherwise as the corners say, parameter by parameter",
            where(lambda study: len(study.sets) > 1),
        ),
        (
            "Corners and bias loads are those of the sines of the reference; all else is of the actuator as it is: "
            "linear models, loops, margins, stiffness and bench tests (but the one that is named after the corners)",
            where(lambda study: len(study.checks) > 1),
        ),
    ]
    return [
        f"Stroke of {math.degrees(plan.stroke):.4g} deg from end to end; amplitudes are peak values, in parts of it.",
        "A sine is settled where two measurements in a row agree within 0.05 % of the fundamental; it starts at "
        "rest, at its crest. Phase and gain are those of the fundamental.",
        "Torques on the load: "
        + "; ".join(
            f"{', '.join(f'{part * study.torque:.3g}' for part in PARTS)} N m ({study.case.name}, of "
            f"{study.torque:.4g} N m at most)"
            for study in studies
        )
        + ".",
        "Mask limits are held at measured points only.",
        *(f"{sentence}{names}." for sentence, names in sentences if names is not None),
    ]


ROUNDING = 1e-12  # a number in a table that is none
LEAST_SHARE = 0.02  # of a state in a pole that is worth a word
MOST_STATES = 4


def margins_of(
    by_mode: Mapping[str, Margins | LiftedMargins], curves: Mapping[str, Sensitivities | None]
) -> list[dict[str, Any]]:
    """A row per mode; one for all through which nothing passes."""
    cut = [mode for mode in by_mode if curves[mode] is None]
    rows = [_margin(by_mode[mode], mode, each) for mode, each in curves.items() if each is not None]
    nothing = {"mode": "; ".join(cut), "closed": "nothing passes", "cells": ["–"] * 6, "gains": "–", "phases": "–"}
    return rows + ([nothing] if cut else [])


def at_peak(peak: Peak) -> str:
    """The value and where it is; without a peak the value alone."""
    where = "" if math.isnan(peak.frequency) else f" at {peak.frequency / (2 * math.pi):.3g} Hz"
    return f"{peak.value:.3g}{where}"


def _margin(found: Margins | LiftedMargins, mode: str, curves: Sensitivities) -> dict[str, Any]:
    peaks = [at_peak(curves.sensitivity_peak), at_peak(curves.complementary_peak)]
    closed = "stable" if found.stable else "unstable"
    if isinstance(found, LiftedMargins):
        low, high = (to_db(value) for value in (found.lower_gain, found.upper_gain))
        gain = f"{number(low)} to {number(high)}"
        cells = [gain, number(math.degrees(found.phase_rad)), "–", "–", *peaks]
        return {
            "mode": mode,
            "closed": closed,
            "cells": cells,
            "gains": "of all values in a period at once",
            "phases": "",
        }
    cells = [
        number(found.gain_db),
        number(found.phase_deg),
        number(1e3 * found.delay_s),
        number(found.disk.size),
        *peaks,
    ]
    gains = "; ".join(
        f"{c.frequency / (2 * math.pi):.4g} Hz: {math.degrees(c.phase_rad):.1f}°, {1e3 * c.delay_s:.3g} ms"
        for c in found.gain_crossings
    )
    phases = "; ".join(f"{c.frequency / (2 * math.pi):.4g} Hz: {to_db(c.gain):+.1f} dB" for c in found.phase_crossings)
    return {"mode": mode, "closed": closed, "cells": cells, "gains": gains or "–", "phases": phases or "–"}


def poles_of(found: Poles) -> list[dict[str, str]]:
    """A row per pole, with the states that take part in it."""
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
    """A number for a table; a word where it is infinite, a dash where there is none."""
    if math.isnan(value):
        return "–"
    if not math.isfinite(value):
        return infinite
    return f"{value:.4g}" if abs(value) > ROUNDING else "0"


def _is_decoupled(actuator: Any) -> bool:
    control = None if actuator.controller is None else actuator.controller.current_control()
    return control is not None and control.decoupling
