"""Laws of teeth against energy, difference quotients and closed forms, and in numbers against the same in symbols."""

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from oracles import gradient_in_symbols, in_symbols, numbers, pressed, rubbing, signs

from gear import Backlash, Coulomb, Linear
from gear.elasticity.law import has_gap

TEETH = Linear(stiffness=2e8, damping=2e5)  # van der Linden, section 4.1
GAP = 15e-6  # m, total: van der Linden, Table 3
WITH_GAP = Backlash(gap=GAP, law=TEETH)
ELASTIC_LAWS = (
    TEETH,
    WITH_GAP,
    Backlash(gap=0.0, law=TEETH),
    Backlash(gap=GAP, law=Linear(stiffness=1e6, damping=0.0)),
)
FRICTION_LAWS = (Coulomb(sliding=0.1, static=0.2), Coulomb(sliding=0.1, static=0.1), Coulomb(sliding=0, static=0))

elastic = pytest.mark.parametrize("law", ELASTIC_LAWS, ids=str)
with_gap = pytest.mark.parametrize("law", ELASTIC_LAWS[1:], ids=str)
frictional = pytest.mark.parametrize("law", FRICTION_LAWS, ids=str)
deflections, rates, flanks = numbers(-1e-4, 1e-4), numbers(-1e-1, 1e-1), st.sampled_from((-1.0, 0.0, 1.0))
penetrations = numbers(0, 1e-4)

STEP = 1e-9  # m, and m/s for rates; a thousandth of the smallest deflection that matters


def force(law, deflection, rate, flank):
    return law.force(pressed(deflection, rate), flank)


def energy(law, deflection, flank):
    return law.stored(pressed(deflection), flank)


def engaged(law, penetration, flank):
    """Deflection at a penetration of the teeth on one flank."""
    return flank * (getattr(law, "gap", 0.0) / 2 + penetration)


# -- the same law in numbers and in symbols -----------------------------------------------------------


@elastic
@settings(deadline=None, max_examples=50)
@given(deflection=deflections, rate=rates, flank=flanks)
def test_elasticity_is_the_same_in_numbers_and_in_symbols(law, deflection, rate, flank):
    assert in_symbols(lambda *x: force(law, *x), deflection, rate, flank) == pytest.approx(
        force(law, deflection, rate, flank)
    )
    assert in_symbols(lambda *x: energy(law, *x), deflection, flank) == pytest.approx(energy(law, deflection, flank))


@frictional
def test_friction_is_the_same_in_numbers_and_in_symbols(law):
    for coefficient in (law.coefficient, law.breakaway):
        assert in_symbols(lambda *x, of=coefficient: of(rubbing(*x)), 0.3, 500.0) == pytest.approx(
            coefficient(rubbing(0.3, 500.0))
        )


@elastic
@settings(deadline=None, max_examples=50)
@given(deflection=deflections, rate=rates, flank=flanks)
def test_symbolic_slope_of_the_force_is_its_difference_quotient(law, deflection, rate, flank):
    assume(abs(abs(deflection) - engaged(law, 0.0, 1.0)) > STEP)
    slopes = gradient_in_symbols(lambda x, v: force(law, x, v, flank), deflection, rate)
    for slope, dx, dv in zip(slopes, (STEP, 0), (0, STEP), strict=True):
        here, ahead, behind = (force(law, deflection + k * dx, rate + k * dv, flank) for k in (0, 1, -1))
        assume(ahead - here == pytest.approx(here - behind, rel=1e-3, abs=1e-9))  # not across an edge of the law
        assert slope == pytest.approx((ahead - behind) / (2 * STEP), rel=1e-3, abs=1e-3)


# -- elasticity: invariants ---------------------------------------------------------------------------


@elastic
@settings(deadline=None, max_examples=50)
@given(penetration=penetrations, flank=signs())
def test_static_force_is_the_derivative_of_the_energy(law, penetration, flank):
    deflection = engaged(law, penetration, flank)
    static = force(law, deflection, 0.0, flank)
    quotient = (energy(law, deflection + STEP, flank) - energy(law, deflection - STEP, flank)) / (2 * STEP)
    assert quotient == pytest.approx(static, rel=1e-6, abs=TEETH.stiffness * STEP)
    slope = gradient_in_symbols(lambda x: energy(law, x, flank), deflection)
    assert slope == pytest.approx(static, rel=1e-9, abs=1e-9)


@elastic
@settings(deadline=None, max_examples=50)
@given(deflection=deflections, rate=rates, flank=flanks)
def test_damping_never_creates_energy(law, deflection, rate, flank):
    assert (force(law, deflection, rate, flank) - force(law, deflection, 0.0, flank)) * rate >= -1e-12


@elastic
@settings(deadline=None, max_examples=50)
@given(deflection=deflections, rate=rates, flank=flanks)
def test_force_turns_with_the_teeth(law, deflection, rate, flank):
    assert force(law, -deflection, -rate, -flank) == pytest.approx(-force(law, deflection, rate, flank))


@with_gap
@settings(deadline=None, max_examples=50)
@given(penetration=penetrations, rate=rates, flank=signs())
def test_teeth_with_backlash_cannot_pull(law, penetration, rate, flank):
    deflection = engaged(law, penetration, flank)
    spring = flank * force(law, deflection, 0.0, flank)
    rounding = 1e-12 * TEETH.stiffness * GAP
    assert -rounding <= flank * force(law, deflection, rate, flank) <= 2 * spring + rounding


