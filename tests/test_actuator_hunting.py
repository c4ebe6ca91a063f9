"""The verdict on hunting, from runs whose answer is known.

Oracles: runs made by hand from cycles of known period, amplitude and stick fraction; describing functions for a loop
with limited torque; the times of the engine's own events for a loop with backlash; unstable loads.
"""

import math

import casadi as ca
import numpy as np
import pytest
from mass_on_guide import MassOnGuide
from scipy.optimize import brentq

from actuator import (
    Actuator,
    Load,
    ModeChange,
    Ramp,
    Run,
    Step,
    TorqueSource,
    classify,
    loop_transfer,
    margins,
    simulate,
    trim,
)
from actuator.parts.sensors import AngleSensor, Sensors
from actuator.simulation.run import Statistics
from actuator.system.hybrid import HybridSystem, Quantity
from actuator.verdict.peaks import find_turning_points
from controllers import PID, Sampling
from gear import Backlash, Bearing, Coulomb, Coupling, ExternalPair, Linear, Mesh, Shaft, Transmission
from gear.quantities.roles import ControllerMemory, Heat

CONTACT = "gear.bearings.only"

# -- runs by hand -------------------------------------------------------------------------------------------


def run_of(time, load, *, changes=(), mode="forward", integral=None, losses=None, **signals):
    """A run in which the load, and the motor ten times as far, moved as given, with one contact."""
    signals = {"load_angle": load, "motor_angle": 10 * load} | signals | (losses or {})
    states = () if integral is None else (Quantity("controller.integral", "N m", roles=(ControllerMemory(),)),)
    signals |= {} if integral is None else {"controller.integral": integral}
    words = np.array([mode, *(after for _, after in changes)])
    row = words[np.searchsorted([moment for moment, _ in changes], time, side="right")]
    none = ca.Function("none", [], [])
    return Run(
        system=HybridSystem(
            name="by hand",
            states=states,
            mode_variables=(),
            inputs=(Quantity("reference", "rad"),) if "reference" in signals else (),
            outputs=tuple(Quantity(name, "W", roles=(Heat(name),)) for name in losses or {}),
            events=(),
            parameters=(),
            flow=none,
            margins=none,
            reset=none,
            outputs_function=none,
        ),
        t=time,
        signals=signals,
        units=dict.fromkeys(signals, "rad"),
        modes={CONTACT: row},
        mode_values=np.zeros((1, len(time))),
        changes=tuple(
            ModeChange(moment, CONTACT, str(before), after)
            for (moment, after), before in zip(changes, words, strict=False)
        ),
        margins=np.zeros((0, len(time))),
        parameters=np.zeros(0),
        statistics=Statistics(wall_s=0.0, simulated_s=time[-1], events=len(changes), settled=0, compiled=False),
    )


def periodic(corners, period, cycles, points=4000):
    """A run along straight lines through (part of the period, angle), stuck where a line is level."""
    shares, angles = np.array([*corners, (1.0, corners[0][1])]).T
    time = np.linspace(0, cycles * period, points + 1)
    load = np.interp(time / period % 1.0, shares, angles)
    level = [a == b for a, b in zip(angles, angles[1:], strict=False)]
    words = ["stuck" if flat else "forward" for flat in level]
    changes = [
        (period * (cycle + share), word)
        for cycle in range(cycles)
        for share, word in zip(shares[:-1], words, strict=True)
    ]
    changes = [
        change for before, change in zip([(0.0, "forward"), *changes], changes, strict=False) if change[1] != before[1]
    ]
    return run_of(time, load, changes=changes[1:] if changes[0][0] == 0 else changes, mode=words[0])


