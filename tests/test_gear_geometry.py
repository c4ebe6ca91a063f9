"""Gear pairs against the sliding direction integrated along the path of contact, closed forms and published numbers."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from oracles import PAPER_PAIR, averaged_friction, external_pairs, numbers
from scipy.optimize import brentq
from tooth_oracles import averages, by_symbols, cut_external_pairs, cut_pairs, plane, turned_round

from gear import Mesh
from gear.teeth.geometry import ExternalPair, GivenPair
from gear.teeth.involute import Rack, Teeth, gearing

STANDARD = {"teeth_a": 20, "teeth_b": 60, "module": 1e-3}

# -- invariants ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("flank", [1, -1])
@settings(deadline=None, max_examples=50)
@given(pair=external_pairs())
def test_constants_are_the_friction_averaged_over_the_path_of_contact(flank, pair):
    averages = averaged_friction(pair, flank)
    sine, cosine = math.sin(pair.pressure_angle), math.cos(pair.pressure_angle)
    near = {"rel": 1e-10, "abs": 1e-10 * pair.module}
    assert averages.torque_a == pytest.approx(-pair.friction_arm_a, **near)
    assert averages.torque_b == pytest.approx(pair.friction_arm_b, **near)
    assert averages.force == pytest.approx(pair.friction_factor * np.array([flank * cosine, -sine]), abs=1e-10)


@settings(deadline=None, max_examples=50)
@given(pair=external_pairs())
def test_arms_and_factor_balance_their_moments(pair):
    length = (pair.radius_a + pair.radius_b) * math.sin(pair.pressure_angle)
    assert -pair.friction_arm_a + pair.friction_arm_b == pytest.approx(
        length * pair.friction_factor, rel=1e-10, abs=1e-12 * length
    )


@settings(deadline=None, max_examples=50)
@given(pair=external_pairs())
def test_swapping_the_wheels_swaps_the_arms_and_turns_the_factor(pair):
    swapped = dataclasses.replace(
        pair, teeth_a=pair.teeth_b, teeth_b=pair.teeth_a, addendum_a=pair.addendum_b, addendum_b=pair.addendum_a
    )
    assert swapped.radius_a == pair.radius_b
    assert swapped.friction_arm_a == pytest.approx(pair.friction_arm_b, rel=1e-9, abs=1e-12)
    assert swapped.friction_arm_b == pytest.approx(pair.friction_arm_a, rel=1e-9, abs=1e-12)
    assert swapped.friction_factor == pytest.approx(-pair.friction_factor, rel=1e-9, abs=1e-12)
    assert swapped.contact_ratio() == pytest.approx(pair.contact_ratio(), rel=1e-12)


@settings(deadline=None, max_examples=50)
@given(pair=external_pairs())
def test_contact_runs_from_tip_to_tip_through_the_pitch_point(pair):
    path = pair.path()
    assert 0 <= path.start < path.pitch < path.end <= path.length


@settings(deadline=None, max_examples=50)
@given(pair=external_pairs(), factor=numbers(0.1, 10.0))
def test_a_larger_module_only_enlarges_the_drawing(pair, factor):
    larger = dataclasses.replace(pair, module=factor * pair.module)
    assert larger.friction_arm_a == pytest.approx(factor * pair.friction_arm_a, rel=1e-9, abs=1e-12)
    assert larger.friction_factor == pytest.approx(pair.friction_factor, abs=1e-12)
    assert larger.contact_ratio() == pytest.approx(pair.contact_ratio(), rel=1e-12)


@settings(deadline=None, max_examples=20)
@given(teeth=st.integers(30, 120), module=numbers(2e-4, 1e-2), addendum=numbers(0.8, 1.0))
def test_equal_wheels_put_no_friction_on_the_bearings(teeth, module, addendum):
    equal = ExternalPair(teeth_a=teeth, teeth_b=teeth, module=module, addendum_a=addendum, addendum_b=addendum)
    assert equal.friction_factor == pytest.approx(0, abs=1e-12)
    assert equal.friction_arm_a == pytest.approx(equal.friction_arm_b, rel=1e-12)


@settings(deadline=None, max_examples=20)
@given(pair=external_pairs())
def test_spur_teeth_without_shift_work_on_their_reference_circles(pair):
    """To the last bit, so that shifts of zero change no result."""
    assert (pair.radius_a, pair.radius_b) == (pair.module * pair.teeth_a / 2, pair.module * pair.teeth_b / 2)
    assert pair.gearing.tip_a == pair.radius_a + pair.addendum_a * pair.module
    assert pair.working_angle == pytest.approx(pair.pressure_angle, rel=1e-15)


# -- profile shift, helix angle, tip radii ------------------------------------------------------------


@pytest.mark.parametrize("flank", [1, -1])
@settings(deadline=None, max_examples=100)
@given(pair=cut_external_pairs())
def test_constants_of_any_teeth_are_the_friction_averaged_over_the_path(flank, pair):
    expected, sine, cosine = averages(plane(pair, flank)), math.sin(pair.working_angle), math.cos(pair.working_angle)
    near = {"rel": 1e-10, "abs": 1e-10 * pair.module}
    assert -pair.friction_arm_a == pytest.approx(expected.torque_a, **near)
    assert pair.friction_arm_b == pytest.approx(expected.torque_b, **near)
    assert pair.friction_factor * np.array([flank * cosine, -sine]) == pytest.approx(expected.force, abs=1e-10)
    length = (pair.radius_a + pair.radius_b) * sine
    assert pair.friction_arm_b - pair.friction_arm_a == pytest.approx(length * pair.friction_factor, abs=1e-12 * length)


@settings(deadline=None, max_examples=50)
@given(pair=cut_external_pairs())
def test_teeth_fill_the_working_pitch_circles(pair):
    """Without backlash the teeth of one wheel are as thick as the spaces of the other, which sets the distance."""
    both = pair.gearing.thickness_a + turned_round(pair.gearing).thickness_a
    assert both == pytest.approx(pair.gearing.pitch, rel=1e-10)
    assert pair.gearing.base_a == pytest.approx(
        pair.gearing.rack.transverse_module * pair.teeth_a / 2 * math.cos(pair.gearing.rack.transverse_angle), rel=1e-12
    )


@settings(deadline=None, max_examples=50)
@given(pair=cut_external_pairs())
def test_given_tips_are_where_the_addenda_put_them(pair):
    given_tips = dataclasses.replace(pair, tip_radius_a=pair.gearing.tip_a, tip_radius_b=pair.gearing.tip_b)
    assert given_tips.path() == pytest.approx(pair.path(), rel=1e-12)


@settings(deadline=None, max_examples=50)
@given(pair=cut_external_pairs())
def test_shifted_teeth_keep_the_clearance_of_the_rack(pair):
    """From the tip of B to the root of A there are clearance modules, as between racks: dedendum less addendum."""
    assume(pair.tip_radius_b is None)
    dedendum = pair.addendum_b + 0.25
    root_a = pair.gearing.a.reference_radius(pair.gearing.rack) + (pair.shift_a - dedendum) * pair.module
    assert pair.gearing.center_distance - pair.gearing.tip_b - root_a == pytest.approx(0.25 * pair.module, rel=1e-8)


@settings(deadline=None, max_examples=100)
@given(lower=numbers(10.0, 45.0), reference=numbers(14.0, 30.0))
def test_the_involute_equation_is_solved_to_rounding(lower, reference):
    """For any working pressure angle that is let through, against bisection."""
    working, angle = math.radians(lower), math.radians(reference)
    opening = math.tan(working) - working - (math.tan(angle) - angle)
    shift = opening * 100 / (2 * math.tan(angle))
    pair = gearing(Rack(1e-3, angle, 0.0), Teeth(50, shift, 1.0, 1.0), Teeth(50, 0.0, 1.0, 1.0))
    found = brentq(lambda x: math.tan(x) - x - (math.tan(angle) - angle) - opening, 0.1, 0.9, xtol=1e-15, rtol=1e-15)
    assert pair.angle == pytest.approx(found, abs=1e-13)


@settings(deadline=None, max_examples=20)
@given(pair=cut_external_pairs())
def test_every_property_is_the_same_in_symbols(pair):
    for name in ("radius_a", "radius_b", "working_angle", "friction_factor", "friction_arm_a", "friction_arm_b"):
        expected = pytest.approx(getattr(pair, name), rel=1e-12)
        assert by_symbols(pair, lambda symbolic, name=name: getattr(symbolic, name)) == expected
    assert by_symbols(pair, lambda symbolic: symbolic.contact_ratio()) == pytest.approx(pair.contact_ratio())
    for name in ("center_distance", "base_helix_angle", "thickness_a", "base_pitch"):
        expected = pytest.approx(getattr(pair.gearing, name))
        assert by_symbols(pair, lambda symbolic, name=name: getattr(symbolic.gearing, name)) == expected
    assert by_symbols(pair, lambda symbolic: symbolic.gearing.overlap_ratio(1e-2)) == pytest.approx(
        pair.gearing.overlap_ratio(1e-2)
    )


@settings(deadline=None, max_examples=50)
@given(pair=cut_external_pairs())
def test_a_mesh_sees_nothing_of_the_teeth_but_working_radii_angle_and_constants(pair):
    same = GivenPair(
        radius_a=pair.radius_a,
        radius_b=pair.radius_b,
        friction_arm_a=pair.friction_arm_a,
        friction_arm_b=pair.friction_arm_b,
        friction_factor=pair.friction_factor,
        pressure_angle=pair.working_angle,
    )
    cut, bare = (Mesh(a="a", b="b", pair=each) for each in (pair, same))
    for read in (Mesh.deflection_per_shaft, Mesh.slip_per_shaft, Mesh.torque_per_normal, Mesh.torque_per_friction):
        assert read(cut) == read(bare)
    assert cut.bearing_force(100.0, 10.0, 1.0) == bare.bearing_force(100.0, 10.0, 1.0)


@settings(deadline=None, max_examples=50)
@given(pair=cut_pairs(spur=True))
def test_spur_teeth_do_not_overlap_along_the_face(pair):
    assert pair.gearing.overlap_ratio(1e-2) == 0
    assert pair.gearing.base_helix_angle == 0


# -- closed forms and published numbers ---------------------------------------------------------------


def test_constants_of_the_paper_pair():
    """Van der Linden, eqs. (21), (27), (30) for the wheels of Table 3 (its printed constants are another pair's)."""
    assert (PAPER_PAIR.radius_a, PAPER_PAIR.radius_b) == pytest.approx((10e-3, 30e-3))
    assert PAPER_PAIR.friction_factor == pytest.approx(0.0682, abs=5e-5)
    assert -PAPER_PAIR.friction_arm_a == pytest.approx(-1.0056e-3, abs=5e-8)
    assert PAPER_PAIR.friction_arm_b == pytest.approx(1.9385e-3, abs=5e-8)


def test_constants_printed_in_the_paper_do_not_balance_their_moments():
    """Van der Linden, Table 3: d_F = 0.84, d_tauA = -9.2 mm, d_tauB = 15.0 mm."""
    printed = GivenPair(
        radius_a=10e-3, radius_b=30e-3, friction_factor=0.84, friction_arm_a=9.2e-3, friction_arm_b=15e-3
    )
    length = (printed.radius_a + printed.radius_b) * math.sin(printed.pressure_angle)
    assert printed.friction_arm_b - printed.friction_arm_a == pytest.approx(5.8e-3)
    assert length * printed.friction_factor == pytest.approx(11.5e-3, rel=1e-2)


def test_published_spur_wheels_with_profile_shift():
    """D. Bolsover, Utilities for Alibre, help page "Profile Shifted External Spur Gears"."""
    pair = ExternalPair(teeth_a=12, teeth_b=24, module=3e-3, shift_a=0.6, shift_b=0.36)
    assert math.degrees(pair.working_angle) == pytest.approx(26.0888, abs=3e-4)
    assert pair.gearing.center_distance == pytest.approx(56.500e-3, abs=5e-7)
    assert (2 * pair.gearing.base_a, 2 * pair.gearing.base_b) == pytest.approx((33.8289e-3, 67.6579e-3), abs=5e-8)
    assert (2 * pair.radius_a, 2 * pair.radius_b) == pytest.approx((37.667e-3, 75.333e-3), abs=5e-7)
    assert (2 * pair.gearing.tip_a, 2 * pair.gearing.tip_b) == pytest.approx((44.840e-3, 79.400e-3), abs=5e-7)
    assert pair.contact_ratio() == pytest.approx(1.202, abs=5e-4)


def test_published_helical_wheels_with_profile_shift():
    """D. Bolsover, Utilities for Alibre, help page "Profile Shifted External Helical Gear - Normal"."""
    pair = ExternalPair(teeth_a=12, teeth_b=60, module=3e-3, helix_angle=math.radians(30), shift_a=0.09809)
    assert math.degrees(pair.gearing.rack.transverse_angle) == pytest.approx(22.79588, abs=1e-5)
    assert math.degrees(pair.working_angle) == pytest.approx(23.1126, abs=1e-4)
    assert pair.gearing.center_distance == pytest.approx(125e-3, abs=5e-7)
    assert (2 * pair.radius_a, 2 * pair.radius_b) == pytest.approx((41.667e-3, 208.333e-3), abs=5e-7)
    assert (2 * pair.gearing.base_a, 2 * pair.gearing.base_b) == pytest.approx((38.322e-3, 191.611e-3), abs=5e-7)
    assert (2 * pair.gearing.tip_a, 2 * pair.gearing.tip_b) == pytest.approx((48.154e-3, 213.842e-3), abs=5e-7)
    assert pair.contact_ratio() == pytest.approx(1.294, abs=5e-4)
    assert pair.gearing.overlap_ratio(20e-3) == pytest.approx(1.061, abs=5e-4)


def test_base_helix_angle_is_that_of_the_base_cylinder():
    """tan(beta_b) = tan(beta) cos(alpha_t): the lead is the same on every cylinder."""
    pair = ExternalPair(teeth_a=30, teeth_b=60, module=3e-3, helix_angle=math.radians(15))
    expected = math.atan(math.tan(math.radians(15)) * math.cos(pair.gearing.rack.transverse_angle))
    assert pair.gearing.base_helix_angle == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("degrees", [14.5, 20.0, 25.0])
def test_contact_ratio_of_very_large_wheels_is_that_of_two_racks(degrees):
    """A tooth of a rack is in contact over one addendum on each side: 4 / (pi sin 2 alpha)."""
    angle = math.radians(degrees)
    racks = ExternalPair(teeth_a=10**6, teeth_b=10**6, module=1e-3, pressure_angle=angle)
    assert racks.contact_ratio() == pytest.approx(4 / (math.pi * math.sin(2 * angle)), rel=1e-4)


def test_contact_ratio_is_the_mean_number_of_tooth_pairs_on_the_path():
    path = PAPER_PAIR.path()
    base_pitch = 2 * math.pi * PAPER_PAIR.radius_a * math.cos(PAPER_PAIR.pressure_angle) / PAPER_PAIR.teeth_a
    leading = path.end - np.linspace(0, base_pitch, 20000, endpoint=False)
    pairs = sum((leading - k * base_pitch >= path.start).astype(int) for k in range(5))
    assert PAPER_PAIR.contact_ratio() == pytest.approx(np.mean(pairs), abs=1e-3)


# -- errors -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"teeth_a": 10}, r"the tip of wheel b reaches .* mm below the base tangent point of wheel a \(interference\)"),
        ({"teeth_b": 10, "teeth_a": 60}, r"the tip of wheel a .* of wheel b \(interference\); .* addendum_a"),
        ({"addendum_a": 0.3, "addendum_b": 0.3}, r"contact ratio >= 1 .* got 0\.\d+; .*addendum_a or .*addendum_b"),
        (
            {"tip_radius_a": 10.2e-3, "tip_radius_b": 30.2e-3},
            r"got 0\.\d+; take a larger tip_radius_a or a",
        ),
        (
            {"tip_radius_a": 9e-3},
            "wheel a, 9 mm, does not reach its working pitch radius of 10 mm; take a larger",
        ),
        ({"tip_radius_b": 33e-3}, r"the tip of wheel b reaches .* \(interference\); .* or a smaller tip_radius_b"),
        (
            {"teeth_a": 16, "teeth_b": 18},
            r"16 teeth of wheel a are undercut by a rack with addendum 1; .* >= 0\.06",
        ),
        ({"teeth_b": 15}, r"teeth of wheel b are undercut .* needs shift_b >= 0\.1227, got 0, or at least 17 teeth"),
        ({"shift_a": -0.3, "teeth_b": 25}, r"20 teeth of wheel a are undercut .* got -0\.3, or at least 23 teeth"),
        (
            {"shift_a": 0.9, "addendum_a": 1.4},
            r"of wheel a are pointed, .* mm\); take a smaller addendum_a or a smaller",
        ),
        (
            {"shift_a": -1.0, "shift_b": -0.5},
            r"shift_a \+ shift_b >= -1\.441 with 20 and 60 teeth, got -1\.5: .* 10 deg",
        ),
        ({"helix_angle": -0.1}, "ExternalPair.helix_angle must be >= 0 rad, got -0.1 rad"),
        ({"module": -1e-3}, r"ExternalPair.module must be > 0 m, got -0.001 m"),
        ({"addendum_b": 0.0}, r"ExternalPair.addendum_b must be > 0, got 0"),
        ({"pressure_angle": 20.0}, r"ExternalPair.pressure_angle must be < 0.785398 rad, got 20 rad"),
        ({"teeth_a": 20.5}, r"ExternalPair.teeth_a must be a whole number of teeth >= 1, got 20.5"),
        ({"teeth_b": 60.0}, r"ExternalPair.teeth_b must be a whole number of teeth >= 1, got 60.0"),
        ({"teeth_a": 0}, r"ExternalPair.teeth_a must be a whole number of teeth >= 1, got 0"),
        ({"teeth_a": True}, r"ExternalPair.teeth_a must be a whole number of teeth >= 1, got True"),
    ],
)
def test_teeth_that_cannot_mesh_are_refused(changes, message):
    with pytest.raises(ValueError, match=message):
        ExternalPair(**STANDARD | changes)


