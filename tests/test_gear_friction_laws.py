"""Laws of friction against formulas in other units, torque balances, themselves in symbols, and whole runs."""

import itertools
import math
from dataclasses import fields, replace
from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from oracles import PAPER_PAIR, external_pairs, gradient_in_symbols, in_symbols, numbers

from actuator import Actuator, Load, Sine, TorqueSource, simulate
from gear import (
    AtViscosity,
    Coulomb,
    Din3990,
    EfficiencyPoint,
    FrictionLaw,
    FrictionPoint,
    FrictionTable,
    GivenPair,
    GivenViscosity,
    Harmonic,
    InternalPair,
    KnownOil,
    Linear,
    Mesh,
    OilAt,
    PeriodicFriction,
    Shaft,
    Stribeck,
    TabulatedEfficiency,
    Transmission,
)
from gear.friction.din3990 import reduced_radius
from gear.motion import Sliding
from studies.checks.paper import figure_9, figure_9_inputs, figure_9_start
from studies.converter import converter

ROOM, COLD, WARM = (273.15 + temperature for temperature in (20, -55, 70))
JET_OIL = KnownOil(name="Mobil Jet Oil II")
PAPER_DIN = Din3990(
    static=0.2,
    lubricant=GivenViscosity(viscosity=0.275),
    roughness=0.8e-6,
    face_width=10e-3,
)
RING = InternalPair(teeth_a=20, teeth_b=60, module=1e-3, addendum_b=0.75)
ROWS = ((0.0, 0.80, 0.75), (0.05, 0.86, 0.82), (0.2, 0.93, 0.90), (0.5, 0.95, 0.93))  # m/s, A drives, B drives


def efficiency_table(*rows, breakout=1.0):
    points = tuple(EfficiencyPoint(speed=speed, a_drives=a, b_drives=b) for speed, a, b in rows)
    return TabulatedEfficiency(points=points, breakout=breakout)


def friction_table(*rows, static):
    return FrictionTable(points=tuple(FrictionPoint(speed=v, coefficient=mu) for v, mu in rows), static=static)


EFFICIENCY = efficiency_table(*ROWS, breakout=1.5)
STRIBECK = Stribeck(static=0.3, coulomb=0.1, stribeck_speed=0.01, viscous=0.05)
TABLE = friction_table((0.0, 0.2), (0.1, 0.1), (1.0, 0.15), static=0.25)
RIPPLE = (Harmonic(cosine=0.3), Harmonic(cosine=-0.1, sine=0.2))
LAWS = {
    "Coulomb": Coulomb(sliding=0.1, static=0.2),
    "Din3990": PAPER_DIN,
    "Din3990 cold": replace(PAPER_DIN, lubricant=OilAt(oil=JET_OIL, temperature=COLD)),
    "efficiency": EFFICIENCY,
    "lossless": efficiency_table((0.0, 1.0, 1.0)),
    "Stribeck": STRIBECK,
    "Stribeck exponential": replace(STRIBECK, exponent=1.0),
    "table": TABLE,
    "viscosity": AtViscosity(
        law=STRIBECK,
        lubricant=OilAt(oil=JET_OIL, temperature=273.15),
        measured_with=OilAt(oil=JET_OIL, temperature=ROOM),
    ),
    "periodic": PeriodicFriction(law=PAPER_DIN, harmonics=RIPPLE),
}
every_law = pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
speeds, forces, positions, sides = numbers(0, 5), numbers(0, 1e4), numbers(-0.1, 0.1), st.sampled_from((0.0, 1.0))


def at(speed=0.0, force=500.0, a_drives=1.0, position=0.0, pair=PAPER_PAIR):
    return Sliding(speed=speed, force=force, a_drives=a_drives, position=position, pair=pair)


# -- every law ----------------------------------------------------------------------------------------


@every_law
@settings(deadline=None, max_examples=30)
@given(speed=speeds, force=forces, side=sides, position=positions)
def test_law_is_the_same_in_numbers_and_in_symbols(law, speed, force, side, position):
    state = at(speed, force, side, position)
    for function in (law.coefficient, law.breakaway):
        value = function(state)
        assert isinstance(value, float)
        assert in_symbols(lambda *s, f=function: f(at(*s)), *state[:4]) == pytest.approx(value, rel=1e-12, abs=1e-15)


