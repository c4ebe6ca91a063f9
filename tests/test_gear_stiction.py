"""The joint decision against enumeration of all 3^n combinations, linear programming, and shafts counted by hand."""

import functools
import itertools

import casadi as ca
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from oracles import numbers
from random_trains import draw_problem, needed_part, worst_violation

from gear.stiction.decision import BACKWARD, FORWARD, STUCK, RestProblem, decide
from gear.stiction.friction import friction
from gear.teeth.geometry import ExternalPair

NEAR = 1e-9  # rounding left by the solutions of well-conditioned problems of this size
ELSEWHERE = None  # entry of a combination for a contact that is not at rest

# -- oracles ------------------------------------------------------------------------------------------


class Problem(RestProblem):
    """A RestProblem that knows its compliance G = S M^-1 T' and demand S M^-1 f."""

    @property
    def compliance(self):
        return self.slip @ np.linalg.solve(self.inertia, self.torque.T)

    @property
    def demand(self):
        return self.slip @ np.linalg.solve(self.inertia, self.load)


def rest_problem(inertia, load, slip, torque, static, sliding=None, **others):
    """A problem of arrays; by default sliding = static, and all contacts are at rest, none just released."""
    onset = static if sliding is None else sliding
    count = len(static)
    fields = {
        "static": static,
        "forward": onset,
        "backward": onset,
        "rest": np.ones(count),
        "released": np.zeros(count),
    }
    values = (fields | others).values()
    return Problem(*(np.array(value, float) for value in (inertia, load, slip, torque, *values)))


def abstract_problem(compliance, demand, static, sliding=None, given=None, **others):
    """A problem given by its compliance and demand, as of shafts of inertia one that each contact has for itself."""
    compliance, one = np.array(compliance, float), np.eye(len(static))
    rest = np.array(others.get("rest", np.ones(len(static))))
    load = np.array(demand) - compliance @ (np.zeros(len(static)) if given is None else np.where(rest, 0, given))
    return rest_problem(one, load, one, compliance.T, static, sliding, **others)


def onset(problem, direction):
    """Friction at the onset of sliding in the directions given, with their sign."""
    return np.where(direction > 0, problem.forward, -problem.backward) * abs(np.sign(direction))


def decided(problem):
    """Motions of the contacts, after asking that there is no fault."""
    decision = decide(problem)
    assert decision.fault == 0
    return decision.motion


@functools.cache
def _friction_function(count):
    inputs = [ca.SX.sym("compliance", count, count), *(ca.SX.sym(f"v{k}", count) for k in range(3))]
    return ca.Function("friction", inputs, [friction(*inputs, redundant=True)])


def shared_friction(problem, motion):
    """Friction scalars of a redundant group, as a run takes them: sliding, or whatever holds."""
    held = (motion == STUCK).astype(float)
    found = _friction_function(len(motion))(problem.compliance, problem.demand, held, onset(problem, motion))
    return np.array(found).ravel()


def is_consistent(problem, combination):
    """Whether held contacts stay within their limit and slipping ones accelerate in their own direction."""
    states = np.array([np.nan if state is ELSEWHERE else state for state in combination])
    held, slips = states == 0, abs(states) == 1
    force = np.where(slips, onset(problem, states), 0)
    if held.any():
        left = (problem.demand - problem.compliance @ force)[held]
        force[held] = np.linalg.solve(problem.compliance[np.ix_(held, held)], left)
    upper, lower = (np.where(problem.released, slid, problem.static) for slid in (problem.forward, problem.backward))
    inside = (force <= upper + NEAR) & (force >= -lower - NEAR)
    acceleration = problem.demand - problem.compliance @ force
    return bool(inside[held].all() and (acceleration[slips] * states[slips] >= -NEAR).all())


def consistent_combinations(problem):
    choices = [(0, 1, -1) if rest else (ELSEWHERE,) for rest in problem.rest]
    return [combination for combination in itertools.product(*choices) if is_consistent(problem, combination)]


# -- problems -----------------------------------------------------------------------------------------


