"""Teeth followed one by one: against contacts placed in the plane, closed forms of averages, the mesh's constants."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from oracles import PAPER_PAIR, numbers
from scipy.integrate import quad
from tooth_oracles import RING, cut_pairs, plane, turned_round

from gear import Engagement, ExternalPair, InternalPair

SHARINGS = ("equal", "stiffness", "constant")
DEEP = ExternalPair(teeth_a=40, teeth_b=60, module=1e-3, addendum_a=1.35, addendum_b=1.35)  # contact ratio 2.28
EXAMPLES = (PAPER_PAIR, RING, DEEP)
FRICTION = ("friction_factor", "friction_arm_a", "friction_arm_b", "sliding")

every_sharing = pytest.mark.parametrize("sharing", SHARINGS)
example = pytest.mark.parametrize("pair", EXAMPLES, ids=["1.67", "ring", "2.28"])
positions = numbers(-0.1, 0.1)


@st.composite
def deep_pairs(draw):
    """Spur pairs with a contact ratio between two and three."""
    addendum = draw(numbers(1.25, 1.4))
    pair = ExternalPair(
        teeth_a=draw(st.integers(60, 100)),
        teeth_b=draw(st.integers(60, 100)),
        module=draw(numbers(1e-3, 5e-3)),
        addendum_a=addendum,
        addendum_b=addendum,
    )
    assume(2 < pair.contact_ratio() < 3)
    return pair


def any_pairs():
    return st.one_of(cut_pairs(spur=True), deep_pairs())


def contacts(pair, position):
    """Distances of all contacts from the pitch point, along the line of action in the direction of travel."""
    drawn, pitch = plane(pair), 2 * math.pi * pair.radius_a / pair.teeth_a
    reach = math.ceil(pair.contact_ratio()) + math.ceil(abs(position) / pitch) + 1
    places = (position + pitch * np.arange(-reach, reach + 1)) * math.cos(pair.working_angle)
    return places[(places > drawn.start) & (places < drawn.end)]


def shares(pair, places, sharing):
    """Part of the normal force on each contact."""
    if sharing == "constant":
        return np.full(len(places), 1 / pair.contact_ratio())
    stiffness = tooth_stiffness(pair, places) if sharing == "stiffness" else np.ones(len(places))
    return stiffness / stiffness.sum()


def tooth_stiffness(pair, places):
    drawn = plane(pair)
    along = (places - drawn.start) / (drawn.end - drawn.start)
    return 0.55 + 1.8 * along - 1.8 * along**2


def jumps(pair):
    """Positions over one pitch where a pair comes, passes the pitch point or goes."""
    drawn, pitch = plane(pair), pair.gearing.pitch
    return np.array([0.0, drawn.start, drawn.end]) / math.cos(pair.working_angle) % pitch


# -- against contacts placed in the plane -------------------------------------------------------------


@every_sharing
@settings(deadline=None, max_examples=100)
@given(pair=any_pairs(), position=positions)
def test_tables_are_the_sum_over_the_contacts_at_a_position(sharing, pair, position):
    pitch = pair.gearing.pitch
    assume(min(abs((position - jump + pitch / 2) % pitch - pitch / 2) for jump in jumps(pair)) > 1e-6 * pitch)
    engagement, drawn, places = Engagement(pair=pair, sharing=sharing), plane(pair), contacts(pair, position)
    unit, torque_a, torque_b, slip = drawn.friction(places)
    load = shares(pair, places, sharing)
    near = (
        {"rel": 1e-9, "abs": 1e-9 * pair.radius_a}
        if sharing != "stiffness"
        else {"rel": 1e-3, "abs": 1e-3 * pair.module}
    )
    assert engagement.at("pairs", position) == len(places)
    force = engagement.at("friction_factor", position) * np.array(
        [math.cos(pair.working_angle), -math.sin(pair.working_angle)]
    )
    assert force == pytest.approx(load @ unit, abs=1e-9 if sharing != "stiffness" else 1e-3)
    assert -engagement.at("friction_arm_a", position) == pytest.approx(load @ torque_a, **near)
    assert engagement.at("friction_arm_b", position) == pytest.approx(load @ torque_b, **near)
    assert engagement.at("sliding", position) == pytest.approx(load @ abs(slip) / pair.radius_a, rel=1e-3, abs=1e-3)


@every_sharing
@settings(deadline=None, max_examples=50)
@given(pair=any_pairs())
def test_at_every_position_moments_balance_and_friction_dissipates(sharing, pair):
    engagement, path = Engagement(pair=pair, sharing=sharing), pair.path()
    arm_a, arm_b = engagement["friction_arm_a"], engagement["friction_arm_b"]
    assert arm_b - arm_a == pytest.approx(path.length * engagement["friction_factor"], abs=1e-11 * abs(path.length))
    assert arm_a / pair.radius_a + arm_b / pair.radius_b == pytest.approx(engagement["sliding"], abs=1e-11)
    assert engagement["sliding"].min() >= 0


# -- averages -----------------------------------------------------------------------------------------


@settings(deadline=None, max_examples=100)
@given(pair=any_pairs())
def test_averages_of_a_constant_tooth_load_are_the_constants_of_the_pair(pair):
    engagement = Engagement(pair=pair, sharing="constant")
    assert engagement.mean("friction_factor") == pytest.approx(pair.friction_factor, rel=1e-10, abs=1e-10)
    assert engagement.mean("friction_arm_a") == pytest.approx(pair.friction_arm_a, rel=1e-10, abs=1e-10 * pair.module)
    assert engagement.mean("friction_arm_b") == pytest.approx(pair.friction_arm_b, rel=1e-10, abs=1e-10 * pair.module)
    loss = pair.friction_arm_a / pair.radius_a + pair.friction_arm_b / pair.radius_b
    assert engagement.mean("sliding") == pytest.approx(loss, rel=1e-10)
    assert [engagement.constant(name) for name in FRICTION] == pytest.approx(
        [pair.friction_factor, pair.friction_arm_a, pair.friction_arm_b, loss], rel=1e-12
    )


@every_sharing
@settings(deadline=None, max_examples=50)
@given(pair=any_pairs())
def test_pairs_and_stiffness_have_the_averages_of_every_sharing(sharing, pair):
    engagement = Engagement(pair=pair, sharing=sharing)
    assert engagement.mean("pairs") == pytest.approx(pair.contact_ratio(), rel=1e-10)
    assert engagement.mean("stiffness") == pytest.approx(1, rel=1e-10)
    assert engagement.constant("pairs") == pair.contact_ratio()
    distance, load = engagement.tooth_load()
    assert np.trapezoid(load, distance) == pytest.approx(pair.gearing.base_pitch, rel=1e-4)


@settings(deadline=None, max_examples=50)
@given(pair=any_pairs())
def test_averages_of_equal_sharing_are_integrals_over_the_parts_of_the_path(pair):
    """Van der Linden, eq. (17) and figure 6: cut where another pair comes or goes, and at the pitch point."""
    path, base_pitch, ratio = pair.path(), pair.gearing.base_pitch, pair.contact_ratio()
    steps = np.arange(math.ceil(ratio)) * base_pitch
    edges = np.unique(
        np.clip([*(path.start + steps), *(path.end - steps), path.pitch, path.start, path.end], *path[2:])
    )
    factor = arm_a = arm_b = 0.0
    for low, high in zip(edges, edges[1:], strict=False):
        middle = (low + high) / 2
        count = math.floor((path.end - middle) / base_pitch) + math.floor((middle - path.start) / base_pitch) + 1
        part = math.copysign((high - low) / count / base_pitch, path.pitch - middle)
        factor, arm_a, arm_b = factor + part, arm_a - part * middle, arm_b + part * (path.length - middle)
    engagement = Engagement(pair=pair)
    assert engagement.mean("friction_factor") == pytest.approx(factor, rel=1e-9, abs=1e-9)
    assert engagement.mean("friction_arm_a") == pytest.approx(arm_a, rel=1e-9, abs=1e-9 * pair.radius_a)
    assert engagement.mean("friction_arm_b") == pytest.approx(arm_b, rel=1e-9, abs=1e-9 * abs(pair.radius_b))


@example
def test_averages_of_stiffness_sharing_are_integrals_along_the_path(pair):
    engagement, drawn, base_pitch = Engagement(pair=pair, sharing="stiffness"), plane(pair), pair.gearing.base_pitch

    def slip(place):
        places = contacts(pair, place / math.cos(pair.working_angle))
        return abs(place) * tooth_stiffness(pair, np.array([place]))[0] / tooth_stiffness(pair, places).sum()

    edges = sorted(
        {drawn.start, 0.0, drawn.end}
        | {
            e
            for k in (1, 2)
            for e in (drawn.start + k * base_pitch, drawn.end - k * base_pitch)
            if drawn.start < e < drawn.end
        }
    )
    total = sum(quad(slip, low, high, epsrel=1e-12)[0] for low, high in zip(edges, edges[1:], strict=False))
    expected = total / base_pitch * (1 / pair.radius_a + 1 / pair.radius_b)
    assert engagement.mean("sliding") == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(
    ("pair", "sharing", "loss"),
    [
        (PAPER_PAIR, "constant", 0.165176),
        (PAPER_PAIR, "equal", 0.143958),
        (PAPER_PAIR, "stiffness", 0.135927),
        (DEEP, "constant", 0.140582),
        (DEEP, "equal", 0.136389),
        (DEEP, "stiffness", 0.126716),
        (RING, "constant", 0.079400),
        (RING, "equal", 0.067771),
        (RING, "stiffness", 0.064466),
    ],
)
def test_teeth_lose_less_where_the_ends_of_the_path_carry_less(pair, sharing, loss):
    """Friction power per friction force and mesh speed; the first of each three is what the constants say."""
    assert Engagement(pair=pair, sharing=sharing).mean("sliding") == pytest.approx(loss, abs=5e-7)


# -- shape of the tables ------------------------------------------------------------------------------


@settings(deadline=None, max_examples=50)
@given(pair=any_pairs())
def test_loads_of_equal_and_stiffness_sharing_add_to_one(pair):
    for sharing in ("equal", "stiffness"):
        for piece in Engagement(pair=pair, sharing=sharing).pieces:
            assert piece.load.sum(axis=0) == pytest.approx(np.ones(len(piece.position)), rel=1e-12)


def test_one_pair_carries_alone_between_x1_and_x2():
    """Van der Linden, figure 6, contact ratio between 1 and 2."""
    path, base_pitch = PAPER_PAIR.path(), PAPER_PAIR.gearing.base_pitch
    distance, load = Engagement(pair=PAPER_PAIR).tooth_load()
    alone = (distance > path.end - base_pitch) & (distance < path.start + base_pitch)
    edge = np.isclose(distance, path.end - base_pitch) | np.isclose(distance, path.start + base_pitch)
    assert set(load[alone & ~edge]) == {1.0}
    assert set(load[~alone & ~edge]) == {0.5}
    assert (distance[0], distance[-1]) == pytest.approx((path.start, path.end))


def test_two_and_three_pairs_share_a_contact_ratio_above_two():
    """Van der Linden, figure 6, contact ratio between 2 and 3: three at the ends and in the middle, two between."""
    path, base_pitch = DEEP.path(), DEEP.gearing.base_pitch
    distance, load = Engagement(pair=DEEP).tooth_load()
    edges = [path.end - 2 * base_pitch, path.start + base_pitch, path.end - base_pitch, path.start + 2 * base_pitch]
    zone = np.searchsorted(edges, distance)
    inside = np.min(np.abs(np.subtract.outer(edges, distance)), axis=0) > 1e-9
    for k, count in enumerate((3, 2, 3, 2, 3)):
        assert load[inside & (zone == k)] == pytest.approx(1 / count)


@every_sharing
@example
def test_tables_repeat_with_every_tooth(sharing, pair):
    engagement, pitch = Engagement(pair=pair, sharing=sharing), 2 * math.pi * pair.radius_a / pair.teeth_a
    places = np.linspace(0.01, 0.99, 50) * pitch
    for name in ("pairs", *FRICTION, "stiffness"):
        assert engagement.at(name, places + 7 * pitch) == pytest.approx(engagement.at(name, places), abs=1e-9)
        assert engagement.at(name, places - 3 * pitch) == pytest.approx(engagement.at(name, places), abs=1e-9)
    assert (engagement["position"][0], engagement["position"][-1]) == pytest.approx((0.0, pitch))
    assert (np.diff(engagement["position"]) >= 0).all()


@every_sharing
@settings(deadline=None, max_examples=50)
@given(pair=cut_pairs(spur=True), position=positions, flank=st.sampled_from((1, -1)))
def test_the_other_wheel_sees_the_same_contacts_from_its_side(sharing, pair, position, flank):
    """With A and B exchanged every feed changes its sign; on both flanks the contacts must be the same ones."""
    if isinstance(pair, InternalPair):
        return  # a pair whose wheel A is the ring cannot be made
    swapped = dataclasses.replace(
        pair,
        **{
            f"{name}_{a}": getattr(pair, f"{name}_{b}")
            for name in ("teeth", "shift", "addendum", "tip_radius")
            for a, b in ("ab", "ba")
        },
    )
    pitch = pair.gearing.pitch
    place = position if flank > 0 else pair.gearing.thickness_a - position
    assume(min(abs((place - jump + pitch / 2) % pitch - pitch / 2) for jump in jumps(pair)) > 1e-6 * pitch)
    here, there = Engagement(pair=pair, sharing=sharing), Engagement(pair=swapped, sharing=sharing)
    near = {"rel": 1e-4, "abs": 1e-4 * pair.module}
    assert there.at("pairs", -position, flank) == here.at("pairs", position, flank)
    assert there.at("friction_arm_a", -position, flank) == pytest.approx(
        here.at("friction_arm_b", position, flank), **near
    )
    assert there.at("friction_factor", -position, flank) == pytest.approx(
        -here.at("friction_factor", position, flank), abs=1e-4
    )
    assert there.at("stiffness", -position, flank) == pytest.approx(here.at("stiffness", position, flank), rel=1e-3)


def test_the_other_flank_comes_to_the_pitch_point_one_tooth_later():
    """One tooth thickness of A, which a profile shift of 0.3 makes pi/2 + 0.6 tan(20 degrees) modules."""
    pair = ExternalPair(teeth_a=20, teeth_b=60, module=1e-3, shift_a=0.3, shift_b=-0.3)
    thickness = 1e-3 * (math.pi / 2 + 0.6 * math.tan(math.radians(20)))
    step, engagement = np.array([1e-5, 1e-4, 2e-4]), Engagement(pair=pair)
    assert engagement.at("sliding", thickness, flank=-1) == pytest.approx(0, abs=1e-12)
    for name in (*FRICTION, "pairs"):
        before, after = engagement.at(name, step), engagement.at(name, -step)
        assert engagement.at(name, thickness - step, flank=-1) == pytest.approx(before, abs=1e-12)
        assert engagement.at(name, thickness + step, flank=-1) == pytest.approx(after, abs=1e-12)


def test_teeth_of_wheel_and_ring_leave_no_backlash_for_the_other_flank():
    assert RING.gearing.thickness_a + turned_round(RING.gearing).thickness_a == pytest.approx(RING.gearing.pitch)


@example
def test_stiffness_follows_the_number_of_pairs_or_their_parabolas(pair):
    equal, parabolas = Engagement(pair=pair), Engagement(pair=pair, sharing="stiffness")
    assert equal["stiffness"] == pytest.approx(equal["pairs"] / pair.contact_ratio())
    for place in np.linspace(0.013, 0.987, 40) * pair.gearing.pitch:
        total = tooth_stiffness(pair, contacts(pair, place)).sum()
        assert parabolas.at("stiffness", place) == pytest.approx(total / (0.85 * pair.contact_ratio()), rel=1e-3)


@every_sharing
@example
def test_harmonics_are_those_of_the_table(sharing, pair):
    engagement, pitch = Engagement(pair=pair, sharing=sharing), pair.gearing.pitch
    edges = np.unique([0.0, *jumps(pair), pitch])
    for k, amplitudes in enumerate(engagement.harmonics("sliding", 5), start=1):
        for wave, amplitude in zip((math.cos, math.sin), amplitudes, strict=True):
            total = sum(
                quad(lambda x, k=k, wave=wave: engagement.at("sliding", x) * wave(2 * math.pi * k * x / pitch), *ends)[
                    0
                ]
                for ends in zip(edges, edges[1:], strict=False)
            )
            assert amplitude == pytest.approx(2 * total / pitch / engagement.mean("sliding"), abs=1e-4)


# -- tables as data and as a picture ------------------------------------------------------------------


def test_the_data_set_has_units_and_says_how_load_is_shared():
    data = Engagement(pair=PAPER_PAIR, sharing="stiffness").to_xarray()
    assert set(data.data_vars) == {"pairs", *FRICTION, "stiffness"}
    assert data.position.attrs["units"] == data.friction_arm_a.attrs["units"] == "m"
    assert data.sliding.attrs["units"] == "1"
    assert data.attrs == {"sharing": "stiffness", "contact_ratio": PAPER_PAIR.contact_ratio()}


@every_sharing
@example
def test_the_picture_shows_load_stiffness_friction_and_arms(sharing, pair):
    figure = Engagement(pair=pair, sharing=sharing).plot()
    figure.canvas.draw()
    assert len(figure.axes) == 4
    assert all(axes.get_xlabel() and axes.get_ylabel() and axes.lines for axes in figure.axes)


# -- errors -------------------------------------------------------------------------------------------


def test_helical_teeth_are_refused():
    helical = dataclasses.replace(PAPER_PAIR, helix_angle=0.3)
    with pytest.raises(ValueError, match="needs spur teeth, got helix_angle = 0.3 rad; .* averaged constants"):
        Engagement(pair=helical)


def test_an_unknown_sharing_is_refused():
    with pytest.raises(ValueError, match="sharing must be one of 'equal', 'stiffness', 'constant', got 'half'"):
        Engagement(pair=PAPER_PAIR, sharing="half")


def test_more_harmonics_than_the_tables_resolve_are_refused():
    with pytest.raises(ValueError, match="count must be between 0 and 20, got 21"):
        Engagement(pair=PAPER_PAIR).harmonics("stiffness", 21)
    with pytest.raises(ValueError, match="over the mean of pairs, sliding, stiffness, got 'friction_factor'"):
        Engagement(pair=PAPER_PAIR).harmonics("friction_factor", 2)


def test_an_unknown_table_is_refused():
    with pytest.raises(KeyError, match="no table named 'arm'; there are position, pairs, friction_factor"):
        Engagement(pair=PAPER_PAIR)["arm"]