CYCLES = {
    "stick-slip": ([(0, -1), (0.1, 1), (0.5, 1), (0.6, -1)], 1.0, 0.8),
    "fast up, slow down": ([(0, -1), (0.05, 1), (0.35, 1), (0.9, -1)], 1.0, 0.4),
    "two stops on the way up and one at the top": ([(0, -1), (0.1, 0), (0.3, 0), (0.4, 1), (0.7, 1)], 1.0, 0.5),
    "a small swing inside a large one": (
        [(0, 0), (0.1, 1), (0.3, 1), (0.4, 0.4), (0.5, 0.4), (0.6, 2), (0.8, 2)],
        1.0,
        0.5,
    ),
    "unequal upper stops": ([(0, -1), (0.1, 1), (0.4, 1), (0.5, -1), (0.55, -1), (0.65, 0.5), (0.9, 0.5)], 1.0, 0.6),
}


@pytest.mark.parametrize("period", [0.02, 3.0, 400.0])
@pytest.mark.parametrize("name", CYCLES)
def test_a_cycle_with_stops_is_hunting_with_its_period_amplitude_and_stick_fraction(name, period):
    corners, amplitude, stuck = CYCLES[name]
    hunting = classify(periodic(corners, period, cycles=20))
    assert hunting.verdict == "hunting", hunting.reason
    assert hunting.cycles
    assert hunting.period_s == pytest.approx(period, rel=1e-3)
    assert hunting.amplitude_rad == pytest.approx(amplitude, rel=0.02)
    assert hunting.motor_amplitude_rad == pytest.approx(10 * amplitude, rel=0.02)
    assert hunting.stick_fraction == pytest.approx(stuck, abs=0.005)


@pytest.mark.parametrize("points", [16, 25, 33, 50, 77, 200])
def test_the_period_does_not_depend_on_the_number_of_output_points(points):
    time = np.arange(60 * points) / points * 0.9817
    hunting = classify(run_of(time, np.sin(2 * np.pi * time / 0.9817 * 1.0037)))
    assert hunting.verdict == "limit cycle without sticking", hunting.reason
    assert hunting.period_s == pytest.approx(0.9817 / 1.0037, rel=1e-2)


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e3])
def test_the_verdict_does_not_depend_on_the_size_of_the_cycle(scale):
    time = np.linspace(0, 30, 3001)
    hunting = classify(run_of(time, scale * np.sin(2 * np.pi * time)))
    assert hunting.verdict == "limit cycle without sticking"
    assert hunting.amplitude_rad == pytest.approx(scale, rel=1e-3)
    assert hunting.stick_fraction == 0


def test_a_cycle_reached_after_a_transient_is_found():
    time = np.linspace(0, 60, 6001)
    hunting = classify(run_of(time, (1 + 3 * np.exp(-time / 5)) * np.sin(2 * np.pi * time)))
    assert hunting.verdict == "limit cycle without sticking"
    assert hunting.amplitude_rad == pytest.approx(1.0, rel=1e-3)


@pytest.mark.parametrize("growth", [1.15, 1.5, 3.0, 20.0])
def test_growing_swings_are_diverging(growth):
    time = np.linspace(0, 20, 4001)
    hunting = classify(run_of(time, 1e-3 * growth ** (2 * time) * np.sin(2 * np.pi * time)))  # per half period
    assert hunting.verdict == "diverging", hunting.reason
    assert math.isnan(hunting.period_s)


@pytest.mark.parametrize("decay", [0.9, 0.5, 0.1])
def test_shrinking_swings_are_on_their_way_to_rest(decay):
    time = np.linspace(0, 20, 4001)
    hunting = classify(run_of(time, decay ** (2 * time) * np.sin(2 * np.pi * time)))
    assert hunting.verdict == "rest", hunting.reason


def test_a_load_that_stands_still_is_at_rest():
    time = np.linspace(0, 10, 1001)
    assert classify(run_of(time, np.minimum(time, 2.0))).verdict == "rest"
    assert classify(run_of(time, 1 - np.exp(-time / 0.3))).verdict == "rest"


def test_a_load_that_stands_still_while_the_integrator_runs_is_not_at_rest():
    time = np.linspace(0, 10, 1001)
    hunting = classify(run_of(time, np.minimum(time, 2.0), integral=0.1 * time))
    assert hunting.verdict == "undecided"
    assert (
        "controller.integral still drifts: it changed by 0.249 N m in the last quarter; simulate longer"
        in hunting.reason
    )
    assert classify(run_of(time, np.minimum(time, 2.0), integral=np.exp(-time / 0.3))).verdict == "rest"


