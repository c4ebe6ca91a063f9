"""How contacts that hold can let go: the mechanisms of a train, by which a group's distance to that is known.

A mechanism is a motion q in which as many contacts as possible stay stuck and some slip. With c_i = T_i q of those, a
group holds as long as for every mechanism (limit analysis, the kinematic theorem)

    sum of limit_i |c_i|  -  |sum of s_i c_i|  >= 0            over those of the group that slip

whatever friction s within the group balances its load: the sum is the power of that load. When one of these falls
through zero, all that slip in it have let go, together. What can be alone in a mechanism is not redundant: its margin
is limit - |s|. With fewer contacts stuck the mechanisms are the same, less what is not stuck any more.
"""

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from gear.kinematics import Kinematics, Row
from gear.quantities import Scalar

SLIPS = 1e-9  # part of its own row above which a contact slips in a mechanism


def mechanisms(torque: Sequence[Row], values: Sequence[Row], shafts: Sequence[str]) -> list[dict[int, Scalar]]:
    """All of them: of the contacts that slip, by number, friction's torque per unit along the motion, c_i.

    Parameters
    ----------
    torque : sequence of dict of str to Scalar
        Per contact the torque on each independent shaft per unit of friction.
    values : sequence of dict of str to float
        The same in numbers, which decide what is redundant.
    shafts : sequence of str
        The independent shafts.
    """
    rank = structural_rank(values, shafts)
    found: dict[tuple[int, ...], dict[int, Scalar]] = {}
    for stuck in combinations(range(len(values)), rank - 1) if rank else ():
        motion = [
            Kinematics(list(shafts), [rows[k] for k in stuck], [values[k] for k in stuck], keep=[])
            for rows in (values, torque)
        ]
        if len(motion[0].independent) != len(shafts) - rank + 1:
            continue  # they lock less than they could
        for free in motion[0].independent:
            powers = [
                [_along(row, one, free) for row in rows] for rows, one in zip((values, torque), motion, strict=True)
            ]
            sizes = np.array([abs(float(c)) for c in powers[0]])
            scale = np.array([max(abs(float(c)) for c in row.values()) for row in values])
            turned = max(abs(float(row.get(free, 0.0))) for row in motion[0].turns.values())
            slips = tuple(int(k) for k in np.flatnonzero(sizes > SLIPS * scale * turned))
            if slips:
                found.setdefault(slips, {k: powers[1][k] for k in slips})
                break
    return list(found.values())


def structural_rank(rows: Sequence[Row], shafts: Sequence[str]) -> int:
    """How many of these rows, in numbers, are independent."""
    return len(shafts) - len(Kinematics(list(shafts), list(rows), list(rows), keep=[]).independent)


def _along(row: Row, motion: Kinematics, free: str) -> Scalar:
    """Power of a row's torques along the motion of one shaft, the others following."""
    return sum((c * motion.turns[shaft][free] for shaft, c in row.items() if free in motion.turns[shaft]), 0.0)
