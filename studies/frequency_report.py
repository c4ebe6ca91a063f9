"""A frequency-response study as files: report.html, pictures, result.json, tables as CSV, netCDF."""

import base64
import csv
import math
import platform
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray
from jinja2 import Environment, PackageLoader, StrictUndefined
from matplotlib.figure import Figure

from actuator import LiftedMargins, Margins, Poles, Spectrum
from actuator.linear.plots import plot_modes
from studies.frequency_mask import LimitCheck
from studies.frequency_pictures import plot_beside, plot_family
from studies.frequency_response import PARTS, Plan, Study, source
from studies.frequency_tests import TESTS
from studies.report import LIBRARIES, _version

SIDES = {
    "gain_low_db": ("gain, from below", 1.0, "dB"),
    "gain_high_db": ("gain, from above", 1.0, "dB"),
    "phase_low": ("phase, from below", 180 / math.pi, "deg"),
    "phase_high": ("phase, from above", 180 / math.pi, "deg"),
}
IN_WORDS = {"rad": (180 / math.pi, "deg"), "rad/s": (180 / math.pi, "deg/s")}
LEAST_SHARE = 0.02  # of a state in a pole that is worth a word
MOST_STATES = 4


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
        images |= {f"{named(label, _file(name))}.png": base64.b64decode(image) for name, image in tests.items()}
    if several:
        pictures["beside"] = plot_beside(studies, _compared(plan))
    text = sentences(plan, studies)
    result = result_of(plan, studies)

    def page(path: Path) -> None:
        """The pictures are in its folder already."""
        found = {each.stem: base64.b64encode(each.read_bytes()).decode() for each in path.parent.glob("*.png")}
        prefixes = {study.case.name: named(study.case.name, "") for study in studies}
        path.write_text(_html(plan, studies, measured, result, text, (found, prefixes)), encoding="utf-8")

    files: dict[str, Callable[[Path], None]] = {
        **{name: partial(_write_image, image) for name, image in images.items()},
        "report.html": page,
        "responses.csv": lambda path: _write(path, _response_rows(plan, studies)),
        "stiffness.csv": lambda path: _write(path, _stiffness_rows(studies)),
        "margins.csv": lambda path: _write(path, _margin_rows(studies)),
        "responses.nc": lambda path: _to_netcdf(path, {s.case.name: s.family.data for s in studies}),
    }
    for word in ("powered", "unpowered"):
        found = {s.case.name: s.stiffness[word].data for s in studies if word in s.stiffness}
        if found:
            files[f"stiffness_{word}.nc"] = lambda path, found=found: _to_netcdf(path, found)
    return StudyFiles(pictures, result, text, files)


def _write_image(image: bytes, path: Path) -> None:
    path.write_bytes(image)


def _file(name: str) -> str:
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


def _write(path: Path, rows: Iterable[Sequence[Any]]) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows(rows)


def _response_rows(plan: Plan, studies: Sequence[Study]) -> Iterable[Sequence[Any]]:
    yield (
        "case", "amplitude_rad", "amplitude_of_stroke", "frequency_Hz", "gain_db", "phase_deg", "mean_rad",
        "third_harmonic_of_fundamental", "moves", "settled", "stuck", "note",
    )  # fmt: skip
    for study in studies:
        data = study.family.data.isel(set=0, load=0, output=0)
        for amplitude in data.amplitude.values:
            for frequency in data.frequency.values:
                one = data.sel(amplitude=amplitude, frequency=frequency)
                value, moves = complex(one.response), bool(one.moves)
                harmonics = abs(one.harmonics.values)
                yield (
                    study.case.name,
                    amplitude,
                    amplitude / plan.stroke,
                    frequency,
                    20 * math.log10(abs(value)) if moves and value else "",
                    math.degrees(math.atan2(value.imag, value.real)) if moves else "",
                    float(one["mean"]),
                    harmonics[2] / harmonics[0] if moves else "",
                    moves,
                    bool(one.settled),
                    float(one.stuck),
                    str(one.note.values),
                )


