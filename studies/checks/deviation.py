"""How far this project's numbers are from those of others, as rows of a table."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

HEADINGS = ("", "theirs", "deviation", "relative", "allowed", "")


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
        The other's number; for a signal over time its peak.
    deviation : float
        This project's number less theirs; for a signal over time the largest, without its sign.
    allowed : float
        Largest share of theirs [-].
    """

    what: str
    unit: str
    theirs: float
    deviation: float
    allowed: float

    @property
    def relative(self) -> float:
        """Size of the deviation over theirs [-]."""
        return abs(self.deviation / self.theirs)

    @property
    def holds(self) -> bool:
        """Whether it is within what is allowed."""
        return self.relative <= self.allowed

    def as_result(self) -> dict[str, Any]:
        """For machines."""
        return {**asdict(self), "relative": self.relative, "holds": self.holds}


def table(rows: Sequence[Deviation]) -> str:
    """The rows as text in columns."""
    cells = [
        (
            row.what,
            f"{row.theirs:.5g} {row.unit}",
            f"{row.deviation:.2g} {row.unit}",
            f"{100 * row.relative:.2g} %",
            f"{100 * row.allowed:g} %",
            "" if row.holds else "TOO FAR",
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
