"""Shared by the tests of teeth: random pairs of every kind, and what plane geometry says of them."""

import dataclasses
import math
from typing import NamedTuple

import casadi as ca
import numpy as np
from hypothesis import reject
from hypothesis import strategies as st
from oracles import numbers

from gear.quantities import unit_of
from gear.teeth.geometry import ExternalPair
from gear.teeth.internal import InternalPair

RING = InternalPair(teeth_a=20, teeth_b=60, module=1e-3, tip_radius_a=11e-3, tip_radius_b=29.25e-3)


def degrees(low, high):
    """Angles [rad] between two in degrees."""
    return numbers(low, high).map(math.radians)


@st.composite
def cut_external_pairs(draw, *, spur=False):
    """External pairs with profile shift and helix angle, tips by addendum or by radius."""
    try:
        pair = ExternalPair(
            teeth_a=draw(st.integers(12, 100)),
            teeth_b=draw(st.integers(12, 100)),
            module=draw(numbers(2e-4, 1e-2)),
            pressure_angle=draw(degrees(15.0, 28.0)),
            helix_angle=0.0 if spur else draw(degrees(0.0, 35.0)),
            shift_a=draw(numbers(-0.4, 0.7)),
            shift_b=draw(numbers(-0.4, 0.7)),
            addendum_a=draw(numbers(0.7, 1.3)),
            addendum_b=draw(numbers(0.7, 1.3)),
        )
        if draw(st.booleans()):
            pair = dataclasses.replace(pair, tip_radius_a=pair.gearing.tip_a, tip_radius_b=pair.gearing.tip_b)
        return pair
    except ValueError:
        reject()


@st.composite
def internal_pairs(draw, *, spur=False):
    """Rings with a wheel inside, with profile shift and helix angle."""
    teeth_a = draw(st.integers(15, 80))
    try:
        return InternalPair(
            teeth_a=teeth_a,
            teeth_b=teeth_a + draw(st.integers(8, 100)),
            module=draw(numbers(2e-4, 1e-2)),
            pressure_angle=draw(degrees(17.0, 28.0)),
            helix_angle=0.0 if spur else draw(degrees(0.0, 35.0)),
            shift_a=draw(numbers(-0.2, 0.6)),
            shift_b=draw(numbers(-0.6, 0.2)),
            addendum_a=draw(numbers(0.7, 1.1)),
            addendum_b=draw(numbers(0.5, 0.9)),
        )
    except ValueError:
        reject()


def cut_pairs(*, spur=False):
    """Pairs of both kinds."""
    return st.one_of(cut_external_pairs(spur=spur), internal_pairs(spur=spur))


def turned_round(gearing):
    """The same two wheels with A and B exchanged; no class makes a pair whose wheel A is the ring."""
    return gearing._replace(
        a=gearing.b,
        b=gearing.a,
        radius_a=gearing.radius_b,
        radius_b=gearing.radius_a,
        tip_a=gearing.tip_b,
        tip_b=gearing.tip_a,
    )


def by_symbols(pair, read):
    """`read(pair)` built with every number a symbol and evaluated at the numbers of the pair afterwards."""
    numbered = [name for name in vars_of(pair) if unit_of(pair, name) and getattr(pair, name) is not None]
    symbols, symbolic = {name: ca.SX.sym(name) for name in numbered}, object.__new__(type(pair))
    for name, value in (vars_of(pair) | symbols).items():
        object.__setattr__(symbolic, name, value)
    built = ca.Function("built", list(symbols.values()), [read(symbolic)])
    return float(built(*(getattr(pair, name) for name in numbered)))


def vars_of(pair):
    """Fields of a pair by name."""
    return {field.name: getattr(pair, field.name) for field in dataclasses.fields(pair)}


