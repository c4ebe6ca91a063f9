"""Poles of a model: how fast and how damped, what each of them belongs to, and how far rounding may have moved it."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import eig, matrix_balance

from actuator.linear.model import least_dynamics
from actuator.linear.operating_point import OperatingPoint

if TYPE_CHECKING:
    import xarray

LEAST = 0.02  # share of a state that is worth a word
AT_ONCE = 1e-12  # a pole z of which nothing is left after one period
RIGID = 1e-7  # part of the fastest pole below which a pole is at zero


def rounding_bound(a: np.ndarray, *, discrete: bool) -> float:
    """How far within the boundary of stability the poles are, each moved there by what may be its rounding.

        n eps |A| / |y x|,    at most sqrt(n eps) |A|

    is what errors of n eps in the balanced matrix make of a simple pole with left and right eigenvectors y and x of
    length one, and of a double one. Negative where one is unstable beyond doubt; [1/s], or of |z| in discrete time.

    References
    ----------
    Golub, Van Loan, "Matrix Computations", 4th edition, 2013, section 7.2.2 (condition of an eigenvalue).
    """
    if not len(a):
        return math.inf
    balanced = np.asarray(matrix_balance(a, permute=False)[0])
    poles, left, right = eig(balanced, left=True, right=True)  # pyright: ignore[reportAssignmentType] - stubs of three answers
    size, error = np.linalg.norm(balanced, 2), len(a) * np.finfo(float).eps
    aligned = abs((left.conj() * right).sum(axis=0))
    moved = size * error / np.maximum(aligned, math.sqrt(error))
    beyond = abs(poles) - 1 if discrete else np.real(poles)
    return float((moved - beyond).min())


@dataclass(frozen=True, kw_only=True)
class Pole:
    """One real pole, or a pair.

    Attributes
    ----------
    value : complex
        [1/s], of a pair the one above the real axis; in discrete time ln(z)/period, minus infinity for a delay.
    participation : mapping of str to float
        Participation factor of each state, its left times its right eigenvector; independent of units, they sum to 1.
    owners : mapping of str to str
        What each state belongs to, as its system says it: "motor winding", "shaft motor", "controller".
    """

    value: complex
    participation: Mapping[str, float]
    owners: Mapping[str, str]

    @property
    def frequency(self) -> float:
        """Natural frequency |s| [rad/s]."""
        return abs(self.value)

    @property
    def damping(self) -> float:
        """Damping ratio -Re(s)/|s| [-]; nan at zero."""
        if math.isinf(self.value.real):
            return 1.0
        return -self.value.real / abs(self.value) if self.value else math.nan

    @property
    def parts(self) -> dict[str, float]:
        """Share of each part, the largest first: what states belong to; one without an owner is its own."""
        shares: dict[str, float] = {}
        for name, share in self.participation.items():
            part = self.owners[name] or name
            shares[part] = shares.get(part, 0.0) + share
        return dict(sorted(shares.items(), key=lambda pair: -pair[1]))

    @property
    def part(self) -> str:
        """The part with the largest share."""
        return next(iter(self.parts))


@dataclass(frozen=True, kw_only=True)
class Poles:
    """The poles of a linear model, slowest first; `print` shows the table."""

    poles: tuple[Pole, ...]
    states: tuple[str, ...]

    def __iter__(self):
        return iter(self.poles)

    def __len__(self) -> int:
        return len(self.poles)

    def __str__(self) -> str:
        """A line a pole: value, frequency, damping, and the states that take part."""
        lines = [f"{'pole in 1/s':>26} {'rad/s':>10} {'damping':>8}  belongs to"]
        for pole in self.poles:
            ranked = sorted(pole.participation.items(), key=lambda pair: -pair[1])
            words = ", ".join(f"{name} {share:.0%}" for name, share in ranked[:4] if share > LEAST)
            value = f"{pole.value.real:.4g}" + (f" +- {pole.value.imag:.4g}j" if pole.value.imag else "")
            lines.append(f"{value:>26} {pole.frequency:>10.4g} {pole.damping:>8.3f}  {words}")
        return "\n".join(lines)

    def to_xarray(self) -> "xarray.Dataset":
        """Values and participations as a dataset over pole and state, units in the attributes."""
        import xarray

        table = np.array([[pole.participation[name] for name in self.states] for pole in self.poles])
        values = np.array([pole.value for pole in self.poles])
        return xarray.Dataset(
            {
                "real": ("pole", np.real(values), {"units": "1/s"}),
                "imaginary": ("pole", np.imag(values), {"units": "1/s"}),
                "frequency": ("pole", [pole.frequency for pole in self.poles], {"units": "rad/s"}),
                "damping": ("pole", [pole.damping for pole in self.poles], {"units": "-"}),
                "participation": (("pole", "state"), table, {"units": "-"}),
            },
            coords={"state": list(self.states)},
        )


def poles(point: OperatingPoint, *, drifting: Sequence[str] = ()) -> Poles:
    """Poles with all loops closed, in the contact mode of the point, without what stuck contacts lock.

    Parameters
    ----------
    point : OperatingPoint
        From `trim`.
    drifting : sequence of str
        As for `linearize`.

    Returns
    -------
    Poles
    """
    a, states, step = least_dynamics(point, drifting=drifting)
    known = {quantity.name: quantity for quantity in point.system.states}
    scale = np.array([known[name].nominal for name in states])
    owners = {name: known[name].owner for name in states}
    values, left, right = eig(a / scale[:, None] * scale, left=True, right=True)  # pyright: ignore[reportAssignmentType] - stubs of three answers
    shares = abs(left.conj() * right)
    shares = shares / shares.sum(axis=0)
    if step:
        # a delay has its pole at z = 0, infinitely fast
        values = np.array([np.log(complex(z)) / step if abs(z) > AT_ONCE else -np.inf for z in values])
    values = np.where(abs(values) > RIGID * abs(values[np.isfinite(values)]).max(initial=0.0), values, 0)
    found = [
        Pole(value=complex(value), participation=dict(zip(states, share.tolist(), strict=True)), owners=owners)
        for value, share in zip(values, shares.T, strict=True)
        if value.imag >= 0 or step and value.imag <= -math.pi / step * (1 - RIGID)
    ]
    return Poles(poles=tuple(sorted(found, key=lambda pole: pole.frequency)), states=tuple(states))
