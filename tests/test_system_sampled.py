"""Sampled controllers as clocks of the hybrid system.

Oracles: the recursion of plant (zero-order hold, from `control.c2d`) and control law, written out tick by tick; the
continuous actuator in the limit of fast sampling; a counter that is a law itself; the same run with finer output,
other output points and interpreted.
"""

from dataclasses import replace

import casadi as ca
import control
import numpy as np
import pytest

from actuator import Actuator, HybridSystem, Ramp, Sine, Step, TorqueSource, simulate
from actuator.system.hybrid import Clock, Quantity
from controllers import PID, Sampling
from gear import Bearing, Shaft, Transmission
from studies import load_case

pytestmark = pytest.mark.thorough

BANDWIDTH, INERTIA = 20.0, 0.3


def servo(period=1e-2, delay=0, bearings=None, **law):
    """A sampled PID on an inertia."""
    pid = PID.for_inertia(inertia=INERTIA, bandwidth=BANDWIDTH, **law)
    gear = Transmission(shafts={"arm": Shaft(inertia=INERTIA)}, bearings=bearings or {}, input="arm", output="arm")
    sampling = None if period is None else Sampling(position=period, delay=delay)
    return Actuator(motor=TorqueSource(), gear=gear, controller=pid, sampling=sampling)


def recursion(period, delay, ticks, reference):
    """Positions at the ticks: double integrator under zero-order hold, PID with Euler's integral."""
    plant = control.c2d(control.ss([[0, 1], [0, 0]], [[0], [1 / INERTIA]], np.eye(2), 0), period)
    pid = PID.for_inertia(inertia=INERTIA, bandwidth=BANDWIDTH)
    x, integral, pending, found = np.zeros(2), 0.0, [0.0] * delay, []
    for _ in range(ticks):
        found.append(x[0])
        error = reference - x[0]
        torque = pid.proportional * error + integral - pid.derivative * x[1]
        integral += period * pid.integral * error
        pending.append(torque)
        x = plant.A @ x + plant.B[:, 0] * pending.pop(0)
    return np.array(found)


@pytest.mark.parametrize("delay", [0, 1])
@pytest.mark.parametrize("resolution", [1e-2, 2.5e-3, 5e-2])
def test_a_discrete_loop_is_its_recursion(delay, resolution):
    run = simulate(
        servo(delay=delay), 1.0, inputs={"reference": 0.1}, resolution=resolution, compiled=False, tolerance=1e-11
    )
    expected = recursion(1e-2, delay, 101, 0.1)
    ticks = np.round(run.t / 1e-2)
    at = np.abs(run.t - ticks * 1e-2) < 1e-12
    assert at.sum() >= 1.0 / max(resolution, 1e-2)
    np.testing.assert_allclose(run["load_angle"][at], expected[ticks[at].astype(int)], rtol=0, atol=1e-9)


def test_fast_sampling_is_continuous_control():
    errors = []
    continuous = simulate(servo(period=None), 0.5, inputs={"reference": 0.1}, compiled=False, resolution=1e-2)
    for period in (2e-3, 1e-3):
        run = simulate(servo(period=period), 0.5, inputs={"reference": 0.1}, compiled=False, resolution=1e-2)
        errors.append(np.abs(np.interp(run.t, continuous.t, continuous["load_angle"]) - run["load_angle"]).max())
    assert errors[1] < 2e-3
    assert errors[0] / errors[1] == pytest.approx(2, rel=0.1)  # of first order in the period


def counting(every):
    """A system whose only law counts its own samples, in x1, while x0 runs with time."""
    x, m, u, p = ca.SX.sym("x", 2), ca.SX.sym("m", 0), ca.SX.sym("u", 0), ca.SX.sym("p", 0)
    due = ca.SX.sym("due", 1)
    names = tuple(Quantity(name, "-", held=held) for name, held in (("time", False), ("samples", True)))
    return HybridSystem(
        name="counter",
        states=names,
        mode_variables=(),
        inputs=(),
        outputs=(),
        events=(),
        parameters=(),
        flow=ca.Function("flow", [x, m, u, p], [ca.vertcat(1, 0)]),
        margins=ca.Function("margins", [x, m, u, p], [ca.SX(0, 1)]),
        reset=ca.Function("reset", [ca.SX.sym("fired", 0), x, m, u, p], [x, m, 0]),
        outputs_function=ca.Function("outputs", [x, m, u, p], [ca.SX(0, 1)]),
        clocks=(Clock("count", every),),
        tick=ca.Function("tick", [due, x, m, u, p], [ca.vertcat(x[0], x[1] + due)]),
        period=ca.Function("period", [p], [0.01]),
    )


@pytest.mark.parametrize("every", [1, 3])
@pytest.mark.parametrize(("duration", "resolution"), [(1.0, 0.01), (0.997, 0.004), (1.003, 0.037), (0.005, 0.001)])
def test_each_law_runs_exactly_once_per_tick(every, duration, resolution):
    run = simulate(counting(every), duration, resolution=resolution, compiled=False)
    assert run.t[-1] == pytest.approx(duration, rel=1e-14)
    assert (np.diff(run.t) > 0).all()
    ticks = 1 + np.floor(run.t / 0.01 + 1e-9)
    ticks[-1] = np.ceil(run.t[-1] / 0.01 - 1e-9)  # a tick at the very end belongs to what comes after
    np.testing.assert_array_equal(run["samples"], np.ceil(ticks / every))


