"""The command line: what it writes, what it says, and what it refuses.

Oracles: the cycle of a mass on a guide in closed form (see test_system_hunting_mass.py), written as a case file; the
two built-in cases, of which one hunts and one comes to rest; HTML that needs nothing but itself; the texts of errors.
"""

import json
import math
import os
import re
import shutil
import sys
from html.parser import HTMLParser

import pytest
from click import Option
from click.testing import CliRunner

from studies import built_in
from studies.__main__ import COMMANDS, main
from studies.findings import Findings
from studies.study import load_commands

pytestmark = pytest.mark.thorough

MASS = """
title = "Mass on a guide"
description = "It hunts."

[motor]
type = "TorqueSource"

[gear]
input = "mass"
output = "mass"

[gear.shafts]
mass = { inertia = 1.0 }

[gear.bearings]
guide = { shaft = "mass", coulomb = 1.0, breakaway = 1.5 }

[controller]
type = "PID"
proportional = 3
integral = 4
derivative = 6

[scenario]
duration = 100

[scenario.inputs.reference]
type = "Constant"
value = 1.0
"""
PNG = b"\x89PNG\r\n\x1a\n"


def invoke(*arguments):
    """Run the command line in this process."""
    return CliRunner().invoke(main, [str(argument) for argument in arguments])


@pytest.fixture
def case_file(tmp_path):
    """Write a case file from its text."""

    def write(text, name="mass.toml"):
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return path

    return write


@pytest.fixture(scope="module")
def mass(tmp_path_factory):
    """The outcome of the mass, and the folder with what was written."""
    folder = tmp_path_factory.mktemp("mass")
    path = folder / "mass.toml"
    path.write_text(MASS, encoding="utf-8")
    return invoke(path, "--out", folder / "out"), folder / "out"


@pytest.fixture(scope="module", params=["aileron", "aileron-retuned"])
def aileron(request, tmp_path_factory):
    """A built-in case: its name, the outcome, and the result."""
    out = tmp_path_factory.mktemp(request.param)
    outcome = invoke("--case", request.param, "--out", out)
    return request.param, outcome, json.loads((out / "result.json").read_text(encoding="utf-8"))


# -- help ---------------------------------------------------------------------------------------------------


def test_the_list_names_every_built_in_case_with_its_title():
    outcome = invoke("--list")
    assert outcome.exit_code == 0
    lines = outcome.output.splitlines()
    assert [line.split()[0] for line in lines] == built_in()
    assert all(len(line.split()) > 1 for line in lines)


def test_help_tells_the_options_and_their_defaults():
    outcome = invoke("--help")
    assert outcome.exit_code == 0
    for word in ("--case", "--out", "--list", "PATH.toml", "benchmark", "default: aileron", "default: out"):
        assert word in outcome.output


# -- what is written ----------------------------------------------------------------------------------------


def test_a_case_file_gives_a_verdict_in_words_and_numbers(mass):
    outcome, out = mass
    assert outcome.exit_code == 0, outcome.output
    assert "verdict: hunting" in outcome.output
    assert "period 23.37 s, amplitude 67.24 mrad at the load, stuck for 78% of the time" in outcome.output
    assert str(out / "report.html") in outcome.output


def test_everything_that_is_announced_is_written_and_nothing_else(mass):
    outcome, out = mass
    written = sorted(path.name for path in out.iterdir() if path.name != "finished.jsonl")
    assert {"report.html", "result.json"} < set(written)
    assert f"and {len(written) - 1} more files" in outcome.output
    pictures = [name for name in written if name.endswith(".png")]
    assert sorted([*pictures, "findings.txt", "report.html", "result.json"]) == written
    assert json.loads((out / "result.json").read_text(encoding="utf-8"))["files"] == written
    assert all((out / name).read_bytes().startswith(PNG) for name in pictures)


class References(HTMLParser):
    """Collects what a page refers to."""

    def __init__(self):
        super().__init__()
        self.found, self.images = [], 0

    def handle_starttag(self, tag, attributes):
        self.images += tag == "img"
        names = ("src", "href", "srcset", "data", "poster", "action")
        self.found += [value for name, value in attributes if name in names]


