"""The engine and the run it returns: events that are hard to see, failures that must be loud, results by name.

Oracles: small systems written by hand whose events have known times (a clock that ticks); integrals of inputs; one
run against another; the texts of errors.
"""

import math

import casadi as ca
import matplotlib.pyplot as plt
import numpy as np
import pytest

from actuator import (
    Actuator,
    Chattering,
    Chirp,
    Constant,
    HybridSystem,
    InconsistentModes,
    Ramp,
    SimulationError,
    Sine,
    Step,
    Sum,
    Table,
    TorqueSource,
    simulate,
)
from actuator.engine.engine import engine
from actuator.system.hybrid import Contact, Event, Mode, Place, Quantity
from actuator.system.parameters import Parameter
from controllers import PID
from gear import Bearing, Shaft, Transmission

# -- systems by hand ----------------------------------------------------------------------------------------


def hybrid(*, flow, margins, reset, states=1, modes=1, name="by hand", parameters=()):
    """A HybridSystem from functions of (x, m, u, p); `reset` of (fired, x, m, u, p) returns x, m, fault."""
    symbols = [parameter.symbol for parameter in parameters]
    x, m, u = ca.SX.sym("x", states), ca.SX.sym("m", modes), ca.SX.sym("u")
    arguments = [x, m, u, ca.vertcat(*symbols)]
    conditions = ca.vertcat(*margins(x, m, u, arguments[3]))
    fired = ca.SX.sym("fired", conditions.shape[0])
    return HybridSystem(
        name=name,
        states=tuple(Quantity(f"x{k}", "m") for k in range(states)),
        mode_variables=tuple(Mode(f"contact{k}.motion") for k in range(modes)),
        contacts=tuple(Contact(f"contact{k}", Place.MESH, f"contact{k}.motion", None, 1) for k in range(modes)),
        inputs=(Quantity("push", "N"),),
        outputs=(Quantity("double", "m"),),
        events=tuple(Event(f"margin {k}") for k in range(conditions.shape[0])),
        parameters=tuple(parameters),
        flow=ca.Function("flow", arguments, [ca.vertcat(*flow(x, m, u, arguments[3]))]),
        margins=ca.Function("margins", arguments, [conditions]),
        reset=ca.Function(
            "reset", [fired, *arguments], [ca.vertcat(*part) for part in reset(fired, x, m, u, arguments[3])]
        ),
        outputs_function=ca.Function("outputs", arguments, [2 * x[0]]),
    )


def kept(fired, x, m, u, p):
    """The reset that changes nothing."""
    return [x], [m], [0]


def integrator(**options):
    """x' = rate * push, without modes."""
    rate = Parameter("rate", "m/(N s)", 1.0, ca.SX.sym("rate"))
    return hybrid(
        flow=lambda x, m, u, p: [p[0] * u],
        margins=lambda x, m, u, p: [],
        reset=kept,
        modes=0,
        parameters=[rate],
        **options,
    )


def ticking(period, modes=1):
    """A clock that falls to zero once per `period`; mode after mode goes over from stuck to forward, and back."""

    def reset(fired, x, m, u, p):
        turn = [ca.logic_and(fired[0], ca.eq(x[1], k)) for k in range(modes)]
        after = [ca.if_else(turn[k], 1 - m[k], m[k]) for k in range(modes)]
        following = ca.if_else(x[1] + 1 < modes, x[1] + 1, 0)
        return [ca.if_else(fired[0], period, x[0]), ca.if_else(fired[0], following, x[1])], after, [0]

    return hybrid(
        flow=lambda x, m, u, p: [-1.0, 0.0],
        margins=lambda x, m, u, p: [x[0]],
        reset=reset,
        states=2,
        modes=modes,
        name="clock",
    )


def run_ticking(period, duration, modes=1, **options):
    system = ticking(period, modes)
    return simulate(system, duration, start={"x0": period}, **options)


# -- events -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("resolution", [0.01, 0.002, 0.0003])
@pytest.mark.parametrize("period", [0.0313, 0.00071, 0.000112])
def test_no_event_is_lost_however_many_fall_between_two_output_points(period, resolution):
    duration = 0.2
    run = run_ticking(period, duration, resolution=resolution)
    expected = period * np.arange(1, int(duration / period) + 1)
    np.testing.assert_allclose([change.time for change in run.changes], expected, rtol=0, atol=1e-9)
    assert run.statistics.events == len(expected)
    assert run.statistics.settled == 0


def test_more_modes_than_fit_into_one_number_are_told_apart():
    run = run_ticking(0.01, 1.0, modes=45)
    assert [change.contact for change in run.changes[:90]] == 2 * [f"contact{k}" for k in range(45)]
    assert [change.after for change in run.changes[:90]] == 45 * ["forward"] + 45 * ["stuck"]