def test_a_load_that_still_travels_is_not_at_rest():
    time = np.linspace(0, 10, 1001)
    for load in (time, 1 - np.exp(-time / 8), np.sin(2 * np.pi * time / 60)):
        assert classify(run_of(time, load)).verdict == "undecided"


def test_two_stops_before_the_next_breakaway_are_not_rest():
    # the first 30 s of a cycle of 23 s: a step, an overshoot, a long stop behind which the torque builds up
    time = np.linspace(0, 30, 3001)
    load = np.interp(time, [0, 3, 5, 8, 20, 22, 30], [0, 1.3, 1.3, 0.7, 0.7, 1.07, 1.07])
    hunting = classify(run_of(time, load, integral=np.where(time > 22, 0.28 * (time - 22), 0.0)))
    assert hunting.verdict == "undecided", hunting.reason


def test_swings_without_a_pattern_are_irregular():
    time = np.linspace(0, 100, 20_001)
    hunting = classify(run_of(time, np.sin(2 * np.pi * time) + np.sin(2 * np.pi * math.sqrt(2) * time)))
    assert hunting.verdict == "irregular"
    assert not hunting.decided  # a longer run may tell
    assert "swings of the load in 100 s neither repeat nor settle" in hunting.reason


@pytest.mark.parametrize("cycles", [0.3, 0.8, 1.4])
def test_less_than_two_periods_are_too_short_for_a_verdict(cycles):
    time = np.linspace(0, cycles, 2001)
    hunting = classify(run_of(time, np.sin(2 * np.pi * time)))
    assert hunting.verdict == "undecided"
    assert "simulate longer" in hunting.reason


def test_too_few_points_after_the_last_change_of_an_input_are_too_short_for_a_verdict():
    time = np.linspace(0, 10, 1001)
    hunting = classify(run_of(time, np.sin(time), reference=(time >= 9.9).astype(float)))
    assert hunting.verdict == "undecided"
    assert "only 11 output points after the last change of an input; simulate longer" in hunting.reason


def test_only_the_time_after_the_last_change_of_an_input_counts():
    time = np.linspace(0, 40, 8001)
    load = np.where(time < 10, np.sin(2 * np.pi * 3 * time), 0.2 * np.sin(2 * np.pi * time))
    hunting = classify(run_of(time, load, reference=(time >= 10).astype(float)))
    assert hunting.period_s == pytest.approx(1.0, rel=1e-3)
    later = classify(run_of(time, np.where(time < 20, load, 0.0)), since=25.0)
    assert later.verdict == "rest"


def test_an_input_that_never_stops_changing_gives_no_verdict():
    time = np.linspace(0, 10, 1001)
    assert classify(run_of(time, time, reference=time)).verdict == "undecided"


def test_a_cycle_that_crawls_away_keeps_its_period():
    time = np.linspace(0, 40, 8001)
    hunting = classify(run_of(time, np.sin(2 * np.pi * time) + 1e-3 * time))
    assert hunting.verdict == "limit cycle without sticking"
    assert hunting.period_s == pytest.approx(1.0, rel=1e-3)


def test_turning_points_count_a_plateau_at_its_first_point():
    signal = np.array([0.0, 0.5, 1.0, 1.0, 1.0, 0.2, -1.0, -1.0, 0.5, 0.45, 1.0, 0.0])
    assert find_turning_points(signal, 0.1) == [0, 2, 6, 10]  # the start opens the first swing
    assert find_turning_points(signal, 5.0) == []


