"""Sine streams, broadband records and what is read from files.

Oracles: the linear models of drives without stiction, continuous and sampled; breakaway torque over the gain of the
stuck loop, in closed form, as the threshold; symmetry, which leaves odd harmonics only; the Fourier series of a
triangle; the transfer function of a filter through which noise was sent.
"""

import dataclasses
import itertools
import json
import math
from functools import cache

import numpy as np
import pytest
from scipy import signal

from actuator import (
    Actuator,
    Gravity,
    Load,
    SimulationError,
    SineStream,
    ThermalNetwork,
    ThermalNode,
    ThermalPath,
    TorqueSource,
    chirp_response,
    frequency_response,
    harmonic_response,
    linearize,
    multisine_response,
    read_record,
    temperature_sets,
    trim,
)
from actuator.response.frequency_response import point_key
from actuator.response.sine import SinePoint
from actuator.simulation.fourier import fourier_coefficients
from controllers import PID, Sampling
from gear import Bearing, KnownOil, OilAt, Shaft, Thickening, Transmission

pytestmark = pytest.mark.thorough

INERTIA, COULOMB, BREAKAWAY = 0.2, 1.0, 1.5
PROPORTIONAL, INTEGRAL, DERIVATIVE = 30.0, 40.0, 6.0


@cache
def servo(*, sticks=False, period=None, integral=INTEGRAL):
    """A PID on an inertia, that sticks or not; with a limit far away."""
    bearing = Bearing(
        shaft="arm", coulomb=COULOMB if sticks else 0.0, breakaway=BREAKAWAY if sticks else 0.0, viscous=0.4
    )
    gear = Transmission(shafts={"arm": Shaft(inertia=INERTIA)}, bearings={"guide": bearing}, input="arm", output="arm")
    return Actuator(
        motor=TorqueSource(),
        gear=gear,
        load=Load(stiffness=5.0),
        controller=PID(proportional=PROPORTIONAL, integral=integral, derivative=DERIVATIVE),
        sampling=None if period is None else Sampling(position=period, delay=0),
    )


def measured(plant, **law):
    law = {"compiled": False, "workers": 1, "agreement": 1e-5} | law
    return frequency_response(plant, **law)


# -- without stiction ---------------------------------------------------------------------------------------

FREQUENCIES = [0.3, 1.0, 3.0, 10.0]


def test_without_stiction_the_sine_stream_is_the_linear_response():
    found = measured(servo(), amplitudes=[1e-3, 0.1], frequencies=FREQUENCIES, seen=("load_angle", "motor_torque"))
    model = linearize(trim(servo(), "forward"), ["reference"], ["load_angle", "motor_torque"])
    expected = model(2j * np.pi * np.array(FREQUENCIES))[:, 0]
    response = found.data.response.isel(set=0, load=0)
    for amplitude in (0, 1):
        np.testing.assert_allclose(response[amplitude].values.T, expected, rtol=1e-3)
        np.testing.assert_allclose(response[amplitude].values.T, expected, rtol=2e-4)
    assert found.data.settled.all()
    assert found.notes == []
    # and what is linear has no harmonics
    harmonics = abs(found.data.harmonics.isel(output=0))
    assert (harmonics.sel(harmonic=slice(2, None)).max("harmonic") < 2e-3 * harmonics.sel(harmonic=1)).all()


def test_without_stiction_a_sampled_sine_stream_is_the_sampled_data_response():
    plant = servo(period=1e-2)
    frequencies = [0.5, 2.0, 10.0]
    found = measured(plant, amplitudes=[0.1], frequencies=frequencies)
    expected = harmonic_response(
        trim(plant, "forward"), ["reference"], ["load_angle"], 2 * np.pi * np.array(frequencies)
    )[0, 0]
    np.testing.assert_allclose(found.select(amplitude=0.1).values, expected, rtol=1e-3)


