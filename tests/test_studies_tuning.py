"""Tuning: derivatives against differences, loops against `loop_transfer`, optima in closed form, a small study.

Oracles: an inertia behind an ideal current loop under P and PI, whose step compliance, bandwidth and optimum are closed
forms, with the multiplier of the demand that decides; difference quotients; `loop_margins`.
"""

import json
import math
from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner

from actuator import Actuator, CurrentSource, Load, TorqueSource, loop_transfer, margins, trim
from actuator.linear.derivatives.continuous import Response, gain_model
from controllers import Cascade, IntegralRemedies
from controllers.pid import PI, PID, P
from gear import Bearing, Shaft, Stribeck, Transmission
from studies import CaseError, load_case
from studies.__main__ import main
from studies.cache import Cache, fingerprint
from studies.corners import Corner
from studies.specification import Change, Criterion, Demand, Specification, Tuning, load_specification
from studies.tuning.check import SINE, Bench, CornerCheck, StepCase, Trial, check_corners, step_trials
from studies.tuning.design import Active, design
from studies.tuning.loops import curves_at, phase_and_delay_margin
from studies.tuning.measures import measures, worst
from studies.tuning.modes import corner_modes, slide_at_breakaway
from studies.tuning.plant import (
    NotTunable,
    add_dead_band,
    inertia_at_motor,
    initial_gains,
    prepare_linear,
    with_dead_band,
)
from studies.tuning.result import shortfalls
from studies.tuning.stiction import (
    ACCURACY,
    MOST,
    Search,
    Seeker,
    StictionMargin,
    least_margin,
    lowest_factor,
    make_ladder,
    stiction_margins,
)
from studies.tuning.study import find_twins, tune

pytestmark = pytest.mark.thorough

DEAD_BAND = "controller.speed.remedies.dead_band"
LOOPS = ("speed_reference", "torque_reference")
PID_PATH = "controller."
GAINS = ("controller.position.gain", "controller.speed.proportional", "controller.speed.integral")
POSITION, SPEED, INTEGRAL = GAINS
INPUTS = ("reference", "load_torque", "inject.speed_reference", "inject.torque_reference")
OUTPUTS = ("load_angle", "current", "speed_reference", "torque_reference")
FREQUENCIES = np.logspace(1, 3.5, 40)  # below, T = -1 but for rounding, and so is the difference quotient of L
INERTIA, COULOMB, BREAKAWAY = 0.01, 0.1, 0.16


def servo(gain=20.0, proportional=0.8, integral=8.0, coulomb=COULOMB, breakaway=BREAKAWAY):
    """One inertia with friction behind a motor that gets its torque at once."""
    bearings = {"shaft": Bearing(shaft="shaft", coulomb=coulomb, breakaway=breakaway, viscous=0.0)}
    gear = Transmission(shafts={"shaft": Shaft(inertia=INERTIA / 2)}, bearings=bearings, input="shaft", output="shaft")
    law = PI(proportional=proportional, integral=integral)
    controller = Cascade(position=P(gain=gain), speed=law, current=None, speed_limit=1e3)
    motor = CurrentSource(torque_constant=1.0, inertia=INERTIA / 2)
    return Actuator(name="servo", motor=motor, gear=gear, load=Load(), controller=controller)


@pytest.fixture(scope="module")
def aileron():
    return load_case("aileron").actuator


@pytest.fixture(scope="module")
def one():
    return servo()


def demand(**changed):
    usual = {
        "stroke": 1.0,
        "amplitude": 0.05,
        "bandwidth": 1.0,
        "gain_margin": 1.5,
        "phase_margin": 0.5,
        "delay_margin": 1e-3,
        "overshoot": 0.5,
        "stiffness": 0.1,
        "peak_current": 100.0,
        "standing_error": 0.1,
        "stiction_margin": 1.5,
    }
    return Demand(**{**usual, **changed})


def model_at(plant, gains, word="forward", names=GAINS):
    point = trim(plant, word, inputs={"reference": 0.1}, parameters=dict(zip(names, gains, strict=True)))
    return point, gain_model(point, names, INPUTS, OUTPUTS)


# -- exact derivatives ------------------------------------------------------------------------------------


