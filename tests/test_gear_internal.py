"""Ring gears: their constants against plane geometry with true radii, a mesh with one, rings that cannot be."""

import dataclasses
import math
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import numbers, signs
from tooth_oracles import RING, averages, by_symbols, internal_pairs, plane, tip_gap, turned_round

from gear import Coulomb, ExternalPair, GivenPair, InternalPair, Linear, Mesh, Shaft, Transmission
from gear.teeth.checks import require_possible
from gear.teeth.involute import Rack, Teeth, gearing
from studies.converter import converter

TEETH = Linear(stiffness=2e8, damping=0.0)
FRICTION = Coulomb(sliding=0.1, static=0.2)
STANDARD = {"teeth_a": 20, "teeth_b": 60, "module": 1e-3, "addendum_b": 0.75}
FIXED_CARRIER = {"a": 3.0, "b": 1.0, "c": 0.0}  # both wheels of RING turn the same way

magnitudes = numbers(0, 1e4)
speeds = st.fixed_dictionaries(dict.fromkeys("abc", numbers(-100, 100)))


def mesh_of(pair, stick_by="mesh speed"):
    return Mesh(a="a", b="b", carrier="c", pair=pair, elasticity=TEETH, friction=FRICTION, stick_by=stick_by)


def torques(mesh, normal, friction):
    by_normal, by_friction = mesh.torque_per_normal(), mesh.torque_per_friction()
    return {shaft: normal * by_normal[shaft] + friction * by_friction[shaft] for shaft in by_normal}


def along(per_shaft, motion):
    return sum(factor * motion[shaft] for shaft, factor in per_shaft.items())


# -- constants ----------------------------------------------------------------------------------------


def test_constants_of_a_ring_of_60_teeth():
    """10/30 mm, 20 degrees, tips 11/29.25 mm; on true radii d_tauB is -0.8407 mm."""
    assert (RING.radius_a, RING.radius_b) == pytest.approx((10e-3, -30e-3))
    assert RING.friction_factor == pytest.approx(0.034138998, abs=5e-10)
    assert -RING.friction_arm_a == pytest.approx(-1.074234121e-3, abs=5e-13)
    assert RING.friction_arm_b == pytest.approx(0.840709623e-3, abs=5e-13)


@pytest.mark.parametrize("flank", [1, -1])
@settings(deadline=None, max_examples=100)
@given(pair=internal_pairs())
def test_constants_are_the_friction_averaged_over_the_path_of_contact(flank, pair):
    expected, sine, cosine = averages(plane(pair, flank)), math.sin(pair.working_angle), math.cos(pair.working_angle)
    near = {"rel": 1e-10, "abs": 1e-10 * pair.module}
    assert -pair.friction_arm_a == pytest.approx(expected.torque_a, **near)
    assert pair.friction_arm_b == pytest.approx(expected.torque_b, **near)
    assert pair.friction_factor * np.array([flank * cosine, -sine]) == pytest.approx(expected.force, abs=1e-10)


@settings(deadline=None, max_examples=100)
@given(pair=internal_pairs())
def test_arms_and_factor_balance_their_moments(pair):
    """d_tauA + d_tauB = T1T2 d_F, signed; with true radii d_tauB = d_tauA + (r_B - r_A) sin(alpha) d_F."""
    true_arm_b, distance = -pair.friction_arm_b, abs(pair.radius_b) - pair.radius_a
    moment = distance * math.sin(pair.working_angle) * pair.friction_factor
    assert true_arm_b == pytest.approx(-pair.friction_arm_a + moment, rel=1e-10, abs=1e-12 * distance)


@settings(deadline=None, max_examples=100)
@given(pair=internal_pairs())
def test_exchanging_wheel_and_ring_exchanges_the_arms_and_turns_the_factor(pair):
    path, back = pair.path(), pair.path()
    back = path._replace(pitch=path.length - path.pitch, start=path.length - path.end, end=path.length - path.start)
    assert back.friction_arm_a == pytest.approx(pair.friction_arm_b, rel=1e-9, abs=1e-12)
    assert back.friction_arm_b == pytest.approx(pair.friction_arm_a, rel=1e-9, abs=1e-12)
    assert back.friction_factor == pytest.approx(-pair.friction_factor, rel=1e-9, abs=1e-12)


