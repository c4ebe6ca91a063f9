"""Efficiency of a transmission that turns steadily: of the whole, of each mesh, over load, speed and temperature."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Literal

import numpy as np

from gear.balance import balance
from gear.transmission import Transmission

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

SIDES: dict[str, Literal["input", "output"]] = {"forward": "input", "backward": "output"}


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
    """Efficiency [-] of each mesh while the input drives: one minus its loss over the power that enters it.

    The power is that of the relative motion to the carrier, which is what the teeth see, by normal force and friction.
    """
    found = balance(gear, output_torque=-np.sign(speed) * torque, output_speed=speed)
    result = {}
    for name, mesh in gear.meshes.items():
        motion, normal, rubs = (
            mesh.motion(found.speeds, found.speeds),
            mesh.torque_per_normal(),
            mesh.torque_per_friction(),
        )
        powers = [
            -(float(normal[wheel]) * found.normal[name] + float(rubs[wheel]) * found.friction[name]) * speed
            for wheel, speed in ((mesh.a, motion.speed_a), (mesh.b, motion.speed_b))
        ]
        entering = sum(max(float(power), 0.0) for power in powers)
        result[name] = 1 - found.loss[f"meshes.{name}"] / entering if entering > 0 else float("nan")
    return result


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