@pytest.mark.parametrize("at", LOOPS)
def test_loop_and_its_derivatives_by_gains(aileron, at):
    gains = (60.0, 0.0072, 0.36)
    point, model = model_at(aileron, gains)
    loop = model.loop(at, FREQUENCIES)
    assert loop.value == pytest.approx(loop_transfer(point, at)(1j * FREQUENCIES), rel=1e-7)
    for k, gain in enumerate(gains):
        stencil = []
        for step in (-2, -1, 1, 2):
            changed = [*gains[:k], gain * (1 + 3e-3 * step), *gains[k + 1 :]]
            stencil.append(model_at(aileron, changed)[1].loop(at, FREQUENCIES).value)
        quotient = (stencil[0] - 8 * stencil[1] + 8 * stencil[2] - stencil[3]) / (36e-3 * gain)
        size = abs(quotient) + 1e-3 * abs(loop.value) / gain
        assert (abs(loop.slopes[:, k] - quotient) / size).max() < 1e-6
    stencil = [model.loop(at, FREQUENCIES * (1 + 3e-3 * step)).value for step in (-2, -1, 1, 2)]
    quotient = (stencil[0] - 8 * stencil[1] + 8 * stencil[2] - stencil[3]) / (36e-3 * FREQUENCIES)
    assert loop.by_frequency == pytest.approx(quotient, rel=1e-6)


def test_an_operating_point_that_moves_with_the_gains_is_accounted_for():
    # gravity: the stiffness at the load follows the angle, and that the gain, as there is no integral
    from actuator import Gravity

    plant = servo(integral=0.0)
    plant = replace(plant, load=Load(gravity=Gravity(moment=0.5)))

    def compliance(gain):
        point = trim(plant, "forward", inputs={"reference": 0.4}, parameters={POSITION: gain})
        return gain_model(point, (POSITION,), ("load_torque",), ("load_angle",)).response(
            "load_torque", "load_angle", [3.0]
        )

    exact = compliance(20.0)
    quotient = (compliance(20.01).value - compliance(19.99).value) / 0.02
    assert exact.slopes[:, 0] == pytest.approx(quotient, rel=1e-6)
    point = trim(plant, "forward", inputs={"reference": 0.4}, parameters={POSITION: 20.0})
    frozen = replace(gain_model(point, (POSITION,), ("load_torque",), ("load_angle",)))
    assert abs(frozen.slopes[0]).max() > 0


def test_step_response_and_its_derivatives(one):
    _, model = model_at(one, (20.0, 0.8, 8.0))
    found = model.step_at("reference", "load_angle", 0.05)
    assert model.steps("reference", "load_angle", 0.01, 6)[5] == pytest.approx(float(found.value), rel=1e-9)
    for k, gain in enumerate((20.0, 0.8, 8.0)):
        ends = []
        for sign in (1, -1):
            gains = [20.0, 0.8, 8.0]
            gains[k] = gain * (1 + sign * 1e-4)
            ends.append(float(model_at(one, gains)[1].step_at("reference", "load_angle", 0.05).value))
        assert found.slopes[k] == pytest.approx((ends[0] - ends[1]) / (2e-4 * gain), rel=1e-6)


def test_every_measure_has_exact_slopes(one):
    gains = dict(zip(GAINS, (20.0, 0.8, 30.0), strict=True))
    modes = corner_modes(prepare_linear(one), Corner("", {}), 1.5, gains)
    middle = measures(modes, gains, demand(), {})
    for k, name in enumerate(gains):
        up, down = (
            measures(modes, {**gains, name: gains[name] * math.exp(step)}, demand(), {}) for step in (1e-5, -1e-5)
        )
        for here, above, below in zip(middle, up, down, strict=True):
            assert here.slopes[k] == pytest.approx((above.slack - below.slack) / 2e-5, rel=1e-5, abs=1e-6), here.name


def test_margins_are_those_of_loop_margins(aileron):
    gains = dict(zip(GAINS, (60.0, 0.0072, 0.36), strict=True))
    modes = corner_modes(aileron, Corner("", {}), 1.0, gains)
    found = {(m.name, m.mode): m.value for m in measures(modes, gains, demand(), {})}
    for at in LOOPS:
        expected = margins(loop_transfer(modes.points["forward"], at))
        words = at.replace("_", " ")
        assert found[f"phase margin at {words}", "forward"] == pytest.approx(expected.phase_rad, rel=1e-6)
        assert found[f"delay margin at {words}", "forward"] == pytest.approx(expected.delay_s, rel=1e-6)
        either_way = min(max(crossing.gain, 1 / crossing.gain) for crossing in expected.phase_crossings)
        assert found[f"gain margin at {words}", "forward"] == pytest.approx(min(either_way, 100.0), rel=1e-6)