@settings(deadline=None, max_examples=50)
@given(pair=internal_pairs())
def test_wheel_and_ring_fill_their_working_pitch_circles(pair):
    """Without backlash the teeth of one are as thick as the spaces of the other."""
    assert pair.gearing.thickness_a + turned_round(pair.gearing).thickness_a == pytest.approx(
        pair.gearing.pitch, rel=1e-9
    )
    assert pair.radius_b / pair.radius_a == pytest.approx(-pair.teeth_b / pair.teeth_a, rel=1e-12)


def test_a_ring_of_many_teeth_is_an_external_wheel_of_as_many():
    """Both become a rack; the constants differ by terms of one over the number of teeth."""
    ring = InternalPair(teeth_a=30, teeth_b=10**6, module=1e-3)
    wheel = ExternalPair(teeth_a=30, teeth_b=10**6, module=1e-3)
    for name in ("friction_factor", "friction_arm_a"):
        assert getattr(ring, name) == pytest.approx(getattr(wheel, name), rel=1e-4)
    assert ring.friction_arm_b / ring.radius_b == pytest.approx(wheel.friction_arm_b / wheel.radius_b, rel=1e-4)
    assert ring.contact_ratio() == pytest.approx(wheel.contact_ratio(), rel=1e-4)


def test_working_distance_of_published_wheels_with_profile_shift():
    """SDP/SI, "Elements of metric gear technology" (D785), table 5-1, where a ring's shift has the opposite sign."""
    rack = Rack(module=3e-3, pressure_angle=math.radians(20), helix_angle=0.0)
    pair = gearing(rack, Teeth(16, 0.0, 1.0, None), Teeth(-24, -0.5, 1.0, None))
    assert math.degrees(pair.angle) == pytest.approx(31.0937, abs=1e-4)
    assert pair.center_distance == pytest.approx(13.1683e-3, abs=5e-8)
    assert (2 * pair.radius_a, -2 * pair.radius_b) == pytest.approx((52.673e-3, 79.010e-3), abs=5e-7)
    assert (2 * pair.tip_a, -2 * pair.tip_b) == pytest.approx((54e-3, 69e-3))


@settings(deadline=None, max_examples=50)
@given(pair=internal_pairs(), shift=numbers(-0.1, 0.1))
def test_equal_and_opposite_shifts_leave_the_distance_as_it_is(pair, shift):
    rack, a, b = pair.gearing[:3]
    moved = gearing(rack, a._replace(shift=a.shift + shift), b._replace(shift=b.shift - shift))
    assert moved.center_distance == pytest.approx(pair.gearing.center_distance, rel=1e-9)
    assert moved.angle == pytest.approx(pair.working_angle, rel=1e-9)


@settings(deadline=None, max_examples=20)
@given(pair=internal_pairs())
def test_every_property_is_the_same_in_symbols(pair):
    for name in ("radius_a", "radius_b", "working_angle", "friction_factor", "friction_arm_a", "friction_arm_b"):
        expected = getattr(pair, name)
        assert by_symbols(pair, lambda symbolic, name=name: getattr(symbolic, name)) == pytest.approx(
            expected, rel=1e-12
        )
    assert by_symbols(pair, lambda symbolic: symbolic.contact_ratio()) == pytest.approx(pair.contact_ratio())
    for name in ("center_distance", "base_helix_angle", "thickness_a", "base_pitch"):
        expected = getattr(pair.gearing, name)
        assert by_symbols(pair, lambda symbolic, name=name: getattr(symbolic.gearing, name)) == pytest.approx(expected)


# -- a mesh with a ring -------------------------------------------------------------------------------