def test_the_response_goes_to_python_control():
    found = measured(servo(), amplitudes=[0.1], frequencies=[1.0, 3.0])
    frd = found.frd(0.1)
    np.testing.assert_allclose(frd.omega, [2 * np.pi, 6 * np.pi])
    np.testing.assert_allclose(frd.frdata[0, 0], found.data.response.values.ravel())
    assert frd.input_labels == ["reference"]


# -- with stiction ------------------------------------------------------------------------------------------


def held_amplitude(frequency, integral):
    """At which the torque of a stuck loop reaches breakaway: P sin + I/w of its integral, in quadrature."""
    return BREAKAWAY / abs(PROPORTIONAL + integral / (2j * math.pi * frequency))


@pytest.mark.parametrize("integral", [0.0, INTEGRAL])
@pytest.mark.parametrize("frequency", [0.2, 2.0])
def test_below_the_threshold_nothing_moves_and_above_it_something_does(frequency, integral):
    plant, edge = servo(sticks=True, integral=integral), held_amplitude(frequency, integral)
    found = measured(plant, amplitudes=[0.98 * edge, 1.3 * edge], frequencies=[frequency])
    below, above = (found.data.isel(set=0, load=0, amplitude=k, frequency=0) for k in (0, 1))
    assert not below.moves
    assert not below.slides
    assert below.stuck == 1
    assert abs(below.response.item()) < 1e-9
    assert above.moves
    assert above.slides
    assert 0 < above.stuck < 1


@pytest.mark.parametrize("integral", [0.0, INTEGRAL])
def test_the_threshold_is_breakaway_over_the_gain_of_the_stuck_loop(integral):
    stream = SineStream(plant=servo(sticks=True, integral=integral), compiled=False)
    found = stream.threshold(SinePoint(amplitude=0.0, frequency=0.5), 1e-3, 1.0)
    assert found == pytest.approx(held_amplitude(0.5, integral), rel=1e-3)


def test_where_nothing_could_stick_there_is_no_threshold():
    plant = dataclasses.replace(servo(), gear=dataclasses.replace(servo().gear, bearings={}))
    with pytest.raises(ValueError, match="actuator: has no contact that could stick, so no threshold"):
        SineStream(plant=plant, compiled=False).threshold(SinePoint(amplitude=0.0, frequency=0.5), 1e-3, 1.0)


@pytest.mark.parametrize(("low", "high", "message"), [(1e-4, 1e-3, "nothing slides"), (0.5, 1.0, "a contact slides")])
def test_bounds_on_one_side_of_the_threshold_are_refused(low, high, message):
    stream = SineStream(plant=servo(sticks=True), compiled=False)
    with pytest.raises(ValueError, match=f"{message} at an amplitude of"):
        stream.threshold(SinePoint(amplitude=0.0, frequency=0.5), low, high)


def test_dry_friction_makes_odd_harmonics_and_costs_gain_at_small_amplitudes():
    edge = held_amplitude(1.0, 0.0)
    found = measured(servo(sticks=True, integral=0.0), amplitudes=[1.3 * edge, 20 * edge], frequencies=[1.0])
    small, large = abs(found.data.response.values.ravel())
    free = abs(linearize(trim(servo(integral=0.0), "forward"), ["reference"], ["load_angle"])(2j * np.pi))
    assert small < 0.8 * large < 0.8 * free
    assert large == pytest.approx(free, rel=0.05)
    harmonics = abs(found.data.harmonics.isel(set=0, load=0, amplitude=0, frequency=0, output=0).values)
    assert harmonics[2] > 0.02 * harmonics[0]
    assert harmonics[1] < 1e-3 * harmonics[2]


def test_a_bias_load_and_a_set_of_parameters_change_the_response():
    found = measured(
        servo(sticks=True),
        amplitudes=[0.1],
        frequencies=[1.0],
        loads=[0.0, 2.0],
        sets={"warm": {}, "cold": {"gear.bearings.guide.viscous": 4.0}},
    )
    assert found.data.response.dims == ("set", "load", "amplitude", "frequency", "output")
    warm, cold = (abs(found.select(set=name, amplitude=0.1).item()) for name in ("warm", "cold"))
    assert cold < 0.95 * warm