@pytest.mark.parametrize(
    ("stable", "angle", "phase", "delay"),
    [
        (True, -170.0, 10.0, 10.0),
        (True, 170.0, 10.0, 350.0),  # a lead is nearest: a delay takes the rest of the turn
        (False, 170.0, -10.0, -10.0),
        (False, -170.0, -10.0, -10.0),
    ],
)
def test_phase_and_delay_of_an_integrator_that_is_turned(stable, angle, phase, delay):
    # L = k/w exp(j angle): crosses at w = k, and d(lag/w)/dk = -lag/k^2
    turned, gain, frequencies = np.exp(1j * math.radians(angle)), 3.0, np.logspace(-1, 2, 40)

    def loop(at, w):
        value = gain / np.asarray(w) * turned
        return Response(value, (value / gain)[:, None], -value / np.asarray(w))

    model = SimpleNamespace(loop=loop, stable=stable, gains=("k",))
    curves = SimpleNamespace(
        frequencies=lambda at: frequencies, loop=lambda at: loop(at, frequencies).value, model=model
    )
    lag, late = phase_and_delay_margin(curves, "x")
    assert lag.size == pytest.approx(math.radians(phase))
    assert lag.slopes == pytest.approx([0.0], abs=1e-9)
    assert late.size == pytest.approx(math.radians(delay) / gain)
    assert late.slopes == pytest.approx([-math.radians(delay) / gain**2])


@pytest.mark.parametrize(("stable", "delay"), [(True, math.inf), (False, 0.0)])
def test_without_a_crossing_no_delay_is_too_long(stable, delay):
    frequencies = np.logspace(-1, 2, 40)
    model = SimpleNamespace(stable=stable, gains=("k",))
    curves = SimpleNamespace(frequencies=lambda at: frequencies, loop=lambda at: 0.1 / (1j + frequencies), model=model)
    lag, late = phase_and_delay_margin(curves, "x")
    assert (lag.size, late.size) == (math.copysign(math.pi, 1 if stable else -1), delay)


def test_stiffness_is_the_least_of_all_frequencies(aileron):
    gains = dict(zip(GAINS, (60.0, 0.0072, 0.36), strict=True))
    modes = corner_modes(aileron, Corner("", {}), 1.0, gains)
    found = worst(measures(modes, gains, demand(), {}, "forward"))
    model = curves_at(modes.points["forward"], gains).model
    sizes = abs(model.response("load_torque", "load_angle", np.logspace(0, 4, 20000)).value)
    assert found["stiffness"].value == pytest.approx(1 / sizes.max(), rel=1e-5)


# -- closed forms -----------------------------------------------------------------------------------------


def test_friction_and_what_a_release_sets_free(one):
    modes = corner_modes(prepare_linear(one), Corner("", {}), 1.5, {})
    assert modes.friction == pytest.approx(COULOMB, rel=1e-9)
    assert modes.released["forward"] == pytest.approx(1.5 * BREAKAWAY - COULOMB, rel=1e-9)


def test_slip_and_bandwidth_in_closed_form(one):
    # J s^2 + Kp s + Kp g = 0 with poles -a, -b and no integral: a step of torque ends at 1/(Kp g) from below
    gains = {POSITION: 10.0, SPEED: 0.5}
    parameters = {INTEGRAL: 1e-12}
    modes = corner_modes(prepare_linear(one), Corner("", parameters), 1.5, gains)
    found = worst(measures(modes, gains, demand(), {}))
    assert found["slip"].value == pytest.approx((1.5 * BREAKAWAY - COULOMB) / 5.0, rel=1e-6)
    s = 2j * math.pi
    plain = INERTIA * s**2 + 0.5 * s + 5.0
    opposed = 1j * 4 * math.sqrt(2) * COULOMB / (math.pi * 0.05)
    assert found["bandwidth"].value == pytest.approx(abs(5.0 / (plain + opposed)), rel=1e-9)


def test_start_in_closed_form(aileron, one):
    assert inertia_at_motor(one) == pytest.approx(INERTIA)
    rotor, pinion, idler, surface = 2e-5, 2e-5, 5e-5 / 5**2, (5e-4 + 0.03) / 35**2
    assert inertia_at_motor(aileron) == pytest.approx(rotor + pinion + idler + surface, rel=1e-9)
    start = initial_gains(one, demand())
    rate = 2 * math.pi * 1.5
    assert start[POSITION] == pytest.approx(rate)
    assert start[SPEED] == pytest.approx(INERTIA * 5 * rate)
    assert start[INTEGRAL] == pytest.approx(INERTIA * 4 * rate * rate)