@st.composite
def well_posed(draw):
    """Problems with one to four contacts whose compliance, symmetric or not, is positive definite (so a P-matrix)."""
    count = draw(st.integers(1, 4))
    matrix = arrays(float, (count, count), elements=numbers(-2.0, 2.0))
    vector = arrays(float, count, elements=numbers(-3.0, 3.0))
    mostly, seldom = (
        arrays(float, count, elements=st.sampled_from(choice)) for choice in ((1.0, 1.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    )
    root, other = draw(matrix), draw(matrix)
    static, rest = abs(draw(vector)), draw(mostly)
    return abstract_problem(
        compliance=root @ root.T + 0.3 * np.eye(count) + (other - other.T) / 2,
        demand=draw(vector),
        static=static,
        forward=draw(numbers(0.1, 1.0)) * static,
        backward=draw(numbers(0.1, 1.0)) * static,
        rest=rest,
        given=draw(vector),
        released=rest * draw(seldom),
    )


@st.composite
def trains(draw):
    """Stages of gears with a bearing on every shaft: n shafts, n - 1 meshes, more contacts than shafts."""
    count = draw(st.integers(2, 4))
    inertia = np.array([10 ** draw(numbers(-5.0, -3.0)) for _ in range(count)])
    slips, torques = list(np.eye(count)), list(np.eye(count))
    for k in range(count - 1):
        pair = ExternalPair(teeth_a=draw(st.integers(17, 30)), teeth_b=draw(st.integers(30, 60)), module=1e-3)
        slips.append(np.zeros(count))
        torques.append(np.zeros(count))
        slips[-1][k : k + 2] = pair.radius_a / 2, -pair.radius_b / 2
        torques[-1][k : k + 2] = pair.friction_arm_a, -pair.friction_arm_b
    outside = np.array([draw(numbers(-1.0, 1.0)) for _ in range(count)])
    bearings = [draw(numbers(0.01, 0.5)) for _ in range(count)]
    static = np.array(bearings + [draw(numbers(1.0, 500.0)) for _ in range(count - 1)])
    sliding = draw(st.sampled_from((1.0, 0.8, 0.3))) * static
    return rest_problem(np.diag(inertia), outside, slips, torques, static, sliding)


def bearings_on_one_shaft(static, torque, sliding=None, inertia=0.5):
    """Several bearings of one shaft: every slip is the speed of the shaft."""
    ones = np.ones((len(static), 1))
    return rest_problem([[inertia]], [torque], ones, ones, static, sliding)


def two_shafts(inertia, ratio, static, outside):
    """A bearing, a mesh and a bearing on two shafts which the mesh locks to turn as ratio:1."""
    slip = np.array([[1.0, 0.0], [0.5, -0.5 * ratio], [0.0, 1.0]])
    arms = np.array([[1.0, 0.0], [0.1, -0.1 * ratio], [0.0, 1.0]])
    return rest_problem(np.diag(inertia), outside, slip, arms, static)


# -- independent contacts -----------------------------------------------------------------------------


@settings(deadline=None, max_examples=150)
@given(problem=well_posed())
def test_decision_is_one_of_the_consistent_combinations(problem):
    motion = decided(problem)
    found = tuple(int(state) if rest else ELSEWHERE for state, rest in zip(motion, problem.rest, strict=True))
    assert is_consistent(problem, found), (found, consistent_combinations(problem))


@settings(deadline=None, max_examples=150)
@given(problem=well_posed())
def test_everything_holds_where_it_can(problem):
    everything = tuple(0 if rest else ELSEWHERE for rest in problem.rest)
    tighter = problem._replace(
        static=problem.static - 2 * NEAR,
        forward=(1 - 2e-6) * problem.forward - 2 * NEAR,
        backward=(1 - 2e-6) * problem.backward - 2 * NEAR,
    )
    if is_consistent(tighter, everything):
        assert (decided(problem)[problem.rest == 1] == STUCK).all()


@settings(deadline=None, max_examples=50)
@given(problem=well_posed())
def test_decision_turns_with_the_direction_of_every_force(problem):
    turned = problem._replace(load=-problem.load, forward=problem.backward, backward=problem.forward)
    assert (decided(turned) == -decided(problem)).all()


@pytest.mark.parametrize(("demand", "motion"), [(0.0, 0), (1.0, 0), (-1.0, 0), (1.001, 1), (-1.001, -1)])
def test_one_contact_slips_beyond_its_static_limit(demand, motion):
    assert decided(abstract_problem([[2.0]], [2 * demand], [1.0], [0.5])) == [motion]


@pytest.mark.parametrize("direction", [1.0, -1.0])
@pytest.mark.parametrize("sliding", [1.0, 0.6])
def test_a_contact_that_has_just_let_go_does_not_hold_again(direction, sliding):
    """At that instant its friction is exactly the static limit."""
    problem = abstract_problem([[2.0]], [direction * 2.0], [1.0], [sliding])
    assert decided(problem) == [STUCK]
    assert decided(problem._replace(released=np.ones(1))) == [direction]


def test_a_contact_that_has_just_let_go_holds_where_its_load_is_gone():
    assert decided(abstract_problem([[2.0]], [0.1], [1.0], [0.6], released=[1.0])) == [STUCK]


def test_a_contact_that_falls_to_sliding_friction_pulls_its_neighbor_along():
    """The second bears 1.4 of its 1.5 N while the first is at its static limit, and 1.75 N once that one slides."""
    compliance = [[1.0, 0.5], [0.5, 1.0]]
    both = abstract_problem(compliance, [2.0, 1.9], [1.0, 1.5], [0.3, 0.3])
    alone = abstract_problem(compliance, [2.0, 1.9], [2.0, 1.5], [0.3, 0.3])
    assert list(decided(alone)) == [0, 0]
    assert list(decided(both)) == [1, 1]


def test_motion_is_that_of_the_sweep_that_settled():
    """A P-matrix, so exactly one combination per set of limits; found among 120 000 random ones."""
    static = np.array([0.44, 0.24, 0.64])
    problem = abstract_problem(
        compliance=[[1.0, 4.6, 0.0], [0.0, 1.0, 4.6], [4.6, 0.0, 1.0]],
        demand=[-1.48, -2.18, -1.71],
        static=static,
        sliding=static / 2,
    )
    assert consistent_combinations(problem) == [(-1, -1, -1)]
    assert tuple(decided(problem)) == (-1, -1, -1)


# -- redundant contacts -------------------------------------------------------------------------------


@settings(deadline=None, max_examples=100)
@given(
    static=st.lists(numbers(0.01, 2.0), min_size=2, max_size=4),
    part=st.one_of(numbers(0.0, 0.999), numbers(1.001, 3.0)),
    drop=numbers(0.1, 1.0),
    direction=st.sampled_from((1.0, -1.0)),
)
def test_bearings_of_one_shaft_break_away_at_the_sum_of_their_limits(static, part, drop, direction):
    limits = np.array(static)
    motion = decided(bearings_on_one_shaft(limits, direction * part * limits.sum(), drop * limits))
    assert (motion == direction).all() if part > 1 else (abs(motion) != 1).all()


@pytest.mark.parametrize(("torque", "moves"), [(7.4, False), (7.6, True), (-7.4, False), (-7.6, True)])
def test_two_bearings_and_the_mesh_between_them_break_away_together(torque, moves):
    """The mesh locks the shafts 3:1, so bearings with 2 and 1.5 N m hold 3 * 2 + 1.5 = 7.5 N m at the slow shaft."""
    problem = two_shafts(inertia=(1.0, 1.0), ratio=3.0, static=(2.0, 1e3, 1.5), outside=(0.0, torque))
    assert list(abs(decided(problem))) == ([1, 0, 1] if moves else [0, 0, 0])


@pytest.mark.parametrize("light", [1e-1, 1e-3, 1e-6])
def test_a_heavy_shaft_with_a_locked_light_one_before_it_holds_up_to_the_sum_of_both_limits(light):
    """What the light one leaves free must not pass for a way to slip, or the heavy one's bearing gives way alone."""
    for load, moves in ((0.6, False), (1.499, False), (1.501, True)):
        problem = two_shafts(inertia=(light, 1.0), ratio=1.0, static=(1.0, 1e3, 0.5), outside=(0.0, load))
        assert (abs(decided(problem)) == 1).any() == moves


@pytest.mark.parametrize("light", [1e-1, 1e-2, 1e-4])
def test_a_shaft_breaks_away_at_the_sum_of_both_limits_with_a_light_one_behind_it(light):
    """The regularization once held it up to 1e-8 of the ratio of inertias beyond that, overloaded."""
    for part, moves in ((1 - 3e-9 / light, False), (1 + 3e-9 / light, True)):
        problem = two_shafts(inertia=(1.0, light), ratio=1.0, static=(1.0, 1e3, 1.0), outside=(2.0 * part, 0.0))
        assert list(abs(decided(problem))) == ([1, 0, 1] if moves else [0, 0, 0])


@pytest.mark.parametrize(
    "light",
    [1e-4, 1e-6],
)
def test_a_light_shaft_turns_with_the_heavy_one_that_drives_it(light):
    problem = two_shafts(inertia=(1.0, light), ratio=1.0, static=(1.0, 1e3, 1.0), outside=(3.0, 0.0))
    assert list(decided(problem)) == [1, 0, 1]


@settings(deadline=None, max_examples=100)
@given(problem=trains())
def test_motion_of_a_train_with_redundant_bearings_is_consistent(problem):
    motion = decided(problem)
    slips = abs(motion) == 1
    size = abs(problem.demand).max()
    force = shared_friction(problem, motion)
    acceleration = problem.demand - problem.compliance @ force
    assert worst_violation(problem, motion, decide(problem).friction) <= 1e-10
    assert (abs(acceleration[~slips]) <= 1e-7 * size).all()
    assert (acceleration[slips] * motion[slips] >= -1e-7 * size).all()


@settings(deadline=None, max_examples=100)
@given(problem=trains())
def test_a_train_that_some_friction_holds_does_not_slip(problem):
    assume(needed_part(problem) <= 1 - NEAR)
    assert not decided(problem).any()


KINDS = {
    "static > sliding": {},
    "static = sliding": {"one_friction": True},
    "light shafts": {"light": 1e-9},
    "light shafts, static = sliding": {"light": 1e-9, "one_friction": True},
    "mesh speed": {"stick_by": "mesh speed"},
    "mesh speed, light shafts, static = sliding": {"stick_by": "mesh speed", "light": 1e-9, "one_friction": True},
}


def against_limit_analysis(kind, seed, count):
    """Everything holds exactly where a linear programme says that it can; and whatever is decided keeps the rules."""
    rng = np.random.default_rng(seed)
    different = broken = 0
    for _ in range(count):
        problem = draw_problem(rng, **KINDS[kind])
        part, decision = needed_part(problem), decide(problem)
        assert decision.fault == 0
        different += abs(part - 1) > NEAR and bool(decision.motion.any()) == (part <= 1)
        broken += worst_violation(problem, decision.motion, decision.friction) > 1e-10
    return different, broken


@pytest.mark.parametrize("kind", KINDS)
def test_what_can_hold_holds(kind):
    assert against_limit_analysis(kind, 1, 60) == (0, 0)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("kind", KINDS)
def test_what_can_hold_holds_in_ten_thousand_trains(kind, seed):
    different, broken = against_limit_analysis(kind, 100 + seed, 170)
    assert different == 0
    assert broken <= ("light" in kind)  # shafts of 1e-13 kg m^2


@pytest.mark.parametrize("kind", KINDS)
def test_a_train_loaded_exactly_to_its_limit_is_decided(kind):
    """Either way is right there."""
    rng = np.random.default_rng(7)
    for _ in range(30):
        problem = draw_problem(rng, **KINDS[kind])
        part = needed_part(problem)
        if 1e-6 < part < np.inf:
            at_limit = problem._replace(load=problem.load / part)
            decision = decide(at_limit)
            assert decision.fault == 0
            assert worst_violation(at_limit, decision.motion, decision.friction) <= NEAR


@settings(deadline=None, max_examples=100)
@given(static=st.lists(numbers(0.1, 2.0), min_size=2, max_size=4), drop=numbers(0.1, 1.0))
def test_a_group_that_has_just_let_go_moves_as_a_whole(static, drop):
    """At that instant its load is exactly the sum of the limits, and no acceleration shows it."""
    limits = np.array(static)
    for direction in (FORWARD, BACKWARD):
        problem = bearings_on_one_shaft(limits, direction * limits.sum(), drop * limits)
        assert (decided(problem._replace(released=np.ones(len(limits)))) == direction).all()


@pytest.mark.parametrize("loads", [(9.9, -9.9), (1.15, -9.99)])
def test_what_was_loaded_before_plays_no_part(loads):
    for load in loads:
        assert not decided(bearings_on_one_shaft([9.0, 1.0], load, [5.0, 0.5])).any()


@settings(deadline=None, max_examples=50)
@given(problem=trains(), order=st.randoms(use_true_random=False))
def test_motion_does_not_depend_on_the_order_of_redundant_contacts(problem, order):
    places = list(range(len(problem.demand)))
    order.shuffle(places)
    # with less friction while sliding, more than one motion can be consistent
    constant = problem._replace(forward=problem.static, backward=problem.static)
    mixed = Problem(*constant[:2], *(rows[places] for rows in constant[2:]))
    accelerations = []
    for asked in (constant, mixed):
        accelerations.append(asked.demand - asked.compliance @ decide(asked).friction)
    size = abs(problem.demand).max()
    assert accelerations[1] == pytest.approx(accelerations[0][places], abs=1e-6 * size)


@settings(deadline=None, max_examples=100)
@given(problem=trains())
def test_redundant_contacts_that_hold_leave_no_acceleration(problem):
    """G is singular: more contacts than shafts."""
    force = shared_friction(problem, np.zeros(len(problem.demand)))
    left = problem.demand - problem.compliance @ force
    assert (abs(left) <= 1e-10 * abs(problem.demand).max()).all()


@settings(deadline=None, max_examples=50)
@given(static=st.lists(numbers(0.01, 2.0), min_size=2, max_size=4), torque=numbers(-1.0, 1.0))
def test_redundant_friction_is_the_smallest_that_holds(static, torque):
    """Equal bearings of one shaft share its torque equally."""
    force = shared_friction(bearings_on_one_shaft(np.array(static), torque), np.zeros(len(static)))
    assert force == pytest.approx(np.full(len(static), torque / len(static)), rel=1e-6, abs=1e-12)
