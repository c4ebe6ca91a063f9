"""A mesh against the invariants that mechanics asks of it: energy, moments, symmetry; friction by integration."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import PAPER_PAIR, averaged_friction, external_pairs, gradient_in_symbols, numbers, signs

from gear import Coulomb, GivenPair, Linear, Mesh

RULES = ("mesh speed", "conjugate speed")
TEETH = Linear(stiffness=2e8, damping=0.0)
FRICTION = Coulomb(sliding=0.1, static=0.2)


def mesh_of(pair, carrier="c", stick_by="mesh speed"):
    return Mesh(a="a", b="b", carrier=carrier, pair=pair, elasticity=TEETH, friction=FRICTION, stick_by=stick_by)


def torques(mesh, normal, friction):
    """Torque on each shaft from normal force and friction scalar."""
    by_normal, by_friction = mesh.torque_per_normal(), mesh.torque_per_friction()
    return {shaft: normal * by_normal[shaft] + friction * by_friction[shaft] for shaft in by_normal}


def power(torque, speed):
    return sum(torque[shaft] * speed[shaft] for shaft in torque)


def along(per_shaft, motion):
    return sum(factor * motion[shaft] for shaft, factor in per_shaft.items())


meshes = st.builds(mesh_of, external_pairs(), st.sampled_from(("c", None)), st.sampled_from(RULES))
forces, magnitudes = numbers(-1e4, 1e4), numbers(0, 1e4)
angles = st.fixed_dictionaries(dict.fromkeys("abc", numbers(-3, 3)))
speeds = st.fixed_dictionaries(dict.fromkeys("abc", numbers(-100, 100)))

# -- invariants: energy -------------------------------------------------------------------------------


@settings(deadline=None, max_examples=50)
@given(mesh=meshes, speed=speeds, force=magnitudes, flank=signs())
def test_sliding_friction_never_creates_energy_while_the_teeth_roll_together(mesh, speed, force, flank):
    """All four quadrants: the deflection does not change, friction opposes mesh speed."""
    carrier = speed["c"] if mesh.carrier else 0.0
    speed |= {"b": carrier - mesh.pair.radius_a / mesh.pair.radius_b * (speed["a"] - carrier)}
    v = mesh.pair.radius_a * (speed["a"] - carrier)
    friction = math.copysign(0.1 * force, v)
    loss = -power(torques(mesh, 0.0, friction), speed)
    assert loss >= -1e-12 * force
    slipping = abs(v) * averaged_sliding(mesh.pair)
    assert loss == pytest.approx(0.1 * force * slipping, rel=1e-9, abs=1e-9)
    assert power(torques(mesh, flank * force, 0.0), speed) == pytest.approx(0, abs=1e-7)


def averaged_sliding(pair):
    """Mean sliding speed along the path of contact per mesh speed: linear in the distance from the pitch point."""
    path = pair.path()
    before, behind = path.pitch - path.start, path.end - path.pitch
    return (1 / pair.radius_a + 1 / pair.radius_b) * (before**2 + behind**2) / (2 * (before + behind))


@settings(deadline=None, max_examples=50)
@given(pair=external_pairs(), speed=speeds, friction=magnitudes)
def test_friction_by_conjugate_speed_never_creates_energy(pair, speed, friction):
    mesh = mesh_of(pair, stick_by="conjugate speed")
    slip = along(mesh.slip_per_shaft(), speed)
    loss = -power(torques(mesh, 0.0, math.copysign(friction, slip)), speed)
    assert loss == pytest.approx(friction * abs(slip), rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("arms", [(1e-3, 2e-3), (-1e-3, 2e-3), (1e-3, -2e-3)])
def test_conjugate_speed_is_passive_with_any_arms(arms):
    pair = GivenPair(radius_a=10e-3, radius_b=30e-3, friction_arm_a=arms[0], friction_arm_b=arms[1])
    mesh = mesh_of(pair, stick_by="conjugate speed")
    for speed in ({"a": 3.0, "b": 1.0, "c": 0.5}, {"a": -3.0, "b": 2.0, "c": 0.5}):
        friction = math.copysign(1.0, along(mesh.slip_per_shaft(), speed))
        assert power(torques(mesh, 0.0, friction), speed) <= 0


@settings(deadline=None, max_examples=50)
@given(mesh=meshes, speed=speeds, normal=forces)
def test_elastic_power_goes_into_the_deflection_alone(mesh, speed, normal):
    """-(T_A phi_A' + T_B phi_B' + T_G phi_G') = F_n cos(alpha) delta'."""
    rate = along(mesh.deflection_per_shaft(), speed)
    stored = normal * math.cos(mesh.pair.pressure_angle) * rate
    assert -power(torques(mesh, normal, 0.0), speed) == pytest.approx(stored, rel=1e-9, abs=1e-6)


# -- invariants: forces and moments -------------------------------------------------------------------


@settings(deadline=None, max_examples=50)
@given(pair=external_pairs(), load=magnitudes, flank=signs())
def test_a_loaded_flank_pushes_the_axes_apart(pair, load, flank):
    apart = mesh_of(pair).bearing_force(flank * load, 0.0, flank).x
    assert apart == pytest.approx(load * math.sin(pair.pressure_angle))


@settings(deadline=None, max_examples=50)
@given(mesh=meshes, load=magnitudes, part=numbers(-0.2, 0.2), flank=signs())
def test_torques_balance_the_moment_of_the_bearing_force(mesh, load, part, flank):
    normal, friction = flank * load, part * load
    torque = torques(mesh, normal, friction)
    sideways = mesh.bearing_force(normal, friction, flank).y
    distance = mesh.pair.radius_a + mesh.pair.radius_b
    assert torque["a"] + torque["b"] + distance * sideways == pytest.approx(0, abs=1e-10 * (1 + load * distance))


@settings(deadline=None, max_examples=50)
@given(pair=external_pairs(), normal=forces, friction=forces)
def test_torques_on_wheels_and_carrier_add_to_zero(pair, normal, friction):
    torque = torques(mesh_of(pair), normal, friction)
    assert torque["c"] == pytest.approx(-(torque["a"] + torque["b"]))
    assert set(torques(mesh_of(pair, carrier=None), normal, friction)) == {"a", "b"}


@pytest.mark.parametrize("flank", [1.0, -1.0])
@settings(deadline=None, max_examples=50)
@given(pair=external_pairs(), friction=forces)
def test_friction_loads_are_those_integrated_along_the_path(flank, pair, friction):
    mesh, averages = mesh_of(pair), averaged_friction(pair, flank)
    torque = torques(mesh, 0.0, friction)
    near = {"rel": 1e-9, "abs": 1e-9 * (1 + abs(friction)) * pair.radius_a}
    assert torque["a"] == pytest.approx(friction * averages.torque_a, **near)
    assert torque["b"] == pytest.approx(friction * averages.torque_b, **near)
    bearing = np.array(mesh.bearing_force(0.0, friction, flank))
    assert bearing == pytest.approx(friction * averages.force, rel=1e-9, abs=1e-9)


# -- invariants: symmetry -----------------------------------------------------------------------------


@settings(deadline=None, max_examples=50)
@given(pair=external_pairs(), speed=speeds, load=magnitudes, part=numbers(-0.2, 0.2), flank=signs())
def test_turning_the_pair_round_is_the_same_physics(pair, speed, load, part, flank):
    mesh = mesh_of(pair)
    round_pair = dataclasses.replace(
        pair, teeth_a=pair.teeth_b, teeth_b=pair.teeth_a, addendum_a=pair.addendum_b, addendum_b=pair.addendum_a
    )
    turned = dataclasses.replace(mesh, a="b", b="a", pair=round_pair)
    normal, friction = flank * load, part * load
    assert along(turned.deflection_per_shaft(), speed) == pytest.approx(along(mesh.deflection_per_shaft(), speed))
    assert along(turned.slip_per_shaft(), speed) == pytest.approx(-along(mesh.slip_per_shaft(), speed))
    assert torques(turned, normal, -friction) == pytest.approx(torques(mesh, normal, friction), abs=1e-9)
    assert turned.bearing_force(normal, -friction, flank) == pytest.approx(
        mesh.bearing_force(normal, friction, flank), rel=1e-9, abs=1e-9 * (1 + load)
    )


@settings(deadline=None, max_examples=50)
@given(pair=external_pairs(), load=magnitudes, part=numbers(-0.2, 0.2), flank=signs())
def test_a_mirror_turns_every_torque_and_leaves_the_axes_pushed_apart(pair, load, part, flank):
    mesh, normal, friction = mesh_of(pair), flank * load, part * load
    seen, mirrored = mesh.bearing_force(normal, friction, flank), mesh.bearing_force(-normal, -friction, -flank)
    assert mirrored == pytest.approx((seen.x, -seen.y))


# -- kinematics ---------------------------------------------------------------------------------------


@settings(deadline=None, max_examples=50)
@given(mesh=meshes, angle=angles, speed=speeds)
def test_motion_of_the_mesh_is_that_of_the_wheels_relative_to_the_carrier(mesh, angle, speed):
    motion, pair = mesh.motion(angle, speed), mesh.pair
    turn, spin = (angle["c"], speed["c"]) if mesh.carrier else (0.0, 0.0)
    x_a, x_b = pair.radius_a * (angle["a"] - turn), -pair.radius_b * (angle["b"] - turn)
    v_a, v_b = pair.radius_a * (speed["a"] - spin), -pair.radius_b * (speed["b"] - spin)
    assert motion.deflection == pytest.approx(x_a - x_b, abs=1e-9)
    assert motion.position == pytest.approx((x_a + x_b) / 2, abs=1e-9)
    assert motion.rate == pytest.approx(v_a - v_b, abs=1e-9)
    assert motion.speed == pytest.approx((v_a + v_b) / 2, abs=1e-9)
    assert motion.rate == pytest.approx(along(mesh.deflection_per_shaft(), speed), abs=1e-9)
    if mesh.stick_by == "mesh speed":
        assert motion.speed == pytest.approx(along(mesh.slip_per_shaft(), speed), abs=1e-9)


@settings(deadline=None, max_examples=20)
@given(pair=external_pairs(), turn=numbers(-10, 10), stick_by=st.sampled_from(RULES))
def test_a_mesh_that_turns_as_a_whole_neither_slips_nor_bends(pair, turn, stick_by):
    mesh, whole = mesh_of(pair, stick_by=stick_by), dict.fromkeys("abc", turn)
    assert along(mesh.deflection_per_shaft(), whole) == pytest.approx(0, abs=1e-12)
    assert along(mesh.slip_per_shaft(), whole) == pytest.approx(0, abs=1e-12)


@settings(deadline=None, max_examples=20)
@given(mesh=meshes, angle=angles, speed=speeds)
def test_rates_of_the_motion_are_its_time_derivatives(mesh, angle, speed):
    shafts = tuple("abc")

    def part(name):
        return lambda *turned: getattr(mesh.motion(dict(zip(shafts, turned, strict=True)), speed), name)

    motion, spins = mesh.motion(angle, speed), [speed[shaft] for shaft in shafts]
    for value, rate in (("deflection", "rate"), ("position", "speed"), ("turn_a", "speed_a"), ("turn_b", "speed_b")):
        slopes = gradient_in_symbols(part(value), *(angle[shaft] for shaft in shafts))
        assert slopes @ spins == pytest.approx(getattr(motion, rate), abs=1e-9)


# -- closed forms -------------------------------------------------------------------------------------


def test_normal_force_turns_the_wheels_on_their_base_circles():
    """Van der Linden, eqs. (1), (2): 1 kN on base radii of 10 and 30 mm times cos 20 degrees."""
    torque = torques(mesh_of(PAPER_PAIR), 1000.0, 0.0)
    assert torque == pytest.approx({"a": -9.396926, "b": -28.190779, "c": 37.587705})


def test_friction_turns_the_wheels_on_their_averaged_arms():
    """Van der Linden, eqs. (27), (30): 100 N of friction scalar on arms of 1.0056 and 1.9385 mm."""
    torque = torques(mesh_of(PAPER_PAIR, carrier=None), 0.0, 100.0)
    assert torque == pytest.approx({"a": -0.10056, "b": 0.19385}, abs=1e-5)


# -- errors -------------------------------------------------------------------------------------------

WITHOUT_ARMS = GivenPair(radius_a=10e-3, radius_b=30e-3, friction_arm_a=0.0, friction_arm_b=0.0)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"b": "a"}, "Mesh needs three different shafts, got a='a', b='a', carrier=None"),
        ({"carrier": "a"}, "Mesh needs three different shafts, got a='a', b='b', carrier='a'"),
        ({"carrier": "b"}, "Mesh needs three different shafts, got a='a', b='b', carrier='b'"),
        ({"count": 0}, "Mesh.count must be a whole number >= 1, got 0"),
        ({"count": 2.0}, "Mesh.count must be a whole number >= 1, got 2.0"),
        ({"pair": WITHOUT_ARMS}, "Mesh.friction cannot act: with friction arms of 0 m and 0 m its pair does not slide"),
        (
            {"stick_by": "sliding speed"},
            """Mesh.stick_by must be "mesh speed" or "conjugate speed", got 'sliding speed'""",
        ),
    ],
)
def test_meshes_that_cannot_be_are_refused(changes, message):
    with pytest.raises(ValueError, match=message):
        dataclasses.replace(mesh_of(PAPER_PAIR, carrier=None), **changes)


def test_a_pair_without_friction_arms_can_be_had_without_friction():
    mesh = dataclasses.replace(mesh_of(PAPER_PAIR, carrier=None), pair=WITHOUT_ARMS, friction=None)
    assert torques(mesh, 0.0, 100.0) == {"a": 0.0, "b": 0.0}


def test_equal_meshes_may_be_counted_by_numpy():
    assert dataclasses.replace(mesh_of(PAPER_PAIR), count=np.int64(3)).count == 3