def test_breakaway_is_never_below_the_sliding_friction_of_any_law(aileron):
    law = Stribeck(static=0.12, coulomb=0.1, stribeck_speed=0.01)
    mesh = replace(aileron.gear.meshes["first"], friction=law)
    plant = replace(aileron, gear=replace(aileron.gear, meshes={**aileron.gear.meshes, "first": mesh}))
    static, system = "gear.meshes.first.friction.static", plant.system()
    steps = step_trials(Corner("", {}), {}, demand(), system.parameters, 0.5)
    assert {trial.parameters[static] for trial in steps.values()} == {0.1}
    values = {p.name: float(p.default) for p in system.parameters}
    assert slide_at_breakaway(system.parameters, values, 2.0)["gear.meshes.first.friction.coulomb"] == 0.24


# -- a PID -----------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def positioner():
    """The same inertia behind a torque source and a gearless PID."""
    bearings = {"shaft": Bearing(shaft="shaft", coulomb=COULOMB, breakaway=BREAKAWAY, viscous=0.0)}
    gear = Transmission(shafts={"shaft": Shaft(inertia=INERTIA)}, bearings=bearings, input="shaft", output="shaft")
    law = PID(proportional=4.0, integral=20.0, derivative=0.3, filter_time=2e-3)
    return Actuator(name="positioner", motor=TorqueSource(), gear=gear, load=Load(), controller=law)


def test_pid_starts_with_three_poles_at_one_rate(positioner):
    start = initial_gains(positioner, demand())
    rate = 2 * math.pi * 1.5
    law = (INERTIA, start[f"{PID_PATH}derivative"], start[f"{PID_PATH}proportional"], start[f"{PID_PATH}integral"])
    assert np.roots(law) == pytest.approx([-rate] * 3, rel=1e-4)
    assert start[f"{PID_PATH}filter_time"] == pytest.approx(0.1 / rate)
    assert with_dead_band(positioner, start, 1e-3)[f"{PID_PATH}remedies.dead_band"] == 1e-3


def test_pid_slip_and_effort_in_closed_form(positioner):
    # without an integral a step of torque ends at 1/Kp, from below where Kd > 2 sqrt(J Kp); the first demand is Kp sine
    gains = {f"{PID_PATH}proportional": 4.0, f"{PID_PATH}derivative": 0.5}
    plant = prepare_linear(positioner)
    corner = Corner("", {f"{PID_PATH}integral": 1e-12, f"{PID_PATH}filter_time": 1e-5})
    modes = corner_modes(plant, corner, 1.5, gains)
    task = demand(peak_current=None, peak_torque=1.0)
    found = measures(modes, gains, task, {})
    deciding = worst(found)
    assert deciding["slip"].value == pytest.approx((1.5 * BREAKAWAY - COULOMB) / 4.0, rel=1e-3)
    assert deciding["peak torque"].value == pytest.approx(COULOMB + 4.0 * task.sine, rel=1e-6)
    tighter = worst(measures(modes, gains, task, {"peak torque": 1.25}))["peak torque"]
    assert tighter.slack == pytest.approx(deciding["peak torque"].slack - math.log(1.25))
    assert {m.name for m in found if "margin" in m.name} >= {"phase margin at position", "delay margin at position"}


def test_a_pid_is_tuned_until_it_does_not_hunt(positioner):
    names = tuple(f"{PID_PATH}{name}" for name in ("proportional", "derivative", "filter_time"))
    task = Specification(
        title="Positioner",
        case="",
        demand=demand(peak_current=None, peak_torque=3.0, stiction_margin=1.2),
        tuning=Tuning(gains=names, dead_band=True, range=20.0),
    )
    start = {name: value for name, value in initial_gains(positioner, task.demand).items() if name in names}
    modes = corner_modes(prepare_linear(positioner), Corner("only", {}), 1.2, start)
    found = design([modes], start, task)
    gains = with_dead_band(positioner, found.gains, found.standing_error)
    plant, corner = add_dead_band(positioner), Corner("only", {})
    ((as_it_was,), (tuned,)) = (check_corners(plant, [corner], g, task.demand, workers=1) for g in ({}, gains))
    assert as_it_was.hunts(1.0)
    assert shortfalls([tuned], task.demand) == {}
    assert tuned.peak_torque <= 3.0 * 1.001
    assert math.isnan(tuned.peak_current)


