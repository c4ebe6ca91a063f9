"""Pictures of a map of hunting."""

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from actuator.plots.diagnosis import VERDICT_COLORS
from actuator.verdict.verdict import DIVERGING, FAILED
from studies.hunting.map import LABELS

if TYPE_CHECKING:
    import xarray

COLORS = VERDICT_COLORS
PALE = 0.45  # share of white in the fields behind the dots


def plot_map(data: "xarray.Dataset", corner: int, label: str) -> Figure:
    """Verdicts and amplitude over both names, the exact boundary over them where it is known."""
    figure = Figure(figsize=(11, 4.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    here = data.isel(corner=corner)
    _draw_verdicts(left, here)
    _draw_amplitude(figure, right, here)
    for axes in (left, right):
        _draw_boundary(axes, here)
        axes.set_xlabel(_label(data.x))
        axes.set_ylabel(_label(data.y))
        axes.margins(0)
    figure.suptitle(f"{data.attrs['system']}, {label}")
    return figure


def _label(axis: "xarray.DataArray") -> str:
    if axis.factor:
        return f"factor on {axis.long_name}"
    return f"{axis.long_name.removeprefix('=')} in {axis.units}"


def _draw_verdicts(axes: Axes, here: "xarray.Dataset") -> None:
    codes = here.verdict.values
    pale = [_paler(COLORS[label]) for label in LABELS]
    shown = np.where(codes < 0, np.nan, codes)
    axes.pcolormesh(
        here.x, here.y, shown, cmap=ListedColormap(pale), vmin=-0.5, vmax=len(LABELS) - 0.5, shading="nearest"
    )
    seen = [k for k in range(len(LABELS)) if (codes == k).any()]
    x, y = np.meshgrid(here.x, here.y)
    for k in seen:
        edge = "#000000" if LABELS[k] in (FAILED, DIVERGING) else COLORS[LABELS[k]]
        marker = "x" if LABELS[k] == FAILED else "o"
        face = "#000000" if marker == "x" else COLORS[LABELS[k]]
        axes.scatter(
            x[codes == k], y[codes == k], s=22, marker=marker, c=face, edgecolors=None if marker == "x" else edge
        )
    handles: list[Any] = [Patch(facecolor=pale[k], edgecolor="#8c8c8c", linewidth=0.5, label=LABELS[k]) for k in seen]
    if "boundary" in here and np.isfinite(here.boundary).any():
        handles.append(Line2D([], [], color="black", marker=".", label="exact boundary"))
    axes.legend(handles=handles, loc="lower left", bbox_to_anchor=(0, 1.0), ncols=3, fontsize="small", frameon=False)


def _draw_amplitude(figure: Figure, axes: Axes, here: "xarray.Dataset") -> None:
    size = 1e3 * here.amplitude
    if not np.isfinite(size).any():
        axes.set_title("no cycle anywhere", fontsize="medium")
        axes.set_xlim(float(here.x.min()), float(here.x.max()))
        axes.set_ylim(float(here.y.min()), float(here.y.max()))
        return
    axes.set_facecolor("#eeeeee")
    drawn = axes.pcolormesh(here.x, here.y, size, cmap="viridis", shading="nearest")
    figure.colorbar(drawn, ax=axes, label="amplitude at the load in mrad (gray: no cycle)")


def _draw_boundary(axes: Axes, here: "xarray.Dataset") -> None:
    if "boundary" not in here or not np.isfinite(here.boundary).any():
        return
    values, other = here.boundary, here["y" if here.boundary.along == "x" else "x"]
    x, y = (values, other) if here.boundary.along == "x" else (other, values)
    axes.plot(x, y, color="black", linewidth=1.6, marker=".", zorder=3)


def _paler(color: str) -> tuple[float, float, float]:
    red, green, blue = (int(color[k : k + 2], 16) / 255 for k in (1, 3, 5))
    return red + PALE * (1 - red), green + PALE * (1 - green), blue + PALE * (1 - blue)