def _stiffness_rows(studies: Sequence[Study]) -> Iterable[Sequence[Any]]:
    yield (
        "case", "state", "amplitude_Nm", "frequency_Hz", "compliance_rad_per_Nm", "stiffness_Nm_per_rad",
        "phase_of_stiffness_deg", "impedance_Nms_per_rad", "moves", "settled",
    )  # fmt: skip
    for study in studies:
        for word, stiffness in study.stiffness.items():
            data = stiffness.data.isel(set=0, load=0)
            for amplitude in data.amplitude.values:
                for frequency in data.frequency.values:
                    one = data.sel(amplitude=amplitude, frequency=frequency)
                    moves = bool(one.moves)
                    yield (
                        study.case.name,
                        word,
                        amplitude,
                        frequency,
                        abs(complex(one.compliance)),
                        abs(complex(one.stiffness)) if moves else "",
                        math.degrees(np.angle(complex(one.stiffness))) if moves else "",
                        abs(complex(one.impedance)) if moves else "",
                        moves,
                        bool(one.settled),
                    )


def _margin_rows(studies: Sequence[Study]) -> Iterable[Sequence[Any]]:
    yield ("case", "loop", "mode", "quantity", "frequency_Hz", "value", "unit")
    for study in studies:
        for at, modes in study.linear.margins.items():
            for mode, found in modes.items():
                start = (study.case.name, at, mode)
                if isinstance(found, LiftedMargins):
                    yield (*start, "lower gain", "", found.lower_gain, "-")
                    yield (*start, "upper gain", "", found.upper_gain, "-")
                    yield (*start, "phase", "", math.degrees(found.phase_rad), "deg")
                    continue
                for gain in found.gain_crossings:
                    hertz = gain.frequency / (2 * math.pi)
                    yield (*start, "phase margin", hertz, math.degrees(gain.phase_rad), "deg")
                    yield (*start, "delay margin", hertz, gain.delay_s, "s")
                for phase in found.phase_crossings:
                    yield (*start, "gain margin", phase.frequency / (2 * math.pi), 20 * math.log10(phase.gain), "dB")
                yield (*start, "disk size", found.disk.frequency / (2 * math.pi), found.disk.size, "-")


def _to_netcdf(path: Path, found: Mapping[str, xarray.Dataset]) -> None:
    """All cases in one file; complex numbers as two, and no words but the names of the axes."""
    parts: list[xarray.Dataset] = []
    for data in found.values():
        kept = data.drop_vars([name for name in data.variables if name in ("note", "unit")])
        for name, variable in list(kept.data_vars.items()):
            if np.iscomplexobj(variable):
                split = {f"{name}_real": variable.real, f"{name}_imaginary": variable.imag}
                kept = kept.drop_vars(str(name)).assign(
                    {key: value.assign_attrs(variable.attrs) for key, value in split.items()}
                )
            elif variable.dtype == bool:
                kept[name] = variable.astype("int8")
        parts.append(kept)
    joined: xarray.Dataset = xarray.concat(
        parts, xarray.DataArray(list(found), dims="case", name="case"), combine_attrs="drop_conflicts"
    )
    joined.to_netcdf(path, engine="scipy")


# -- the page ---------------------------------------------------------------------------------------------


def _html(  # noqa: PLR0913, PLR0917 - all there is to show
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
            *study.family.notes,
            *(f"stiffness, {word}: {n}" for word, each in study.stiffness.items() for n in each.measured.notes),
        ],
        "modes": [model.name for model in linear.models],
        "unreachable": linear.models.unreachable,
        "missing_loops": linear.missing,
        "missing": study.missing,
        "margins": {at: _margins_of(linear.margins[at]) for at in linear.margins},
        "poles": {mode: _poles(found) for mode, found in linear.poles.items()},
    }


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
    return f"{value:.4g}" if math.isfinite(value) else infinite
