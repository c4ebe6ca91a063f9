"""Units at the edge: key suffixes such as `_deg` and `_mm`, and the unit of every key."""

import math
import sys
from typing import Any, NamedTuple

from gear.quantities import unit_of


class Suffix(NamedTuple):
    """A unit for use in files: how many of it make one SI unit, and its zero in SI units."""

    count: float
    unit: str
    zero: float = 0.0


# counts and not factors: 20 / 1e6 is the same double as 2e-5, 20 * 1e-6 is not
SUFFIXES = {
    "deg": Suffix(180 / math.pi, "rad"),
    "arcmin": Suffix(60 * 180 / math.pi, "rad"),
    "rpm": Suffix(30 / math.pi, "rad/s"),
    "deg_per_s": Suffix(180 / math.pi, "rad/s"),
    "mm": Suffix(1e3, "m"),
    "um": Suffix(1e6, "m"),
    "ms": Suffix(1e3, "s"),
    "us": Suffix(1e6, "s"),
    "kHz": Suffix(1e-3, "Hz"),
    "kgcm2": Suffix(1e4, "kg m^2"),
    "gcm2": Suffix(1e7, "kg m^2"),
    "mNm": Suffix(1e3, "N m"),
    "mohm": Suffix(1e3, "ohm"),
    "mH": Suffix(1e3, "H"),
    "uH": Suffix(1e6, "H"),
    "degC": Suffix(1.0, "K", 273.15),
    "mPas": Suffix(1e3, "Pa s"),
    "mm2_per_s": Suffix(1e6, "m^2/s"),
}

# of signals, whose values are in the unit of the input they drive
SIGNAL_UNITS = {
    **dict.fromkeys(("time", "times", "end", "duration"), "s"),
    **dict.fromkeys(("frequency", "first_frequency", "last_frequency"), "Hz"),
    **dict.fromkeys(("value", "values", "before", "after", "start", "amplitude", "offset"), "{input}"),
    "slope": "{input}/s",
    "phase": "rad",
}


class Key(NamedTuple):
    """A key of a file taken apart: the field it means, and the suffix it carries."""

    name: str
    suffix: Suffix | None


def split(key: str) -> Key:
    """Take the longest known suffix off a key."""
    for text in sorted(SUFFIXES, key=len, reverse=True):
        if key.endswith(f"_{text}"):
            return Key(key.removesuffix(f"_{text}"), SUFFIXES[text])
    return Key(key, None)


def field_unit(owner: type, name: str, input_unit: str | None) -> str | None:
    """SI unit of a field; `input_unit` for the owners that are signals. None where it is not a quantity."""
    unit = unit_of(owner, name)
    if unit is None and input_unit is not None and name in SIGNAL_UNITS:
        return SIGNAL_UNITS[name].format(input=input_unit)
    return unit


def spellings(name: str, unit: str | None) -> list[str]:
    """Every way to write the key of a field in this unit."""
    return [name, *(f"{name}_{text}" for text, suffix in SUFFIXES.items() if suffix.unit == unit)]


def is_number(value: Any) -> bool:
    """Whether a value of a file is a finite number (true and false are not)."""
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= sys.float_info.max


def to_si(value: Any, suffix: Suffix) -> Any:
    """A number, or each number of a list, in SI; anything else as it is, for the type check to refuse."""
    if isinstance(value, list):
        return [to_si(item, suffix) for item in value]
    return value / suffix.count + suffix.zero if is_number(value) else value
