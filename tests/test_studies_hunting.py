"""Maps of hunting: what is computed, kept, gone on with, written, drawn and refused.

Oracles: a mass on a guide under a PID, which hunts where there are both excess breakaway friction and integral action
(its closed form has the cycle) and rests where one of them is missing; a killed map finished without computing a point
twice.
"""

import json

import numpy as np
import pytest
import xarray
from click.testing import CliRunner
from mass_on_guide import MassOnGuide

from studies.__main__ import main
from studies.cache import Cache, Steps
from studies.files import StudyError
from studies.hunting import map as maps
from studies.hunting.ends import add_boundary, find_axis, find_crossings, find_ends
from studies.hunting.map import LABELS, Axis, Plan, compute, dataset
from studies.hunting.study import make_plan

pytestmark = pytest.mark.thorough

BREAKAWAY, GAIN = "gear.bearings.guide.breakaway", "controller.integral"
MASS = """
title = "Mass on a guide"

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
duration = 150

[scenario.inputs.reference]
type = "Constant"
value = 1.0
"""


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    """The mass as a case file."""
    path = tmp_path_factory.mktemp("case") / "mass.toml"
    path.write_text(MASS, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def plan(case):
    """Three gains over three breakaway frictions."""
    return Plan(case=case, x=Axis.between(BREAKAWAY, 1.0, 2.0, 3), y=Axis.between(GAIN, 0.0, 8.0, 3))


@pytest.fixture(scope="module")
def points(plan):
    """All points of the map, in this process."""
    return compute(plan, Steps(), jobs=1)


def invoke(*arguments):
    """Run the command line in this process."""
    return CliRunner().invoke(main, ["hunting", *(str(argument) for argument in arguments)])


# -- the map ----------------------------------------------------------------------------------------------------


def test_the_mass_hunts_exactly_where_friction_drops_and_the_integral_works(plan, points):
    assert len(points) == 9
    for (_, j, i), point in points.items():
        breakaway, gain = plan.x.values[i], plan.y.values[j]
        assert point["verdict"] == ("hunting" if breakaway > 1 and gain > 0 else "rest"), (breakaway, gain, point)
        if point["verdict"] == "hunting":
            cycle = MassOnGuide(breakaway=breakaway, ki=gain).cycle()
            assert point["amplitude"] == pytest.approx(cycle.amplitude, rel=2e-3)
            assert point["period"] == pytest.approx(cycle.period, rel=2e-3)
            assert point["stick_fraction"] == pytest.approx(cycle.stick_fraction, rel=5e-3)
        else:
            assert point["amplitude"] is None


def test_the_data_set_names_everything_and_survives_the_disk(plan, points, tmp_path):
    data = dataset(plan, points)
    data.to_netcdf(tmp_path / "map.nc", engine="scipy")
    back = xarray.open_dataset(tmp_path / "map.nc", engine="scipy")
    words = back.verdict.attrs["flag_meanings"].split()
    assert words == [label.replace(" ", "_") for label in LABELS]
    verdict = {label: int(code) for label, code in zip(words, back.verdict.attrs["flag_values"], strict=True)}
    assert back.verdict.sel(corner=0, x=1.5, y=4.0) == verdict["hunting"]
    assert back.verdict.sel(corner=0, x=1.0, y=4.0) == verdict["rest"]
    assert back.x.attrs["long_name"] == BREAKAWAY and back.x.attrs["units"] == "N m"
    assert float(back.amplitude.sel(corner=0, x=1.5, y=4.0)) == pytest.approx(0.06724, rel=1e-3)
    assert np.isnan(back.amplitude.sel(corner=0, x=1.0, y=4.0))
    np.testing.assert_array_equal(back.verdict, data.verdict)


def test_lines_of_the_map_that_cross_a_boundary_are_found(plan, points):
    assert find_axis(plan) == "x"
    found = find_crossings(plan, points)
    assert sorted(index[1] for index in found) == [1, 2]  # with an integral gain
    assert all(points[index]["verdict"] == "hunting" for index in found)


def test_the_exact_boundary_of_the_mass_is_its_sliding_friction(plan, points):
    steps = Steps()
    found = find_ends(plan, find_crossings(plan, points), steps, jobs=1, progress=None)
    again = find_ends(plan, find_crossings(plan, points), steps, jobs=1, progress=lambda *told: pytest.fail("again"))
    assert again.keys() == found.keys()
    data = add_boundary(plan, dataset(plan, points), found)
    # the amplitude goes to zero where breakaway friction is no larger than sliding friction
    np.testing.assert_allclose(data.boundary.sel(corner=0, y=[4.0, 8.0]), 1.0, rtol=0, atol=1e-3)
    assert np.isnan(data.boundary.sel(corner=0, y=0.0))
    assert {end.kind for end in found.values()} == {"amplitude zero"}


# -- kill and resume --------------------------------------------------------------------------------------------


class Killed(BaseException):
    """Stands for the end of the process."""


def test_a_killed_map_goes_on_without_computing_a_point_twice(plan, points, tmp_path, monkeypatch):
    computed = []

    def counted(plan, index, kill_after=4):
        if len(computed) == kill_after:
            raise Killed
        computed.append(index)
        return points[index]

    def steps(plan=plan):
        """As another process would find them."""
        return Steps(Cache(tmp_path / "kept.jsonl"), plan.fingerprint())

    monkeypatch.setattr(maps, "compute_point", counted)
    with pytest.raises(Killed):
        compute(plan, steps(), jobs=1)
    with (tmp_path / "kept.jsonl").open("a", encoding="utf-8") as file:
        file.write('{"key": "point (0, 1, 1)", "resu')  # what a kill in the middle of a write leaves
    monkeypatch.setattr(maps, "compute_point", lambda plan, index: counted(plan, index, kill_after=99))
    told = []
    assert compute(plan, steps(), jobs=1, progress=lambda *counts: told.append(counts)) == points
    assert sorted(computed) == sorted(plan.indices())
    assert told == [(finished, 9) for finished in range(5, 10)]
    assert compute(plan, steps(), jobs=1) == points  # and now from the disk alone
    assert len(computed) == 9
    other = Plan(case=plan.case, x=plan.x, y=Axis.between(GAIN, 0.0, 8.0, 4))
    assert "point (0, 0, 0)" in steps() and "point (0, 0, 0)" not in steps(other)


def test_the_same_map_has_the_same_fingerprint(plan):
    assert plan.fingerprint() == Plan(case=plan.case, x=plan.x, y=plan.y).fingerprint()


# -- default axes ------------------------------------------------------------------------------------------------------


def test_a_map_without_axes_is_that_of_integral_gain_over_breakaway_friction():
    plan = make_plan("aileron", corners=("load.bias=0", "load.bias=20,load.damping=0.1"))
    assert plan.x.name == "controller.speed.integral" and plan.y.name == "breakaway"
    assert plan.selection(plan.y).factor and len(plan.selection(plan.y).parameters) == 5
    assert [plan.label(k) for k in (0, 1)] == ["load.bias=0", "load.bias=20, load.damping=0.1"]
    assert len(plan.indices()) == 2 * len(plan.x.values) * len(plan.y.values)


def test_a_case_without_an_integral_gain_needs_axes(tmp_path):
    path = tmp_path / "open.toml"
    path.write_text(MASS[: MASS.index("[controller]")] + "[scenario]\nduration = 1\n")
    with pytest.raises(StudyError, match="has no integral gain to vary; choose two names with --x and --y"):
        make_plan(path)


# -- the command line -------------------------------------------------------------------------------------------

SMALL = ("--x", BREAKAWAY, 1.0, 1.5, 2, "--y", GAIN, 4, 8, 2, "--jobs", 1)


def test_the_command_writes_pictures_numbers_and_the_data_set(case, tmp_path):
    outcome = invoke(case, *SMALL, "--corner", "load.damping=0", "--corner", "load.damping=1", "--out", tmp_path)
    assert outcome.exit_code == 0, outcome.output
    assert "load.damping=0: of 4 points rest at 2, hunting at 2" in outcome.output
    names = {path.name for path in tmp_path.iterdir() if path.suffix != ".jsonl"}
    assert names == {"hunting_map_1.png", "hunting_map_2.png", "hunting.nc", "result.json", "findings.txt"}
    result = json.loads((tmp_path / "result.json").read_text())
    assert len(result["points"]) == 8
    assert result["points"][0]["corner"] == "load.damping=0"
    data = xarray.open_dataset(tmp_path / "hunting.nc", engine="scipy")
    assert data.corner.attrs["flag_meanings"] == "load.damping=0 load.damping=1"


def test_several_processes_give_the_same_points(case):
    small = Plan(case=case, x=Axis.between(BREAKAWAY, 1.0, 1.5, 2), y=Axis.between(GAIN, 4.0, 8.0, 2))
    alone = compute(small, Steps(), jobs=1)
    together = compute(small, Steps(), jobs=2)
    assert together == alone


WRONG = {
    "an unknown name": (("--x", "gear.bearings.guide.breakway", 1, 2, 2), "did you mean gear.bearings.guide.breakaway"),
    "a value that breaks a rule": (("--x", BREAKAWAY, 0.5, 2, 2), "needs coulomb <= breakaway"),
    "the same name twice": (("--x", GAIN, 1, 2, 2, "--y", GAIN, 1, 2, 2), "both axes are 'controller.integral'"),
    "a corner without a value": (("--corner", "load.bias"), "a corner is NAME=VALUE,NAME=VALUE with numbers"),
    "no points": (("--x", GAIN, 1, 2, 0), "Invalid value for '--x'"),
    "too few words": (("--x", GAIN, 1), "Invalid value for '--x'"),
    "no duration": (("--duration", 0), "Invalid value for '--duration'"),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_map_is_refused_and_nothing_is_written(name, case, tmp_path):
    arguments, message = WRONG[name]
    outcome = invoke(case, *arguments, "--out", tmp_path / "out")
    assert outcome.exit_code == 2
    assert message in outcome.output
    assert isinstance(outcome.exception, SystemExit)
    assert not (tmp_path / "out").exists()


def test_an_unknown_case_is_refused_in_one_line(tmp_path):
    outcome = invoke("ailerons", "--out", tmp_path / "out")
    assert outcome.exit_code == 2
    assert "cannot be read" in outcome.output
    assert len(outcome.output.strip().splitlines()) == 1


def test_help_tells_what_names_may_be():
    outcome = invoke("--help")
    assert outcome.exit_code == 0
    for word in (
        "--x",
        "--corner",
        "--exact",
        "--jobs",
        "NAME FROM TO COUNT",
        "values then multiply all matching parameters",
        "breakaway",
    ):
        assert word in " ".join(outcome.output.split())
