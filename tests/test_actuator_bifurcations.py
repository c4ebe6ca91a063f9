"""Ends of families of orbits where they are known in closed form.

Oracle: a plane cycle x, y of radius r at unit frequency, with a pair a, b that turns half as fast in its frame:

    r' = r (mu + r^2 - r^4),    theta' = 1,    p' = (sigma - p^2 - q^2) p,    q' = (-1 - p^2 - q^2) q,
    a + j b = exp(j theta/2) (p + j q)

The outer cycle has 2 r^2 = 1 + sqrt(1 + 4 mu); it ends in a fold at mu = -1/4. Its multipliers are -exp(2 pi sigma),
-exp(-2 pi) and exp(2 pi (2 r^2 - 4 r^4)); at sigma = 0 its period doubles.
"""

from functools import cache
from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest

from actuator import HybridSystem, continue_orbit, find_orbit, simulate
from actuator.continuation.bifurcations import classify_loss
from actuator.orbits.segments import Segment
from actuator.system.hybrid import MARGIN_BAND, Contact, Event, Mode, Place, Quantity
from actuator.system.parameters import Parameter

pytestmark = pytest.mark.thorough


@cache
def twisted():
    """The oracle as a system; its only event is that y changes its sign."""
    x, m, u, p = (ca.SX.sym(name, size) for name, size in (("x", 4), ("m", 1), ("u", 0), ("p", 2)))
    mu, sigma = p[0], p[1]
    square, pair = x[0] ** 2 + x[1] ** 2, x[2:]
    growth = mu + square - square**2
    cosine, sine = x[0] / ca.sqrt(square), x[1] / ca.sqrt(square)
    # R(theta/2) diag(sigma, -1) R(-theta/2), and half a turn
    twist = ca.vertcat(ca.horzcat(cosine, sine), ca.horzcat(sine, -cosine))
    matrix = (sigma - 1) / 2 * ca.SX.eye(2) + (sigma + 1) / 2 * twist + ca.SX([[0, -0.5], [0.5, 0]])
    turning = ca.vertcat(growth * x[0] - x[1], growth * x[1] + x[0])
    flow = ca.vertcat(turning, matrix @ pair - ca.sumsqr(pair) * pair)
    fired = ca.SX.sym("fired", 1)
    modes = ca.if_else(fired > 0.5, -ca.sign(m), ca.if_else(x[1] >= 0, 1, -1))
    known = [x, m, u, p]
    return HybridSystem(
        name="twisted cycle",
        states=tuple(Quantity(name, "rad", 1.0, begin) for name, begin in zip("xyab", (1, 0, 0.01, 0), strict=True)),
        mode_variables=(Mode("half.motion"),),
        inputs=(),
        outputs=(Quantity("load_angle", "rad"), Quantity("load_speed", "rad/s"), Quantity("motor_angle", "rad")),
        events=(Event("half turn"),),
        parameters=(Parameter("mu", "1/s", 0.5, mu), Parameter("sigma", "1/s", -0.3, sigma)),
        contacts=(Contact("half", Place.BEARING, "half.motion", None, 1),),
        flow=ca.Function("flow", known, [flow]),
        margins=ca.Function("margins", known, [m * x[1] + MARGIN_BAND]),
        reset=ca.Function("reset", [fired, *known], [x, modes, ca.SX(0)]),
        outputs_function=ca.Function("outputs", known, [ca.vertcat(x[0] + x[2], flow[0] + flow[2], x[0])]),
    )


@cache
def orbit(sigma=-0.3):
    run = simulate(twisted(), 60.0, parameters={"sigma": sigma}, resolution=0.02, compiled=False)
    return find_orbit(twisted(), run, compiled=False)


def test_multipliers_are_those_of_the_closed_form():
    found = orbit()
    square = (1 + np.sqrt(1 + 4 * 0.5)) / 2
    assert found.period == pytest.approx(2 * np.pi, abs=1e-9)
    assert found.load_amplitude == pytest.approx(np.sqrt(square), abs=1e-9)
    expected = [-np.exp(-0.6 * np.pi), -np.exp(-2 * np.pi), np.exp(2 * np.pi * (2 * square - 4 * square**2))]
    np.testing.assert_allclose(sorted(found.multipliers.real), sorted(expected), atol=1e-8)
    assert found.trivial_error < 1e-8


def test_a_family_turns_back_at_its_fold():
    branch = continue_orbit(orbit(), "mu", (-0.4, 1.0), upward=False)
    assert branch.end.kind == "fold"
    assert branch.end.value == pytest.approx(-0.25, abs=2e-3)
    for value, found in zip(branch.values, branch.orbits, strict=True):
        assert found.load_amplitude**2 == pytest.approx((1 + np.sqrt(1 + 4 * value)) / 2, rel=1e-8)


def test_a_multiplier_that_passes_minus_one_doubles_the_period():
    branch = continue_orbit(orbit(), "sigma", (-0.5, 0.5), upward=True)
    assert branch.end.kind == "period doubling"
    assert branch.end.value == pytest.approx(0.0, abs=2e-2)
    assert branch.stable[:-1].all()
    assert not branch.stable[-1]


def test_behind_the_doubling_the_cycle_takes_two_turns():
    found = orbit(0.05)
    assert found.period == pytest.approx(4 * np.pi, rel=1e-8)
    assert found.stable


@pytest.mark.parametrize(
    ("slips", "kind", "last"),
    [
        ((1, 0, -1, 0), "crossing-sliding", True),  # the only contact sticks between a slip and the one back
        ((1, 0, 1, 0), "grazing-sliding", True),  # between slips in the same direction
        ((1, 0, -1, 0), "crossing-sliding", False),
    ],
)
def test_a_standstill_that_disappears_has_the_class_of_the_slips_around_it(slips, kind, last):
    contact = Contact("guide", Place.BEARING, "guide.motion", None, 1)
    durations = (0.5, 1e-3, 0.5, 2e-3 if last else 0.5)
    orbit = SimpleNamespace(
        system=SimpleNamespace(modes=("guide.motion",), contacts=(contact,)),
        segments=tuple(Segment((mode,), (), duration, 0) for mode, duration in zip(slips, durations, strict=True)),
        sequence=tuple((mode,) for mode in slips),
        period=sum(durations),
    )
    found, words = classify_loss(orbit)
    assert found == kind
    assert words == "a standstill of 0.001 s disappears" + (", and with it all sticking" if last else "")