def test_steps_between_ticks_are_not_moved_to_ticks():
    law = {"compiled": False, "resolution": 1e-3, "tolerance": 1e-10}
    late = simulate(servo(period=1e-2), 0.1, inputs={"load_torque": Step(time=0.0237, after=1.0)}, **law)
    before = late["load_speed"][late.t < 0.0237]
    assert np.abs(before).max() == 0
    now = np.argmin(np.abs(late.t - 0.03))
    assert late["load_speed"][now] == pytest.approx((0.03 - 0.0237) / INERTIA, rel=1e-9)


GUIDE = {"guide": Bearing(shaft="arm", coulomb=1.0, breakaway=1.5)}


@pytest.mark.parametrize(
    "reference", [Step(time=0.013, after=0.4), Ramp(slope=0.3, end=1.0), Sine(amplitude=0.3, frequency=0.9)]
)
def test_stick_slip_between_ticks_keeps_every_margin_and_no_output_grid_matters(reference):
    plant = servo(period=1e-2, delay=1, bearings=GUIDE)
    runs = [
        simulate(plant, 2.0, inputs={"reference": reference}, resolution=resolution, compiled=False, tolerance=1e-9)
        for resolution in (1e-2, 1e-3, 7e-2)
    ]
    assert all(run.margins.min() >= -1e-9 for run in runs)
    assert len(runs[0].changes) >= 2
    for run in runs[1:]:
        assert [change[1:] for change in run.changes] == [change[1:] for change in runs[0].changes]
        np.testing.assert_allclose(
            [change.time for change in run.changes], [change.time for change in runs[0].changes], atol=1e-7
        )
        assert run["load_angle"][-1] == pytest.approx(runs[0]["load_angle"][-1], abs=1e-8)
    # a torque that jumps at a tick lets go at the tick
    released = [change.time for change in runs[0].changes if change.before == "stuck"]
    assert released[0] / 1e-2 == pytest.approx(round(released[0] / 1e-2), abs=1e-9)


def test_a_sampled_aileron_is_near_the_continuous_one_and_nothing_is_lost_by_a_coarse_tolerance():
    continuous = load_case("aileron").actuator
    sampled = replace(continuous, sampling=Sampling(current=1e-4, speed=5e-4, position=1e-3))
    inputs = {"reference": Step(time=0.01, after=0.02)}
    runs = [
        simulate(plant, 0.3, inputs=inputs, resolution=1e-3, tolerance=tolerance, compiled=False)
        for plant, tolerance in ((sampled, 1e-6), (sampled, 1e-7), (continuous, 1e-6))
    ]
    assert [change[1:] for change in runs[0].changes] == [change[1:] for change in runs[1].changes]
    np.testing.assert_allclose(runs[0]["load_angle"], runs[1]["load_angle"], atol=1e-6)
    near = np.abs(np.interp(runs[0].t, runs[2].t, runs[2]["load_angle"]) - runs[0]["load_angle"])
    assert near.max() < 0.03 * 0.02
    assert runs[0].margins.min() >= -1e-9


def test_the_interpreted_and_the_compiled_run_are_the_same():
    plant = servo(period=1e-2, bearings=GUIDE)
    runs = [simulate(plant, 1.0, inputs={"reference": 0.4}, resolution=1e-2, compiled=c) for c in (False, None)]
    np.testing.assert_allclose(runs[0]["load_angle"], runs[1]["load_angle"], atol=1e-12)


# -- errors -------------------------------------------------------------------------------------------------


def test_periods_that_do_not_nest_are_refused_with_their_numbers():
    with pytest.raises(ValueError, match=r"speed 0.00025 s is 2.5 times current 0.0001 s"):
        Sampling(current=1e-4, speed=2.5e-4, position=1e-3)


def test_loops_without_a_period_are_named():
    with pytest.raises(ValueError, match=r"loops of its controller \(position\), got speed, position"):
        replace(servo(), sampling=Sampling(speed=1e-3, position=1e-2))


def test_a_period_can_be_swept_and_its_ratio_not():
    plant = servo()
    slow = simulate(plant, 0.5, inputs={"reference": 0.1}, parameters={"sampling.position": 2e-2}, compiled=False)
    built = simulate(servo(period=2e-2), 0.5, inputs={"reference": 0.1}, compiled=False)
    assert slow["load_angle"][-1] == pytest.approx(built["load_angle"][-1], abs=1e-9)
    fast = replace(load_case("aileron").actuator, sampling=Sampling(current=1e-4, speed=5e-4, position=1e-3))
    with pytest.raises(ValueError, match="change all periods by the same factor"):
        simulate(fast, 0.1, parameters={"sampling.current": 5e-4})


def test_the_hunting_sampled_aileron_loses_no_mode_change_against_a_tolerance_ten_times_tighter():
    """10 kHz, two stages with gaps, encoders, dead time and drops: through the step and the first swings."""
    case = load_case("aileron-sampled")
    runs = [
        simulate(case.actuator, 0.5, inputs=case.inputs, resolution=2e-3, tolerance=tolerance, compiled=False)
        for tolerance in (1e-6, 1e-7)
    ]
    assert len(runs[0].changes) > 50
    assert [change[1:] for change in runs[0].changes] == [change[1:] for change in runs[1].changes]
    np.testing.assert_allclose(
        [change.time for change in runs[0].changes], [change.time for change in runs[1].changes], atol=2e-4
    )
    assert all(run.margins.min() >= -1e-9 for run in runs)
