"""Torques of a transmission that turns steadily, friction and all."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from gear.mesh import Mesh
from gear.motion import Sliding
from gear.transmission import Transmission

ITERATIONS = 200  # of the normal forces, whose friction depends on their size
SETTLED = 1e-13  # relative change of the normal forces
STILL = 1e-9  # part of the speed of the output that is no twist of a coupling


class NoSteadyState(ValueError):
    """Friction jams the train at this load: no finite normal forces balance it."""


@dataclass(frozen=True, kw_only=True)
class Balance:
    """Torques of a transmission that turns steadily.

    Attributes
    ----------
    input_torque, output_torque : float
        From outside on the input and output shaft [N m]; positive accelerates.
    speeds : dict of str to float
        Of every shaft [rad/s].
    normal, friction : dict of str to float
        Signed normal force and friction scalar of each mesh [N].
    loss : dict of str to float
        Power lost in each mesh and bearing [W], by path.
    """

    input_torque: float
    output_torque: float
    speeds: dict[str, float]
    normal: dict[str, float]
    friction: dict[str, float]
    loss: dict[str, float] = field(repr=False)

    def input_power(self, gear: Transmission) -> float:
        """Power into the gear at the input [W]."""
        return self.input_torque * self.speeds[gear.input]

    def output_power(self, gear: Transmission) -> float:
        """Power into the gear at the output [W]."""
        return self.output_torque * self.speeds[gear.output]


def balance(
    gear: Transmission, *, output_torque: float, output_speed: float, friction: Literal["sliding", "static"] = "sliding"
) -> Balance:
    """Torques while every shaft turns steadily, for a torque from outside on the output.

    Torques on every shaft add to zero, with each mesh sliding in the direction of its motion:

        sum of meshes (torque_per_normal F_n + torque_per_friction sign(v) mu |F_n|) + outside - bearings = 0

    Where meshes work side by side, such as those of separate planets, this leaves their shares open; the smallest
    normal forces are taken. What springs and gaps make of it, a run shows.

    Parameters
    ----------
    gear : Transmission
        With one speed ratio.
    output_torque : float
        From outside on the output shaft [N m]; it drives where its sign is that of the speed.
    output_speed : float
        [rad/s], its sign is the direction. Not zero; a small one where friction does not depend on speed.
    friction : "sliding" or "static"
        Coefficients while turning, or those at breakaway, with all contacts about to let go.

    Raises
    ------
    NoSteadyState
        Where friction jams the train.
    ValueError
        Speed zero.
    """
    if output_speed == 0:
        raise ValueError("balance: output_speed must not be 0 rad/s; its sign is the direction of motion")
    speeds = {name: turns * output_speed for name, turns in gear.speed_ratios().items()}
    shafts = [name for name in gear.shafts if name not in gear.fixed]
    outside = dict.fromkeys(gear.shafts, 0.0) | {gear.output: output_torque}
    loss = {}
    for name, drag in gear.drags.items():
        resisting = float(drag.torque(speeds[drag.shaft]))
        outside[drag.shaft] += resisting
        loss[f"drags.{name}"] = -resisting * speeds[drag.shaft]
    columns = [np.array([float(m.torque_per_normal().get(s, 0.0)) for s in shafts]) for m in gear.meshes.values()]
    rubs = [np.array([float(m.torque_per_friction().get(s, 0.0)) for s in shafts]) for m in gear.meshes.values()]
    rows = [coupling.twist_per_shaft() for coupling in gear.couplings.values()]
    # a coupling passes what torque it must; a return spring, whose twist grows, has none that is steady
    passing = [row for row in rows if abs(sum(c * speeds[s] for s, c in row.items())) <= STILL * abs(output_speed)]
    passed = [np.array([row.get(s, 0.0) for s in shafts]) for row in passing]
    drive = np.array([1.0 if name == gear.input else 0.0 for name in shafts])
    forces, scalars = np.zeros(len(columns)), np.zeros(len(columns))
    for _ in range(ITERATIONS):
        ratios = np.array(
            [_friction_ratio(m, speeds, f, friction) for m, f in zip(gear.meshes.values(), forces, strict=True)]
        )
        matrix = np.column_stack([*(c + k * b for c, k, b in zip(columns, ratios, rubs, strict=True)), *passed, drive])
        opposing = _bearing_torques(gear, speeds, dict(zip(gear.meshes, forces, strict=True)), friction)
        held = dict.fromkeys(shafts, 0.0)
        for name, bearing in gear.bearings.items():
            held[bearing.shaft] = held.get(bearing.shaft, 0.0) + opposing[name]
        right = np.array([held[name] - outside[name] for name in shafts])
        solved, *_ = np.linalg.lstsq(matrix, right, rcond=None)
        meshing = solved[: len(columns)]
        change = abs(meshing - forces).max(initial=0.0)
        forces, scalars = meshing, ratios * meshing
        if change <= SETTLED * max(abs(forces).max(initial=0.0), 1e-300):
            break
    else:
        raise NoSteadyState(
            f"balance: the normal forces do not settle at {output_torque:g} N m on {gear.output!r}; friction jams it"
        )
    loss |= {f"bearings.{name}": opposing[name] * speeds[bearing.shaft] for name, bearing in gear.bearings.items()}
    for (name, mesh), scalar in zip(gear.meshes.items(), scalars, strict=True):
        loss[f"meshes.{name}"] = -scalar * sum(float(t) * speeds[s] for s, t in mesh.torque_per_friction().items())
    return Balance(
        input_torque=float(solved[-1]),
        output_torque=output_torque,
        speeds=speeds,
        normal={name: float(force) for name, force in zip(gear.meshes, forces, strict=True)},
        friction={name: float(scalar) for name, scalar in zip(gear.meshes, scalars, strict=True)},
        loss={name: float(power) for name, power in loss.items()},
    )


def _bearing_torques(
    gear: Transmission, speeds: Mapping[str, float], normal: Mapping[str, float], kind: str
) -> dict[str, float]:
    """Torque of each bearing against the motion of its shaft [N m]; viscous drag only while turning."""
    found = {}
    for name, bearing in gear.bearings.items():
        speed, load = speeds[bearing.shaft], float(gear.bearing_load(bearing, normal))
        if kind == "sliding":
            found[name] = np.sign(speed) * bearing.sliding(load, abs(speed)) - bearing.viscous_torque(speed)
        else:
            found[name] = np.sign(speed) * bearing.holding(load)
    return found


def _friction_ratio(mesh: Mesh, speeds: Mapping[str, float], force: float, kind: str) -> float:
    """Friction scalar over signed normal force: sign(v) mu sign(F_n), zero for a mesh that only transmits."""
    if mesh.friction is None:
        return 0.0
    slip = sum(float(c) * speeds[shaft] for shaft, c in mesh.slip_per_shaft().items())
    if slip == 0:
        return 0.0
    flank = -1.0 if force < 0 else 1.0
    mesh_speed = abs(mesh.motion(speeds, speeds).speed)
    sliding = Sliding(
        speed=mesh_speed,
        force=abs(force) / mesh.count,
        a_drives=1.0 if slip * flank > 0 else 0.0,
        position=0.0,
        pair=mesh.pair,
    )
    law = mesh.friction.coefficient if kind == "sliding" else mesh.friction.breakaway
    return float(np.sign(slip) * law(sliding) * flank)
