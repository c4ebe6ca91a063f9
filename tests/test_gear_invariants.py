"""What mechanics asks of every mesh: any teeth, external or of a ring, any law of friction and elasticity, any state.

Oracles: the second law (sliding friction only takes), action and reaction (moments about any point add to zero), the
conservation of elastic energy, and the mirror (every motion turned round turns every torque round).
"""

import math

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from oracles import gradient_in_symbols, numbers, signs
from tooth_oracles import cut_external_pairs, internal_pairs

from gear import (
    AtViscosity,
    Backlash,
    Coulomb,
    Din3990,
    EfficiencyPoint,
    FrictionPoint,
    FrictionTable,
    GivenPair,
    GivenViscosity,
    Harmonic,
    KnownOil,
    Linear,
    Mesh,
    OilAt,
    PeriodicFriction,
    PeriodicStiffness,
    ProgressiveISO,
    ProgressiveNiemann,
    Shaft,
    Stribeck,
    TabulatedEfficiency,
    Transmission,
)

OIL = OilAt(oil=KnownOil(name="Mobil Jet Oil II"), temperature=250.0)
STRIBECK = Stribeck(static=0.3, coulomb=0.1, stribeck_speed=0.01, viscous=0.05)
FRICTION = {
    "Coulomb": Coulomb(sliding=0.1, static=0.2),
    "DIN": Din3990(static=0.2, lubricant=OIL, roughness=0.8e-6, face_width=10e-3),
    "efficiency": TabulatedEfficiency(points=(EfficiencyPoint(speed=0.0, a_drives=0.9, b_drives=0.85),), breakout=1.2),
    "Stribeck": STRIBECK,
    "table": FrictionTable(
        points=(FrictionPoint(speed=0.0, coefficient=0.2), FrictionPoint(speed=0.5, coefficient=0.05)), static=0.25
    ),
    "other oil": AtViscosity(law=STRIBECK, lubricant=OIL, measured_with=GivenViscosity(viscosity=0.05)),
    "periodic": PeriodicFriction(law=STRIBECK, pitch=3e-3, harmonics=(Harmonic(cosine=0.3, sine=-0.2),)),
}
SPRING = Linear(stiffness=2e8, damping=2e4)
ELASTICITY = {
    "linear": SPRING,
    "ISO": ProgressiveISO(stiffness=2e8, roughness=1e-6, damping=2e4),
    "Niemann": ProgressiveNiemann(stiffness=2e8, nominal_force=300.0, damping=2e4),
    "backlash": Backlash(gap=15e-6, law=SPRING),
    "periodic": PeriodicStiffness(law=SPRING, pitch=3e-3, harmonics=(Harmonic(cosine=0.2),)),
}

every_friction = pytest.mark.parametrize("friction", FRICTION.values(), ids=FRICTION)
every_elasticity = pytest.mark.parametrize("elasticity", ELASTICITY.values(), ids=ELASTICITY)
few = settings(deadline=None, max_examples=25)
any_pairs = cut_external_pairs() | internal_pairs()
any_rule = st.sampled_from(("mesh speed", "conjugate speed"))
angles = st.fixed_dictionaries(dict.fromkeys("abc", numbers(-1e-3, 1e-3)))
speeds = st.fixed_dictionaries(dict.fromkeys("abc", numbers(-100, 100)))


def gear_of(pair, elasticity, friction, stick_by):
    """One mesh on a carrier; shafts so heavy that every mesh can stick."""
    try:
        mesh = Mesh(a="a", b="b", carrier="c", pair=pair, elasticity=elasticity, friction=friction, stick_by=stick_by)
        return Transmission(shafts=dict.fromkeys("abc", Shaft(inertia=1.0)), meshes={"m": mesh}, input="a", output="b")
    except ValueError as error:  # short teeth: an efficiency they cannot have, a mode that does not exist
        assert "cannot be reached" in str(error) or "cannot stick" in str(error)
        assume(False)
        raise


def normal_force(gear, angle, speed, flank):
    return gear.meshes["m"].law().force(gear.motions(angle, speed)["m"], flank)


def torques(mesh, normal, scalar):
    by_normal, by_friction = mesh.torque_per_normal(), mesh.torque_per_friction()
    return {shaft: float(normal * by_normal[shaft] + scalar * by_friction[shaft]) for shaft in "abc"}


def sliding_scalar(gear, angle, speed, normal):
    """The friction scalar of the mode that the motion has."""
    slip = sum(float(c) * speed[shaft] for shaft, c in gear.meshes["m"].slip_per_shaft().items())
    direction = math.copysign(1.0, slip)
    contact = ("meshes.m",)
    limits = gear.friction_limits(
        gear.motions(angle, speed),
        {"m": normal},
        dict.fromkeys(contact, abs(slip)),
        dict.fromkeys(contact, direction),
    )
    holding, sliding = (float(limit) for limit in limits["meshes.m"])
    assert 0 <= sliding and 0 <= holding
    return direction * sliding