@settings(deadline=None, max_examples=100)
@given(pair=internal_pairs(), turn=numbers(-100, 100), carrier=numbers(-100, 100), force=magnitudes, flank=signs())
def test_sliding_friction_loses_what_the_teeth_slide(pair, turn, carrier, force, flank):
    """All four quadrants: the loss is friction times sliding speed, averaged over the path in the plane."""
    mesh = mesh_of(pair)
    speed = {"a": carrier + turn, "b": carrier - turn * pair.radius_a / pair.radius_b, "c": carrier}
    friction = math.copysign(0.1 * force, turn * pair.radius_a)
    torque = torques(mesh, flank * force, friction)
    loss = -sum(torque[shaft] * speed[shaft] for shaft in "abc")
    expected = 0.1 * force * abs(turn) * averages(plane(pair, flank)).slip
    assert expected >= 0
    assert loss == pytest.approx(expected, rel=1e-9, abs=1e-9 * (1 + force))


@settings(deadline=None, max_examples=50)
@given(pair=internal_pairs(), speed=speeds, friction=magnitudes)
def test_friction_by_conjugate_speed_never_creates_energy(pair, speed, friction):
    mesh = mesh_of(pair, stick_by="conjugate speed")
    slip = along(mesh.slip_per_shaft(), speed)
    torque = torques(mesh, 0.0, math.copysign(friction, slip))
    assert sum(torque[shaft] * speed[shaft] for shaft in "abc") <= 1e-9 * friction


@settings(deadline=None, max_examples=50)
@given(pair=internal_pairs(), speed=speeds, force=magnitudes, flank=signs())
def test_elastic_power_goes_into_the_deflection_alone(pair, speed, force, flank):
    mesh = mesh_of(pair)
    torque = torques(mesh, flank * force, 0.0)
    stored = flank * force * math.cos(pair.working_angle) * along(mesh.deflection_per_shaft(), speed)
    assert -sum(torque[shaft] * speed[shaft] for shaft in "abc") == pytest.approx(stored, rel=1e-9, abs=1e-6)


@settings(deadline=None, max_examples=100)
@given(pair=internal_pairs(), force=magnitudes, part=numbers(-0.2, 0.2), flank=signs())
def test_forces_and_torques_are_those_of_one_force_at_the_contact(pair, force, part, flank):
    """Normal force through the pitch point plus averaged friction, on true radii in the plane, for both wheels."""
    mesh, drawn = mesh_of(pair), plane(pair, flank)
    friction, rubbing = part * force, averages(drawn)
    push = force * drawn.normal
    torque, bearing = torques(mesh, flank * force, friction), mesh.bearing_force(flank * force, friction, flank)
    near = {"rel": 1e-9, "abs": 1e-9 * (1 + force)}
    assert tuple(bearing) == pytest.approx(tuple(push + friction * rubbing.force), **near)
    assert torque["a"] == pytest.approx(-moment(drawn.pitch_point, push) + friction * rubbing.torque_a, **near)
    arm_b = drawn.pitch_point - drawn.center_b
    assert torque["b"] == pytest.approx(moment(arm_b, push) + friction * rubbing.torque_b, **near)
    assert torque["a"] + torque["b"] + moment(drawn.center_b, np.array(bearing)) == pytest.approx(0, **near)
    assert sum(torque.values()) == pytest.approx(0, **near)


def moment(arm, force):
    return arm[0] * force[1] - arm[1] * force[0]


@settings(deadline=None, max_examples=20)
@given(pair=internal_pairs(), speed=speeds, force=magnitudes, part=numbers(-0.2, 0.2), flank=signs())
def test_a_ring_given_by_its_constants_is_the_ring(pair, speed, force, part, flank):
    given = mesh_of(
        GivenPair(
            radius_a=pair.radius_a,
            radius_b=pair.radius_b,
            friction_arm_a=pair.friction_arm_a,
            friction_arm_b=pair.friction_arm_b,
            friction_factor=pair.friction_factor,
            pressure_angle=pair.working_angle,
        )
    )
    mesh, load = mesh_of(pair), (flank * force, part * force)
    assert torques(given, *load) == torques(mesh, *load)
    assert given.bearing_force(*load, flank) == mesh.bearing_force(*load, flank)
    assert given.motion(speed, speed)[:-1] == mesh.motion(speed, speed)[:-1]