def test_an_event_at_the_very_end_of_an_output_interval_is_counted_once():
    run = run_ticking(0.005, 1.0, resolution=0.005)  # every event on an output point
    assert len(run.changes) == pytest.approx(200, abs=1)
    np.testing.assert_allclose(np.diff([change.time for change in run.changes]), 0.005, rtol=0, atol=1e-9)


def test_a_margin_that_a_reset_leaves_negative_is_found_and_settled():
    # at 0.3 s the first contact changes, and with it, against the rules, the margin of the second turns negative
    def reset(fired, x, m, u, p):
        first = ca.if_else(x[0] > 0.5, m[0], ca.if_else(fired[0], 1, m[0]))
        second = ca.if_else(ca.sum1(fired) > 0, m[1], ca.if_else(m[0] > 0.5, 1, m[1]))
        return [x], [first, second], [0]

    system = hybrid(
        flow=lambda x, m, u, p: [-1.0],
        margins=lambda x, m, u, p: [ca.if_else(m[0] > 0.5, 1, x[0]), ca.if_else(m[0] > m[1] + 0.5, -1, 1)],
        reset=reset,
        modes=2,
    )
    run = simulate(system, 1.0, start={"x0": 0.3})
    assert run.statistics.settled == 1
    assert [(change.contact, change.after) for change in run.changes] == [
        ("contact0", "forward"),
        ("contact1", "forward"),
    ]
    assert [change.time for change in run.changes] == pytest.approx([0.3, 0.3], abs=1e-6)
    assert run.margins.min() >= 0


# -- failures -----------------------------------------------------------------------------------------------


def test_modes_that_flip_without_time_passing_are_chattering_with_time_and_modes():
    message = r"clock: simulation stopped at t = 0.002 s: .*contact0.motion = [01]"
    with pytest.raises(SimulationError, match=message) as caught:
        simulate(ticking(1e-13), 0.01, start={"x0": 0.002})
    assert caught.type is Chattering
    assert caught.value.time == pytest.approx(0.002, abs=1e-6)
    assert set(caught.value.modes) == {"contact0.motion"}


def faulty(**states):
    """Falls to zero, where no modes are consistent."""
    return hybrid(
        flow=lambda x, m, u, p: [-1.0],
        margins=lambda x, m, u, p: [x[0]],
        reset=lambda fired, x, m, u, p: ([x], [m], [ca.logic_or(fired[0], x[0] < 0)]),
        name="jammed",
    )


@pytest.mark.parametrize("resolution", [1e-3, 1e-2])
def test_inconsistent_modes_are_reported_with_their_time(resolution):
    with pytest.raises(
        InconsistentModes, match=r"jammed: no consistent contact modes .* contact0.motion = 0"
    ) as caught:
        simulate(faulty(), 1.0, start={"x0": 0.3}, resolution=resolution)
    assert caught.value.modes == {"contact0.motion": 0}
    assert caught.value.time == pytest.approx(0.3, abs=resolution)


def test_inconsistent_modes_at_the_start_are_reported_at_time_zero():
    with pytest.raises(InconsistentModes, match="t = 0 s") as caught:
        simulate(faulty(), 1.0, start={"x0": -1.0})
    assert caught.value.time == 0


def test_a_state_that_grows_beyond_all_bounds_is_not_returned_as_a_result():
    # x' = x^2 from 1e4 is infinite at 1e-4 s
    system = hybrid(flow=lambda x, m, u, p: [x[0] ** 2], margins=lambda x, m, u, p: [], reset=kept, modes=0)
    with pytest.raises(SimulationError, match="simulation stopped") as caught:
        simulate(system, 2e-4, start={"x0": 1e4})
    assert caught.value.time == pytest.approx(1e-4, abs=1e-6)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"inputs": {"pusch": 1.0}}, "no input named 'pusch'; did you mean push?"),
        ({"start": {"x": 1.0}}, "no state named 'x'; did you mean x0?"),
        ({"parameters": {"rat": 1.0}}, "no parameter named 'rat'; did you mean rate?"),
    ],
)
def test_an_unknown_name_is_refused_with_the_nearest_one(options, message):
    with pytest.raises(KeyError) as caught:
        simulate(integrator(), 1.0, **options)
    assert message in str(caught.value)


@pytest.mark.parametrize("value", [0, 0.0, -1.0, math.nan, math.inf])
@pytest.mark.parametrize("name", ["duration", "resolution"])
def test_a_time_that_is_not_positive_is_refused(name, value):
    with pytest.raises(ValueError, match=rf"{name} must be > 0 s, got {value}"):
        simulate(integrator(), **({"duration": 1.0} | {name: value}))


