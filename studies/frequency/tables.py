"""The tables of a frequency-response study: rows of CSV files, and data sets as netCDF."""

import csv
import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray

from actuator.linear.bode import to_db
from studies.frequency.plan import Plan
from studies.frequency.study import CaseResponse

HARMONICS = range(2, 8)  # that have a column


def write_rows(path: Path, rows: Iterable[Sequence[Any]]) -> None:
    """Write a CSV file, with the names in its first row."""
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows(rows)


def response_rows(plan: Plan, studies: Sequence[CaseResponse]) -> Iterable[Sequence[Any]]:
    """Every reference sine."""
    yield (
        "case", "corner", "bias_Nm", "amplitude_rad", "amplitude_of_stroke", "frequency_Hz", "gain_db", "phase_deg",
        "mean_rad", *(f"harmonic_{k}_of_fundamental" for k in HARMONICS), "distortion", "moves", "settled", "stuck",
        "note",
    )  # fmt: skip
    for study in studies:
        data = study.family.data.isel(output=0)
        for corner, bias, amplitude, frequency in itertools.product(
            *(data[name].values for name in ("set", "load", "amplitude", "frequency"))
        ):
            one = data.sel(set=corner, load=bias, amplitude=amplitude, frequency=frequency)
            value, moves = complex(one.response), bool(one.moves)
            harmonics = abs(one.harmonics.values)
            yield (
                study.case.name,
                corner,
                bias,
                amplitude,
                amplitude / plan.stroke,
                frequency,
                to_db(abs(value)) if moves and value else "",
                math.degrees(math.atan2(value.imag, value.real)) if moves else "",
                float(one["mean"]),
                *(harmonics[k - 1] / harmonics[0] if moves else "" for k in HARMONICS),
                float(one.distortion) if moves else "",
                moves,
                bool(one.settled),
                float(one.stuck),
                str(one.note.values),
            )


def stiffness_rows(studies: Sequence[CaseResponse]) -> Iterable[Sequence[Any]]:
    """Every sine of torque on the load."""
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


def margin_rows(studies: Sequence[CaseResponse]) -> Iterable[Sequence[Any]]:
    """Every crossing of every loop in every mode."""
    yield ("case", "loop", "mode", "quantity", "frequency_Hz", "value", "unit")
    for study in studies:
        for at, modes in study.linear.margins.items():
            for mode, found in modes.items():
                start = (study.case.name, at, mode)
                for quantity, frequency, value, unit in found.rows():
                    yield (*start, quantity, "" if frequency is None else frequency / (2 * math.pi), value, unit)
        for at, modes in study.linear.sensitivities.items():
            for mode, each in modes.items():
                for word, peak in (("S", each.sensitivity_peak), ("T", each.complementary_peak)) if each else ():
                    yield (study.case.name, at, mode, f"peak {word}", peak.frequency / (2 * math.pi), peak.value, "-")


def write_netcdf(path: Path, found: Mapping[str, xarray.Dataset]) -> None:
    """Write all cases into one file; complex numbers as two, and no texts but the names of the axes."""
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
        parts, xarray.DataArray(list(found), dims="case", name="case"), join="outer", combine_attrs="drop_conflicts"
    )
    joined.to_netcdf(path, engine="scipy")