def test_the_report_needs_no_other_file(mass):
    _, out = mass
    page = (out / "report.html").read_text(encoding="utf-8")
    references = References()
    references.feed(page)
    assert references.images == len(list(out.glob("*.png")))
    assert [value[:40] for value in references.found if not value.startswith(("data:", "#"))] == []
    assert re.findall(r"https?://|file:|url\(|@import", page) == []
    assert "<title>Mass on a guide</title>" in page
    assert "hunting" in page


def test_the_result_holds_the_verdict_the_margins_and_the_cost(mass):
    result = json.loads((mass[1] / "result.json").read_text(encoding="utf-8"))
    assert result["case"] == "mass"
    hunting, simulation = result["hunting"], result["simulation"]
    assert hunting["verdict"] == "hunting"
    assert hunting["period_s"] == pytest.approx(23.3693, rel=1e-3)
    assert hunting["amplitude_rad"] == pytest.approx(0.067240, rel=1e-3)
    assert hunting["stick_fraction"] == pytest.approx(0.780187, rel=2e-3)
    assert set(result["margins"]) == {"position", "torque_reference"}
    assert set(result["margins"]["position"]) == {"stuck", "forward", "backward"}
    # by hand, the loop is (3 + 4/s)/(s^2 + 6 s)
    crossing = result["margins"]["position"]["forward"]["phase_frequency"]
    assert math.hypot(3, 4 / crossing) == pytest.approx(crossing * math.hypot(crossing, 6), rel=1e-6)
    assert simulation["simulated_s"] == 100
    assert simulation["wall_s"] > 0
    assert simulation["events"] == 19
    assert {"python", "casadi", "control", "numpy", "scipy"} <= set(result["versions"])


def test_a_result_without_a_cycle_holds_null_and_no_nan(case_file, tmp_path):
    path = case_file(MASS.replace("breakaway = 1.5", "breakaway = 1.0"))
    outcome = invoke(path, "--out", tmp_path / "out")
    assert outcome.exit_code == 0, outcome.output
    assert "period" not in outcome.output
    text = (tmp_path / "out" / "result.json").read_text(encoding="utf-8")
    assert "NaN" not in text and "Infinity" not in text
    assert json.loads(text)["hunting"]["period_s"] is None


def test_a_case_without_a_controller_is_reported_too(case_file, tmp_path):
    start, end = MASS.index("[controller]"), MASS.index("[scenario]")
    text = (MASS[:start] + MASS[end:]).replace("inputs.reference", "inputs.torque_reference")
    outcome = invoke(case_file(text.replace("duration = 100", "duration = 1")), "--out", tmp_path / "out")
    assert outcome.exit_code == 0, outcome.output
    assert (tmp_path / "out" / "report.html").exists()


def test_a_second_run_replaces_the_first(case_file, tmp_path):
    out = tmp_path / "out"
    for duration in (1, 2):
        path = case_file(MASS.replace("duration = 100", f"duration = {duration}"))
        assert invoke("--out", out, path).exit_code == 0  # before or after the path
        result = json.loads((out / "result.json").read_text(encoding="utf-8"))
        assert result["simulation"]["simulated_s"] == duration
    assert [path.name for path in out.iterdir() if path.name.startswith(".")] == []


# -- interrupted --------------------------------------------------------------------------------------------


def numbers(out):
    """The result without what it cost."""
    result = json.loads((out / "result.json").read_text(encoding="utf-8"))
    return {name: value for name, value in result.items() if name not in ("case", "simulation")}


