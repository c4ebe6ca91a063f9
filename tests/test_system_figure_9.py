"""Figure 9 of the gear paper: a preloaded mesh under a torque ramp, sticking and slipping for ten seconds.

Oracles: the published times of the first release and of sticking again, the published number of mode changes and
the published angle of the load wheel, for the lever arms the paper prints and for those that follow from its
geometry; the first release in closed form; the balance of torques after ten seconds; one run against another (finer
tolerance, other output points, compiled against plain Python).
"""

import os
import subprocess
import sys
from typing import NamedTuple

import numpy as np
import pytest

from actuator import simulate
from actuator.system.contact_modes import STUCK
from studies.checks.paper import figure_9, figure_9_inputs, figure_9_start

DURATION = 10.0
MESH = "gear.meshes.mesh"
TIME, ANGLE = 1e-6, 1e-6  # s, rad: what the published digits and the tolerances below allow
TOLERANCES = (1e-6, 1e-8)


class Published(NamedTuple):
    """What is known of the run."""

    changes: int
    release: float  # s
    stuck_again: float  # s
    load_angle: float  # rad, after 10 s


PUBLISHED = {
    "printed": Published(20, 1.688746, 1.696439, -0.0349861),
    "geometric": Published(188, 0.1780141, 0.1868594, -0.0436760),
}
both_arms = pytest.mark.parametrize("arms", PUBLISHED)
both_tolerances = pytest.mark.parametrize("tolerance", TOLERANCES)


def first_release(plant):
    """Time [s] at which the friction s of the stuck mesh, moved at a steady rate by the ramp, reaches 0.2 F_n.

    With q = phi_B - phi_B(0) = q0 + q1 t, s = s0 + s1 t and no slip (r_A phi_A' = r_B phi_B'):

        F_n = c (delta0 + 2 r_B q) + 2 d r_B q1
        wheel A:  l_A F_n + e_A s = 5 + t
        wheel B:  k (phi_B(0) + q) + D q1 = e_B s - l_B F_n
    """
    pair, start = plant.gear.meshes["mesh"].pair, figure_9_start(plant)
    stiffness, damping, spring, damper = 2e8, 2e5, 1000.0, 2.0
    base_a, base_b = (radius * np.cos(pair.pressure_angle) for radius in (pair.radius_a, pair.radius_b))
    per_turn = 2 * stiffness * pair.radius_b
    matrix = [[base_a * per_turn, pair.friction_arm_a], [spring + base_b * per_turn, -pair.friction_arm_b]]
    rate, friction_rate = np.linalg.solve(matrix, [1.0, 0.0])
    held = stiffness * (pair.radius_a * start["wheel_a.angle"] + pair.radius_b * start["wheel_b.angle"])
    held += 2 * damping * pair.radius_b * rate
    offset, friction = np.linalg.solve(
        matrix, [5.0 - base_a * held, -spring * start["wheel_b.angle"] - damper * rate - base_b * held]
    )
    return (friction - 0.2 * (held + per_turn * offset)) / (0.2 * per_turn * rate - friction_rate)


@pytest.fixture(scope="module")
def run():
    """Runs of figure 9 by lever arms and options of `simulate`; each is made once."""
    plants, done = {arms: figure_9(arms) for arms in PUBLISHED}, {}

    def run_once(arms, **options):
        settings = {"resolution": 0.05, "tolerance": 1e-6} | options
        key = (arms, *sorted(settings.items()))
        if key not in done:
            plant = plants[arms]
            done[key] = simulate(plant, DURATION, inputs=figure_9_inputs(), start=figure_9_start(plant), **settings)
        return done[key]

    return run_once


def times(run):
    """Times of the mode changes [s]."""
    return np.array([change.time for change in run.changes])


@both_tolerances
@both_arms
def test_the_published_number_of_mode_changes_is_met(run, arms, tolerance):
    assert len(run(arms, tolerance=tolerance).changes) == PUBLISHED[arms].changes


@both_tolerances
@both_arms
def test_the_mesh_lets_go_and_sticks_again_at_the_published_times(run, arms, tolerance):
    release, again = run(arms, tolerance=tolerance).changes[:2]
    assert (release.contact, release.before, release.after) == (MESH, "stuck", "forward")
    assert (again.contact, again.before, again.after) == (MESH, "forward", "stuck")
    assert release.time == pytest.approx(PUBLISHED[arms].release, abs=TIME)
    assert again.time == pytest.approx(PUBLISHED[arms].stuck_again, abs=TIME)