@settings(deadline=None, max_examples=50)
@given(pair=internal_pairs(), load=numbers(1.0, 1e4), flank=signs())
def test_a_loaded_flank_pushes_the_axes_together_and_the_teeth_apart(pair, load, flank):
    """Other than on external wheels: the center of the ring is on the far side of the wheel inside it."""
    force, drawn = mesh_of(pair).bearing_force(flank * load, 0.0, flank), plane(pair, flank)
    assert force.x == pytest.approx(load * math.sin(pair.working_angle))
    assert force.x * drawn.center_b[0] < 0


@settings(deadline=None, max_examples=50)
@given(pair=internal_pairs(), speed=speeds, load=magnitudes, part=numbers(-0.2, 0.2), flank=signs())
def test_turning_the_pair_round_is_the_same_physics(pair, speed, load, part, flank):
    mesh, normal, friction = mesh_of(pair), flank * load, part * load
    back = turned_round(pair.gearing)
    swapped = SimpleNamespace(
        radius_a=back.radius_a,
        radius_b=back.radius_b,
        working_angle=back.angle,
        friction_arm_a=pair.friction_arm_b,
        friction_arm_b=pair.friction_arm_a,
        friction_factor=-pair.friction_factor,
        sticks_by_mesh_speed=True,
    )
    turned = dataclasses.replace(mesh, a="b", b="a", pair=swapped)
    assert along(turned.deflection_per_shaft(), speed) == pytest.approx(along(mesh.deflection_per_shaft(), speed))
    assert along(turned.slip_per_shaft(), speed) == pytest.approx(-along(mesh.slip_per_shaft(), speed))
    assert torques(turned, normal, -friction) == pytest.approx(torques(mesh, normal, friction), abs=1e-9)


@pytest.mark.parametrize("stick_by", ["mesh speed", "conjugate speed"])
def test_a_mesh_that_turns_as_a_whole_neither_slips_nor_bends(stick_by):
    mesh, whole = mesh_of(RING, stick_by=stick_by), dict.fromkeys("abc", 7.0)
    assert along(mesh.deflection_per_shaft(), whole) == pytest.approx(0, abs=1e-12)
    assert along(mesh.slip_per_shaft(), whole) == pytest.approx(0, abs=1e-12)


def test_wheel_and_ring_turn_the_same_way():
    motion = mesh_of(RING).motion(FIXED_CARRIER, FIXED_CARRIER)
    assert motion.rate == pytest.approx(0, abs=1e-15)
    assert motion.speed == pytest.approx(30e-3)
    gear = Transmission(
        shafts={"wheel": Shaft(inertia=1e-4), "ring": Shaft(inertia=1e-3)},
        meshes={"only": Mesh(a="wheel", b="ring", pair=RING, elasticity=TEETH, friction=FRICTION)},
        input="wheel",
        output="ring",
    )
    assert gear.ratio() == pytest.approx(3.0)


def test_a_file_can_hold_a_ring():
    table = {
        "a": "planet",
        "b": "ring",
        "pair": {
            "type": "InternalPair",
            "teeth_a": 20,
            "teeth_b": 60,
            "module_mm": 1,
            "pressure_angle_deg": 20,
            "helix_angle_deg": 0,
            "tip_radius_a_mm": 11,
            "tip_radius_b_mm": 29.25,
        },
    }
    pair = converter().structure(table, Mesh).pair
    assert isinstance(pair, InternalPair)
    assert pair.friction_arm_b == pytest.approx(RING.friction_arm_b, rel=1e-12)


# -- errors -------------------------------------------------------------------------------------------


@settings(deadline=None, max_examples=100)
@given(
    teeth=st.tuples(st.integers(15, 80), st.integers(2, 20)),
    angle=numbers(17, 28),
    shifts=st.tuples(numbers(-0.2, 0.6), numbers(-0.6, 0.2)),
    addenda=st.tuples(numbers(0.7, 1.1), numbers(0.5, 0.9)),
)
def test_overlapping_tips_are_those_that_meet_when_both_are_turned(teeth, angle, shifts, addenda):
    count = teeth[0], -teeth[0] - teeth[1]
    parts = [Teeth(*part, None) for part in zip(count, shifts, addenda, strict=True)]
    rack = Rack(module=1e-3, pressure_angle=math.radians(angle), helix_angle=0.0)
    try:
        require_possible("pair", rack, *parts)
        clear = True
    except ValueError as error:
        if "overlap" not in str(error):
            return
        clear = False
    assert (tip_gap(gearing(rack, *parts)) > -1e-9) == clear


