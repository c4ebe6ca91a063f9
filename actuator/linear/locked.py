"""What stuck contacts lock, taken out of a linear model."""

import numpy as np

from actuator.linear.jacobians import jacobians
from actuator.linear.operating_point import OperatingPoint

DEPENDENT = 1e-9  # part of a row that is left of it when it follows from others
HELD = 1e-10  # part of the fastest rate of the model by which something locked may seem to move, by rounding


def unlocked(point: OperatingPoint, matrices: tuple[np.ndarray, ...]) -> tuple[tuple[np.ndarray, ...], list[int]]:
    """A, B, C, D without the states that follow from the others where contacts are stuck, and which states are left.

    A stuck contact has no slip, c . speeds = 0, and does not travel, c . angles = 0 in deviations from the point. Each
    such equation takes out one state, the one with the largest part in it.

    Raises
    ------
    ArithmeticError
        Where the model moves what is locked.
    """
    a, b, c, d = matrices
    rows = [row for slip in slips(point) for row in (slip, _travel(point, slip))]
    expressed, kept = eliminated(rows, len(a))
    scale = np.array([quantity.nominal for quantity in point.system.states])
    fastest = abs(a * scale / scale[:, None]).max(initial=0.0)
    for row in rows:
        moved = abs(row @ a @ expressed * scale[kept]).max(initial=0.0) / (abs(row) @ scale)
        if moved > HELD * fastest:
            raise ArithmeticError(
                f"{point.system.name}: a contact is stuck and its slip changes all the same, by {moved:.3g} of its "
                f"usual size per second, where {HELD * fastest:.3g} is rounding; use minimal=False"
            )
    return (a[kept] @ expressed, b[kept], c @ expressed, d), kept


def slips(point: OperatingPoint) -> list[np.ndarray]:
    """A row over the states for the slip of each stuck contact."""
    system = point.system
    outputs = [quantity.name for quantity in system.outputs]
    modes = dict(zip(system.modes, np.round(point.m), strict=True))
    rows = []
    for name, mode in modes.items():
        contact = name.removesuffix(".motion")
        if contact == name or abs(mode) == 1 or modes.get(f"{contact}.flank", 1) == 0:
            continue
        rows.append(outputs.index(f"{contact}.slip_speed"))
    return list(jacobians(point)[2][rows])


def _travel(point: OperatingPoint, slip: np.ndarray) -> np.ndarray:
    """The same row over the angles instead of the speeds."""
    names = [quantity.name for quantity in point.system.states]
    travel = np.zeros_like(slip)
    for k in np.flatnonzero(slip):
        travel[names.index(names[k].removesuffix("speed") + "angle")] = slip[k]
    return travel


def eliminated(rows: list[np.ndarray], states: int) -> tuple[np.ndarray, list[int]]:
    """All states by those that are left where each row over them is zero, and which are left.

    Each row takes out one state, the one with the largest part in it.
    """
    expressed, kept = np.eye(states), list(range(states))
    for row in rows:
        left = row @ expressed
        if abs(left).max(initial=0.0) <= DEPENDENT * abs(row).max():
            continue
        gone = int(abs(left).argmax())
        expressed = expressed - np.outer(expressed[:, gone], left / left[gone])
        kept.remove(gone)
    return expressed[:, kept], kept
