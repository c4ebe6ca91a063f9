"""What rounding leaves of a loop, and python-control's tools on loops.

Oracles: integrators and conditionally stable loops whose crossings are known in closed form, in states turned at random
so that nothing cancels exactly; the poles of the closed loop; python-control's margins; a current loop by hand; a load
that rests on its spring, in the gap of a mesh.
"""

import math
from dataclasses import replace
from functools import cache

import control
import matplotlib.pyplot as plt
import numpy as np
import pytest
from random_parts import draw

from actuator import (
    Actuator,
    Load,
    TorqueSource,
    disk_margin,
    lifted_margins,
    loop_transfer,
    margins,
    poles,
    reduce_order,
    trim,
)
from controllers import Sampling
from gear import Shaft, Transmission
from studies import load_case

FAST = 2e4  # rad/s


def turned(loop, seed=0):
    """The same loop in other states."""
    turn = np.linalg.qr(np.random.default_rng(seed).standard_normal((loop.nstates,) * 2))[0]
    return control.ss(turn @ loop.A @ turn.T, turn @ loop.B, loop.C @ turn.T, loop.D, loop.dt)


def in_other_units(loop):
    """The same loop with other units of its states."""
    units = 10.0 ** np.random.default_rng(1).uniform(-4, 4, loop.nstates)
    return control.ss(loop.A * units[:, None] / units, loop.B * units[:, None], loop.C / units, loop.D, loop.dt)


def chain(*gains):
    """sum of gains[k]/s^(k+1), as a chain of integrators."""
    n = len(gains)
    return control.ss(np.eye(n, k=-1), np.eye(n, 1), np.array([gains]), 0)


# -- what is rounding and what is not -----------------------------------------------------------------------


@pytest.mark.parametrize("order", [1, 2, 3, 4])
@pytest.mark.parametrize("turn", [False, True])
def test_integrators_have_no_phase_crossing(order, turn):
    # k/s^2 is real and negative at every frequency and crosses nothing: what changes its sign is rounding
    loop = chain(*[0.0] * (order - 1), 0.7)
    assert margins(turned(loop) if turn else loop).phase_crossings == ()


@pytest.mark.parametrize(("corner", "turn"), [(1e-5, False), (1e-3, False), (1.0, False), (1e-3, True), (100.0, True)])
def test_a_conditionally_stable_loop_has_its_one_crossing_however_slow(corner, turn):
    # k (s + w)^2/s^3 is real where s = j w, and -2 k/w there
    gain = 3.0 * corner
    loop = chain(gain, 2 * gain * corner, gain * corner**2)
    (crossing,) = margins(turned(loop) if turn else loop).phase_crossings
    assert crossing.frequency == pytest.approx(corner, rel=1e-6)
    assert crossing.gain == pytest.approx(corner / (2 * gain), rel=1e-6)


def test_a_slow_crossing_beside_a_pole_at_a_million_is_kept():
    slow, fast = 1e-3, 1e6
    loop = control.series(chain(1.0, 2 * slow, slow**2), control.ss(-fast, fast, 1, 0))
    (crossing,) = margins(in_other_units(loop)).phase_crossings
    assert crossing.frequency == pytest.approx(slow, rel=1e-4)


def test_crossings_of_an_actuator_do_not_depend_on_rounding():
    _, design, _, drifting = draw(0)
    point = trim(design, "forward", inputs={"load_torque": 0.5}, drifting=drifting)
    loop = loop_transfer(point, "position", drifting=drifting)
    found, other = margins(loop), margins(in_other_units(loop))
    frequencies = [crossing.frequency for crossing in found.phase_crossings]
    assert min(frequencies) > 1.0
    np.testing.assert_allclose([crossing.frequency for crossing in other.phase_crossings], frequencies, rtol=1e-6)


def test_an_integrator_in_discrete_time_has_no_crossing_at_standstill():
    assert min(crossing.frequency for crossing in margins(loops()["sampled"]).phase_crossings) > 1.0