@both_tolerances
@both_arms
def test_the_first_release_is_that_of_the_closed_form(run, arms, tolerance):
    assert run(arms, tolerance=tolerance).changes[0].time == pytest.approx(first_release(figure_9(arms)), abs=1e-9)


@both_tolerances
@both_arms
def test_the_load_wheel_ends_at_the_published_angle(run, arms, tolerance):
    assert run(arms, tolerance=tolerance)["wheel_b.angle"][-1] == pytest.approx(PUBLISHED[arms].load_angle, abs=ANGLE)


@both_arms
def test_the_mesh_sticks_and_slips_forward_in_turn(run, arms):
    modes = [change.after for change in run(arms).changes]
    assert modes == ["forward", "stuck"] * (PUBLISHED[arms].changes // 2)


@both_tolerances
@both_arms
def test_a_stuck_mesh_does_not_creep(run, arms, tolerance):
    result = run(arms, tolerance=tolerance)
    stuck = result.modes[MESH] == STUCK
    assert stuck.sum() > 100
    assert abs(result[f"{MESH}.slip_speed"][stuck]).max() < 1e-12


@both_arms
def test_no_margin_is_negative_and_no_event_is_missed(run, arms):
    result = run(arms)
    assert result.margins.min() >= -1e-9
    assert result.statistics.settled == 0


@both_arms
def test_the_torques_on_both_wheels_balance_at_the_end(run, arms):
    # both wheels nearly at rest: T_A = F_n l_A + s e_A and k phi_B = s e_B - F_n l_B
    pair = figure_9(arms).gear.meshes["mesh"].pair
    result = run(arms)
    normal, friction = result[f"{MESH}.normal_force"][-1], result[f"{MESH}.friction"][-1]
    base = np.cos(pair.pressure_angle)
    torque_a = normal * pair.radius_a * base + friction * pair.friction_arm_a
    torque_b = friction * pair.friction_arm_b - normal * pair.radius_b * base
    assert torque_a == pytest.approx(5 + DURATION, rel=1e-6)
    assert torque_b == pytest.approx(1000.0 * result["wheel_b.angle"][-1] + 2.0 * result["wheel_b.speed"][-1], rel=1e-6)


@both_arms
def test_tolerances_of_1e_6_and_1e_8_put_every_mode_change_at_the_same_time(run, arms):
    coarse, fine = (run(arms, tolerance=tolerance) for tolerance in TOLERANCES)
    np.testing.assert_allclose(times(coarse), times(fine), rtol=0, atol=TIME)


@pytest.mark.parametrize("resolution", [0.02, 0.0045, 0.0005])
@both_arms
def test_more_output_points_leave_the_mode_changes_where_they_are(run, arms, resolution):
    one_window, many = run(arms), run(arms, resolution=resolution)
    assert len(many.t) > len(one_window.t)
    np.testing.assert_allclose(times(many), times(one_window), rtol=0, atol=TIME)


PLAIN = """
import sys
import numpy as np
from actuator import simulate
from studies.checks.paper import figure_9, figure_9_inputs, figure_9_start

plant = figure_9(sys.argv[1])
run = simulate(plant, 2.0, inputs=figure_9_inputs(), start=figure_9_start(plant), resolution=0.05)
assert not run.statistics.compiled
np.savez(sys.argv[2], times=[change.time for change in run.changes], states=[run[q.name] for q in run.system.states])
"""


@both_arms
def test_the_engine_gives_the_same_as_plain_python(tmp_path, arms):
    file = tmp_path / "plain.npz"
    environment = os.environ | {"NUMBA_DISABLE_JIT": "1", "PYTHONPATH": os.pathsep.join(sys.path)}
    subprocess.run([sys.executable, "-c", PLAIN, arms, str(file)], env=environment, check=True)
    plain, plant = np.load(file), figure_9(arms)
    run = simulate(plant, 2.0, inputs=figure_9_inputs(), start=figure_9_start(plant), resolution=0.05)
    assert run.statistics.compiled
    np.testing.assert_allclose(times(run), plain["times"], rtol=0, atol=TIME)
    for state, values in zip(run.system.states, plain["states"], strict=True):
        np.testing.assert_allclose(run[state.name], values, rtol=0, atol=1e-6 * state.nominal, err_msg=state.name)


def test_the_start_is_a_balance_without_friction():
    # the ramp starts from rest: without it nothing would ever move
    plant = figure_9("geometric")
    result = simulate(plant, 1.0, inputs={"torque_reference": 5.0}, start=figure_9_start(plant))
    assert result.changes == ()
    assert abs(result["wheel_b.speed"]).max() < 1e-9
