"""Shared by the tests: example and random parts, a formula built on symbols, the averaged friction by geometry."""

from typing import NamedTuple

import casadi as ca
import numpy as np
from hypothesis import reject
from hypothesis import strategies as st

from gear.elasticity.law import AT_REST
from gear.motion import Sliding
from gear.teeth.geometry import ExternalPair

PAPER_PAIR = ExternalPair(teeth_a=20, teeth_b=60, module=1e-3)  # 10/30 mm, tips 11/31 mm: van der Linden, Table 3


def numbers(low, high):
    """Finite floats in a range."""
    return st.floats(low, high, allow_subnormal=False)


def signs():
    """+1 or -1."""
    return st.sampled_from((1.0, -1.0))


@st.composite
def external_pairs(draw):
    """Any external pair that can mesh."""
    try:
        return ExternalPair(
            teeth_a=draw(st.integers(18, 120)),
            teeth_b=draw(st.integers(18, 120)),
            module=draw(numbers(2e-4, 1e-2)),
            pressure_angle=np.radians(draw(numbers(17.0, 30.0))).item(),
            addendum_a=draw(numbers(0.6, 1.1)),
            addendum_b=draw(numbers(0.6, 1.1)),
        )
    except ValueError:
        reject()


def pressed(deflection, rate=0.0):
    """Motion of a mesh that is bent, and nothing else."""
    return AT_REST._replace(deflection=deflection, rate=rate)


def rubbing(speed, force):
    """A mesh that slides at the pitch point's first position, wheel A driving."""
    return Sliding(speed=speed, force=force, a_drives=1.0, position=0.0, pair=PAPER_PAIR)


def in_symbols(function, *values):
    """`function` built on symbols first and evaluated at the values afterwards, as a flat array."""
    symbols = [ca.SX.sym(f"x{k}") for k in range(len(values))]
    built = function(*symbols)
    rows = ca.vertcat(*(built if isinstance(built, list | tuple) else [built]))
    return np.array(ca.Function("built", symbols, [rows])(*values)).ravel()


def gradient_in_symbols(function, *values):
    """Derivatives of a scalar `function` with respect to each argument, by `casadi.jacobian`."""
    return in_symbols(lambda *symbols: ca.jacobian(function(*symbols), ca.vertcat(*symbols)).T, *values)


class Averages(NamedTuple):
    """Friction per unit of friction scalar: force on B (x from A to B), torques on A and B."""

    force: np.ndarray
    torque_a: float
    torque_b: float


def averaged_friction(pair, flank):
    """Unit friction of one tooth pair, averaged over its path of contact, both wheels traveling forward.

    The plane has wheel A at the origin and wheel B on the x axis; friction on B points along the tooth's
    tangent in the direction in which A slides over B there.
    """
    sine, cosine = np.sin(pair.pressure_angle), np.cos(pair.pressure_angle)
    center_b, pitch_point = np.array([pair.radius_a + pair.radius_b, 0.0]), np.array([pair.radius_a, 0.0])
    normal, tangent = np.array([sine, flank * cosine]), np.array([-flank * cosine, sine])
    tip_a = pair.radius_a + pair.addendum_a * pair.module
    tip_b = pair.radius_b + pair.addendum_b * pair.module
    start = min(np.roots([1.0, -2 * pair.radius_b * sine, pair.radius_b**2 - tip_b**2]).real)
    end = max(np.roots([1.0, 2 * pair.radius_a * sine, pair.radius_a**2 - tip_a**2]).real)

    nodes, weights = np.polynomial.legendre.leggauss(4)
    force, torque_a, torque_b = np.zeros(2), 0.0, 0.0
    for low, high in ((start, 0.0), (0.0, end)):
        for node, weight in zip(nodes, weights, strict=True):
            point = pitch_point + ((low + high) / 2 + (high - low) / 2 * node) * normal
            share = weight * (high - low) / 2 / (end - start)
            speed_a, speed_b = turned(point), -pair.radius_a / pair.radius_b * turned(point - center_b)
            unit = np.sign((speed_a - speed_b) @ tangent) * tangent
            force += share * unit
            torque_a += share * (turned(point) @ -unit)
            torque_b += share * (turned(point - center_b) @ unit)
    return Averages(force, torque_a, torque_b)


def turned(vector):
    """A plane vector turned by a right angle: the velocity of a point per unit of angular speed."""
    return np.array([-vector[1], vector[0]])