# -- what simulations ask for -----------------------------------------------------------------------------


def check(**changed):
    usual = {
        "corner": "",
        "verdicts": {StepCase(1.0, 1.0): "rest", StepCase(1.0, 1.5): "rest"},
        "cycle": 0.0,
        "standing_error": 0.01,
        "followed": 0.9,
        "settled": True,
        "overshoot": 0.1,
        "peak_current": 10.0,
        "peak_torque": 10.0,
    }
    return CornerCheck(**{**usual, **changed})


@pytest.mark.parametrize(
    ("changed", "asked"),
    [
        ({}, {}),
        ({"overshoot": 0.6}, {"overshoot": 1.02 * 1.2}),
        ({"peak_current": 120.0}, {"peak current": 1.02 * 1.2}),
        ({"standing_error": 0.11}, {"standing error": 1.02 * 1.1}),
        ({"followed": 0.5}, {"bandwidth": 1.02 / (math.sqrt(2) * 0.5)}),
        ({"followed": 0.0}, {"bandwidth": 1.02 / (math.sqrt(2) * 0.1)}),
        ({"verdicts": {StepCase(1.0, 1.5): "hunting"}}, {"slip": 1.25}),
        # what hunts is first to stop hunting
        ({"verdicts": {StepCase(1.0, 1.0): "hunting"}, "overshoot": 2.0, "peak_current": 1e3}, {"slip": 1.25}),
    ],
)
def test_what_simulations_show_short_is_tightened_by_as_much(changed, asked):
    assert shortfalls([check(), check(**changed)], demand()) == pytest.approx(asked)


def test_a_sine_that_failed_is_one_that_does_not_follow(one, monkeypatch):
    bench = Bench(one)
    failed = SimpleNamespace(harmonics=[[[0.0, 0.0], [math.nan, math.nan]]], settled=False)
    monkeypatch.setattr(bench, "stream", SimpleNamespace(measure=lambda point: failed))
    assert bench(Trial(SINE, {}, 0.05, 1.0)) == {"followed": 0.0, "settled": False}


def test_steps_begin_at_rest():
    # all is linear but for a trace of friction: a bias held from the beginning adds to the torque, not to the overshoot
    plant = servo(gain=30.0, proportional=0.3, integral=2.0, coulomb=1e-4, breakaway=1e-4)
    task = demand(amplitude=0.05)
    plain, biased = check_corners(plant, [Corner("a", {}), Corner("b", {"load.bias": -0.5})], {}, task, workers=1)
    assert plain.overshoot > 0.05
    assert biased.overshoot == pytest.approx(plain.overshoot, rel=2e-3)
    assert biased.peak_torque == pytest.approx(plain.peak_torque + 0.5, rel=2e-3)


def test_tightened_demands_are_met_by_as_much_more(one):
    start = {POSITION: 10.0, SPEED: 0.3}
    modes = corner_modes(prepare_linear(one), Corner("only", {INTEGRAL: 1e-12}), 1.5, start)
    task = specification(peak_current=2.0)
    plain, tight = (design([modes], start, task, asked) for asked in ({}, {"peak current": 1.25}))
    for found, limit in ((plain, 2.0), (tight, 1.6)):
        assert worst(found.measures)["peak current"].value == pytest.approx(limit, rel=1e-4)
    closer = design([modes], start, specification(), {"standing error": 4.0})
    assert closer.standing_error <= 0.1 / 4.0


# -- where hunting begins ---------------------------------------------------------------------------------


class Pretender(Seeker):
    """Hunts in a window of factors."""

    def __init__(self, low, high, parameters):
        self.low, self.high, self.parameters, self.tried = low, high, parameters, []

    def lowest(self, search):
        return lowest_factor(self.parameters, search.corner.parameters)

    def hunts(self, search, factor):
        self.tried.append(factor)
        return self.low <= factor < self.high


@pytest.mark.parametrize("begins", [0.51, 0.7, 0.99, 1.1, 1.29, 1.31, 1.7, 3.9])
@pytest.mark.parametrize("width", [1.26, 1.6, 100.0])
def test_the_first_factor_of_hunting_is_found(begins, width):
    # also where hunting ends again, because the motor is too weak to break away, and below what is demanded
    seeker = Pretender(begins, begins * width, servo(coulomb=1.0, breakaway=2.0).system().parameters)
    found = StictionMargin("", **seeker(Search(Corner("", {}), {}, demand(stiction_margin=1.3))))
    assert found.rests < begins <= found.hunts <= ACCURACY * found.rests
    assert min(seeker.tried) >= 0.5