@pytest.mark.parametrize(
    ("start", "end", "expected"),
    [(0.0, 10.0, 0.4), (1.5, 2.5, 0.5), (2.5, 4.5, 0.75), (4.03, 5.0, 0.0), (2.2, 3.3, 1.0)],
)
@pytest.mark.parametrize("points", [11, 101, 10_001])
def test_the_stuck_share_comes_from_the_times_of_the_changes(start, end, expected, points):
    time = np.linspace(0, 10, points)
    run = run_of(time, time, changes=[(2.0, "stuck"), (4.0, "forward"), (8.0, "stuck")])
    assert run.stuck_share(start, end) == pytest.approx(expected, abs=1e-12)


# -- runs of simple systems ---------------------------------------------------------------------------------

TORQUE_LIMIT = 2.0  # N m


def two_masses(proportional, torque_limit=TORQUE_LIMIT):
    """A torque on one mass positions the other, on a spring behind it: too much gain is unstable."""
    gear = Transmission(
        shafts={"motor": Shaft(inertia=1.0), "load": Shaft(inertia=2.0)},
        couplings={"shaft": Coupling(a="motor", b="load", stiffness=50.0, damping=0.2)},
        input="motor",
        output="load",
    )
    return Actuator(
        motor=TorqueSource(torque_limit=torque_limit),
        gear=gear,
        load=Load(damping=1.5),
        controller=PID(proportional=proportional, integral=0.0, derivative=0.0),
    )


def critical():
    """Largest stable gain, and the frequency [rad/s] at which the loop oscillates there."""
    point = trim(two_masses(1.0), "forward")
    found = margins(loop_transfer(point, "position"))
    return found.gain, found.gain_frequency


@pytest.mark.parametrize("resolution", [None, 0.01])
def test_an_unstable_loop_with_limited_torque_cycles_as_its_describing_function_says(resolution):
    gain, frequency = critical()
    proportional = 3 * gain
    # the limiter passes a third of a sine with this amplitude, over the one at which it sets in
    ratio = brentq(lambda a: 2 / math.pi * (math.asin(1 / a) + math.sqrt(1 - 1 / a**2) / a) - 1 / 3, 1.001, 100)
    hunting = classify(
        simulate(two_masses(proportional), 60.0, inputs={"reference": 0.01}, resolution=resolution, compiled=False)
    )
    assert hunting.verdict == "limit cycle without sticking", hunting.reason
    assert hunting.period_s == pytest.approx(2 * math.pi / frequency, rel=0.01)
    assert hunting.amplitude_rad == pytest.approx(ratio * TORQUE_LIMIT / proportional, rel=0.02)


def test_the_same_loop_with_less_gain_comes_to_rest():
    plant = two_masses(0.3 * critical()[0])
    assert classify(simulate(plant, 120.0, inputs={"reference": 0.01}, compiled=False)).verdict == "rest"


@pytest.mark.parametrize(("times", "duration"), [(1.05, 12.0), (1.5, 10.0), (3.0, 6.0)])
def test_the_same_loop_without_a_limit_diverges(times, duration):
    plant = two_masses(times * critical()[0], torque_limit=None)
    hunting = classify(simulate(plant, duration, inputs={"reference": 0.01}, compiled=False))
    assert hunting.verdict == "diverging", hunting.reason


def test_backlash_cycles_without_sticking():
    mesh = Mesh(
        a="motor",
        b="load",
        pair=ExternalPair(teeth_a=20, teeth_b=60, module=1e-3),
        elasticity=Backlash(gap=1e-4, law=Linear(stiffness=1e7, damping=1e4)),
        friction=Coulomb(sliding=0.0, static=0.0),
    )
    gear = Transmission(
        shafts={"motor": Shaft(inertia=1e-3), "load": Shaft(inertia=9e-3)},
        meshes={"mesh": mesh},
        input="motor",
        output="load",
    )
    plant = Actuator(motor=TorqueSource(), gear=gear, controller=PID(proportional=5.0, integral=10.0, derivative=0.3))
    run = simulate(plant, 10.0, inputs={"reference": 0.1}, resolution=2e-3, compiled=False)
    engaged = [change.time for change in run.changes if change.before == "free"]
    hunting = classify(run)
    assert hunting.verdict == "limit cycle without sticking"
    assert hunting.stick_fraction == 0
    assert hunting.period_s == pytest.approx(engaged[-1] - engaged[-3], rel=1e-3)
    # about half the gap of 0.1 mm on the wheel's 30 mm
    assert 1e-4 < hunting.amplitude_rad < 1e-2