@every_law
@settings(deadline=None, max_examples=30)
@given(speed=numbers(1e-4, 5), force=numbers(1, 1e4), side=sides, position=positions)
def test_symbolic_slope_is_the_difference_quotient(law, speed, force, side, position):
    state = np.array([speed, force, side, position])
    slopes = gradient_in_symbols(lambda *s: law.coefficient(at(*s)), *state)
    for k, step in ((0, 1e-6 * speed), (1, 1e-6 * force), (3, 1e-8)):
        ahead, here, behind = (law.coefficient(at(*(state + j * step * (np.arange(4) == k)))) for j in (1, 0, -1))
        assume(ahead - here == pytest.approx(here - behind, rel=1e-2, abs=1e-12))  # not across a kink
        assert slopes[k] == pytest.approx((ahead - behind) / (2 * step), rel=1e-3, abs=1e-3)


@every_law
@pytest.mark.parametrize("speed", [0.0, 1e-12, 0.1])
@pytest.mark.parametrize("force", [0.0, 1e-12, 500.0])
def test_law_and_its_slopes_are_finite_at_rest_and_without_load(law, speed, force):
    """Of the coefficient, and of the friction force in which it is multiplied by the normal force."""
    state = at(speed, force)
    for function in (law.coefficient, law.breakaway):
        for power in (0, 1):
            slopes = gradient_in_symbols(lambda *s, f=function, n=power: ca.SX(f(at(*s)) * s[1] ** n), *state[:4])
            assert np.isfinite(slopes).all()
        assert math.isfinite(function(state))


@every_law
@settings(deadline=None, max_examples=30)
@given(force=forces, side=sides, position=positions)
def test_breakaway_is_not_below_sliding_just_off_standstill(law, force, side, position):
    """What the joint decision of the contacts needs: 0 <= onset <= static, for both driving sides."""
    state = at(0.0, force, side, position)
    assert 0 <= law.coefficient(state) <= law.breakaway(state) * (1 + 1e-15)
    assert law.breakaway(state) == law.breakaway(state._replace(a_drives=1.0 - side))


# -- DIN 3990-4 ---------------------------------------------------------------------------------------


def given_pair(pair, **changes):
    """The constants of a pair as given numbers, with some of them changed."""
    names = (field.name for field in fields(GivenPair))
    own = {name: getattr(pair, name) for name in names if name != "pressure_angle"}
    return GivenPair(**own | {"pressure_angle": pair.working_angle} | changes)


def din_in_its_own_units(law, speed, force, pair=PAPER_PAIR):
    """The formula as printed, in N/mm, um, mPa s, m/s and mm, without the cap."""
    ratio, center = pair.radius_b / pair.radius_a, pair.radius_a + pair.radius_b
    line_load = force / (1e3 * law.face_width * law.effective_width)
    viscosity = 1e3 * law.lubricant.dynamic_viscosity()
    rolling = 2 * speed * np.sin(pair.working_angle)
    radius = 1e3 * ratio * center * np.sin(pair.working_angle) / ((1 + ratio) ** 2 * np.cos(pair.base_helix_angle))
    return 0.12 * (line_load * 1e6 * law.roughness / (viscosity * rolling * radius)) ** 0.25


def test_din_gives_the_known_value():
    assert PAPER_DIN.coefficient(at(0.1, 532.0889)) == pytest.approx(0.116296852, abs=1e-9)


def test_din_takes_the_viscosity_in_pascal_seconds():
    """A thousandth of the viscosity is what a mistake by mPa s would be: a factor 1000^(1/4) = 5.62."""
    open_cap = replace(PAPER_DIN, static=10.0)
    thin = replace(open_cap, lubricant=GivenViscosity(viscosity=0.275e-3))
    state = at(0.1, 532.0889)
    assert thin.coefficient(state) / open_cap.coefficient(state) == pytest.approx(5.6234, rel=1e-4)