class Plane(NamedTuple):
    """A pair drawn in the plane: wheel A at the origin, the pitch point on the x axis, true radii."""

    pitch_point: np.ndarray
    center_b: np.ndarray
    speed_b: float  # of wheel B per speed of wheel A, counter-clockwise
    normal: np.ndarray  # of the flanks at the pitch point, along the line of action, from A to B
    tangent: np.ndarray
    start: float  # along the normal, from the pitch point to where contact starts and ends
    end: float

    def friction(self, along):
        """In contacts at places (n,) along the normal, per unit of friction scalar: force on B, torques, sliding speed.

        Friction on B points along the tangent of the flanks, in the direction in which A slides over B there.
        """
        point = self.pitch_point + np.multiply.outer(along, self.normal)
        arm_b = point - self.center_b
        slip = (_turned(point) - self.speed_b * _turned(arm_b)) @ self.tangent
        unit = np.multiply.outer(np.sign(slip), self.tangent)
        return unit, -_cross(point, unit), _cross(arm_b, unit), slip


def _turned(vectors):
    return np.stack([-vectors[:, 1], vectors[:, 0]], axis=1)


def _cross(arms, forces):
    return arms[:, 0] * forces[:, 1] - arms[:, 1] * forces[:, 0]


def plane(pair, flank=1):
    """Draw a pair from its working radii, angle and tips; a ring lies around wheel A, its center on the other side."""
    gearing, ring = pair.gearing, isinstance(pair, InternalPair)
    radius_a, radius_b, tip_b = gearing.radius_a, abs(gearing.radius_b), abs(gearing.tip_b)
    sine, cosine = np.sin(gearing.angle), np.cos(gearing.angle)
    normal = np.array([sine, flank * cosine])
    pitch_point = np.array([radius_a, 0.0])
    center_b = pitch_point + np.array([-radius_b if ring else radius_b, 0.0])
    return Plane(
        pitch_point=pitch_point,
        center_b=center_b,
        speed_b=(1 if ring else -1) * radius_a / radius_b,
        normal=normal,
        tangent=np.array([-normal[1], normal[0]]),
        start=max(crossing for crossing in _crossings(pitch_point - center_b, normal, tip_b) if crossing < 0),
        end=min(crossing for crossing in _crossings(pitch_point, normal, gearing.tip_a) if crossing > 0),
    )


def _crossings(point, direction, radius):
    """Where a line from a point, relative to a circle's center, crosses the circle."""
    return np.roots([1.0, 2 * point @ direction, point @ point - radius**2]).real


class Averages(NamedTuple):
    """Friction per unit of friction scalar: force on B (x from A to the pitch point), torques on A and B."""

    force: np.ndarray
    torque_a: float
    torque_b: float
    slip: float  # mean size of the sliding speed per speed of wheel A


def averages(drawn):
    """Friction of one tooth pair averaged over its path, by Gauss's rule on both sides of the pitch point."""
    nodes, weights = np.polynomial.legendre.leggauss(4)
    total = [np.zeros(2), 0.0, 0.0, 0.0]
    for low, high in ((drawn.start, 0.0), (0.0, drawn.end)):
        places = (low + high) / 2 + (high - low) / 2 * nodes
        share = weights * (high - low) / 2 / (drawn.end - drawn.start)
        unit, torque_a, torque_b, slip = drawn.friction(places)
        total = [t + share @ part for t, part in zip(total, (unit, torque_a, torque_b, abs(slip)), strict=True)]
    return Averages(*total)


def tip_gap(gearing, steps=20000):
    """Smallest distance [m] along the arc between a corner of wheel A and the flank of the ring that it has just left.

    Both flanks start at the pitch point and turn together; the corner is followed until it is out of the ring's
    teeth. It touches at the end of the path of contact, so the distance is zero for teeth that clear each other.
    """
    turn = np.linspace(0.0, np.pi, steps)
    corner = gearing.tip_a * np.exp(
        1j * (turn - _involute_at(gearing.base_a, gearing.tip_a) + _involute(gearing.angle))
    )
    seen = corner + gearing.center_distance  # from the center of the ring
    turn, seen = turn[abs(seen) >= -gearing.tip_b], seen[abs(seen) >= -gearing.tip_b]
    flank = turn * gearing.radius_a / -gearing.radius_b - _involute_at(-gearing.base_b, abs(seen))
    return float(np.min((flank + _involute(gearing.angle) - np.angle(seen)) * abs(seen)))


def _involute(angle):
    return np.tan(angle) - angle


def _involute_at(base, radius):
    return _involute(np.arccos(base / radius))