def test_a_small_sine_is_the_linear_response_at_its_bias_load_and_its_set_of_parameters():
    # a weight on a spring pulls back the less, the farther a bias load holds it from its lowest point
    weight = Load(stiffness=5.0, gravity=Gravity(moment=20.0))
    plant = dataclasses.replace(servo(), controller=None, load=weight)
    sets = {"warm": {}, "cold": {"gear.bearings.guide.viscous": 4.0}}
    loads, frequencies = [-15.0, 0.0, 20.0], [0.5, 1.5]
    found = measured(
        plant, amplitudes=[1e-2], frequencies=frequencies, given="load_torque", loads=loads, sets=sets
    )  # fmt: skip
    seen = set()
    for (name, changes), load in itertools.product(sets.items(), loads):
        point = trim(plant, "forward", inputs={"load_torque": load}, parameters=changes)
        model = linearize(point, ["load_torque"], ["load_angle"])
        frd = found.frd(1e-2, set=name, load=load)
        np.testing.assert_allclose(frd.frdata[0, 0], model(2j * np.pi * np.array(frequencies)), rtol=1e-3)
        seen.add(round(abs(frd.frdata[0, 0, 0]), 4))
    assert len(seen) == len(sets) * len(loads)  # each is another


def test_the_distortion_of_dry_friction_is_that_of_a_square_wave():
    plant = servo(sticks=True, integral=0.0)
    found = measured(
        plant, amplitudes=[10.0], frequencies=[1.0], seen=("load_angle", "gear.bearings.guide.friction"),
        sets={"dry": {"gear.bearings.guide.viscous": 0.0}},
    )  # fmt: skip
    square = math.sqrt(sum(1 / k**2 for k in (3, 5, 7)))
    friction = found.select("distortion", output="gear.bearings.guide.friction").item()
    assert friction == pytest.approx(square, rel=0.02)
    assert found.select("distortion", output="load_angle").item() < 0.05 * square


def test_a_place_is_chosen_by_its_number_up_to_rounding_and_no_other():
    found = measured(servo(), amplitudes=[0.1, 0.2], frequencies=[1.0])
    assert found.select(amplitude=0.2 * (1 + 1e-9)).item() == found.data.response.values[0, 0, 1, 0, 0]
    for where, message in (
        ({"amplitude": 0.15}, "no amplitude 0.15; there are 0.1, 0.2"),
        ({"amplitude": 0.1, "load": 1.0}, "no load 1.0; there are 0.0"),
        ({"amplitude": 0.1, "set": "cold"}, "no set 'cold'; there are ''"),
    ):
        with pytest.raises(KeyError, match=message):
            found.select(**where)


def test_a_fundamental_alone_says_nothing_of_distortion():
    found = measured(servo(sticks=True), amplitudes=[0.2], frequencies=[1.0], harmonics=1)
    assert found.data.moves.all() and math.isnan(found.data.distortion.item())


def test_what_stands_still_has_no_distortion():
    found = measured(servo(sticks=True), amplitudes=[1e-3], frequencies=[1.0])
    assert math.isnan(found.data.distortion.item())