@settings(deadline=None, max_examples=50)
@given(
    teeth=external_pairs(),
    speed=numbers(1e-3, 5),
    force=numbers(1, 1e4),
    viscosity=numbers(1e-3, 100),
    roughness=numbers(1e-7, 5e-6),
    width=numbers(1e-3, 0.1),
    share=numbers(0.1, 1),
    helix=numbers(0, 0.5),
)
def test_din_is_the_printed_formula_below_its_cap(teeth, speed, force, viscosity, roughness, width, share, helix):  # noqa: PLR0913, PLR0917
    law = Din3990(
        static=0.2,
        lubricant=GivenViscosity(viscosity=viscosity),
        roughness=roughness,
        face_width=width,
        effective_width=share,
    )
    pair = given_pair(teeth, base_helix_angle=helix)
    wanted = min(0.2, din_in_its_own_units(law, speed, force, pair))
    assert law.coefficient(at(speed, force, pair=pair)) == pytest.approx(wanted)


def test_din_is_capped_at_all_speeds_not_at_standstill_only():
    slow = PAPER_DIN.cap_speed(500.0, PAPER_PAIR)
    assert din_in_its_own_units(PAPER_DIN, slow, 500.0) == pytest.approx(0.2)
    assert [PAPER_DIN.coefficient(at(part * slow)) for part in (0, 0.01, 0.5, 1)] == [0.2] * 4
    assert PAPER_DIN.coefficient(at(1.01 * slow)) < 0.2


def test_din_falls_with_speed_and_viscosity_and_rises_with_load():
    base = PAPER_DIN.coefficient(at(0.1))
    assert PAPER_DIN.coefficient(at(0.2)) < base < PAPER_DIN.coefficient(at(0.1, 600.0))
    assert replace(PAPER_DIN, lubricant=GivenViscosity(viscosity=0.5)).coefficient(at(0.1)) < base
    assert replace(PAPER_DIN, roughness=1.6e-6).coefficient(at(0.1)) == pytest.approx(base * 2**0.25)


def test_din_at_three_temperatures_is_one_argument():
    cold, room, warm = (
        replace(PAPER_DIN, lubricant=OilAt(oil=JET_OIL, temperature=T)).coefficient(at(0.5, 50.0))
        for T in (COLD, ROOM, WARM)
    )
    assert cold < room < warm < 0.2
    ratio = OilAt(oil=JET_OIL, temperature=COLD).dynamic_viscosity() / JET_OIL.dynamic_viscosity(ROOM)
    assert room / cold == pytest.approx(ratio**0.25)


def test_din_takes_the_helix_of_its_pair():
    """sin(beta_b) = sin(beta) cos(alpha_n)."""
    helical = replace(PAPER_PAIR, helix_angle=0.3)
    straight = given_pair(helical, base_helix_angle=0.0)
    helix = np.arcsin(np.sin(0.3) * np.cos(PAPER_PAIR.pressure_angle))
    assert reduced_radius(helical) * np.cos(helix) == pytest.approx(reduced_radius(straight))


def test_din_reduced_radius_of_a_ring_gear_is_that_of_the_difference():
    """An internal gear B has a negative radius in every formula."""
    assert reduced_radius(RING) == pytest.approx(0.01 * 0.03 / (0.03 - 0.01) * np.sin(np.radians(20)))


# -- efficiency tables --------------------------------------------------------------------------------


def efficiency_of(pair, coefficient, side, direction):
    """Output over input power of a mesh that slides steadily, from its torques.

    T_A = -F_n l_A - s e_A,  T_B = -F_n l_B + s e_B,  s = sign(v) mu |F_n|;  A drives where F_n v > 0.
    """
    normal = direction * (1.0 if side == "a" else -1.0)
    scalar = direction * coefficient * abs(normal)
    cosine = np.cos(pair.working_angle)
    torque_a = -normal * pair.radius_a * cosine - scalar * pair.friction_arm_a
    torque_b = -normal * pair.radius_b * cosine + scalar * pair.friction_arm_b
    power_a, power_b = torque_a * direction / pair.radius_a, -torque_b * direction / pair.radius_b
    return -power_b / power_a if side == "a" else -power_a / power_b


quadrants = pytest.mark.parametrize(("side", "direction"), list(itertools.product("ab", (1.0, -1.0))))