@pytest.mark.parametrize("teeth", [40, 60])
def test_full_teeth_at_20_degrees_need_a_difference_of_nine(teeth):
    """SDP/SI, "Elements of metric gear technology" (D785), section 5.2."""
    assert InternalPair(teeth_a=teeth, teeth_b=teeth + 9, module=1e-3).contact_ratio() > 1
    with pytest.raises(ValueError, match=f"and of the ring overlap .* difference of teeth than {teeth + 8}"):
        InternalPair(teeth_a=teeth, teeth_b=teeth + 8, module=1e-3)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"teeth_b": 20}, "more teeth on the ring than on the wheel inside it, got teeth_a=20 and teeth_b=20"),
        ({"teeth_b": 60.0}, "InternalPair.teeth_b must be a whole number of teeth >= 1, got 60.0"),
        (
            {"tip_radius_b": 29e-3},
            r"the tip of wheel b reaches 0\.03746 mm below the base tangent point of wheel a \(interference\); .*"
            "or a larger tip_radius_b",
        ),
        ({"addendum_b": 1.0}, r"reaches 0\.03746 mm below .* \(interference\); .* or a smaller addendum_b"),
        (
            {"tip_radius_b": 28e-3},
            "tip radius of wheel b, 28 mm, is inside its base circle of 28.19 mm, .* a larger tip",
        ),
        (
            {"tip_radius_b": 30.1e-3},
            "wheel b, 30.1 mm, does not reach .* of 30 mm; take a smaller tip_radius_b",
        ),
        (
            {"tip_radius_a": 9.9e-3},
            "wheel a, 9.9 mm, does not reach .* of 10 mm; take a larger tip_radius_a",
        ),
        ({"tip_radius_a": -11e-3}, "InternalPair.tip_radius_a must be > 0 m, got -0.011 m"),
        (
            {"addendum_a": 0.3, "addendum_b": 0.3},
            r"contact ratio >= 1 .* got 0\.\d+; take a larger addendum_a or a larger",
        ),
        (
            {"shift_b": 1.5},
            r"needs shift_a \+ shift_b <= 0\.7204 with 20 and 60 teeth, got 1\.5: .* below 10 deg",
        ),
        (
            {"teeth_a": 14, "addendum_b": 0.5},
            r"14 teeth .* undercut .* shift_a >= 0\.1812, got 0, or at least 17",
        ),
        (
            {"shift_a": 1.3, "shift_b": -1.3, "tip_radius_b": 29.5e-3},
            "wheel a are pointed, .* a smaller shift_a",
        ),
        ({"teeth_a": 59, "shift_a": 0.1, "shift_b": -0.1}, r"tips of wheel a and of the ring overlap by 0\.75 mm"),
        (
            {"teeth_a": 55, "addendum_b": 0.7},
            "tips of wheel a and of the ring overlap by .* difference of teeth than 60",
        ),
    ],
)
def test_rings_that_cannot_mesh_are_refused(changes, message):
    with pytest.raises(ValueError, match=message):
        InternalPair(**STANDARD | changes)


@settings(deadline=None, max_examples=200)
@given(
    st.fixed_dictionaries(
        {
            "teeth_a": st.integers(1, 200),
            "teeth_b": st.integers(1, 400),
            "module": numbers(1e-4, 1e-2),
            "pressure_angle": numbers(0.01, 0.78),
            "helix_angle": numbers(0, 1.5),
            "shift_a": numbers(-5, 5),
            "shift_b": numbers(-5, 5),
            "addendum_a": numbers(0.01, 5),
            "addendum_b": numbers(0.01, 5),
        },
        optional={"tip_radius_a": numbers(1e-4, 1.0), "tip_radius_b": numbers(1e-4, 1.0)},
    ),
    st.sampled_from((ExternalPair, InternalPair)),
)
def test_whatever_is_asked_for_is_a_pair_or_a_reason(values, kind):
    try:
        pair = kind(**values)
    except ValueError as error:
        assert str(error).startswith(kind.__name__)
    else:
        assert pair.contact_ratio() >= 1
