"""The verdict on measured logs.

Oracles: the verdict on the very run a log is made of, by interpolation, noise and counts; sines, which do not stick
however noisy; the texts of errors.
"""

from functools import cache

import numpy as np
import pytest
from mass_on_guide import MassOnGuide

from actuator import classify, simulate
from actuator.verdict.log import classify_log, estimate_noise
from studies import load_case


@cache
def run_of(name):
    """A run that hunts, and the distance of the samples of its log [s]."""
    if name == "mass":
        return simulate(MassOnGuide().actuator(), 150.0, inputs={"reference": 1.0}, compiled=False), 0.05
    case = load_case("aileron")
    return simulate(case.actuator, case.duration, inputs=case.inputs, resolution=2e-3), 2e-3


def log_of(name, sigma=0.0, count=0.0, seed=1):
    """What a data logger makes of a run, with noise and a resolution at the load."""
    run, step = run_of(name)
    time = np.arange(0, run.t[-1], step)
    position = np.interp(time, run.t, run["load_angle"]) + sigma * np.random.default_rng(seed).standard_normal(
        len(time)
    )
    return {
        "time": time,
        "position": count * np.round(position / count) if count else position,
        "reference": run["reference"][np.searchsorted(run.t, time)],
        "motor position": np.interp(time, run.t, run["motor_angle"]),
    }


@pytest.mark.parametrize(
    ("name", "sigma", "count"),
    [
        ("mass", 0.0, 0.0),
        ("mass", 1e-3, 0.0),
        ("mass", 0.0, 5e-3),
        ("mass", 5e-4, 1e-3),
        ("aileron", 0.0, 0.0),
        ("aileron", 1e-5, 0.0),
        ("aileron", 0.0, 1e-4),
        ("aileron", 3e-5, 5e-5),
        ("aileron", 1e-4, 0.0),
    ],
)
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_log_gives_the_verdict_of_its_run(name, sigma, count, seed):
    found, expected = classify_log(log_of(name, sigma, count, seed)), classify(run_of(name)[0])
    assert found.verdict == expected.verdict == "hunting", found.reason
    assert found.period_s == pytest.approx(expected.period_s, rel=2e-2)
    assert found.amplitude_rad == pytest.approx(expected.amplitude_rad, rel=0.05, abs=2 * sigma + count)
    assert found.motor_amplitude_rad == pytest.approx(expected.motor_amplitude_rad, rel=1e-2)
    assert found.stick_fraction == pytest.approx(expected.stick_fraction, abs=0.06)
    assert found.duty.load_reversals_per_h == pytest.approx(expected.duty.load_reversals_per_h, rel=3e-2)
    assert found.standing_error_rad == pytest.approx(0, abs=0.1 * expected.amplitude_rad + count)
    assert (
        f"what moves by less than {estimate_noise(log_of(name, sigma, count, seed)['position']).band:.3g} rad"
        in found.reason
    )


@pytest.mark.parametrize(("sigma", "count"), [(0.0, 0.0), (0.01, 0.0), (0.0, 0.05), (0.02, 0.02)])
@pytest.mark.parametrize("points", [50, 400])
def test_a_noisy_sine_does_not_stick(sigma, count, points):
    time = np.arange(30 * points) / points
    position = np.sin(2 * np.pi * time) + sigma * np.random.default_rng(0).standard_normal(len(time))
    log = {"time": time, "position": count * np.round(position / count) if count else position}
    found = classify_log(log)
    assert found.verdict == "limit cycle without sticking", found.reason
    assert found.period_s == pytest.approx(1.0, rel=2e-2)
    assert found.amplitude_rad == pytest.approx(1.0, abs=estimate_noise(log["position"]).band / 2 + 3e-3)
    assert found.stick_fraction == 0


@pytest.mark.parametrize(("sigma", "count"), [(0.0, 0.0), (1e-3, 0.0), (0.0, 1e-2), (1e-3, 1e-3)])
def test_a_noisy_log_of_a_step_that_settles_is_at_rest_with_its_error(sigma, count):
    time = np.linspace(0, 20, 4001)
    position = 0.9 * (1 - np.exp(-time / 0.5)) + sigma * np.random.default_rng(0).standard_normal(len(time))
    position = count * np.round(position / count) if count else position
    found = classify_log({"time": time, "position": position, "reference": np.ones(len(time))})
    assert found.verdict == "rest", found.reason
    assert found.standing_error_rad == pytest.approx(0.1, abs=4 * sigma + count + 1e-5)


@pytest.mark.parametrize(("sigma", "count"), [(1e-3, 0.0), (0.0, 1e-2), (1e-2, 5e-3)])
def test_noise_and_resolution_are_found(sigma, count):
    time = np.linspace(0, 20, 20_001)
    position = np.sin(time) + sigma * np.random.default_rng(0).standard_normal(len(time))
    noise = estimate_noise(count * np.round(position / count) if count else position)
    assert noise.resolution == pytest.approx(count)
    # rounding is noise of at most a twelfth of the count squared
    assert 0.9 * sigma <= noise.sigma <= 1.1 * np.hypot(sigma, count / np.sqrt(12))


def test_a_file_is_read_with_its_header_in_any_order(tmp_path):
    path = tmp_path / "log.csv"
    log = log_of("mass", 1e-3)
    names = ["Position", "time", "current", "motor_position", "reference"]
    current = 2 + 0 * log["time"]
    rows = zip(log["position"], log["time"], current, log["motor position"], log["reference"], strict=True)
    path.write_text("\n".join([",".join(names), *(",".join(map(repr, map(float, row))) for row in rows)]) + "\n")
    found, expected = classify_log(path), classify_log(log)
    assert found.period_s == expected.period_s
    assert found.motor_amplitude_rad == expected.motor_amplitude_rad
    assert found.duty.current_rms == pytest.approx(2.0)


def test_uneven_times_are_laid_on_even_ones():
    log = log_of("mass", 1e-3)
    keep = np.sort(np.random.default_rng(0).permutation(len(log["time"]))[: int(0.9 * len(log["time"]))])
    found = classify_log({name: values[keep] for name, values in log.items()})
    assert found.verdict == "hunting"
    assert found.period_s == pytest.approx(classify(run_of("mass")[0]).period_s, rel=1e-2)


def test_a_short_log_asks_for_a_longer_one():
    log = log_of("mass", 1e-3)
    found = classify_log({name: values[log["time"] < 20] for name, values in log.items()})
    assert found.verdict == "undecided"
    assert "log longer, by about" in found.reason
    assert found.longer_s > 0


WRONG = {
    "no position": ("time,reference\n0,1\n", "a log needs time and position; position is not among time, reference"),
    "a word": ("time,position\n0,1\n1,high\n", "line 3 must be 2 numbers, got '1,high'"),
    "a short line": ("time,position\n0,1\n1\n", "line 3 must be 2 numbers, got '1'"),
    "nothing": ("", "empty; a log begins with the names of its columns: time, position"),
    "not a number": ("time,position\n0,nan\n", "position must be finite, got nan in row 1"),
    "time that stands": ("time,position\n0,1\n0,1\n", "time must increase, got 0 s and then 0 s in row 2"),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_log_is_refused(name, tmp_path):
    text, message = WRONG[name]
    path = tmp_path / "log.csv"
    path.write_text(text)
    with pytest.raises(ValueError) as caught:
        classify_log(path)
    assert message in str(caught.value)


def test_arrays_of_unequal_length_are_refused():
    with pytest.raises(ValueError, match="position must have one value for each of 3 times"):
        classify_log({"time": np.arange(3.0), "position": np.arange(2.0)})
