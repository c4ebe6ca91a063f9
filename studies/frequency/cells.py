"""Cells of the tables of loops and poles: margins, peaks and participation in round numbers."""

import math
from collections.abc import Mapping
from typing import Any

from actuator import LiftedMargins, Margins, Poles
from studies.frequency.sensitivity import Peak, Sensitivities

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
        low, high = (
            20 * math.log10(value) if value > 0 else -math.inf for value in (found.lower_gain, found.upper_gain)
        )
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
    phases = "; ".join(
        f"{c.frequency / (2 * math.pi):.4g} Hz: {20 * math.log10(c.gain):+.1f} dB" for c in found.phase_crossings
    )
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