@quadrants
@settings(deadline=None, max_examples=30)
@given(pair=external_pairs() | st.just(RING), efficiency=numbers(0.05, 1.0))
def test_coefficient_of_an_efficiency_has_that_efficiency(side, direction, pair, efficiency):
    arms = pair.friction_arm_a / pair.radius_a, pair.friction_arm_b / pair.radius_b
    assume(min(arms) + efficiency * max(arms) > 0.01)  # short teeth can have a negative arm
    law = efficiency_table((0.0, efficiency, efficiency))
    coefficient = law.coefficient(at(a_drives=1.0 if side == "a" else 0.0, pair=pair))
    assert efficiency_of(pair, coefficient, side, direction) == pytest.approx(efficiency, rel=1e-9)


@quadrants
@settings(deadline=None, max_examples=30)
@given(pair=external_pairs() | st.just(RING), coefficient=numbers(0, 0.5))
def test_efficiency_of_a_coefficient_gives_that_coefficient(side, direction, pair, coefficient):
    efficiency = efficiency_of(pair, coefficient, side, direction)
    assume(0 < efficiency <= 1)
    law = efficiency_table((0.0, efficiency, efficiency))
    assert law.coefficient(at(a_drives=1.0 if side == "a" else 0.0, pair=pair)) == pytest.approx(
        coefficient, rel=1e-9, abs=1e-12
    )


@pytest.mark.parametrize(("side", "column"), [("a", 1), ("b", 2)])
@settings(deadline=None, max_examples=50)
@given(speed=numbers(0, 2))
def test_efficiency_between_the_points_is_linear_and_constant_beyond_the_last(side, column, speed):
    table = np.array(ROWS)
    coefficient = EFFICIENCY.coefficient(at(speed, a_drives=1.0 if side == "a" else 0.0))
    wanted = np.interp(speed, table[:, 0], table[:, column])
    assert efficiency_of(PAPER_PAIR, coefficient, side, 1.0) == pytest.approx(wanted, rel=1e-12)


def test_breakaway_is_the_larger_of_both_sides_times_the_breakout_factor():
    both = [EFFICIENCY.coefficient(at(a_drives=side)) for side in (0.0, 1.0)]
    assert EFFICIENCY.breakaway(at()) == pytest.approx(1.5 * max(both))
    assert efficiency_table(*ROWS).breakaway(at()) == pytest.approx(max(both))


def test_efficiency_of_a_whole_cold_gearbox_needs_a_coefficient_above_0_9():
    """85 % from the paper's own geometry, which its abstract calls a gear efficiency."""
    law = efficiency_table((0.0, 0.85, 0.80))
    assert law.coefficient(at(a_drives=1.0)) == pytest.approx(0.939113, abs=1e-6)
    assert law.coefficient(at(a_drives=0.0)) > 1.2


# -- Stribeck, tables, viscosity, position ------------------------------------------------------------


@pytest.mark.parametrize("speed", [-1.0, -1e-3, -1e-11, -1e-13, 0.0, 1e-13, 1e-4, 1.0])
@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.0])
def test_stribeck_is_finite_with_all_slopes_below_zero_speed_too(speed, exponent):
    """Where a stage of an integrator or a Newton step comes; from zero on against the slopes by hand."""
    v, vs, e = (ca.SX.sym(name) for name in ("v", "vs", "e"))
    law = object.__new__(Stribeck)
    for name, value in {"static": 1.5, "coulomb": 1.0, "stribeck_speed": vs, "exponent": e, "viscous": 0.0}.items():
        object.__setattr__(law, name, value)
    mu = law.coefficient(at(v))
    slopes = ca.Function("slopes", [v, vs, e], [mu, *(ca.jacobian(mu, of) for of in (v, vs, e))])
    found = [float(value) for value in slopes(speed, 0.1, exponent)]
    assert np.isfinite(found).all()
    if speed < 0:
        assert found[0] == pytest.approx(1.5, abs=1e-10)
    else:
        x = speed / 0.1
        fall = 0.5 * np.exp(-(x**exponent))
        by_speed = -fall * exponent * x ** (exponent - 1) / 0.1
        assert found[:3] == pytest.approx([1.0 + fall, by_speed, -by_speed * x], abs=1e-9 if exponent != 1.5 else 3e-5)


@pytest.mark.parametrize("exponent", [1.0, 2.0, 3.5])
def test_stribeck_is_its_formula(exponent):
    law = Stribeck(static=0.3, coulomb=0.1, stribeck_speed=0.01, exponent=exponent, viscous=0.05)
    for speed in (0.0, 1e-3, 0.01, 0.05, 1.0):
        wanted = 0.1 + 0.2 * math.exp(-((speed / 0.01) ** exponent)) + 0.05 * speed
        assert law.coefficient(at(speed)) == pytest.approx(wanted, rel=1e-9)
    assert law.breakaway(at()) == 0.3