def test_what_a_loop_feeds_back_leaves_no_rounding_when_it_is_opened():
    values = loop_transfer(points()["continuous"], "torque_reference").A
    assert abs(values[values != 0]).min() > 1e-9 * abs(values).max() * np.finfo(float).eps


def lagged(loop, *corners):
    """The loop behind lags with these corners [rad/s]."""
    for corner in corners:
        loop = control.series(loop, control.ss(-corner, corner, 1, 0))
    return loop


def speed_loop(gain, corner, *lags):
    """gain (s + corner)/s^2 behind lags."""
    return lagged(control.ss(control.tf([gain, gain * corner], [1, 0, 0])), *lags)


@pytest.mark.parametrize("slow", [1e-22, 1e-12, 1e-6])
def test_integrators_that_rounding_moved_have_no_crossing(slow):
    # -0.7/((s - w)(s + w)) is 0.7/w^2 at standstill, and its own negative everywhere
    for sign in (1, -1):
        loop = control.ss(np.array([[slow, 0], [1, -slow]]), np.eye(2, 1), np.array([[0, 0.7 * sign]]), 0)
        assert margins(loop).phase_crossings == ()


def test_what_passes_at_once_has_its_gain_margin_at_infinite_frequency():
    # 1 - k (s/2 + 1)/(s + 3) = ((1 - k/2) s + 3 - k)/(s + 3): unstable from k = 2 on
    found = margins(control.ss(control.tf([-0.5, -1.0], [1.0, 3.0])))
    assert [crossing.frequency for crossing in found.phase_crossings] == [0.0, math.inf]
    assert (found.gain, found.gain_frequency) == (pytest.approx(2.0, rel=1e-12), math.inf)
    assert found.stable
    for gain, stable in ((1.99, True), (2.01, False)):
        assert margins(control.ss(control.tf([-0.5 * gain, -gain], [1.0, 3.0]))).stable == stable


@pytest.mark.parametrize("damping", [3e-3, 3e-4, 1e-6])
@pytest.mark.parametrize("at", [10.02, 500.0])
def test_a_resonance_between_points_of_the_grid_is_crossed(damping, at):
    # |L| = 1 where (w^2 - x)^2 + 4 d^2 w^2 x = g^2, x the square of the frequency
    size = 3 * 2 * damping * at**2
    loop = control.ss(control.tf([size], [1, 2 * damping * at, at**2]))
    expected = np.roots([1, (4 * damping**2 - 2) * at**2, at**4 - size**2])
    found = margins(loop)
    np.testing.assert_allclose([c.frequency for c in found.gain_crossings], np.sort(np.sqrt(expected)), rtol=1e-9)
    sampled = margins(control.sample_system(loop, 0.1 / at))
    assert len(sampled.gain_crossings) == 2


@pytest.mark.parametrize(("pole", "stable"), [(1e-4, False), (1e-7, False), (-1e-4, True)])
@pytest.mark.parametrize("fast", [1e3, 1e6])
def test_a_slow_unstable_pole_beside_a_fast_lag_is_unstable(pole, stable, fast):
    # the integrator closes at this pole: s (s/fast + 1) = pole
    assert margins(lagged(control.ss(0.0, 1.0, -pole, 0), fast)).stable == stable
    sampled = control.ss(1.0, 1.0, -pole, 0, 1.0)
    assert lifted_margins(sampled).stable == margins(sampled).stable == stable


@pytest.mark.parametrize("signal", ["torque_reference", "voltage"])
def test_a_pole_that_is_nearly_double_at_zero_is_not_unstable_by_rounding(signal):
    _, design, _, drifting = draw(26)
    stuck = trim(design, "stuck", inputs={"load_torque": 0.5}, drifting=drifting)
    assert margins(loop_transfer(stuck, signal, drifting=drifting, minimal=True)).stable


# -- python-control -----------------------------------------------------------------------------------------