def test_a_cold_oil_is_a_set_of_parameters_that_damps():
    oil = KnownOil(name="Mobil Jet Oil II")
    warm = OilAt(oil=oil, temperature=293.15)
    bearing = Bearing(
        shaft="arm",
        coulomb=0.0,
        breakaway=0.0,
        viscous=0.4,
        thickening=Thickening(lubricant=warm, measured_with=warm, exponent=0.5),
    )
    plant = dataclasses.replace(servo(), gear=dataclasses.replace(servo().gear, bearings={"guide": bearing}))
    sets = temperature_sets(plant, [233.15, 293.15])
    assert list(sets) == ["-40 degC", "20 degC"]
    assert list(sets["-40 degC"].values()) == [233.15]
    found = measured(plant, amplitudes=[0.1], frequencies=[1.0], sets=sets)
    cold, room = (found.select(set=name, amplitude=0.1).item() for name in sets)
    thick = OilAt(oil=oil, temperature=233.15).dynamic_viscosity() / warm.dynamic_viscosity()
    for response, viscous in ((room, 0.4), (cold, 0.4 * thick**0.5)):
        s = 2j * np.pi
        free = PROPORTIONAL + INTEGRAL / s
        assert response == pytest.approx(free / (INERTIA * s**2 + (DERIVATIVE + viscous) * s + 5 + free), rel=1e-3)


def test_a_temperature_is_that_of_every_thermal_node():
    network = ThermalNetwork(
        nodes={"housing": ThermalNode(temperature=293.15, capacity=50.0), "air": ThermalNode(temperature=293.15)},
        paths={"fins": ThermalPath(a="housing", b="air", resistance=2.0)},
    )
    sets = temperature_sets(dataclasses.replace(servo(), thermal=network), [218.15])
    assert sets == {"-55 degC": {"thermal.nodes.housing.temperature": 218.15, "thermal.nodes.air.temperature": 218.15}}


def test_temperatures_without_an_oil_are_refused():
    with pytest.raises(ValueError, match="has an oil"):
        temperature_sets(servo(), [218.15])


# -- resuming -----------------------------------------------------------------------------------------------


def test_what_is_done_is_not_measured_again_and_survives_a_file():
    seen, done = [], {}
    law = {"amplitudes": [0.1], "frequencies": [1.0, 3.0], "progress": lambda k, n: seen.append((k, n))}
    first = measured(servo(), done=done, **law)
    assert seen == [(1, 2), (2, 2)]
    again = measured(servo(), done=json.loads(json.dumps(done)), **law)
    assert seen == [(1, 2), (2, 2)]
    np.testing.assert_array_equal(again.data.response, first.data.response)
    assert len(done) == 2


def test_another_parameter_is_another_point():
    done = {}
    for value in (0.4, 0.5):
        sets = {"": {"gear.bearings.guide.viscous": value}}
        measured(servo(), amplitudes=[0.1], frequencies=[3.0], sets=sets, done=done)
    assert len(done) == 2


def test_another_law_is_another_point_of_an_actuator_and_of_a_bare_system():
    limited = dataclasses.replace(servo().controller, limit=50.0)
    plants = [
        dataclasses.replace(servo(period=period), controller=dataclasses.replace(limited, anti_windup=law))
        for period in (None, 1e-2)
        for law in ("back-calculation", "clamping", "conditional")
    ]
    point = SinePoint(amplitude=1.0, frequency=1.0)
    for made in (plants, [plant.system() for plant in plants]):
        assert len({point_key(SineStream(plant=plant), point) for plant in made}) == len(plants)
    # each function counts alone, and how often a clock ticks; the same built again is the same
    first, second = (plant.system() for plant in (plants[3], plants[4]))
    others = [
        dataclasses.replace(first, tick=second.tick),
        dataclasses.replace(first, reset=plants[0].system().reset),
        dataclasses.replace(first, clocks=tuple(clock._replace(every=2) for clock in first.clocks)),
    ]
    again = dataclasses.replace(plants[3]).system()
    keys = [point_key(SineStream(plant=each), point) for each in (first, again, *others)]
    assert keys[0] == keys[1]
    assert len(set(keys)) == 1 + len(others)


# -- broadband ----------------------------------------------------------------------------------------------