def test_stribeck_falls_and_rises_again():
    values = [STRIBECK.coefficient(at(speed)) for speed in np.linspace(0, 1, 2001)]
    turn = int(np.argmin(values))
    assert 0 < turn < 2000
    assert (np.diff(values[: turn + 1]) < 0).all()
    assert (np.diff(values[turn:]) > 0).all()


def test_stribeck_has_a_slope_over_its_exponent_at_standstill():
    def value(exponent):
        copy = object.__new__(Stribeck)
        for name, number in {**STRIBECK.__dict__, "exponent": exponent}.items():
            object.__setattr__(copy, name, number)
        return copy.coefficient(at(0.0))

    assert gradient_in_symbols(value, 2.0) == pytest.approx(0.0, abs=1e-12)


@settings(deadline=None, max_examples=50)
@given(speed=numbers(0, 3))
def test_friction_table_is_linear_between_its_points_and_constant_beyond(speed):
    wanted = np.interp(speed, [0.0, 0.1, 1.0], [0.2, 0.1, 0.15])
    assert TABLE.coefficient(at(speed)) == pytest.approx(wanted, rel=1e-12)
    assert TABLE.breakaway(at(speed)) == 0.25


def test_oil_twice_as_thick_does_at_half_the_speed_what_the_other_did():
    thin, thick = GivenViscosity(viscosity=0.1), GivenViscosity(viscosity=0.2)
    for law in (STRIBECK, TABLE, EFFICIENCY):
        other = AtViscosity(law=law, lubricant=thick, measured_with=thin)
        assert other.coefficient(at(0.03)) == pytest.approx(law.coefficient(at(0.06)))
        assert other.breakaway(at()) == law.breakaway(at())
        same = AtViscosity(law=law, lubricant=thin, measured_with=thin)
        assert same.coefficient(at(0.03)) == pytest.approx(law.coefficient(at(0.03)))


def test_film_of_din_depends_on_speed_times_viscosity_too():
    """The rule of AtViscosity holds for the law that has the viscosity inside."""
    thick = replace(PAPER_DIN, lubricant=GivenViscosity(viscosity=0.55))
    assert thick.coefficient(at(0.1)) == pytest.approx(PAPER_DIN.coefficient(at(0.2)))


def test_periodic_friction_repeats_with_every_tooth():
    law = PeriodicFriction(law=TABLE, harmonics=RIPPLE)
    tooth = 2 * math.pi * PAPER_PAIR.radius_a / PAPER_PAIR.teeth_a
    for part in (0.0, 0.2, 0.7):
        angle = 2 * math.pi * part
        factor = 1 + 0.3 * math.cos(angle) - 0.1 * math.cos(2 * angle) + 0.2 * math.sin(2 * angle)
        for turn in (-3, 0, 5):
            state = at(0.05, position=(part + turn) * tooth)
            assert law.coefficient(state) == pytest.approx(factor * TABLE.coefficient(state))
            assert law.breakaway(state) == pytest.approx(factor * 0.25)


def test_mean_of_periodic_friction_is_the_law():
    law = PeriodicFriction(law=TABLE, harmonics=RIPPLE)
    mean = np.mean([law.coefficient(at(0.05, position=k * PAPER_PAIR.tooth_pitch / 100)) for k in range(100)])
    assert mean == pytest.approx(TABLE.coefficient(at(0.05)))


@settings(deadline=None, max_examples=50)
@given(amplitudes=st.lists(numbers(-1, 1), min_size=2, max_size=6))
def test_factor_of_accepted_harmonics_is_positive_everywhere(amplitudes):
    harmonics = tuple(Harmonic(cosine=c, sine=s) for c, s in zip(amplitudes[::2], amplitudes[1::2], strict=False))
    angles = np.linspace(0, 2 * math.pi, 20001)
    lowest = 1 + sum(h.cosine * np.cos(k * angles) + h.sine * np.sin(k * angles) for k, h in enumerate(harmonics, 1))
    assume(abs(lowest.min()) > 1e-3)
    if lowest.min() > 0:
        PeriodicFriction(law=TABLE, pitch=3e-3, harmonics=harmonics)
    else:
        with pytest.raises(ValueError, match="must leave a factor > 0 everywhere"):
            PeriodicFriction(law=TABLE, pitch=3e-3, harmonics=harmonics)