@cache
def points():
    actuator = load_case("aileron").actuator
    sampled = replace(actuator, sampling=Sampling(current=1e-4, speed=5e-4, position=1e-3))
    return {
        name: trim(plant, "forward", inputs={"reference": 0.1})
        for name, plant in (("continuous", actuator), ("sampled", sampled))
    }


@cache
def loops():
    return {name: loop_transfer(point, "position") for name, point in points().items()}


KINDS = pytest.mark.parametrize("kind", ["continuous", "sampled"])


def short(kind):
    return reduce_order(loops()[kind], FAST if kind == "continuous" else None)


@KINDS
def test_a_reduced_loop_has_fewer_states_and_the_same_margins(kind):
    whole, less = margins(loops()[kind]), margins(short(kind))
    assert short(kind).nstates <= loops()[kind].nstates - 4
    assert less.gain_db == pytest.approx(whole.gain_db, rel=1e-8)
    assert less.phase_rad == pytest.approx(whole.phase_rad, rel=1e-8)
    assert less.disk.size == pytest.approx(whole.disk.size, rel=1e-8)


@KINDS
def test_at_gain_one_the_root_locus_is_at_the_poles_of_the_closed_loop(kind):
    found = control.root_locus_map(short(kind), gains=[0.0, 1.0]).loci[1]
    step = short(kind).dt
    for pole in poles(points()[kind]):
        # those at -750 are of the direct axis, which the position does not see
        if pole.frequency < 600:
            value = np.exp(pole.value * step) if step else pole.value
            assert abs(found - value).min() < 1e-6 * abs(value)


@KINDS
def test_at_the_gain_margin_the_root_locus_crosses_the_boundary(kind):
    margin, step = margins(loops()[kind]), short(kind).dt
    found = control.root_locus_map(short(kind), gains=[0.999 * margin.gain, margin.gain, 1.001 * margin.gain])
    outside = (abs(found.loci) - 1 if step else found.loci.real).max(axis=1)
    assert outside[0] < 0 < outside[2]
    at = 1j * margin.gain_frequency
    assert abs(found.loci[1] - (np.exp(at * step) if step else at)).min() < 1e-5 * (1 if step else abs(at))


@KINDS
def test_python_control_finds_the_same_margins(kind):
    loop, found = loops()[kind], margins(loops()[kind])
    gain, phase, _, at_gain, at_phase, _ = control.stability_margins(loop, method="frd" if loop.dt else "best")
    assert (gain, phase) == pytest.approx((found.upper_gain, found.phase_deg), rel=1e-4)
    assert (at_gain, at_phase) == pytest.approx((found.gain_frequency, found.phase_frequency), rel=1e-4)
    near = found.disk.frequency * np.linspace(0.999, 1.001, 101)
    assert control.disk_margins(loop, near)[0] == pytest.approx(disk_margin(loop).size, rel=1e-6)


@KINDS
def test_closed_by_python_control_the_position_follows(kind):
    closed = control.feedback(loops()[kind], 1)
    response = control.step_response(closed, 2.0)
    assert response.outputs.squeeze()[-1] == pytest.approx(1.0, abs=1e-3)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("draw_it", [control.sisotool, control.nyquist_plot])
def test_the_charts_of_python_control_take_a_reduced_loop(draw_it):
    before = plt.get_fignums()
    try:
        draw_it(short("continuous"))
        assert plt.get_fignums() != before
    finally:
        plt.close("all")


def test_a_reduced_current_loop_is_an_integrator():
    # the zero of the PI cancels R/L, all else is locked: L = bandwidth/s
    stuck = trim(load_case("aileron").actuator, "stuck", inputs={"reference": 0.1})
    loop = reduce_order(loop_transfer(stuck, "voltage", minimal=True))
    assert loop.nstates == 1
    np.testing.assert_allclose(loop(1j * np.array([1.0, 100.0])), 4000 / (1j * np.array([1.0, 100.0])), rtol=1e-9)