def test_an_interrupted_run_says_so_and_goes_on_to_the_same_result(mass, case_file, tmp_path, monkeypatch):
    def interrupt(*arguments, **options):
        raise KeyboardInterrupt

    out, path = tmp_path / "out", case_file(MASS)
    with monkeypatch.context() as patch:
        patch.setattr("studies.judge.study.find_causes", interrupt)
        outcome = invoke(path, "--out", out)
    assert outcome.exit_code == 130
    assert outcome.output.splitlines()[1:] == ["", "interrupted; repeat the command to resume"]
    assert [each.name for each in out.iterdir()] == ["finished.jsonl"]
    for name in ("find_orbit", "hunting_margin"):
        monkeypatch.setattr(f"studies.judge.study.{name}", lambda *arguments, **options: pytest.fail("computed again"))
    outcome = invoke(path, "--out", out)
    assert outcome.exit_code == 0, outcome.output
    assert f"Resuming: 3 results found in {out / 'finished.jsonl'}" in outcome.output
    assert f"3 reused from {out / 'finished.jsonl'}" in outcome.output
    assert numbers(out) == numbers(mass[1])


def test_files_of_an_earlier_result_go_and_others_stay(mass, case_file, tmp_path):
    out = tmp_path / "out"
    shutil.copytree(mass[1], out)
    (out / "mine.png").write_text("not of a study")
    (out / ".writing-killed").mkdir()
    assert (out / "causes.png").exists()
    rests = MASS.replace("breakaway = 1.5", "breakaway = 1.0").replace("duration = 100", "duration = 5")
    assert invoke(case_file(rests), "--out", out).exit_code == 0
    names = {each.name for each in out.iterdir()}
    assert {"mine.png", "finished.jsonl", "report.html", "step.png"} <= names
    assert names.isdisjoint({"causes.png", "remedies.png", "orbit.png", ".writing-killed"})


def test_what_cannot_be_written_leaves_the_earlier_result_as_it_was(tmp_path):
    def contents():
        return {path.name: path.read_text() if path.is_file() else None for path in tmp_path.iterdir()}

    Findings(pictures={}, result={"x": 1}, text=["one"], files={"a.csv": "1", "old.csv": "1"}).save(tmp_path)
    (tmp_path / "margins.csv").mkdir()
    before = contents()
    later = Findings(pictures={}, result={"x": 2}, text=["two"], files={"a.csv": "2", "margins.csv": "2", "z.csv": "2"})
    with pytest.raises(IsADirectoryError):
        later.save(tmp_path)
    assert contents() == before
    (tmp_path / "margins.csv").rmdir()
    later.save(tmp_path)
    assert set(contents()) == {"a.csv", "margins.csv", "z.csv", "findings.txt", "result.json"}
    assert contents()["a.csv"] == "2"


def test_the_list_of_files_is_the_first_to_go_and_the_last_to_come(tmp_path, monkeypatch):
    Findings(pictures={}, result={}, text=[], files={"z.csv": "1"}).save(tmp_path)
    replace, moved = os.replace, []
    monkeypatch.setattr("os.replace", lambda source, target: moved.append(source.name) or replace(source, target))
    Findings(pictures={}, result={}, text=[], files={"z.csv": "2"}).save(tmp_path)
    assert moved[0] == moved[-1] == "result.json" and len(moved) == 2 * 3