def unstable_load(controller, start):
    """A mass on a spring that pushes away from the middle."""
    guide = Bearing(shaft="mass", coulomb=0.0, breakaway=0.0)
    gear = Transmission(shafts={"mass": Shaft(inertia=1.0)}, bearings={"guide": guide}, input="mass", output="mass")
    plant = Actuator(motor=TorqueSource(), gear=gear, load=Load(stiffness=-10.0), controller=controller)
    return classify(simulate(plant, 6.0, start={"mass.angle": start}, compiled=False))


def test_an_unstable_load_without_control_diverges():
    hunting = unstable_load(None, 1e-3)
    assert hunting.verdict == "diverging", hunting.reason


def test_an_unstable_load_under_a_controller_without_damping_diverges():
    hunting = unstable_load(PID(proportional=400.0, integral=2000.0, derivative=0.0), 1e-3)
    assert hunting.verdict == "diverging", hunting.reason


def test_an_unstable_load_under_a_good_controller_comes_to_rest():
    assert unstable_load(PID(proportional=110.0, integral=100.0, derivative=20.0), 1e-3).verdict == "rest"


def test_a_reference_that_keeps_moving_gives_no_verdict_and_says_why():
    plant = two_masses(10.0)
    hunting = classify(simulate(plant, 10.0, inputs={"reference": Ramp(slope=0.1)}, compiled=False))
    assert hunting.verdict == "undecided"
    assert "after the last change of an input" in hunting.reason


def test_a_late_step_is_judged_by_what_follows_it():
    plant = two_masses(0.3 * critical()[0])
    hunting = classify(simulate(plant, 100.0, inputs={"reference": Step(time=99.8, after=0.1)}, compiled=False))
    assert hunting.verdict == "undecided"
    assert "simulate longer" in hunting.reason


# -- trends, drift, wear --------------------------------------------------------------------------------------


@pytest.mark.parametrize(("factor", "verdict"), [(0.99, "rest"), (0.995, "rest"), (1.008, "diverging")])
def test_swings_that_change_by_the_same_factor_ever_again_are_no_cycle(factor, verdict):
    time = np.linspace(0, 40, 8001)
    hunting = classify(run_of(time, factor**time * np.sin(2 * np.pi * time)))
    assert hunting.verdict == verdict, hunting.reason
    assert f"by a factor {factor:.3g} in each of" in hunting.reason


def test_a_cycle_that_has_ended_is_none():
    time = np.linspace(0, 40, 8001)
    assert classify(run_of(time, np.where(time < 21, np.sin(2 * np.pi * time), 0.0))).verdict == "rest"


def test_a_small_cycle_behind_a_long_large_transient_is_found():
    time = np.linspace(0, 40, 40_001)
    hunting = classify(run_of(time, 2 * np.exp(-time / 4) + 2e-4 * np.sin(2 * np.pi * 5 * time)))
    assert hunting.verdict == "limit cycle without sticking", hunting.reason
    assert hunting.period_s == pytest.approx(0.2, rel=1e-2)
    assert hunting.amplitude_rad == pytest.approx(2e-4, rel=0.1)  # and what is left of the transient in one period


@pytest.mark.parametrize("duration", [28.0, 29.0, 30.0])
def test_a_stuck_mass_under_integral_action_names_when_it_lets_go(duration):
    plant = MassOnGuide().actuator()
    hunting = classify(simulate(plant, duration, inputs={"reference": 1.0}, compiled=False))
    later = simulate(plant, 60.0, inputs={"reference": 1.0}, compiled=False)
    released = next(change.time for change in later.changes if change.before == "stuck" and change.time > duration)
    assert hunting.verdict == "undecided"
    # the torque grows in proportion to time while the mass stands
    assert hunting.breakaway_s == pytest.approx(released - duration, abs=1e-4)
    assert f"at the present rate breakaway occurs after {hunting.breakaway_s:.3g} s" in hunting.reason
    assert hunting.longer_s >= duration


