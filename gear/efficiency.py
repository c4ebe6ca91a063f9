"""Steady answers of a transmission: efficiency, breakout torque, self-locking; per mesh and for the whole."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from gear.mesh import Mesh
from gear.motion import Sliding
from gear.transmission import Transmission

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

ITERATIONS = 200  # of the normal forces, whose friction depends on their size
SETTLED = 1e-13  # relative change of the normal forces
NO_LOAD = 1e-9  # part of a load that is none
HARDEST = 1e6  # factor on all friction beyond which nothing locks it
STILL = 1e-9  # part of the speed of the output that is no twist of a coupling


class NoSteadyState(ValueError):
    """Friction jams the train at this load: no finite normal forces balance it."""


SIDES: dict[str, Literal["input", "output"]] = {"forward": "input", "backward": "output"}


@dataclass(frozen=True, kw_only=True)
class Balance:
    """Torques of a transmission that turns steadily.

    Attributes
    ----------
    input_torque, output_torque : float
        From outside on the input and output shaft [N m]; positive accelerates.
    speeds : dict of str to float
        Of every shaft [rad/s].
    normal : dict of str to float
        Signed normal force of each mesh [N].
    loss : dict of str to float
        Power lost in each mesh and bearing [W], by path.
    """

    input_torque: float
    output_torque: float
    speeds: dict[str, float]
    normal: dict[str, float]
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
    speeds = {name: turns * output_speed for name, turns in gear.travel().items()}
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


def efficiency(
    gear: Transmission, *, torque: float, speed: float, driving: Literal["input", "output"] = "input"
) -> float:
    """Output power over input power [-] of steady motion.

    Parameters
    ----------
    gear : Transmission
        With one speed ratio.
    torque : float
        Size of the load's torque at the output shaft [N m], > 0: resisting where the input drives, driving
        where the output does.
    speed : float
        Of the output shaft [rad/s], its sign is the direction.
    driving : "input" or "output"
        The side that drives. Negative for "output" where the gear locks itself: the input must help.
    """
    if torque <= 0:
        raise ValueError(f"efficiency: torque must be > 0 N m, got {torque!r} N m; the direction is that of the speed")
    sign = np.sign(speed)
    if driving == "input":
        found = balance(gear, output_torque=-sign * torque, output_speed=speed)
        return -found.output_power(gear) / found.input_power(gear)
    found = balance(gear, output_torque=sign * torque, output_speed=speed)
    return -found.input_power(gear) / found.output_power(gear)


def mesh_efficiencies(gear: Transmission, *, torque: float, speed: float) -> dict[str, float]:
    """Efficiency [-] of each mesh while the input drives: one minus its loss over the power it passes on.

    The power is that of the relative motion to the carrier, which is what the teeth see.
    """
    found = balance(gear, output_torque=-np.sign(speed) * torque, output_speed=speed)
    result = {}
    for name, mesh in gear.meshes.items():
        motion = mesh.motion(found.speeds, found.speeds)
        arms = mesh.torque_per_normal()
        through = abs(found.normal[name]) * max(
            abs(float(arms[mesh.a]) * motion.speed_a), abs(float(arms[mesh.b]) * motion.speed_b)
        )
        result[name] = 1 - found.loss[f"meshes.{name}"] / through if through > 0 else float("nan")
    return result


@dataclass(frozen=True, kw_only=True)
class Breakout:
    """What it takes to get a transmission moving against a load, from standstill.

    Attributes
    ----------
    input_torque : float
        At the input [N m] to move the output against the load.
    output_torque : float
        At the output [N m] to drive the gear backward with the input free; infinite where it locks itself.
    locking_margin : float
        Factor on all mesh friction at which the gear begins to lock itself at standstill; below one it does.
    """

    input_torque: float
    output_torque: float
    locking_margin: float

    @property
    def self_locking(self) -> bool:
        """Whether no torque at the output moves the input."""
        return self.locking_margin <= 1


def breakout(gear: Transmission, *, torque: float, direction: Literal[1, -1] = 1) -> Breakout:
    """Breakout torques against a load [N m] at the output, moving the output in `direction`."""
    start = balance(gear, output_torque=-direction * torque, output_speed=float(direction), friction="static")

    def resisting(push: float) -> float:
        """Torque with which the input must still hold (> 0) or help (< 0) where the output drives."""
        return _safe(lambda load: _held_at_input(gear, direction, load), push)

    bare = replace(gear, bearings={})

    margin = _last_positive(lambda factor: _held_at_input(scaled(bare, factor), direction, 1.0))
    reach = float("inf")
    if margin > 1:
        # linear in the load but for laws that depend on it: bearings offset it, meshes scale it
        top = 1.0
        while resisting(top) <= 0:
            top *= 2
        low = NO_LOAD * top
        reach = _bisected(resisting, low, top) if resisting(low) < 0 else 0.0
    return Breakout(input_torque=abs(start.input_torque), output_torque=reach, locking_margin=margin)


def _held_at_input(gear: Transmission, direction: int, push: float) -> float:
    found = balance(gear, output_torque=direction * push, output_speed=float(direction), friction="static")
    return -found.input_torque * float(np.sign(found.speeds[gear.input]))


def _last_positive(gives: Callable[[float], float]) -> float:
    """Where a function of the friction factor falls to zero, by doubling and bisection."""
    low, high = 0.0, 1.0
    while _safe(gives, high) > 0:
        low, high = high, 2 * high
        if high > HARDEST:
            return float("inf")
    return _bisected(lambda factor: -_safe(gives, factor), low, high)


def _bisected(rises: Callable[[float], float], low: float, high: float) -> float:
    """Where a function turns from negative to positive; it may jump there."""
    for _ in range(100):
        middle = (low + high) / 2
        low, high = (low, middle) if rises(middle) >= 0 else (middle, high)
    return (low + high) / 2


def _safe(gives: Callable[[float], float], scale: float) -> float:
    """A jammed train gives nothing."""
    try:
        return gives(scale)
    except NoSteadyState:
        return -1.0


@dataclass(frozen=True, kw_only=True)
class _Scaled:
    """A friction law with all its coefficients multiplied by a factor."""

    law: object
    factor: float

    def coefficient(self, sliding: Sliding) -> float:
        """Sliding coefficient [-]."""
        return self.factor * self.law.coefficient(sliding)  # type: ignore[attr-defined]

    def breakaway(self, sliding: Sliding) -> float:
        """Coefficient at breakaway [-]."""
        return self.factor * self.law.breakaway(sliding)  # type: ignore[attr-defined]


def scaled(gear: Transmission, factor: float) -> Transmission:
    """The same transmission with all mesh friction multiplied by a factor."""
    meshes = {
        name: mesh if mesh.friction is None else replace(mesh, friction=_Scaled(law=mesh.friction, factor=factor))
        for name, mesh in gear.meshes.items()
    }
    return replace(gear, meshes=meshes)


def efficiency_map(
    gears: Mapping[float, Transmission] | Transmission, *, torques: Sequence[float], speeds: Sequence[float]
) -> "xarray.Dataset":
    """Efficiency forward and backward over load, speed and, with one transmission per temperature, temperature.

    Parameters
    ----------
    gears : Transmission, or mapping of temperature [K] to Transmission
        Such as {T: at_temperature(gear, T) for T in (218.15, 293.15, 343.15)}, see `gear.at_temperature`.
    torques, speeds : sequence of float
        At the output [N m], [rad/s].

    Returns
    -------
    xarray.Dataset
        `forward`, `backward` [-] over temperature, torque, speed; units in the attributes.
    """
    import xarray

    family = gears if isinstance(gears, Mapping) else {float("nan"): gears}
    values = {
        side: [
            [[efficiency(g, torque=t, speed=w, driving=end) for w in speeds] for t in torques] for g in family.values()
        ]
        for side, end in SIDES.items()
    }
    axes = ("temperature", "torque", "speed")
    return xarray.Dataset(
        {side: (axes, np.array(table), {"units": "1"}) for side, table in values.items()},
        coords={
            "temperature": ("temperature", list(family), {"units": "K"}),
            "torque": ("torque", list(torques), {"units": "N m"}),
            "speed": ("speed", list(speeds), {"units": "rad/s"}),
        },
    )


def plot_efficiency(data: "xarray.Dataset") -> "Figure":
    """Forward and backward efficiency over load and speed, a row per temperature."""
    from matplotlib.figure import Figure

    count = data.sizes["temperature"]
    figure = Figure(figsize=(9, 0.6 + 3.2 * count), layout="constrained")
    panels = figure.subplots(count, 2, squeeze=False, sharex=True, sharey=True)
    for row, temperature in zip(panels, data.temperature.values, strict=True):
        for axes, side in zip(row, ("forward", "backward"), strict=True):
            table = 100 * data[side].sel(temperature=temperature) if count > 1 else 100 * data[side][0]
            mesh = axes.contourf(data.speed, data.torque, table, levels=12, cmap="viridis")
            figure.colorbar(mesh, ax=axes, label="efficiency in %")
            suffix = f" at {temperature - 273.15:.0f} degC" if np.isfinite(temperature) else ""
            axes.set_title(f"{side}{suffix}", fontsize="medium")
    for axes in panels[-1]:
        axes.set_xlabel("output speed in rad/s")
    for axes in panels[:, 0]:
        axes.set_ylabel("output torque in N m")
    return figure
