"""What all pictures have in common: in which unit a quantity is shown, colors by meaning, legends.

Shown unit and label follow from the SI unit of a quantity and from what it is, never from its name.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from actuator.system.contact_modes import BACKWARD, FORWARD, FREE, STUCK


class Shown(NamedTuple):
    """How a quantity is shown: unit, and factor from SI."""

    unit: str
    scale: float = 1.0

    def text(self, value: float) -> str:
        """An SI value with its unit, for titles and legends."""
        return f"{self.scale * value:.3g} {self.unit}"

    def label(self, what: str) -> str:
        """Of an axis."""
        return f"{what} in {self.unit}"


DEGREES = math.degrees(1.0)
PLAY, CYCLE, LOAD_SPEED = Shown("arcmin", 60 * DEGREES), Shown("mrad", 1e3), Shown("deg/s", DEGREES)
UNITS = {"rad": Shown("deg", DEGREES)}  # that are shown as another one wherever nothing else is said

MODE_COLORS = {STUCK: "#4d4d4d", FORWARD: "#3b75af", BACKWARD: "#e1812c", FREE: "#d9d9d9"}
ABOVE: dict[str, Any] = {"loc": "lower right", "bbox_to_anchor": (1, 0.97), "fontsize": "small", "frameon": False}


def shown_as(unit: str) -> Shown:
    """How a quantity of an SI unit is shown."""
    return UNITS.get(unit, Shown(unit))


def words_of(name: str) -> str:
    """A name as people read it."""
    return name.replace("gear.", "").replace("_", " ").replace(".", " ")


def colors_over(count: int, colormap: str = "viridis", first: float = 0.05, last: float = 0.9) -> np.ndarray:
    """Colors of a family of lines, from dark to light."""
    return colormaps[colormap](np.linspace(first, last, count))


def legend_below(figure: Figure, axes: Axes, columns: int) -> None:
    """The legend of the lines on some axes, below all panels."""
    handles = axes.get_legend_handles_labels()
    figure.legend(*handles, loc="outside lower center", ncols=columns, fontsize="small", frameon=False)