def test_factors_that_are_tried_are_no_further_apart_than_a_step():
    found = make_ladder(0.48, 1.3)
    assert found[0] == 0.48 and found[-1] == MOST
    assert {1.0, 1.3} <= set(found)
    assert max(b / a for a, b in pairwise(found)) <= 1.25 + 1e-12
    assert make_ladder(1.0, 5.0)[-1] == 5.0


def test_a_margin_that_is_kept_is_that_of_the_demand_it_was_sought_for(one):
    class Recorder(dict):
        def __missing__(self, key):
            raise LookupError(key)

        def __contains__(self, key):
            return True

    asked = []
    for margin in (1.2, 1.3):
        with pytest.raises(LookupError) as missing:
            stiction_margins(one, [Corner("", {})], {}, demand(stiction_margin=margin), done=Recorder(), workers=1)
        asked.append(missing.value.args[0])
    assert asked[0] != asked[1]


def test_no_hunting_and_nothing_but_hunting():
    values = servo(coulomb=1.0, breakaway=2.0).system().parameters
    search = Search(Corner("", {"gear.bearings.shaft.coulomb": 1.6}), {}, demand(stiction_margin=1.3))
    never, always = (StictionMargin("", **Pretender(low, 1e3, values)(search)) for low in (99.0, 0.0))
    assert (never.rests, never.hunts) == (pytest.approx(MOST), None)
    assert (always.rests, always.hunts) == (None, pytest.approx(0.8))  # where breakaway is as large as sliding friction
    assert "none up to factor 4" in never.label
    assert "already at the lowest factor" in always.label
    assert least_margin([never, always]) is always


def test_least_factor_leaves_no_stiction(aileron):
    assert lowest_factor(aileron.system().parameters, {}) == pytest.approx(0.12 / 0.25)


# -- the optimum ------------------------------------------------------------------------------------------


def specification(**changed):
    return Specification(
        title="", case="", demand=demand(**changed), tuning=Tuning(gains=(POSITION, SPEED), dead_band=True)
    )


def test_the_optimum_lies_where_delay_and_phase_let_it(one):
    # without an integral D = H/(Kp g): the speed loop Kp/(J s) (1 + g/s) is as fast as the delay margin allows
    task = specification(peak_current=1e4, delay_margin=3e-3)
    start = {POSITION: 10.0, SPEED: 0.3}
    modes = corner_modes(prepare_linear(one), Corner("only", {INTEGRAL: 1e-12}), 1.5, start)
    found = design([modes], start, task)
    names = [each.name for each in found.active]
    assert "slip" in names
    assert any("delay" in name or name == "overshoot" for name in names)
    again = design([modes], {POSITION: 20.0, SPEED: 0.6}, task)
    assert again.standing_error == pytest.approx(found.standing_error, rel=1e-4)


def test_a_multiplier_is_what_the_demand_costs(one):
    start = {POSITION: 10.0, SPEED: 0.3}
    modes = corner_modes(prepare_linear(one), Corner("only", {INTEGRAL: 1e-12}), 1.5, start)
    # peak current = friction + sine * g * Kp at the first instant: the product of the gains is what it bounds
    limit = 2.0
    found = design([modes], start, specification(peak_current=limit))
    current = next(each for each in found.active if each.name == "peak current")
    other = design([modes], start, specification(peak_current=limit * 0.99))
    assert math.log(other.standing_error / found.standing_error) == pytest.approx(
        0.01005 * current.multiplier, rel=0.02
    )
    # D = H/(Kp g) and peak = friction + 0.05 Kp g: both known
    assert found.standing_error == pytest.approx((1.5 * BREAKAWAY - COULOMB) / ((limit - COULOMB) / 0.05), rel=0.01)
    assert current.multiplier == pytest.approx(limit / (limit - COULOMB), rel=0.01)
    assert "1 % tighter costs 1.0" in current.cost