def test_two_signals_of_one_name_are_refused():
    shafts = {"motor": Shaft(inertia=1.0)}
    gear = Transmission(
        shafts=shafts, bearings={"a": Bearing(shaft="motor", coulomb=0, breakaway=0)}, input="motor", output="motor"
    )
    assert Actuator(motor=TorqueSource(), gear=gear).system().states[0].name == "motor.angle"
    with pytest.raises(ValueError, match="signals share a name: double"):
        HybridSystem(**(integrator().__dict__ | {"inputs": (Quantity("double", "N"),)}))


def test_a_run_with_many_events_prints_nothing(capfd):
    run = run_ticking(0.001, 0.5, resolution=0.5)
    assert len(run.changes) == pytest.approx(500, abs=1)
    captured = capfd.readouterr()
    assert (captured.out, captured.err) == ("", "")


# -- inputs -------------------------------------------------------------------------------------------------

LENGTH = 2.0  # s
SIGNALS = {
    "constant": (Constant(value=3.0), 6.0),
    "step": (Step(time=0.7123456789, before=1.0, after=-2.0), 0.7123456789 - 2 * (LENGTH - 0.7123456789)),
    "ramp": (Ramp(time=0.31234, start=1.0, slope=2.0, end=1.41234), LENGTH + 2 * (1.1**2 / 2 + 1.1 * 0.58766)),
    "sine": (
        Sine(amplitude=2.0, frequency=3.3, time=0.123, offset=1.0, phase=0.4),
        LENGTH
        + 2.0 * (math.cos(0.4) - math.cos(0.4 + 2 * math.pi * 3.3 * (LENGTH - 0.123))) / (2 * math.pi * 3.3)
        - 0.0,
    ),
    "table": (Table(times=(0.25, 0.777, 1.5), values=(1.0, -1.0, 2.0)), 0.25 + 0.0 + 0.723 * 0.5 + 1.0),
    "two steps and a ramp": (
        Sum(parts=(Step(time=0.333, after=1.0), Step(time=1.777, after=2.0), Ramp(time=1.0, slope=1.0))),
        (LENGTH - 0.333) + 2 * (LENGTH - 1.777) + 0.5,
    ),
    "chirp of one frequency": (
        Chirp(amplitude=1.0, first_frequency=2.0, last_frequency=2.0, duration=0.61, time=0.2),
        (1 - math.cos(2 * math.pi * 2.0 * 0.61)) / (2 * math.pi * 2.0),
    ),
}


@pytest.mark.parametrize("name", SIGNALS)
@pytest.mark.parametrize("resolution", [None, 0.05])
def test_the_engine_integrates_every_signal_exactly(name, resolution):
    signal, integral = SIGNALS[name]
    run = simulate(integrator(), LENGTH, inputs={"push": signal}, resolution=resolution, tolerance=1e-9)
    assert run["x0"][-1] == pytest.approx(integral, abs=1e-9)
    np.testing.assert_array_equal(run["double"], 2 * run["x0"])


def test_a_chirp_is_integrated_like_the_fine_sum_of_its_values():
    chirp = Chirp(amplitude=1.0, first_frequency=1.0, last_frequency=20.0, duration=1.5, time=0.25)
    run = simulate(integrator(), LENGTH, inputs={"push": chirp}, tolerance=1e-9)
    tau = np.linspace(0, 1.5, 200_001)
    exact = np.trapezoid(np.sin(2 * np.pi * (tau + (20.0 - 1.0) / 1.5 * tau**2 / 2)), tau)
    assert run["x0"][-1] == pytest.approx(exact, abs=1e-8)


@pytest.mark.parametrize("time", [0.1234567, 1 / 3, 0.5, 0.99999, 1e-6])
def test_a_step_between_two_output_points_is_hit_exactly(time):
    run = simulate(integrator(), 1.0, inputs={"push": Step(time=time, after=1.0)}, resolution=0.01)
    assert time in run.t
    np.testing.assert_allclose(run["x0"], np.maximum(run.t - time, 0), rtol=0, atol=1e-12)
    np.testing.assert_array_equal(run["push"], (run.t >= time).astype(float))


def test_a_step_after_the_end_or_at_the_end_changes_nothing():
    for time in (1.0, 5.0):
        run = simulate(integrator(), 1.0, inputs={"push": Step(time=time, after=1.0)})
        assert abs(run["x0"]).max() == 0
        assert run.t[-1] == 1.0


# -- one engine for many runs -------------------------------------------------------------------------------


def guided_mass():
    guide = Bearing(shaft="mass", coulomb=1.0, breakaway=1.5)
    gear = Transmission(shafts={"mass": Shaft(inertia=1.0)}, bearings={"guide": guide}, input="mass", output="mass")
    return Actuator(motor=TorqueSource(), gear=gear, controller=PID(proportional=3, integral=4, derivative=6))