@with_gap
@settings(deadline=None, max_examples=20)
@given(rate=rates, flank=signs())
def test_force_does_not_jump_where_a_flank_engages_or_lets_go(law, rate, flank):
    assert force(law, engaged(law, 0.0, flank), rate, flank) == 0
    assert energy(law, engaged(law, 0.0, flank), flank) == 0


@with_gap
@settings(deadline=None, max_examples=20)
@given(part=numbers(-1.0, 1.0), rate=rates)
def test_there_is_no_force_and_no_energy_in_the_gap(law, part, rate):
    inside = part * law.gap / 2
    assert force(law, inside, rate, 0.0) == 0
    assert energy(law, inside, 0.0) == 0


@with_gap
@settings(deadline=None, max_examples=20)
@given(distance=penetrations, flank=signs())
def test_force_of_an_engaged_flank_goes_on_with_its_slope_below_contact(law, distance, flank):
    """No run comes there; a search for an operating point needs the slope to find its way back."""
    assert force(law, engaged(law, -distance, flank), 0.0, flank) == pytest.approx(
        -force(law, engaged(law, distance, flank), 0.0, flank), rel=1e-9, abs=1e-9
    )


@with_gap
@settings(deadline=None, max_examples=20)
@given(penetration=numbers(-1e-4, 1e-4), flank=signs())
def test_penetration_is_counted_from_the_flank_and_positive_in_contact(law, penetration, flank):
    deflection = engaged(law, penetration, flank)
    assert law.penetration(pressed(deflection), flank) == pytest.approx(penetration, abs=1e-18)
    assert law.penetration(pressed(deflection), -flank) == pytest.approx(-penetration - law.gap, abs=1e-18)


# -- elasticity: closed forms -------------------------------------------------------------------------


@settings(deadline=None, max_examples=20)
@given(deflection=deflections, rate=rates, flank=flanks)
def test_linear_teeth_are_a_spring_and_a_damper(deflection, rate, flank):
    """Van der Linden, eq. (40)."""
    law = TEETH
    assert force(law, deflection, rate, flank) == pytest.approx(2e8 * deflection + 2e5 * rate)
    assert energy(law, deflection, flank) == pytest.approx(1e8 * deflection**2)


@settings(deadline=None, max_examples=20)
@given(penetration=penetrations, flank=signs())
def test_engaged_teeth_are_bent_by_what_exceeds_half_the_total_gap(penetration, flank):
    """Van der Linden, eq. (42)."""
    static = force(WITH_GAP, flank * (7.5e-6 + penetration), 0.0, flank)
    assert static == pytest.approx(flank * 2e8 * penetration, rel=1e-6, abs=1e-9)


@pytest.mark.parametrize(
    ("rate", "total"),
    [(0.0, 200.0), (5e-4, 300.0), (-5e-4, 100.0), (1e-3, 400.0), (1.0, 400.0), (-1e-3, 0.0), (-1.0, 0.0)],
)
def test_damping_is_limited_to_the_spring_force(rate, total):
    """One micrometer deep: spring 200 N, so the total stays between 0 and 400 N at any rate."""
    assert force(WITH_GAP, engaged(WITH_GAP, 1e-6, 1.0), rate, 1.0) == pytest.approx(total, abs=1e-6)


def test_only_backlash_has_a_gap():
    assert [has_gap(law) for law in ELASTIC_LAWS] == [False, True, True, True]


@elastic
def test_usual_force_is_that_of_a_micrometer(law):
    assert law.force_scale() == pytest.approx(force(law, engaged(law, 1e-6, 1.0), 0.0, 1.0))


# -- friction -----------------------------------------------------------------------------------------


@frictional
@settings(deadline=None, max_examples=20)
@given(speed=numbers(0, 10.0), load=numbers(0, 1e5))
def test_sliding_friction_is_never_above_breakaway(law, speed, load):
    assert 0 <= law.coefficient(rubbing(speed, load)) <= law.breakaway(rubbing(speed, load))


def test_coulomb_is_constant_with_its_own_breakaway():
    """Van der Linden, eq. (34)."""
    law = Coulomb(sliding=0.06, static=0.2)
    for sliding in (rubbing(0.0, 1.0), rubbing(5.0, 1e4)):
        assert (law.coefficient(sliding), law.breakaway(sliding)) == (0.06, 0.2)


# -- errors -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Coulomb(sliding=0.2, static=0.1), "sliding <= static, got sliding=0.2 and static=0.1"),
        (lambda: Coulomb(sliding=-0.1, static=0.1), "Coulomb.sliding must be >= 0, got -0.1"),
        (lambda: Linear(stiffness=0.0, damping=0.0), "Linear.stiffness must be > 0 N/m, got 0 N/m"),
        (lambda: Linear(stiffness=1e8, damping=-1.0), "Linear.damping must be >= 0 N s/m, got -1 N s/m"),
        (lambda: Backlash(gap=-1e-6, law=TEETH), "Backlash.gap must be >= 0 m, got -1e-06 m"),
    ],
)
def test_laws_without_meaning_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()