def test_an_interrupted_benchmark_promises_nothing(monkeypatch):
    def interrupt(*arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr("studies.checks.commands.run_benchmark", interrupt)
    outcome = invoke("benchmark")
    assert outcome.exit_code == 130
    assert outcome.output.strip() == "interrupted"


# -- the built-in cases -------------------------------------------------------------------------------------


def test_the_aileron_hunts_and_comes_to_rest_when_retuned(aileron):
    name, outcome, result = aileron
    assert outcome.exit_code == 0, outcome.output
    hunting = result["hunting"]
    if name == "aileron":
        assert hunting["verdict"] == "hunting"
        assert 0.1 < hunting["period_s"] < 10
        assert 1e-5 < hunting["amplitude_rad"] < 0.1
        assert 0 < hunting["stick_fraction"] < 1
    else:
        assert hunting["verdict"] == "rest"
        assert hunting["period_s"] is None


def test_the_aileron_has_margins_at_every_loop_in_every_mode(aileron):
    _, _, result = aileron
    assert result["not_linearized"] == {}
    assert set(result["margins"]) == {"position", "speed_reference", "torque_reference", "voltage"}
    for loop in result["margins"].values():
        assert set(loop) == {"stuck", "forward", "backward"}
        for mode in ("forward", "backward"):
            assert loop[mode]["phase_deg"] > 0


def test_the_report_on_the_aileron_explains_its_hunting(aileron):
    name, outcome, result = aileron
    assert result["missing"] == {}
    margins = result["hunting_margins"]
    assert set(margins) == {"stiction", "backlash", "integral gain"}
    if name == "aileron-retuned":
        assert result["orbit"] is None and result["causes"] is None and result["remedies"] is None
        assert all(margin["factor"] is None or margin["factor"] > 1 for margin in margins.values())  # None: infinite
        return
    assert all(margin["factor"] < 1 for margin in margins.values())
    orbit = result["orbit"]
    assert orbit["period_s"] == pytest.approx(result["hunting"]["period_s"], rel=1e-3)
    assert orbit["amplitude_rad"] == pytest.approx(result["hunting"]["amplitude_rad"], rel=1e-3)
    assert orbit["stable"] and orbit["error_of_trivial_multiplier"] < 1e-4
    assert all(math.hypot(mu["real"], mu["imaginary"]) < 1 for mu in orbit["multipliers"])
    without = result["causes"]["without"]
    assert without["integral action"]["verdict"] == "rest"
    assert without["breakaway above sliding friction"]["verdict"] == "rest"
    assert result["remedies"][0]["does"] == "rest"
    assert "best countermeasure: " in outcome.output
    assert "integral gain margin: -" in outcome.output


# -- what is refused ----------------------------------------------------------------------------------------

WRONG = {
    "a value out of range": (
        "inertia = 1.0",
        "inertia = -1.0",
        "gear.shafts.mass.inertia must be > 0 kg m^2, got -1 kg m^2",
    ),
    "a rule between two values": ("breakaway = 1.5", "breakaway = 0.5", "got coulomb=1 N m and breakaway=0.5 N m"),
    "a misspelled key": ("coulomb", "coulom", "gear.bearings.guide.coulom"),
    "a string for a number": (
        "proportional = 3",
        'proportional = "3"',
        'controller.proportional = "3" must be a number',
    ),
    "an unknown input": ("inputs.reference", "inputs.referense", "did you mean reference"),
    "an unknown shaft": ('input = "mass"', 'input = "masss"', "names shaft 'masss'; the shafts are mass"),
    "no duration": ("duration = 100", "", "scenario.duration is missing; it must be a number [s]"),
    "not TOML": ("title = ", "title : ", "not valid TOML"),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_file_is_refused_in_one_line_and_nothing_is_written(name, case_file, tmp_path):
    right, wrong, message = WRONG[name]
    assert right in MASS
    path = case_file(MASS.replace(right, wrong, 1))
    outcome = invoke(path, "--out", tmp_path / "out")
    assert outcome.exit_code == 2
    assert message in outcome.output
    assert str(path) in outcome.output
    assert len(outcome.output.strip().splitlines()) == 1
    assert "Traceback" not in outcome.output
    assert isinstance(outcome.exception, SystemExit)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("arguments", [("--case", "ailerons"), ("nowhere.toml",)])
def test_an_unknown_case_is_refused_with_the_names_of_all(arguments, tmp_path):
    outcome = invoke(*arguments, "--out", tmp_path / "out")
    assert outcome.exit_code == 2
    assert "cannot be read" in outcome.output
    assert ", ".join(built_in()) in outcome.output
    assert "Traceback" not in outcome.output
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("arguments", "option"),
    [
        (("--case", "aileron", "hunting"), "--case"),
        (("--thorough", "gear-paper"), "--thorough"),
        (("--list", "tuning"), "--list"),
    ],
)
def test_an_option_that_a_command_does_not_heed_is_refused(arguments, option):
    outcome = invoke(*arguments)
    assert outcome.exit_code == 2
    assert f"{option} does not apply to '{arguments[-1]}'" in outcome.output


@pytest.mark.parametrize("command", [(), *((name,) for name in COMMANDS if name not in ("run", "benchmark"))])
def test_a_folder_that_cannot_be_written_is_refused_at_once(command, tmp_path):
    (tmp_path / "file").write_text("")
    outcome = invoke(*command, "--out", tmp_path / "file" / "out")
    assert outcome.exit_code == 2
    assert f"cannot write to {tmp_path / 'file' / 'out'}: Not a directory; choose another folder" in outcome.output
    outcome = invoke(*command, "--out", tmp_path / "file")
    assert outcome.exit_code == 2
    assert "is a file" in outcome.output


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_explains_every_option(command):
    outcome = invoke(command, "--help")
    assert outcome.exit_code == 0
    assert all(option.help for option in COMMANDS[command].params if isinstance(option, Option))
    if command != "benchmark":
        assert "--out" in outcome.output
        assert "Repeat the command to resume" in " ".join(outcome.output.split())


def test_an_unknown_option_and_an_unknown_command_are_refused():
    for argument in ("--cases", "simulate"):
        outcome = invoke(argument)
        assert outcome.exit_code == 2
        assert "No such" in outcome.output


def test_a_run_that_cannot_be_completed_is_told_in_one_line_and_nothing_is_written(case_file, tmp_path):
    # pushed away from the middle by its load, the mass is beyond all numbers after 230 s
    text = (
        MASS[: MASS.index("[controller]")]
        + "[load]\ntype = 'Load'\nstiffness = -10\nbias = 2\n[scenario]\nduration = 300\n"
    )
    outcome = invoke(case_file(text), "--out", tmp_path / "out")
    assert outcome.exit_code != 0
    assert isinstance(outcome.exception, SystemExit), repr(outcome.exception)
    assert "simulation stopped" in outcome.output
    assert list((tmp_path / "out").iterdir()) == []


# -- a study of one's own -----------------------------------------------------------------------------------

OWN = '''
from dataclasses import dataclass

import click

from studies.files import StudyError
from studies.findings import TEXT, Findings
from studies.study import Work, study


@dataclass(frozen=True, kw_only=True)
class Square:
    number: float
    title: str = "Square"

    def run(self, work: Work) -> Findings:
        key = f"square of {self.number}"
        if key not in work.cache:
            work.cache[key] = {"square": self.number**2}
        work.part(0.0, 1.0)(1, 1)
        square = work.cache[key]["square"]
        return Findings(pictures={}, result={"square": square}, text=[f"{square:g}"], passed=square < 100)


@study("square", first=TEXT)
@click.argument("number", type=float)
def square(number: float) -> Square:
    """The square of a number."""
    if number < 0:
        raise StudyError(f"NUMBER must be >= 0, got {number:g}")
    return Square(number=number)
'''


@pytest.fixture
def square(tmp_path, monkeypatch):
    """A study in a folder of its own, found by nothing but that."""
    import studies

    folder = tmp_path / "square"
    folder.mkdir()
    (folder / "__init__.py").write_text("")
    (folder / "commands.py").write_text(OWN)
    monkeypatch.setattr(studies, "__path__", [*studies.__path__, str(tmp_path)])
    monkeypatch.setattr(main, "commands", dict(load_commands()))
    yield
    COMMANDS.pop("square")
    for name in ("studies.square", "studies.square.commands"):
        sys.modules.pop(name)


def test_a_study_is_one_folder(square, tmp_path):
    out = tmp_path / "out"
    assert "The square of a number." in invoke("--help").output
    outcome = invoke("--out", out, "square", 3)
    assert outcome.exit_code == 0, outcome.output
    assert outcome.output.splitlines()[1] == "9" and "1 results computed" in outcome.output
    assert json.loads((out / "square" / "result.json").read_text())["square"] == 9
    again = invoke("--out", out, "square", 3)
    assert "Resuming: 1 results found" in again.output and "0 results computed" in again.output
    assert invoke("square", 10, "--out", out).exit_code == 1  # where a check has failed
    refused = invoke("--out", out, "square", "--", -1)
    assert refused.exit_code == 2 and refused.output == "Error: NUMBER must be >= 0, got -1\n"
    assert "--jobs" in invoke("square", "--help").output