# -- errors -------------------------------------------------------------------------------------------

WRONG_ARMS = GivenPair(radius_a=0.01, radius_b=0.03, friction_arm_a=1e-3, friction_arm_b=-2e-3)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: replace(PAPER_DIN, static=0.0), "Din3990.static must be > 0, got 0"),
        (lambda: replace(PAPER_DIN, roughness=-1e-6), "Din3990.roughness must be > 0 m, got -1e-06 m"),
        (lambda: replace(PAPER_DIN, effective_width=1.1), "Din3990.effective_width must be <= 1, got 1.1"),
        (
            lambda: PAPER_DIN.require_pair(SimpleNamespace(radius_a=0.01, radius_b=-0.01)),
            "Din3990 is for teeth that roll on each other, got SimpleNamespace with radius_a=0.01 m and radius_b=-0",
        ),
        (lambda: GivenViscosity(viscosity=0.0), "GivenViscosity.viscosity must be > 0 Pa s, got 0 Pa s"),
        (lambda: OilAt(oil=JET_OIL, temperature=20.0), "Mobil Jet Oil II: temperature must be from 218.15 K"),
        (lambda: efficiency_table((0, 1.2, 0.9)), "EfficiencyPoint.a_drives must be <= 1, got 1.2"),
        (lambda: efficiency_table((0, 0.9, 0.0)), "EfficiencyPoint.b_drives must be > 0, got 0"),
        (efficiency_table, "TabulatedEfficiency.points must not be empty"),
        (lambda: efficiency_table((0.1, 1, 1)), r"TabulatedEfficiency.points\[0\].speed must be 0 m/s"),
        (
            lambda: efficiency_table((0, 1, 1), (0.2, 1, 1), (0.1, 1, 1)),
            r"TabulatedEfficiency.points\[2\].speed must be > 0.2 m/s, the one before, got 0.1 m/s",
        ),
        (lambda: replace(EFFICIENCY, breakout=0.9), "TabulatedEfficiency.breakout must be >= 1, got 0.9"),
        (
            lambda: one_mesh(efficiency_table((0, 0.9, 0.9), (1, 0.5, 0.9)), damping=0.25, pair=WRONG_ARMS),
            r"TabulatedEfficiency.points\[1\].a_drives = 0.5 cannot be reached: with friction arms 0.1 r_A and",
        ),
        (lambda: replace(STRIBECK, coulomb=0.4), "Stribeck needs coulomb <= static, got coulomb=0.4 and static=0.3"),
        (lambda: replace(STRIBECK, exponent=0.5), "Stribeck.exponent must be >= 1, got 0.5"),
        (lambda: replace(STRIBECK, stribeck_speed=0.0), "Stribeck.stribeck_speed must be > 0 m/s, got 0 m/s"),
        (
            lambda: friction_table((0, 0.3), static=0.2),
            r"FrictionTable needs points\[0\].coefficient <= static, got points\[0\].coefficient=0.3 and static=0.2",
        ),
        (lambda: friction_table((0, 0.1), (0, 0.1), static=0.2), r"FrictionTable.points\[1\].speed must be > 0 m/s"),
        (lambda: friction_table((0, -0.1), static=0.2), "FrictionPoint.coefficient must be >= 0, got -0.1"),
        (
            lambda: PeriodicFriction(law=TABLE, pitch=0.0, harmonics=()),
            "PeriodicFriction.pitch must be > 0 m, got 0 m",
        ),
        (
            lambda: PeriodicFriction(law=TABLE, pitch=1e-3, harmonics=(Harmonic(sine=1.0),)),
            "PeriodicFriction.harmonics must leave a factor > 0 everywhere, got 0 at its lowest",
        ),
    ],
)
def test_laws_without_meaning_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


