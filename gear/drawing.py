"""A transmission as a table and as a drawing: shafts, meshes, teeth, speeds, torques."""

from itertools import pairwise
from typing import TYPE_CHECKING

from gear.balance import balance
from gear.mesh import Mesh
from gear.transmission import Transmission

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

BOX = {"boxstyle": "round,pad=0.45", "facecolor": "white", "edgecolor": "#4d4d4d"}
COLORS = {"input": "#3b75af", "output": "#e1812c", "fixed": "#8c8c8c"}


def table(gear: Transmission, *, output_torque: float = -1.0, output_speed: float = 1.0) -> str:
    """Shafts and meshes in plain text, turning steadily at the given torque [N m] and speed [rad/s] of the output.

    The torque is that from outside on the output shaft; by default 1 N m resists 1 rad/s.
    """
    found = balance(gear, output_torque=output_torque, output_speed=output_speed)
    rows = [("shaft", "inertia", "speed", "torque from outside", "")]
    for name, shaft in gear.shafts.items():
        torque = {gear.input: found.input_torque, gear.output: output_torque}.get(name)
        rows.append(
            (
                name,
                f"{shaft.inertia:.3g} kg m^2",
                f"{found.speeds[name]:.5g} rad/s",
                "" if torque is None else f"{torque:.5g} N m",
                _role(gear, name),
            )
        )
    meshes = [("mesh", "wheels", "teeth", "normal force", "loss")]
    for name, mesh in gear.meshes.items():
        meshes.append(
            (
                name,
                f"{mesh.a} - {mesh.b}" + (f" on {mesh.carrier}" if mesh.carrier else ""),
                teeth(mesh),
                f"{found.normal[name]:.5g} N",
                f"{found.loss[f'meshes.{name}']:.3g} W",
            )
        )
    return "\n\n".join(_aligned(part) for part in (rows, meshes) if len(part) > 1)


def teeth(mesh: Mesh) -> str:
    """Numbers of teeth of a mesh, or its radii where it has none; with the number of equal ones."""
    return mesh.pair.size() if mesh.count == 1 else f"{mesh.count} x {mesh.pair.size()}"


def _role(gear: Transmission, name: str) -> str:
    roles = {"input": name == gear.input, "output": name == gear.output, "fixed": name in gear.fixed}
    return ", ".join(role for role, holds in roles.items() if holds)


def _aligned(rows: list[tuple[str, ...]]) -> str:
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    return "\n".join(
        "  ".join(f"{cell:<{width}}" for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows
    )


def draw(gear: Transmission, *, output_torque: float = -1.0, output_speed: float = 1.0) -> "Figure":
    """Shafts as boxes from input to output with speeds and torques, meshes as lines with their teeth.

    A dotted line ties a mesh to the carrier that its line of centers rides on.
    """
    from matplotlib.figure import Figure

    found = balance(gear, output_torque=output_torque, output_speed=output_speed)
    places = _layout(gear)
    width, height = (1 + max(place[k] for place in places.values()) for k in (0, 1))
    figure = Figure(figsize=(3.0 * width + 0.6, 1.7 * height + 0.6), layout="constrained")
    axes = figure.subplots()
    for name, mesh in gear.meshes.items():
        _draw_mesh(axes, places, mesh, name)
    for coupling in gear.couplings.values():
        for a, b in pairwise(coupling.terminals().values()):
            (x0, y0), (x1, y1) = places[a], places[b]
            axes.plot([x0, x1], [y0, y1], color="#4d4d4d", linestyle="--", zorder=1)
    outside = {gear.input: found.input_torque, gear.output: output_torque}
    for name, (x, y) in places.items():
        role = _role(gear, name)
        lines = [name, f"{found.speeds[name]:.4g} rad/s"]
        lines += [f"{outside[name]:.4g} N m"] if name in outside else []
        lines += ["fixed"] if role == "fixed" else []
        edge = COLORS.get(role.split(",")[0], "#4d4d4d")
        axes.text(
            x,
            y,
            "\n".join(lines),
            ha="center",
            va="center",
            fontsize="small",
            bbox={**BOX, "edgecolor": edge},
            zorder=3,
        )
    axes.set_xlim(-0.6, width - 0.4)
    axes.set_ylim(height - 0.4, -0.6)
    axes.axis("off")
    return figure


def _draw_mesh(axes: "Axes", places: dict[str, tuple[float, float]], mesh: Mesh, name: str) -> None:
    (x0, y0), (x1, y1) = places[mesh.a], places[mesh.b]
    axes.plot([x0, x1], [y0, y1], color="#4d4d4d", linewidth=2, zorder=1)
    middle = ((x0 + x1) / 2, (y0 + y1) / 2)
    if mesh.carrier:
        x, y = places[mesh.carrier]
        axes.plot([middle[0], x], [middle[1], y], color="#8c8c8c", linestyle=":", zorder=0)
    axes.text(
        *middle,
        f"{name}\n{teeth(mesh)}",
        ha="center",
        va="center",
        fontsize="x-small",
        zorder=2,
        bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.5},
    )


def _layout(gear: Transmission) -> dict[str, tuple[float, float]]:
    """Columns by distance from the input through meshes and couplings, carriers on a row of their own below."""
    joined = [(mesh.a, mesh.b) for mesh in gear.meshes.values()]
    joined += [pair for c in gear.couplings.values() for pair in pairwise(c.terminals().values())]
    carriers = {mesh.carrier for mesh in gear.meshes.values() if mesh.carrier}
    start = gear.input if gear.input not in carriers else next(a for a, _ in joined)
    column, front = {start: 0}, [start]
    while front:
        reached = []
        for here in front:
            for pair in joined:
                for there, back in (pair, pair[::-1]):
                    if back == here and there not in column:
                        column[there] = column[here] + 1
                        reached.append(there)
        front = reached
    places: dict[str, tuple[float, float]] = {}
    for name in gear.shafts:
        if name in column:
            row = sum(1 for other in places if other in column and column[other] == column[name])
            places[name] = (float(column[name]), float(row))
    depth = 1 + max(y for _, y in places.values())
    for k, name in enumerate(name for name in gear.shafts if name not in places):
        places[name] = (0.5 + k + max(column.values()) / 2 - 0.5, depth)
    return places