def test_a_chirp_through_a_linear_servo_has_its_response_and_is_coherent():
    found = chirp_response(servo(), amplitude=0.1, lowest=0.5, highest=8.0, duration=60.0)
    model = linearize(trim(servo(), "forward"), ["reference"], ["load_angle"])
    inside = (found.frequencies > 0.8) & (found.frequencies < 7)
    expected = model(2j * np.pi * found.frequencies[inside])
    np.testing.assert_allclose(found.response[inside], expected, rtol=0.03)
    assert found.coherence[inside].min() > 0.98


def test_a_multisine_through_a_linear_servo_has_its_response_and_is_coherent():
    found = multisine_response(servo(), amplitude=0.1, lowest=0.5, lines=[1, 2, 3, 5, 8, 13], settling=2)
    model = linearize(trim(servo(), "forward"), ["reference"], ["load_angle"])
    np.testing.assert_allclose(found.response, model(2j * np.pi * found.frequencies), rtol=2e-3)
    assert found.coherence.min() > 0.9999


def test_stiction_costs_coherence():
    law = {"lowest": 0.5, "lines": [1, 2, 3, 5, 8, 13], "settling": 1}
    small, large = (multisine_response(servo(sticks=True), amplitude=size, **law) for size in (0.03, 1.0))
    assert small.coherence.mean() < 0.98 < large.coherence.mean()


def test_one_realization_has_no_coherence():
    with pytest.raises(ValueError, match="at least two realizations"):
        multisine_response(servo(), amplitude=0.1, lowest=0.5, lines=[1], realizations=1)


# -- measured -----------------------------------------------------------------------------------------------


def write(path, time, reference, response, names=("time", "reference", "response")):
    table = np.column_stack([time, reference, response])
    np.savetxt(path, table, delimiter=",", header=",".join(names), comments="", fmt="%.12g")
    return path


def test_noise_through_a_filter_is_read_back_as_the_filter(tmp_path):
    time = np.arange(0, 200, 5e-3)
    noise = np.random.default_rng(1).normal(size=time.size)
    law = signal.butter(2, 5.0, fs=200)
    path = write(tmp_path / "bench.csv", time, noise, signal.lfilter(*law, noise))
    found = read_record(path).spectrum(0.5, 20.0)
    expected = signal.freqz(*law, worN=found.frequencies, fs=200)[1]
    np.testing.assert_allclose(found.response, expected, rtol=0.05)
    assert found.coherence.min() > 0.99
    assert found.label == "bench"


def test_a_measured_sine_is_reduced_as_a_simulated_one(tmp_path):
    time, w = np.linspace(0, 10, 20001), 2 * np.pi * 1.5
    response = 0.05 + 0.3 * np.sin(w * time + 0.2 - 0.7) + 0.02 * np.sin(3 * (w * time + 0.2))
    path = write(tmp_path / "sine.csv", time, 0.5 * np.sin(w * time + 0.2), response, ("t", "asked", "angle"))
    found = read_record(path, time="t", reference="asked", response="angle").sine(1.5)
    assert found[0] == pytest.approx(0.1, rel=1e-4)
    assert found[1] == pytest.approx(0.6 * np.exp(-0.7j), rel=1e-4)
    assert abs(found[3]) == pytest.approx(0.04, rel=1e-4)


def test_a_triangle_has_its_fourier_series():
    time = np.linspace(0, 2, 4001)
    found = fourier_coefficients(time, signal.sawtooth(2 * np.pi * time, 0.5)[None], 1.0, 5)[0]
    np.testing.assert_allclose(found, [0, -8 / np.pi**2, 0, -8 / (9 * np.pi**2), 0, -8 / (25 * np.pi**2)], atol=1e-6)


def test_part_of_a_period_is_refused():
    with pytest.raises(ValueError, match="needs whole periods of 1 Hz, got 1.5 s"):
        fourier_coefficients(np.linspace(0, 1.5, 100), np.zeros((1, 100)), 1.0, 3)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("time,reference\n0,1\n", "no column response; there are time, reference"),
        ("time,reference,response\n0,1,2\n1,a,3\n", "line 3 needs three numbers, got 1, a, 3"),
        ("time,reference,response\n0,1,2\n1,1,3\n1,1,3\n", "time does not increase after 1 s"),
        ("time,reference,response\n0,1,2\n", "time has fewer than three values"),
    ],
)
def test_a_file_that_is_no_record_is_refused_with_the_line(tmp_path, text, message):
    path = tmp_path / "bad.csv"
    path.write_text(text)
    with pytest.raises(ValueError, match=message):
        read_record(path)