def test_gains_stay_in_their_range_about_the_start_wherever_the_search_begins(one):
    start = {POSITION: 20.0, SPEED: 0.6}
    modes = corner_modes(prepare_linear(one), Corner("only", {INTEGRAL: 1e-12}), 1.5, start)
    task = replace(specification(peak_current=1e4), tuning=Tuning(gains=(POSITION, SPEED), dead_band=True, range=1.2))
    found = design([modes], start, task)
    again = design([modes], start, task, first=found.gains)
    assert max(again.gains[name] / value for name, value in start.items()) == pytest.approx(1.2)
    assert again.gains == pytest.approx(found.gains, rel=1e-4)


def test_demands_that_exclude_each_other(one):
    start = {POSITION: 10.0, SPEED: 0.3}
    modes = corner_modes(prepare_linear(one), Corner("only", {INTEGRAL: 1e-12}), 1.5, start)
    with pytest.raises(NotTunable, match=r"no gains meet all demands at once; nearest: .*standing error"):
        design([modes], start, specification(peak_current=0.3, standing_error=1e-3))


def test_costs_in_words():
    assert (
        "1 deg more costs 1.76 %" in Active(Criterion.PHASE_MARGIN, "phase margin at x", "", "", 1.0, "rad", 1.0).cost
    )
    assert "1 dB more costs 12.2 %" in Active(Criterion.GAIN_MARGIN, "gain margin at x", "", "", 1.0, "-", 1.0).cost


# -- the whole study --------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def tuned():
    one = servo(proportional=0.2, integral=8.0, breakaway=0.3)
    task = Specification(
        title="Servo",
        case="",
        demand=demand(peak_current=3.0, stiction_margin=1.3),
        tuning=Tuning(gains=(POSITION, SPEED), dead_band=True, range=5.0),
        corners={"friction": {"as it is": Change(), "less": Change(factors={"gear.bearings.*.*": 0.5})}},
    )
    return tune(task, one, margins=(1.0, 1.6), workers=1)


def test_a_servo_that_hunts_is_tuned_until_it_does_not(tuned):
    assert all(check.hunts(1.0) for check in tuned.before_checks)
    assert tuned.met
    assert not any(check.hunts(1.0) or check.hunts(1.3) for check in tuned.rounds[-1].checks)
    assert all(check.followed > 1 / math.sqrt(2) for check in tuned.rounds[-1].checks)
    assert max(check.standing_error for check in tuned.rounds[-1].checks) < tuned.design.standing_error * 1.01
    assert all(margin.hunts <= 1.0 for margin in tuned.margins_before)
    assert all(margin.rests >= 1.3 for margin in tuned.margins)
    errors = [error for _, error in tuned.trade_off]
    assert errors[0] < errors[1]


def test_the_dead_band_is_what_ends_the_hunting(tuned):
    corner = tuned.corners[0]
    small = replace(tuned.specification.demand, amplitude=0.002)  # moves that end inside what stiction holds
    (with_it,) = check_corners(tuned.plant, [corner], tuned.parameters, small, workers=1)
    (without,) = check_corners(tuned.plant, [corner], {**tuned.parameters, DEAD_BAND: 0.0}, small, workers=1)
    assert without.hunts(1.0)
    assert not with_it.hunts(1.0)
    assert shortfalls([without], small)["slip"] > 1


def test_dead_band_at_the_motor(aileron):
    ratio = abs(aileron.gear.ratio())
    assert with_dead_band(aileron, {POSITION: 30.0}, 1e-3)[DEAD_BAND] == pytest.approx(ratio * 30.0 * 1e-3)
    assert add_dead_band(aileron).controller.speed.remedies == IntegralRemedies(dead_band=0.0)


def test_twins_are_corners_that_linear_models_cannot_tell_apart(one):
    modes = [corner_modes(prepare_linear(one), Corner(name, {}), 1.5, {}) for name in ("a", "b")]
    gains = dict(zip(GAINS, (20.0, 0.8, 8.0), strict=True))
    assert find_twins([m for each in modes for m in measures(each, gains, demand(), {})]) == {"a": ["a", "b"]}


def test_report(tuned, tmp_path):
    from studies.cases import Case
    from studies.tuning.report import tuning_findings

    case = Case(name="servo", title="", description="", actuator=tuned.original, duration=1.0, inputs={})
    found = tuning_findings(tuned, case)
    found.save(tmp_path)
    pictures = {"loops.png", "margins.png", "step.png", "trade_off.png"}
    tables = {"corners.csv", "measures.csv", "findings.txt", "result.json", "report.html"}
    assert {path.name for path in tmp_path.iterdir()} == pictures | tables
    result = json.loads((tmp_path / "result.json").read_text())
    assert result["met"]
    assert result["gains"]["tuned"][DEAD_BAND] > 0
    html = (tmp_path / "report.html").read_text()
    assert "All demands are met in every corner: margins and stiffness on the linear models" in html
    assert "hunting (or an undecided step) begins" in html
    assert "failed or did not settle: before tuning at as it is</li>" in html  # and none after
    assert [row["corner"] for row in result["stiction_margins"]["tuned"]] == ["as it is", "less"]
    assert html.count("data:image/png;base64") == 4


