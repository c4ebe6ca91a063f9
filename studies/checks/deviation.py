"""Deviations of this project's numbers from published ones, as rows of a table."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

HEADINGS = ("", "reference", "deviation", "relative", "limit", "")


@dataclass(frozen=True, kw_only=True)
class Deviation:
    """One comparison.

    Attributes
    ----------
    what : str
        What is compared.
    unit : str
        Of both numbers.
    theirs : float
        The published number; for a signal over time its peak.
    deviation : float
        This project's number less theirs; for a signal over time the largest, without its sign.
    allowed : float
        Limit of the relative deviation [-].
    """

    what: str
    unit: str
    theirs: float
    deviation: float
    allowed: float

    @property
    def relative(self) -> float:
        """Magnitude of the deviation over the published number [-]."""
        return abs(self.deviation / self.theirs)

    @property
    def holds(self) -> bool:
        """Whether it is within its limit."""
        return self.relative <= self.allowed

    def as_result(self) -> dict[str, Any]:
        """As a dictionary, for result.json."""
        return {**asdict(self), "relative": self.relative, "holds": self.holds}


def table(rows: Sequence[Deviation]) -> str:
    """Format the rows as text in columns."""
    cells = [
        (
            row.what,
            f"{row.theirs:.5g} {row.unit}",
            f"{row.deviation:.2g} {row.unit}",
            f"{100 * row.relative:.2g} %",
            f"{100 * row.allowed:g} %",
            "" if row.holds else "EXCEEDED",
        )
        for row in rows
    ]
    widths = [max(len(line[k]) for line in (HEADINGS, *cells)) for k in range(len(HEADINGS))]
    lines = [
        "  ".join(
            [line[0].ljust(widths[0]), *(cell.rjust(width) for cell, width in zip(line[1:], widths[1:], strict=True))]
        )
        for line in (HEADINGS, *cells)
    ]
    return "\n".join(line.rstrip() for line in lines)