def test_a_record_too_short_or_too_coarse_is_refused(tmp_path):
    time = np.linspace(0, 10, 101)
    record = read_record(write(tmp_path / "a.csv", time, np.sin(time), np.sin(time)))
    with pytest.raises(ValueError, match="fewer than 3 segments"):
        record.spectrum(0.1, 1.0)
    with pytest.raises(ValueError, match="too long for 8 Hz"):
        record.spectrum(1.0, 8.0)
    with pytest.raises(ValueError, match="has no 3 periods of 0.1 Hz"):
        record.sine(0.1)


# -- pictures and refusals ----------------------------------------------------------------------------------


def test_the_picture_has_a_line_per_amplitude_and_the_overlay():
    found = measured(servo(sticks=True), amplitudes=[1e-3, 0.2], frequencies=[0.5, 2.0])
    overlay = multisine_response(servo(), amplitude=0.1, lowest=0.5, lines=[1, 2, 3])
    model = linearize(trim(servo(sticks=True), "forward"), ["reference"], ["load_angle"])
    figure = found.plot({"forward": model}, [overlay])
    words = [text.get_text() for text in figure.legends[0].get_texts()]
    assert "0.0573 deg: no motion" in words
    assert "11.5 deg" in words
    assert "multisine, 0.1 rad rms" in words
    assert overlay.plot().axes[2].get_ylabel() == "coherence"


def test_the_picture_of_harmonics_has_a_panel_for_each_and_one_for_all():
    found = measured(servo(sticks=True), amplitudes=[1e-3, 0.2], frequencies=[0.5, 2.0])
    figure = found.plot_harmonics()
    titles = [axes.get_title() for axes in figure.axes]
    assert titles == ["harmonic 2", "harmonic 3", "harmonic 5", "all harmonics up to 7 (distortion)"]
    third = figure.axes[1].get_lines()[3].get_ydata()  # of the second amplitude: each has a line, settled, others
    harmonics = abs(found.select("harmonics", amplitude=0.2)).values
    np.testing.assert_allclose(third, 100 * harmonics[:, 2] / harmonics[:, 0])
    words = [text.get_text() for text in figure.legends[0].get_texts()]
    assert words == ["0.0573 deg: no motion", "11.5 deg"]


def test_what_failed_is_not_said_to_stand_still(monkeypatch):
    def fails(self, point):
        raise SimulationError("stuck", 0.0, {})

    monkeypatch.setattr(SineStream, "_measured", fails)
    found = measured(servo(sticks=True), amplitudes=[1e-3], frequencies=[0.5, 2.0])
    words = [text.get_text() for text in found.plot().legends[0].get_texts()]
    assert words == ["0.0573 deg: failed"]


@pytest.mark.parametrize(
    ("law", "error", "message"),
    [
        ({"amplitudes": [0.0]}, ValueError, "amplitudes must be > 0"),
        ({"frequencies": []}, ValueError, "frequencies must be > 0, and at least one"),
        ({"given": "referense"}, KeyError, "did you mean reference"),
        ({"seen": ["load"]}, KeyError, "no output named 'load'"),
        ({"sets": {"a": {"gear.bearings.guide.viscos": 1.0}}}, KeyError, "did you mean gear.bearings.guide.viscous"),
    ],
)
def test_what_cannot_be_measured_is_refused(law, error, message):
    with pytest.raises(error, match=message):
        measured(servo(), **({"amplitudes": [0.1], "frequencies": [1.0]} | law))
