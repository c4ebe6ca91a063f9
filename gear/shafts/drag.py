"""Drag that vanishes at rest: windage, churning."""

from dataclasses import dataclass
from itertools import pairwise

import casadi as ca

from gear.friction.tables import piecewise_linear
from gear.lubrication.drag import Thickening
from gear.quantities import Scalar
from gear.quantities.registry import part
from gear.shafts.law import ShaftDrag


@part(ShaftDrag, default=True)
@dataclass(frozen=True, kw_only=True)
class Drag(ShaftDrag):
    """Torque that opposes motion and vanishes at rest, as a table over speed: windage, churning.

        torque = -sign(speed) * table(|speed|) * thickening

    with straight lines between the points, constant beyond the last.

    Parameters
    ----------
    shaft : str
        Name of the shaft.
    speeds : tuple of float
        [rad/s], increasing from 0.
    torques : tuple of float
        [N m], as many, the first 0, none negative.
    thickening : Thickening or None
        Makes the torques depend on the oil; None where they are given for the oil in use.
    """

    shaft: str
    speeds: tuple[float, ...]
    torques: tuple[float, ...]
    thickening: Thickening | None = None

    @classmethod
    def examples(cls) -> "tuple[Drag, ...]":
        """Windage."""
        return (cls(shaft="a", speeds=(0.0, 10.0, 100.0), torques=(0.0, 0.01, 0.2)),)

    def __post_init__(self) -> None:
        where = f"Drag on shaft {self.shaft!r}"
        if len(self.speeds) != len(self.torques) or len(self.speeds) < 2:  # noqa: PLR2004
            raise ValueError(
                f"{where} needs at least two speeds and as many torques, got {len(self.speeds)} and {len(self.torques)}"
            )
        if self.speeds[0] != 0 or any(late <= early for early, late in pairwise(self.speeds)):
            raise ValueError(f"{where}: speeds must increase from 0 rad/s, got {self.speeds}")
        if self.torques[0] != 0 or min(self.torques) < 0:
            raise ValueError(f"{where}: torques must begin with 0 N m and not be negative, got {self.torques}")

    def torque(self, speed: Scalar) -> Scalar:
        """Torque on the shaft [N m] at a signed speed [rad/s]; an odd function, so no sign is taken.

        The first part of the table and its image are one straight line through standstill, where there is no corner.
        """
        first = self.speeds[1]
        through = self.torques[1] / first * ca.fmax(-first, ca.fmin(speed, first))
        table = [piecewise_linear(side, self.speeds[1:], self.torques[1:]) for side in (speed, -speed)]
        return -(through + (table[0] - table[1])) * (1.0 if self.thickening is None else self.thickening.factor())
