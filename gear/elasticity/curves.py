"""Characteristics of elasticity laws, to compare and to draw them."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np

from gear.elasticity.law import AT_REST, ElasticityLaw, has_gap

if TYPE_CHECKING:
    import xarray


def elasticity_curves(laws: Mapping[str, ElasticityLaw], deflections: Sequence[float] | np.ndarray) -> "xarray.Dataset":
    """Normal force and stiffness of several laws over the deflection of a mesh at rest.

    Parameters
    ----------
    laws : mapping of str to ElasticityLaw
        By the name under which the curve is found.
    deflections : sequence of float, (n,)
        [m], ascending or not.

    Returns
    -------
    xarray.Dataset
        `force` [N] and `stiffness` dF/d(deflection) [N/m], over `law` and `deflection`. What varies with the
        turn of the wheels is taken at turn and position zero, a flank is engaged where it is penetrated, and
        at an edge of a law the stiffness is that of one side or between the two.
    """
    import xarray

    grid = np.asarray(deflections, dtype=float)
    rows = np.array([_force_and_stiffness(law, grid) for law in laws.values()]).reshape(-1, 2, grid.size)
    return xarray.Dataset(
        {
            "force": (("law", "deflection"), rows[:, 0], {"units": "N"}),
            "stiffness": (("law", "deflection"), rows[:, 1], {"units": "N/m"}),
        },
        coords={"law": list(laws), "deflection": ("deflection", grid, {"units": "m"})},
    )


def _force_and_stiffness(law: ElasticityLaw, deflections: np.ndarray) -> np.ndarray:
    """Both rows of one law, (2, n)."""
    deflection = ca.SX.sym("deflection")
    motion = AT_REST._replace(deflection=deflection)
    flank = 1.0
    if has_gap(law):
        engaged = [law.penetration(motion, side) > 0 for side in (1, -1)]
        flank = ca.if_else(engaged[0], 1, ca.if_else(engaged[1], -1, 0))
    force = law.force(motion, flank)
    curve = ca.Function("curve", [deflection], [ca.vertcat(force, ca.jacobian(force, deflection))])
    return np.array(curve(deflections[np.newaxis, :]))