@pytest.mark.parametrize("radius_b", [0.0, -5e-3, -10e-3])
def test_the_ring_of_a_given_pair_must_be_larger_than_the_wheel_inside_it(radius_b):
    with pytest.raises(
        ValueError, match=rf"radius_b must be > 0 m, or for a ring < -radius_a = -0.01 m, got {radius_b:g} m"
    ):
        GivenPair(radius_a=10e-3, radius_b=radius_b, friction_arm_a=1e-3, friction_arm_b=2e-3)


def test_a_negative_pitch_radius_is_refused():
    with pytest.raises(ValueError, match="GivenPair.radius_a must be > 0 m, got -0.01 m"):
        GivenPair(radius_a=-10e-3, radius_b=30e-3, friction_arm_a=1e-3, friction_arm_b=2e-3)


def test_counts_and_lengths_may_be_numbers_of_numpy():
    pair = ExternalPair(teeth_a=np.int64(20), teeth_b=np.int32(60), module=np.float32(1e-3), shift_a=np.float64(0.1))
    assert pair.radius_b / pair.radius_a == pytest.approx(3)
    with pytest.raises(ValueError, match="must be a whole number of teeth >= 1, got np.float64"):
        ExternalPair(teeth_a=np.float64(20), teeth_b=60, module=1e-3)
    with pytest.raises(ValueError, match="ExternalPair.module must be > 0 m, got -0.001 m"):
        ExternalPair(teeth_a=20, teeth_b=60, module=np.float32(-1e-3))