def test_nothing_is_left_of_a_loop_through_a_stuck_gear():
    stuck = trim(load_case("aileron").actuator, "stuck", inputs={"reference": 0.1})
    loop = reduce_order(loop_transfer(stuck, "position", minimal=True))
    assert (loop.nstates, loop.D.item()) == (0, 0)


@pytest.mark.parametrize(
    ("gain", "corner", "lags"),
    [(60.0, 0.1, (1e4, 1e6)), (60.0, 0.01, (1e6,)), (100.0, 0.01, (2e5,)), (60.0, 0.1, (1e4,))],
)
def test_an_integrator_beside_a_lag_at_a_million_is_kept(gain, corner, lags):
    loop = reduce_order(in_other_units(speed_loop(gain, corner, *lags)))
    assert loop.nstates == 2 + len(lags)
    s = 1j * np.logspace(-2, 4, 13)
    expected = gain * (s + corner) / s**2 / np.prod([s / lag + 1 for lag in lags], axis=0)
    np.testing.assert_allclose(loop(s), expected, rtol=1e-2)
    assert margins(loop).lower_gain == 0


def test_fast_poles_become_a_lag():
    slow, fast = control.ss(-1.0, 3.0, 1.0, 0), control.ss(-1e5, 1e5, 0.01, 0)
    loop = reduce_order(turned(control.parallel(slow, fast)), 1e3)
    np.testing.assert_allclose(np.sort(loop.poles().real), [-1e3, -1.0], rtol=1e-9)
    s = 1j * np.logspace(-2, 2, 9)
    np.testing.assert_allclose(loop(s), 3 / (s + 1) + 0.01 / (s / 1e3 + 1), rtol=1e-9)


@pytest.mark.parametrize(
    ("loop", "fastest", "message"),
    [
        (control.ss(-1.0, 100.0, 1.0, 0), 50.0, r"loop gain is 2 beyond fastest=50 rad/s.*choose it above 19\d"),
        (control.ss(1e3, 1.0, 1.0, 0), 50.0, "a pole faster than fastest=50 rad/s is unstable"),
        (control.ss(0.5, 1.0, 0.1, 0, 1e-3), 50.0, "is for loops in continuous time; leave it out"),
        (control.ss(np.eye(2), np.eye(2), np.eye(2), np.zeros((2, 2))), None, "2 inputs and 2 outputs"),
    ],
)
def test_a_reduction_that_would_hide_something_is_refused(loop, fastest, message):
    with pytest.raises(ValueError, match=message):
        reduce_order(loop, fastest)


# -- operating points ---------------------------------------------------------------------------------------


def test_a_load_that_its_spring_holds_within_the_gap_leaves_the_mesh_free():
    _, design, _, _ = draw(53)
    point = trim(design, "forward", inputs={"load_torque": 0.5})
    assert point.flanks["gear.meshes.second"] == 0
    load = design.load
    assert point.states["surface.angle"] == pytest.approx((0.5 + load.bias) / load.stiffness, rel=1e-9)


def test_an_operating_point_is_found_to_rounding():
    gear = Transmission(shafts={"arm": Shaft(inertia=0.3)}, input="arm", output="arm")
    arm = Actuator(motor=TorqueSource(), gear=gear, load=Load(stiffness=7.0))
    point = trim(arm, "forward", inputs={"torque_reference": 1.0})
    assert point.states["arm.angle"] == pytest.approx(1 / 7, rel=4e-16)


def test_a_rectifier_above_its_voltage_finds_back_to_it():
    _, design, _, drifting = draw(62)
    assert design.link.source == "rectifier"
    battery = replace(design, link=replace(design.link, source="battery"))
    found, expected = (
        trim(plant, "forward", inputs={"load_torque": 0.5}, drifting=drifting).states["link.voltage"]
        for plant in (design, battery)
    )
    assert found == pytest.approx(expected, rel=1e-12)
