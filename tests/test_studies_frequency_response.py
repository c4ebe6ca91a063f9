"""The frequency-response study: what is measured, kept, gone on with, written and refused.

Oracles: a mass under a PID without friction, whose response to a sine has a closed form; limits that are known to be
kept or missed by it; a study that was killed finished without computing a point twice.
"""

import csv
import json
import math
from types import SimpleNamespace

import numpy as np
import pytest
import xarray
from click.testing import CliRunner

from actuator import SimulationError, SineStream
from studies.__main__ import main
from studies.cases import load_case
from studies.files import CaseError, StudyError
from studies.frequency.bench import TESTS, BenchPlan
from studies.frequency.mask import Limit, check_limit, load_mask
from studies.frequency.page import list_assumptions
from studies.frequency.plan import PARTS, load_positioner
from studies.frequency.tables import write_netcdf

pytestmark = pytest.mark.thorough

INERTIA, GAIN, RATE, INTEGRAL = 1.0, 100.0, 8.0, 50.0
FREQUENCIES = (0.5, 1.0, 2.0)  # Hz
STROKE, AMPLITUDE = 40.0, 0.01  # deg, of it
BIAS = 3.0  # N m
MASS = f"""
title = "A mass under a PID"

[motor]
type = "TorqueSource"

[gear]
input = "mass"
output = "mass"

[gear.shafts]
mass = {{ inertia = {INERTIA} }}

[controller]
type = "PID"
proportional = {GAIN}
integral = {INTEGRAL}
derivative = {RATE}

[scenario]
duration = 5

[scenario.inputs.reference]
type = "Constant"
value = 1.0
"""
MASK = """
title = "For a test"

[[limits]]
amplitude = 0.01
frequencies = [0.4, 3.0]
gain_low_db = [-3.0, -3.0]
gain_high_db = [{high}, {high}]
phase_low_deg = [-150, -150]
"""


def response(frequency, inertia=INERTIA):
    """Load angle over reference of the mass; the derivative is that of the load alone."""
    s = 2j * math.pi * np.asarray(frequency)
    return (GAIN + INTEGRAL / s) / (inertia * s**2 + RATE * s + GAIN + INTEGRAL / s)


def invoke(*arguments):
    """Run the command line in this process."""
    return CliRunner().invoke(main, ["frequency-response", *(str(argument) for argument in arguments)])