# -- wrong input ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("plant", "says"),
    [
        (
            lambda: replace(servo(), motor=TorqueSource(), controller=None),
            "tuning needs a controller, and there is none",
        ),
        (
            lambda: replace(
                servo(), controller=replace(servo().controller, position=PI(proportional=1.0, integral=1.0))
            ),
            "of two integrals in a row",
        ),
    ],
)
def test_what_cannot_be_tuned(plant, says):
    with pytest.raises(NotTunable, match=says):
        tune(specification(), plant(), workers=1)


def test_wrong_gains_and_efforts_name_the_right_ones(positioner):
    with pytest.raises(
        NotTunable, match=r"may name controller.proportional, .*derivative, .*, not controller.position"
    ):
        tune(specification(), positioner, workers=1)
    task = replace(specification(), tuning=Tuning(gains=("controller.proportional",), dead_band=True))
    with pytest.raises(NotTunable, match="no current; demand a peak_torque"):
        tune(task, positioner, workers=1)


def test_without_a_dead_band_stiction_and_integral_hunt(one):
    task = replace(specification(), tuning=Tuning(gains=GAINS))
    with pytest.raises(NotTunable, match="allow tuning.dead_band"):
        tune(task, one, workers=1)


def test_built_in_specification():
    task, case = load_specification("aileron")
    corners = task.all_corners(case.actuator)
    assert len(corners) == 12
    assert corners[0].parameters == {"load.bias": 8.0} or corners[0].parameters == {}
    last = corners[-1].parameters
    assert last["load.bias"] == -8.0
    assert last["gear.bearings.hinge.breakaway"] == pytest.approx(9 * 0.25)
    assert last["gear.meshes.first.elasticity.gap"] == pytest.approx(30e-6)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("title = 'x'", "is missing"),
        ("[demand]\nbandwidth = -1", "bandwidth"),
        ("[corners.a.b.factors]\n'gear.none.*' = 2", "no parameter matches 'gear.none"),
    ],
)
def test_wrong_specifications_get_one_line(tmp_path, text, says):
    path = tmp_path / "own.toml"
    whole = (
        "title = 't'\ncase = 'aileron'\n[tuning]\ngains = ['controller.position.gain']\n[demand]\nstroke = 1.0\n"
        "stiffness = 1.0\npeak_current = 1.0\nstanding_error = 0.1\n"
    )
    body = whole + "bandwidth = 1.0\n" + text if text.startswith("[corners") else text
    if text.startswith("[demand]"):
        body = whole + "bandwidth = -1.0\n"
    path.write_text(body)
    with pytest.raises(CaseError, match=says):
        load_specification(path)
    ended = CliRunner().invoke(main, ["tuning", str(path)])
    assert ended.exit_code == 2
    assert len(ended.output.strip().splitlines()) == 1


def test_unknown_specification_and_help():
    ended = CliRunner().invoke(main, ["tuning", "nothing"])
    assert ended.exit_code == 2
    assert "the built-in ones are aileron" in ended.output
    assert "--jobs" in CliRunner().invoke(main, ["tuning", "--help"]).output


# -- what is kept -----------------------------------------------------------------------------------------


def test_kept_results_survive_a_kill(tmp_path):
    path = tmp_path / "kept.jsonl"
    cache = Cache(path)
    cache["a"], cache["b"] = {"x": 1.0}, {"x": 2.0}
    with path.open("a") as file:
        file.write('{"key": "c", "res')
    again = Cache(path)
    assert dict(again) == {"a": {"x": 1.0}, "b": {"x": 2.0}}
    again["c"] = {"x": 3.0}
    assert Cache(path)["c"] == {"x": 3.0}
    with pytest.raises(TypeError, match="cannot be deleted one by one"):
        del again["a"]
    assert fingerprint({"b": 1, "a": 2.0}) == fingerprint({"a": 2.0, "b": 1}) != fingerprint({"a": 2.0, "b": 2})