@pytest.fixture(scope="module")
def mass():
    return guided_mass()


def test_parameters_change_the_result_and_not_the_engine(mass):
    options = {"inputs": {"reference": 1.0}}
    first = simulate(mass, 20.0, **options)
    built = engine.cache_info().misses
    heavy = simulate(mass, 20.0, parameters={"gear.shafts.mass.inertia": 2.0}, **options)
    loose = simulate(mass, 5.0, parameters={"gear.bearings.guide.coulomb": 0.0}, resolution=0.01, **options)
    assert engine.cache_info().misses == built
    assert heavy["load_angle"][-1] != pytest.approx(first["load_angle"][-1], abs=1e-3)
    assert loose["gear.bearings.guide.friction_loss"].max() == 0
    fresh = simulate(guided_mass(), 20.0, parameters={"gear.shafts.mass.inertia": 2.0}, **options)
    np.testing.assert_array_equal(heavy["load_angle"], fresh["load_angle"])


def test_building_and_running_an_engine_prints_nothing(capfd):
    simulate(guided_mass(), 1.0, inputs={"reference": 1.0})
    engine(guided_mass().system())
    captured = capfd.readouterr()
    assert (captured.out, captured.err) == ("", "")


def test_progress_is_told_in_rising_times_up_to_the_end(mass):
    told = []
    inputs = {"reference": Step(time=0.5, after=1.0)}
    simulate(mass, 4.0, inputs=inputs, resolution=1e-3, progress=told.append)
    assert len(told) > 10
    assert told == sorted(told)
    assert told[-1] == 4.0


# -- the run ------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def run(mass):
    return simulate(mass, 40.0, inputs={"reference": 1.0}, tolerance=1e-8)


def test_a_run_holds_every_input_state_and_output_by_name(run):
    system = run.system
    for quantity in (*system.inputs, *system.states, *system.outputs):
        assert run[quantity.name].shape == run.t.shape
        assert run.units[quantity.name] == quantity.unit
    assert (np.diff(run.t) > 0).all()
    assert (run.t[0], run.t[-1]) == (0.0, 40.0)


def test_an_unknown_signal_is_refused_with_the_nearest_ones(run):
    with pytest.raises(KeyError, match="no signal named 'load_angel'; did you mean load_angle"):
        run["load_angel"]


def test_modes_and_changes_tell_the_same_story(run):
    guide = "gear.bearings.guide"
    word = run.changes[0].before
    for change in run.changes:
        assert (change.contact, change.before) == (guide, word)
        word = change.after
    times = [change.time for change in run.changes]
    assert times == sorted(times)
    words = np.array([run.changes[0].before, *(change.after for change in run.changes)])
    np.testing.assert_array_equal(run.modes[guide], words[np.searchsorted(times, run.t, side="right")])


def test_a_run_as_a_dataset_has_time_units_and_modes(run):
    data = run.to_xarray()
    assert dict(data.sizes) == {"time": len(run.t)}
    np.testing.assert_array_equal(data["time"], run.t)
    assert data["time"].attrs["units"] == "s"
    for name, values in run.signals.items():
        np.testing.assert_array_equal(data[name], values)
        assert data[name].attrs["units"] == run.units[name]
    np.testing.assert_array_equal(data["gear.bearings.guide.mode"], run.modes["gear.bearings.guide"])
    assert data.attrs["events"] == run.statistics.events


def test_a_plot_leaves_no_figure_open(run):
    before = plt.get_fignums()
    figure = run.plot()
    assert len(figure.axes) == 3  # angles, torque, ribbon
    assert figure.axes[-1].get_xlabel() == "time in s"
    assert plt.get_fignums() == before


def test_a_plot_of_an_unknown_signal_is_refused_with_the_nearest_ones(run):
    with pytest.raises(KeyError, match="did you mean"):
        run.plot(["load_angel"])


@pytest.mark.parametrize("cut", [2.0, 10.0, 25.0])
def test_a_run_started_from_the_state_of_another_goes_on_like_one_long_run(mass, run, cut):
    options = {"inputs": {"reference": 1.0}, "tolerance": 1e-8}
    head = simulate(mass, cut, **options)
    tail = simulate(mass, 40.0 - cut, start=head.state(), **options)
    for state, value in run.state().items():
        assert tail[state][-1] == pytest.approx(value, abs=1e-7), state
    times = [change.time for change in head.changes] + [cut + change.time for change in tail.changes]
    np.testing.assert_allclose(times, [change.time for change in run.changes], rtol=0, atol=1e-6)


def test_a_state_can_be_taken_at_any_output_point(run):
    assert run.state(0) == {state.name: 0.0 for state in run.system.states}
    assert run.state(100)["mass.angle"] == run["mass.angle"][100]