@pytest.mark.parametrize("duration", [10.0, 30.0])
def test_as_much_longer_as_is_asked_for_decides(duration):
    plant, asked = MassOnGuide().actuator(), [duration]
    while not (hunting := classify(simulate(plant, sum(asked), inputs={"reference": 1.0}, compiled=False))).decided:
        asked.append(hunting.longer_s)
    assert hunting.verdict == "hunting"
    assert len(asked) <= 5


def test_an_integrator_with_a_dead_band_rests_with_a_standing_error_that_is_named():
    # wider than the error of 67 mrad at which the mass without it comes to stop
    plant = MassOnGuide(dead=0.1).actuator()
    hunting = classify(simulate(plant, 150.0, inputs={"reference": 1.0}, compiled=False))
    assert hunting.verdict == "rest", hunting.reason
    assert 1e-4 < abs(hunting.standing_error_rad) < 0.1
    assert f"{hunting.standing_error_rad:.3g} rad from its reference" in hunting.reason


def test_wear_of_a_cycle_is_what_is_counted_by_hand():
    corners, amplitude, _ = CYCLES["stick-slip"]
    found = classify(periodic(corners, 3.0, cycles=20)).duty
    assert found.load_reversals_per_h == pytest.approx(2 * 3600 / 3.0, rel=1e-3)
    assert found.motor_reversals_per_h == pytest.approx(2 * 3600 / 3.0, rel=1e-3)
    assert found.load_travel_per_h == pytest.approx(4 * amplitude * 3600 / 3.0, rel=1e-2)
    assert found.motor_travel_per_h == pytest.approx(40 * amplitude * 3600 / 3.0, rel=1e-2)
    assert math.isnan(found.current_rms) and math.isnan(found.mean_loss)


def test_current_and_loss_are_means_over_the_period():
    time = np.linspace(0, 30, 30_001)
    run = run_of(
        time,
        np.sin(2 * np.pi * time),
        current=3 + 4 * math.sqrt(2) * np.sin(2 * np.pi * time),
        losses={"copper_loss": 2 + np.sin(2 * np.pi * time), "friction_loss": 0.5 + 0 * time},
        gear_loss=100 + 0 * time,  # of one bearing, which the total has already: it does not have the role
    )
    found = classify(run).duty
    assert found.current_rms == pytest.approx(5.0, rel=1e-3)
    assert found.mean_loss == pytest.approx(2.5, rel=1e-3)


# -- sampled drives with counts ------------------------------------------------------------------------------


def arm(resolution):
    """A sampled PID on an inertia, without any friction."""
    gear = Transmission(shafts={"arm": Shaft(inertia=0.3)}, input="arm", output="arm")
    return Actuator(
        motor=TorqueSource(),
        gear=gear,
        controller=PID.for_inertia(inertia=0.3, bandwidth=20.0, filter_time=5e-3),
        sampling=Sampling(position=2e-3, delay=1),
        sensors=Sensors(load=AngleSensor(resolution=resolution)),
    )


def test_a_drive_that_cannot_rest_between_two_counts_hunts_for_its_quantizer():
    hunting = classify(simulate(arm(1e-3), 20.0, inputs={"reference": 0.1234}, resolution=2e-3, compiled=False))
    assert hunting.verdict == "quantizer hunting"
    assert hunting.cycles
    assert 2 * hunting.amplitude_rad < 3e-3
    assert "counts of the sensor, of 0.001 rad" in hunting.reason
    still = classify(simulate(arm(None), 20.0, inputs={"reference": 0.1234}, resolution=2e-3, compiled=False))
    assert still.verdict == "rest"
    assert still.standing_error_rad == pytest.approx(0, abs=1e-9)