def options(folder, mask="kept.toml", amplitudes="1"):
    """Of a small study."""
    return (
        folder / "mass.toml", "--mask", folder / mask, "--stroke", STROKE, "--amplitudes", amplitudes,
        "--frequencies", 0.5, 2, 3, "--torque", 5, "--jobs", 1,
    )  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A case, two masks, and the results of a study of it."""
    path = tmp_path_factory.mktemp("mass")
    (path / "mass.toml").write_text(MASS, encoding="utf-8")
    (path / "heavier.toml").write_text(
        'base = "mass.toml"\ntitle = "A heavier mass"\n[gear.shafts]\nmass = { inertia = 2.0 }\n', encoding="utf-8"
    )
    (path / "kept.toml").write_text(MASK.format(high=6), encoding="utf-8")
    (path / "missed.toml").write_text(MASK.format(high=0.5), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def outcome(folder):
    """Of a study of two cases with a record laid over them and a bias load, with its files in folder/out."""
    time = np.arange(0, 30, 0.01)
    reference = np.random.default_rng(0).standard_normal(len(time))
    table = np.column_stack([time, reference, 0.5 * reference])
    np.savetxt(folder / "rig.csv", table, delimiter=",", header="time,reference,response", comments="")
    beside = ("--against", folder / "heavier.toml", "--measured", folder / "rig.csv", "--bias", BIAS)
    return invoke(*options(folder), *beside, "--out", folder / "out")


@pytest.fixture
def without_pictures(monkeypatch):
    """They take longer than all that is computed here."""
    monkeypatch.setattr("studies.frequency.report._pictures", lambda *arguments: {})


def test_the_sines_are_those_of_the_closed_form(folder, outcome):
    assert outcome.exit_code == 0, outcome.output
    data = xarray.open_dataset(folder / "out" / "responses.nc", engine="scipy").isel(case=0, set=0, load=0, output=0)
    found = data.response_real.values + 1j * data.response_imaginary.values
    np.testing.assert_allclose(data.amplitude, [math.radians(AMPLITUDE * STROKE)])
    np.testing.assert_allclose(data.frequency, FREQUENCIES)
    np.testing.assert_allclose(found[0], response(FREQUENCIES), rtol=1e-3)
    with (folder / "out" / "responses.csv").open(newline="", encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["case"] == "mass"]
    assert [float(row["bias_Nm"]) for row in rows] == [0.0] * 3 + [BIAS] * 3
    gains = np.reshape([float(row["gain_db"]) for row in rows], (2, 3))
    np.testing.assert_allclose(gains[0], 20 * np.log10(abs(found[0])), rtol=1e-9)
    np.testing.assert_allclose(gains[1], gains[0], atol=1e-2)  # what is linear does not mind a bias load
    assert all(float(row["distortion"]) < 1e-2 for row in rows)


def test_the_compliance_is_that_of_the_closed_form(folder, outcome):
    with (folder / "out" / "stiffness.csv").open(newline="", encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["state"] == "powered" and row["case"] == "mass"]
    s = 2j * math.pi * np.array([float(row["frequency_Hz"]) for row in rows])
    stiffness = abs(INERTIA * s**2 + GAIN + INTEGRAL / s + RATE * s)
    np.testing.assert_allclose([float(row["stiffness_Nm_per_rad"]) for row in rows], stiffness, rtol=1e-3)


def test_the_margins_are_those_of_the_closed_form(folder, outcome):
    result = json.loads((folder / "out" / "result.json").read_text())["cases"]["mass"]
    (crossing,) = result["margins"]["torque_reference"]["forward"]["gain_crossings"]
    s = 1j * crossing["frequency"]
    loop = (GAIN + INTEGRAL / s + RATE * s) / (INERTIA * s**2)
    assert abs(loop) == pytest.approx(1, rel=1e-6)
    s = 1j * np.geomspace(1, 100, 100_000)
    loops = (GAIN + INTEGRAL / s + RATE * s) / (INERTIA * s**2)
    peaks = result["sensitivity"]["torque_reference"]["forward"]
    assert peaks["S"]["value"] == pytest.approx(abs(1 / (1 + loops)).max(), rel=1e-6)
    assert peaks["T"]["value"] == pytest.approx(abs(loops / (1 + loops)).max(), rel=1e-6)
    s = 1j * crossing["frequency"]
    assert crossing["phase_rad"] == pytest.approx(math.pi + np.angle(loop), rel=1e-6)


def test_everything_is_written_and_the_page_needs_nothing_else(folder, outcome):
    names = {path.name for path in (folder / "out").iterdir() if path.suffix != ".jsonl"}
    assert {"report.html", "result.json", "findings.txt", "responses.csv", "stiffness.csv", "margins.csv"} <= names
    assert {
        "responses.nc",
        "stiffness_powered.nc",
        "stiffness_unpowered.nc",
        "mass_family.png",
        "mass_harmonics.png",
        "mass_places_1.png",
        "mass_sensitivity_torque_reference.png",
        "heavier_test_step.png",
    } <= names
    page = (folder / "out" / "report.html").read_text(encoding="utf-8")
    result = json.loads((folder / "out" / "result.json").read_text())
    assert "src=" in page and page.count("src=") == page.count('src="data:image/png;base64,')
    for words in (
        result["cases"]["mass"]["model"],
        result["source"],
        "For a test",
        "gear.shafts.mass.inertia",
        "kg m^2",
    ):
        assert words in page
    assert not [name for name in names if name.startswith(".writing")]


def test_a_mask_is_kept_or_missed_and_the_second_study_computes_nothing(
    folder, outcome, tmp_path, without_pictures, monkeypatch
):
    peak = 20 * np.log10(abs(response(FREQUENCIES))).max()
    assert 0.5 < peak < 6  # dB: one mask is missed and the other kept
    assert "mass, no bias: the mask is kept." in outcome.output
    assert "mass, bias +3 N m: the mask is kept." in outcome.output

    def never(*arguments, **others):
        raise AssertionError("a finished point was computed again")

    monkeypatch.setattr("actuator.response.sine.SineStream.measure", never)
    monkeypatch.setattr("studies.frequency.bench.BenchWork.__call__", never)
    (kept,) = (folder / "out").glob("finished.jsonl")
    (tmp_path / kept.name).write_text(kept.read_text())
    again = invoke(*options(folder, "missed.toml"), "--out", tmp_path)
    assert again.exit_code == 0, again.output
    assert "mass: the mask is missed: gain, upper limit, at 0.4 deg" in again.output
    rows = json.loads((tmp_path / "result.json").read_text())["cases"]["mass"]["checks"]
    slack = {row["side"]: row["slack"] for row in rows}
    assert slack["gain_high_db"] == pytest.approx(0.5 - peak, abs=0.01)
    assert slack["gain_low_db"] > 0 and not all(row["met"] for row in rows)


def test_a_killed_study_goes_on_where_it_stopped(folder, outcome, tmp_path, without_pictures, monkeypatch):
    (kept,) = (folder / "out").glob("finished.jsonl")
    lines = kept.read_text().splitlines(keepends=True)
    dropped = [line for line in lines if "at 2 Hz" in line]
    # sines of 2 Hz: of the reference with a bias load and without, others of torque
    mass, both = 1 + 2 * len(PARTS), 2 * (2 + 2 * len(PARTS))
    assert len(dropped) == both
    left = "".join(line for line in lines if line not in dropped)
    (tmp_path / kept.name).write_text(left + '{"key": "half')  # what a kill in the middle of a write leaves
    computed = []
    measure = SineStream.measure
    monkeypatch.setattr(
        "actuator.response.sine.SineStream.measure",
        lambda self, point: computed.append(point) or measure(self, point),
    )
    again = invoke(*options(folder), "--out", tmp_path)
    assert again.exit_code == 0, again.output
    assert len(computed) == mass and {point.frequency for point in computed} == {2.0}
    rows, before = ((path / "responses.csv").read_text().splitlines() for path in (tmp_path, folder / "out"))
    assert rows == [row for row in before if not row.startswith("heavier") and f",{BIAS}," not in row]


def test_what_failed_is_counted_and_not_said_to_stand_still(folder, outcome, tmp_path, without_pictures, monkeypatch):
    (kept,) = (folder / "out").glob("finished.jsonl")
    lines = kept.read_text().splitlines(keepends=True)
    (tmp_path / kept.name).write_text("".join(line for line in lines if "at 2 Hz" not in line))
    measured = SineStream._measured

    def fails(self, point):
        if self.given == "reference":
            raise SimulationError("no modes", 0.0, {})
        return measured(self, point)

    monkeypatch.setattr(SineStream, "_measured", fails)
    found = invoke(*options(folder), "--out", tmp_path)
    assert found.exit_code == 0, found.output
    words = "gain, lower limit, at 0.4 deg and 2 Hz, 1 of 3 simulations failed"
    assert words in found.output and "mass: 1 of 3 sines failed." in found.output
    assert "nothing moves" not in found.output and "have not settled" not in found.output
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "1 of 3 simulations failed" in page and "no motion" not in page


def test_a_mass_on_a_bearing_that_sticks_is_studied_and_what_it_has_is_told(folder, tmp_path, without_pictures):
    (folder / "rubbing.toml").write_text(
        'base = "mass.toml"\ntitle = "It rubs"\n[gear.bearings.guide]\nshaft = "mass"\ncoulomb = 0.5\nbreakaway = 0.8\n'
        '[scenario.inputs.load_torque]\ntype = "Constant"\nvalue = 0.1\n',
        encoding="utf-8",
    )
    case = folder / "rubbing.toml"
    found = invoke(*options(folder), "--against", case, "--out", tmp_path)
    assert found.exit_code == 0, found.output
    page = " ".join((tmp_path / "report.html").read_text(encoding="utf-8").split())
    # each case at its own operating point; each sentence of those that have the part
    assert "mass, reference 0: " in page and "rubbing, reference 0, load_torque 0.1: " in page
    assert "<li>Contacts stick with zero slip speed, and break away at their breakaway friction (rubbing).</li>" in page
    for word in ("der Linden", "backlash", "inverter", "ecoupling", "winding", "sampled", "Corners and bias loads"):
        assert word not in page, word
    assert "mass, not measured: mass: has no contact that could stick, so no threshold" in page
    result = json.loads((tmp_path / "result.json").read_text())["cases"]
    assert result["rubbing"]["tests"]["threshold"] and "reason" not in result["rubbing"]["tests"]["threshold"]


def test_what_was_assumed_is_told_of_the_cases_that_have_the_part():
    cases = [load_case(name) for name in ("aileron", "aileron-sampled")]
    studies = [
        SimpleNamespace(case=case, torque=5.0, stiffness={"unpowered": None}, checks={}, sets={}) for case in cases
    ]
    told = list_assumptions(SimpleNamespace(stroke=1.0), studies)
    for sentence in (
        "Averaged inverter.",
        "Decoupling with the true motor parameters.",
        "Teeth with backlash push but do not pull.",
        "Controllers in continuous time (aileron).",
        "Controllers sampled (aileron-sampled).",
        "Unpowered: the winding is open.",
    ):
        assert sentence in told
    assert not [sentence for sentence in told if sentence.startswith(("Temperatures", "Corners"))]


def test_it_is_said_up_to_which_torque_the_one_that_drives_back_was_sought():
    actuator = load_case("aileron").actuator
    plan = BenchPlan(stroke=1.0, torque=1.0, frequencies=(1.0,), sets={}, inputs={})
    found = TESTS["back driving"](actuator, plan)
    assert found.words == "not back-driven forward or backward up to 1 N m"
    assert all(math.isinf(value) for value, _ in found.numbers.values())


def test_a_corner_is_the_case_with_its_parameters_and_all_but_its_sines_are_there_already(
    folder, outcome, tmp_path, without_pictures, monkeypatch
):
    (kept,) = (folder / "out").glob("finished.jsonl")
    (tmp_path / kept.name).write_text(kept.read_text())
    computed, measure = [], SineStream.measure
    monkeypatch.setattr(
        "actuator.response.sine.SineStream.measure",
        lambda self, point: computed.append(point) or measure(self, point),
    )
    heavy = ("--corner", "heavy: gear.shafts.mass.inertia=3", "--bias", BIAS)
    found = invoke(*options(folder, "missed.toml"), *heavy, "--out", tmp_path)
    assert found.exit_code == 0, found.output
    assert len(computed) == 2 * len(FREQUENCIES)  # with the bias load and without
    with (tmp_path / "responses.csv").open(newline="", encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["corner"] == "heavy"]
    expected = response(FREQUENCIES * 2, inertia=3.0)
    gains = [float(row["gain_db"]) for row in rows]
    np.testing.assert_allclose(gains, 20 * np.log10(abs(expected)), atol=1e-2)
    result = json.loads((tmp_path / "result.json").read_text())["cases"]["mass"]
    assert result["corners"] == {"as it is": {}, "heavy": {"gear.shafts.mass.inertia": 3.0}}
    slack = {(row["corner"], row["bias"]): row["slack"] for row in result["checks"] if row["side"] == "gain_high_db"}
    peak = 20 * np.log10(abs(response(FREQUENCIES, inertia=3.0))).max()
    assert list(slack) == [("as it is", 0.0), ("heavy", 0.0), ("as it is", BIAS), ("heavy", BIAS)]
    assert slack["heavy", BIAS] == pytest.approx(0.5 - peak, abs=0.01)
    assert f"mass, heavy, bias +{BIAS:g} N m: the mask is missed: " in found.output
    assert "heavy, overshoot" in result["tests"]["every corner"]


def test_a_second_case_and_a_record_are_laid_beside_it(folder, outcome):
    page = (folder / "out" / "report.html").read_text(encoding="utf-8")
    assert "A mass under a PID and A heavier mass" in page and "Measured responses" in page and "rig" in page
    assert page.count("No bias. Fundamental of load angle") == 2  # each says of which place it is
    assert "Parameters that differ are shaded" in page and page.count('class="other"') == 1
    data = xarray.open_dataset(folder / "out" / "responses.nc", engine="scipy").isel(set=0, load=0, output=0)
    assert data.case.values.tolist() == ["mass", "heavier"]
    heavier = data.isel(case=1, amplitude=0)
    found = heavier.response_real.values + 1j * heavier.response_imaginary.values
    np.testing.assert_allclose(found, response(FREQUENCIES, inertia=2 * INERTIA), rtol=1e-3)
    assert (folder / "out" / "beside.png").exists()


def test_cases_that_have_not_the_same_corners_share_a_file(tmp_path):
    def data(names, value):
        moves = (("set",), np.ones(len(names), bool))
        return xarray.Dataset({"response": ("set", np.full(len(names), value)), "moves": moves}, {"set": names})

    write_netcdf(tmp_path / "both.nc", {"one": data(["as it is", "cold"], 1 + 2j), "two": data(["cold"], 3j)})
    found = xarray.open_dataset(tmp_path / "both.nc", engine="scipy")
    assert found.response_imaginary.sel(set="cold").values.tolist() == [2.0, 3.0]
    assert found.response_real.sel(case="one", set="as it is") == 1.0
    assert np.isnan(found.moves.sel(case="two", set="as it is"))


# -- limits ---------------------------------------------------------------------------------------------------


def test_limits_are_straight_over_the_logarithm_of_frequency():
    limit = Limit(amplitude=0.1, frequencies=(1.0, 100.0), gain_low_db=(0.0, -6.0))
    np.testing.assert_allclose(limit.at("gain_low_db", np.array([1.0, 10.0, 100.0])), [0.0, -3.0, -6.0], atol=1e-12)
    hertz, moves = np.array([0.5, 1.0, 10.0]), np.ones(3, bool)
    (check,) = check_limit(limit, hertz, np.array([1e-6, 1.1, 10 ** (-4 / 20)], complex), moves)
    assert check.slack == pytest.approx(-1.0) and check.frequency == 10.0 and check.points == 2 and not check.met


def test_what_does_not_move_or_has_failed_keeps_to_no_lower_limit():
    limit = Limit(amplitude=0.1, frequencies=(1.0, 2.0), gain_low_db=(-60.0, -60.0), phase_low=(-9.0, -9.0))
    for value, moves, words in (
        (1e-15, [False, True], "nothing moves"),
        (math.nan, [True, True], "1 of 2 simulations failed"),
    ):
        checks = check_limit(limit, np.array([1.0, 2.0]), np.array([value, 1.0], complex), np.array(moves))
        assert [check.slack for check in checks] == [-math.inf, -math.inf]
        assert [check.nothing for check in checks] == [words, words]


def test_the_built_in_mask_is_read():
    assert [limit.amplitude for limit in load_mask().limits] == [0.01, 0.1]


WRONG_LIMITS = {
    "frequencies that fall": ("frequencies = [2, 1]\ngain_low_db = [0, 0]", "must be > 0 Hz and ascend"),
    "a value too few": ("frequencies = [1, 2]\ngain_low_db = [0]", "must have a value at each of the 2 frequencies"),
    "no limit": ("frequencies = [1, 2]", "needs at least one of gain_low_db"),
    "an unknown key": ("frequencies = [1]\ngain_lo_db = [0]", "did you mean gain_low_db"),
}


@pytest.mark.parametrize("name", WRONG_LIMITS)
def test_a_wrong_mask_is_refused(name, tmp_path):
    text, message = WRONG_LIMITS[name]
    path = tmp_path / "mask.toml"
    path.write_text(f'title = "x"\n[[limits]]\namplitude = 0.01\n{text}\n')
    with pytest.raises(CaseError, match=message):
        load_mask(path)


# -- what is refused --------------------------------------------------------------------------------------------

WRONG = {
    "an unknown case": (("ailerons",), "cannot be read"),
    "amplitudes that are no numbers": (("--amplitudes", "1;2"), "--amplitudes takes numbers separated by commas"),
    "an amplitude beyond the stroke": (
        ("--amplitudes", "80"),
        "<= 50 % of the stroke, at least one, got 80 %",
    ),
    "frequencies that fall": (("--frequencies", 2, 1, 3), "--frequencies takes FROM TO COUNT with 0 < FROM <= TO"),
    "no frequency within the mask": (("--frequencies", 100, 200, 2), "no frequency is within limit 1 of the mask"),
    "a mask that is not there": (("--mask", "nowhere.toml"), "cannot be read"),
    "a record that is not there": (("--measured", "nowhere.csv"), "nowhere.csv: cannot be read"),
    "the same case twice": (("--against", "aileron"), "both cases are called aileron"),
    "an unknown parameter": (("--corner", "motor.resistence=1"), "did you mean motor.resistance"),
    "a corner without a number": (("--corner", "motor.resistance"), "a corner is NAME=VALUE,NAME=VALUE with numbers"),
    "a bias load that is none": (("--bias", "nan"), "bias loads are numbers in N m, got nan"),
    "a tuning that is none": (("--against", "nowhere.json"), "nowhere.json: cannot be read: No such file"),
    "no stroke": (("--stroke", 0), "Invalid value for '--stroke'"),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_study_is_refused_in_one_line_and_nothing_is_written(name, tmp_path):
    arguments, message = WRONG[name]
    found = invoke(*arguments, "--out", tmp_path / "out")
    assert found.exit_code == 2, found.output
    assert message in found.output
    assert isinstance(found.exception, SystemExit)
    assert "Invalid value" in message or len(found.output.strip().splitlines()) == 1
    assert not (tmp_path / "out").exists()


def test_a_motor_without_limits_needs_a_torque(folder, tmp_path):
    found = invoke(folder / "mass.toml", "--out", tmp_path / "out")
    assert found.exit_code == 2
    assert "its motor has no torque limit; give the largest torque at the load with --torque" in found.output


def test_a_case_without_a_controller_has_no_response(folder, tmp_path):
    path = tmp_path / "open.toml"
    path.write_text(MASS[: MASS.index("[controller]")] + "[scenario]\nduration = 1\n")
    with pytest.raises(StudyError, match="open has no position controller"):
        load_positioner(path)


def test_help_tells_the_options():
    found = invoke("--help")
    assert found.exit_code == 0
    for word in (
        "--against",
        "--corner",
        "--bias",
        "--measured",
        "--mask",
        "--amplitudes",
        "FROM TO COUNT",
        "Repeat the command to resume",
    ):
        assert word in " ".join(found.output.split())