# -- from files ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("table", "law"),
    [
        ({"type": "Coulomb", "sliding": 0.1, "static": 0.2}, LAWS["Coulomb"]),
        (
            {
                "type": "Din3990",
                "static": 0.2,
                "lubricant": {"type": "OilAt", "oil": {"type": "KnownOil", "name": JET_OIL.name}, "temperature": COLD},
                "roughness": 0.8e-6,
                "face_width_mm": 10,
            },
            LAWS["Din3990 cold"],
        ),
        (
            {
                "type": "TabulatedEfficiency",
                "points": [{"speed": v, "a_drives": a, "b_drives": b} for v, a, b in ROWS],
                "breakout": 1.5,
            },
            EFFICIENCY,
        ),
        (
            {
                "type": "PeriodicFriction",
                "law": {"type": "Stribeck", "static": 0.3, "coulomb": 0.1, "stribeck_speed": 0.01, "viscous": 0.05},
                "pitch_mm": 3,
                "harmonics": [{"cosine": 0.3}],
            },
            PeriodicFriction(law=STRIBECK, pitch=3e-3, harmonics=(Harmonic(cosine=0.3),)),
        ),
    ],
    ids=lambda value: value.get("type") if isinstance(value, dict) else "",
)
def test_law_can_be_read_from_a_file(table, law):
    assert converter().structure(table, FrictionLaw) == law


# -- whole runs ---------------------------------------------------------------------------------------


def one_mesh(law, damping, pair=PAPER_PAIR, stick_by="mesh speed"):
    """The mesh of figure 9 between a torque source and a viscous load."""
    gear = Transmission(
        shafts={"a": Shaft(inertia=5e-4), "b": Shaft(inertia=1e-3)},
        meshes={
            "mesh": Mesh(
                a="a", b="b", pair=pair, elasticity=Linear(stiffness=2e8, damping=2e5), friction=law, stick_by=stick_by
            )
        },
        input="a",
        output="b",
    )
    return Actuator(motor=TorqueSource(), gear=gear, load=Load(damping=damping))


@pytest.mark.parametrize("stick_by", ["mesh speed", "conjugate speed"])
@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(("column", "torques"), [(1, (1.0, 0.0)), (1, (0.3, 0.0)), (2, (0.5, 6.0)), (2, (0.7, 3.5))])
def test_efficiency_of_a_steady_run_is_that_of_the_table(column, torques, sign, stick_by):
    """Motor drives (column 1) or the load does (column 2), in both directions, whatever speed the mesh sticks by."""
    inputs = {"torque_reference": sign * torques[0], "load_torque": sign * torques[1]}
    plant = one_mesh(EFFICIENCY, damping=0.25, stick_by=stick_by)
    run = simulate(plant, 4.0, inputs=inputs, resolution=0.01, compiled=False)
    last = {name: run[name][-1] for name in ("motor_torque", "motor_speed", "total_load_torque", "load_speed")}
    at_a, at_b = last["motor_torque"] * last["motor_speed"], last["total_load_torque"] * last["load_speed"]
    efficiency = -at_b / at_a if column == 1 else -at_a / at_b
    speed = abs(PAPER_PAIR.radius_a * last["motor_speed"])
    table = np.array(ROWS)
    assert (at_a > 0) == (column == 1) and speed > 0.05
    assert efficiency == pytest.approx(np.interp(speed, table[:, 0], table[:, column]), abs=1e-6)


@pytest.mark.parametrize(
    "law", [law for name, law in LAWS.items() if name != "lossless"], ids=[name for name in LAWS if name != "lossless"]
)
def test_every_law_runs_through_stick_and_slip(law):
    inputs = {"torque_reference": Sine(amplitude=1.0, frequency=2.0)}
    run = simulate(one_mesh(law, damping=0.25), 1.0, inputs=inputs, compiled=False)
    modes = {change.after for change in run.changes}
    assert {"forward", "backward"} <= modes
    assert run["gear.meshes.mesh.friction_loss"].min() > -1e-6
    assert run.margins.min() >= -1e-9