@every_friction
@few
@given(pair=any_pairs, turn=numbers(-100, 100), carrier=numbers(-50, 50), force=numbers(-1e4, 1e4), rule=any_rule)
def test_friction_of_rolling_teeth_takes_energy_in_all_four_quadrants(friction, pair, turn, carrier, force, rule):  # noqa: PLR0913, PLR0917
    gear = gear_of(pair, SPRING, friction, rule)
    assume(abs(turn) > 1e-6)
    rolling = -turn * pair.radius_a / pair.radius_b
    speed = {"a": carrier + turn, "b": carrier + rolling, "c": carrier}
    scalar = sliding_scalar(gear, dict.fromkeys("abc", 0.0), speed, force)
    rubbing = torques(gear.meshes["m"], 0.0, scalar)
    power = sum(rubbing[shaft] * speed[shaft] for shaft in "abc")
    assert power <= 1e-9 * abs(force)


@every_friction
@few
@given(pair=any_pairs, speed=speeds, force=numbers(-1e4, 1e4))
def test_friction_by_conjugate_speed_takes_energy_whatever_moves(friction, pair, speed, force):
    gear = gear_of(pair, SPRING, friction, "conjugate speed")
    scalar = sliding_scalar(gear, dict.fromkeys("abc", 0.0), speed, force)
    rubbing = torques(gear.meshes["m"], 0.0, scalar)
    assert sum(rubbing[shaft] * speed[shaft] for shaft in "abc") <= 1e-9 * abs(force)


@every_elasticity
@few
@given(pair=any_pairs, angle=angles, speed=speeds, flank=signs(), share=numbers(-0.3, 0.3))
def test_forces_and_moments_balance(elasticity, pair, angle, speed, flank, share):  # noqa: PLR0913, PLR0917
    gear = gear_of(pair, elasticity, FRICTION["Coulomb"], "conjugate speed")
    mesh, normal = gear.meshes["m"], float(normal_force(gear, angle, speed, flank))
    side = math.copysign(1.0, normal)
    torque, bearing = torques(mesh, normal, share * normal), mesh.bearing_force(normal, share * normal, side)
    size = 1e-9 * (1 + abs(normal)) * abs(pair.radius_b)
    assert sum(torque.values()) == pytest.approx(0.0, abs=size)
    assert torque["a"] + torque["b"] + (pair.radius_a + pair.radius_b) * float(bearing.y) == pytest.approx(
        0.0, abs=size
    )
    pushed = mesh.bearing_force(normal, 0.0, side)
    assert float(pushed.x) == pytest.approx(abs(normal) * math.sin(pair.working_angle))  # from A towards the teeth of B


@every_elasticity
@few
@given(pair=any_pairs, angle=angles, flank=signs())
def test_elastic_torques_are_the_slope_of_the_stored_energy(elasticity, pair, angle, flank):
    """All shafts held but for what periodic stiffness, a forcing, does over the position."""
    gear = gear_of(pair, elasticity, None, "mesh speed")
    still = dict.fromkeys("abc", 0.0)
    motion = gear.motions(angle, still)["m"]
    law = gear.meshes["m"].law()
    assume(law.penetration(motion, flank) is None or float(law.penetration(motion, flank)) > 0)

    def stored(deflection):
        return math.cos(pair.working_angle) * law.stored(motion._replace(deflection=deflection), flank)

    slope = gradient_in_symbols(stored, motion.deflection).item()
    torque = torques(gear.meshes["m"], float(normal_force(gear, angle, still, flank)), 0.0)
    for shaft, per_angle in gear.meshes["m"].deflection_per_shaft().items():
        assert torque[shaft] == pytest.approx(-slope * float(per_angle), rel=1e-6, abs=1e-9)


@every_friction
@few
@given(pair=any_pairs, turn=numbers(0.01, 100), force=numbers(-1e4, 1e4), rule=any_rule)
def test_a_mirror_turns_every_torque_and_leaves_the_axes_pushed_alike(friction, pair, turn, force, rule):
    gear = gear_of(pair, SPRING, friction, rule)
    mesh, still = gear.meshes["m"], dict.fromkeys("abc", 0.0)
    speed = {"a": turn, "b": -turn * pair.radius_a / pair.radius_b, "c": 0.0}
    assume(force != 0)
    one, other = (
        (sign * force, sliding_scalar(gear, still, {s: sign * w for s, w in speed.items()}, sign * force))
        for sign in (1.0, -1.0)
    )
    assert torques(mesh, *other) == pytest.approx({s: -t for s, t in torques(mesh, *one).items()}, rel=1e-9)
    seen, mirrored = (mesh.bearing_force(*load, math.copysign(1.0, load[0])) for load in (one, other))
    assert tuple(map(float, mirrored)) == pytest.approx((float(seen.x), -float(seen.y)), rel=1e-9)


def test_a_law_inside_a_law_is_held_against_the_teeth_too():
    inside = AtViscosity(law=FRICTION["efficiency"], lubricant=OIL, measured_with=OIL)
    wrong = PeriodicFriction(law=inside, pitch=3e-3, harmonics=())
    climbing = GivenPair(radius_a=10e-3, radius_b=30e-3, friction_arm_a=1e-3, friction_arm_b=-3.2e-3)
    with pytest.raises(ValueError, match="TabulatedEfficiency.points.0..a_drives = 0.9 cannot be reached"):
        Mesh(a="a", b="b", pair=climbing, elasticity=SPRING, friction=wrong)