@pytest.mark.parametrize(
    ("lubricant", "sticks_again"), [(PAPER_DIN.lubricant, False), (OilAt(oil=JET_OIL, temperature=COLD), True)]
)
def test_figure_9_with_din_friction(lubricant, sticks_again):
    """The mesh lets go at the static coefficient whatever the oil; 275 mPa s is too thin to leave the cap there."""
    plant = figure_9("geometric")
    mesh = replace(plant.gear.meshes["mesh"], friction=replace(PAPER_DIN, lubricant=lubricant))
    rubbing = Actuator(motor=plant.motor, load=plant.load, gear=replace(plant.gear, meshes={"mesh": mesh}))
    run = simulate(rubbing, 10.0, inputs=figure_9_inputs(), start=figure_9_start(rubbing), compiled=False)
    assert run.changes[0].after == "forward"
    assert run.changes[0].time == pytest.approx(0.1780141, abs=1e-6)  # of Coulomb friction with the same static value
    assert (len(run.changes) > 1) == sticks_again
    if not sticks_again:
        speed = abs(run["gear.meshes.mesh.slip_speed"]).max()
        assert speed < PAPER_DIN.cap_speed(run["gear.meshes.mesh.normal_force"].min(), PAPER_PAIR)


def test_temperature_is_a_parameter_of_a_simulation():
    law = LAWS["Din3990 cold"]
    name = "gear.meshes.mesh.friction.lubricant.temperature"
    ends = []
    for temperature in (COLD, ROOM, WARM):
        changed = simulate(
            one_mesh(law, damping=0.25),
            4.0,
            inputs={"torque_reference": 1.0},
            parameters={name: temperature},
            resolution=0.1,
            compiled=False,
        )
        built = one_mesh(replace(law, lubricant=OilAt(oil=JET_OIL, temperature=temperature)), damping=0.25)
        run = simulate(built, 4.0, inputs={"torque_reference": 1.0}, resolution=0.1, compiled=False)
        assert changed["load_speed"][-1] == pytest.approx(run["load_speed"][-1], rel=1e-9)
        ends.append(abs(run["load_speed"][-1]))
    assert ends[0] > ends[1] > ends[2]  # thicker oil carries more of the load


@pytest.mark.parametrize(
    "law", [LAWS["Din3990"], EFFICIENCY, LAWS["periodic"]], ids=["Din3990", "efficiency", "periodic"]
)
def test_a_sweep_over_the_teeth_changes_what_the_law_knows_of_them(law):
    """Another module, other addenda: the parameters of the mesh's pair are all there is to change."""
    changes = {"module": 2e-3, "addendum_a": 0.9, "addendum_b": 1.05}
    names = {f"gear.meshes.mesh.pair.{name}": value for name, value in changes.items()}
    inputs, options = {"torque_reference": 1.0}, {"resolution": 0.1, "compiled": False}
    swept = simulate(one_mesh(law, damping=0.25), 4.0, inputs=inputs, parameters=names, **options)
    built = simulate(one_mesh(law, damping=0.25, pair=replace(PAPER_PAIR, **changes)), 4.0, inputs=inputs, **options)
    plain = simulate(one_mesh(law, damping=0.25), 4.0, inputs=inputs, **options)
    assert swept["load_speed"][-1] == pytest.approx(built["load_speed"][-1], rel=1e-9)
    assert abs(swept["load_speed"][-1] / plain["load_speed"][-1] - 1) > 1e-3


def test_an_efficiency_is_kept_by_a_sweep_over_the_teeth():
    efficiency = efficiency_table((0.0, 0.9, 0.9))
    teeth = {"gear.meshes.mesh.pair.module": 2e-3, "gear.meshes.mesh.pair.addendum_a": 0.8}
    inputs = {"torque_reference": 1.0}
    run = simulate(one_mesh(efficiency, damping=0.25), 4.0, inputs=inputs, parameters=teeth, compiled=False)
    at_a, at_b = run["motor_torque"] * run["motor_speed"], run["total_load_torque"] * run["load_speed"]
    assert -at_b[-1] / at_a[-1] == pytest.approx(0.9, abs=1e-6)


def test_a_sweep_to_teeth_that_the_law_does_not_suit_is_refused():
    wrong = {"gear.meshes.mesh.pair.friction_arm_a": 1e-3, "gear.meshes.mesh.pair.friction_arm_b": -2e-3}
    given = one_mesh(efficiency_table((0.0, 0.5, 0.5)), damping=0.25, pair=given_pair(PAPER_PAIR))
    with pytest.raises(ValueError, match="TabulatedEfficiency.points.0..a_drives = 0.5 cannot be reached"):
        simulate(given, 1.0, inputs={"torque_reference": 1.0}, parameters=wrong, compiled=False)
