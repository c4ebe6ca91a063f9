"""Corners of a frequency-response study, and what is laid beside it.

Oracles: the corners of the specification; closed forms of viscosity; a case file that holds what the command line or
the result of a tuning says.
"""

import json
from dataclasses import replace

import pytest

from actuator import Actuator, TorqueSource
from gear import Bearing, KnownOil, OilAt, Shaft, Thickening, Transmission
from studies.cases import load_case
from studies.corners import AS_IS
from studies.files import CaseError, StudyError
from studies.frequency.mask import load_mask
from studies.frequency.plan import Corners, Place, Plan, choose_corners, load_second
from studies.specification import load_specification

AILERON = load_case("aileron")
GAINS = {
    "controller.position.gain": 80.0,
    "controller.speed.proportional": 0.04,
    "controller.speed.integral": 13.0,
    "controller.speed.remedies.dead_band": 2.5,
}


def test_without_words_the_corners_are_the_temperatures_of_the_specification():
    sets = choose_corners("aileron", ()).sets_of(AILERON.actuator)
    assert list(sets) == ["-55 degC", "20 degC", "70 degC"]
    specification, _ = load_specification("aileron")
    expected = {corner.name: corner.parameters for corner in specification.all_corners(AILERON.actuator)}
    for name, changes in sets.items():
        assert changes == expected[f"{name}, bias +8 N m, new"]


@pytest.mark.parametrize("name", ["aileron-retuned", "aileron-sampled"])
def test_a_case_has_the_temperatures_of_the_one_it_is_based_on(name):
    assert list(choose_corners(name, ()).sets_of(load_case(name).actuator)) == ["-55 degC", "20 degC", "70 degC"]


def test_an_oil_is_a_temperature_and_what_knows_none_is_as_it_is():
    warm = OilAt(oil=KnownOil(name="Mobil Jet Oil II"), temperature=293.15)
    thickening = Thickening(lubricant=warm, measured_with=warm, exponent=0.5)
    bearing = Bearing(shaft="arm", coulomb=0.0, breakaway=0.0, viscous=0.4, thickening=thickening)
    gear = Transmission(shafts={"arm": Shaft(inertia=1.0)}, input="arm", output="arm")
    dry = Actuator(motor=TorqueSource(), gear=gear)
    oiled = replace(dry, gear=replace(gear, bearings={"guide": bearing}))
    assert Corners().sets_of(dry) == {AS_IS: {}}
    sets = Corners().sets_of(oiled)
    assert [list(changes.values()) for changes in sets.values()] == [[], [218.15], [343.15]]
    assert list(sets) == ["20 degC", "-55 degC", "70 degC"]  # first the one that it has


def test_words_are_settings_with_a_label_or_without():
    corners = choose_corners("aileron", ["worn: gear.meshes.*.gap=1.5,load.bias=0", "motor.resistance=0.5", AS_IS])
    sets = corners.sets_of(AILERON.actuator)
    assert list(sets) == [AS_IS, "worn", "motor.resistance=0.5"]
    gap = "gear.meshes.{}.elasticity.gap"
    expected = {gap.format("first"): 3e-5, gap.format("second"): 3e-5, "load.bias": 0.0}
    assert sets["worn"] == pytest.approx(expected, rel=1e-12)
    assert choose_corners("aileron", [AS_IS]).sets_of(AILERON.actuator) == {AS_IS: {}}


@pytest.mark.parametrize(
    ("texts", "message"),
    [
        (["motor.resistence=0.5"], "no parameter named 'motor.resistence'; did you mean motor.resistance"),
        (["gear.meshs.*.gap=2"], "no parameter matches"),
        (["motor.resistance=cold"], "a corner is NAME=VALUE,NAME=VALUE with numbers, got 'motor.resistance=cold'"),
        (["motor.resistance=-1"], "resistance must be"),
        (["cold: load.bias=1", "cold: load.bias=2"], "two corners are called 'cold'"),
    ],
)
def test_a_wrong_corner_is_refused(texts, message):
    with pytest.raises(StudyError, match=message):
        choose_corners("aileron", texts).sets_of(AILERON.actuator)


def test_every_corner_comes_with_every_bias_load():
    plan = Plan(
        mask=load_mask(), stroke=1.0, amplitudes=(0.01,), frequencies=(1.0, 2.0), biases=(-8.0, 8.0, 0.0),
        corners=choose_corners("aileron", ["cold: motor.resistance=0.2"]),
    )  # fmt: skip
    places = plan.places(AILERON.actuator)
    assert places == [Place(corner, bias) for bias in (0.0, -8.0, 8.0) for corner in (AS_IS, "cold")]
    assert plan.sines(AILERON.actuator) == 6 * 2 * 2  # two amplitudes: one more is that of the mask


# -- beside ---------------------------------------------------------------------------------------------------


@pytest.fixture
def tuning(tmp_path):
    """The result.json of a tuning."""
    path = tmp_path / "result.json"
    path.write_text(json.dumps({"case": "aileron", "gains": {"tuned": GAINS}}))
    return path


@pytest.mark.parametrize("name", ["aileron", "aileron-sampled"])
def test_the_result_of_a_tuning_is_the_case_with_its_gains(name, tuning, tmp_path):
    path = tmp_path / f"{name}-tuned.toml"
    path.write_text(
        f'base = "{name}"\n[controller.position]\ntype = "P"\ngain = 80.0\n'
        "[controller.speed]\nproportional = 0.04\nintegral = 13.0\nremedies = { dead_band = 2.5 }\n"
    )
    found, expected = load_second(str(tuning), load_case(name)), load_case(path)
    assert found.name == expected.name == found.actuator.name
    assert repr(found.actuator) == repr(expected.actuator)
    assert found.inputs == load_case(name).inputs
    assert "tuned" in found.title


@pytest.mark.parametrize(
    ("text", "error", "message"),
    [
        ("{}", CaseError, "is not the result.json of a tuning"),
        (
            '{"case": "aileron", "gains": {"tuned": {"controller.gain": 1}}}',
            CaseError,
            "controller.gain is not a parameter of aileron",
        ),
        ('{"case": "aileron", "gains": {"tuned": {"controller.position.gain": -1}}}', StudyError, "gain must be"),
    ],
)
def test_what_is_no_tuning_is_refused(text, error, message, tuning):
    tuning.write_text(text)
    with pytest.raises(error, match=message):
        load_second(str(tuning), AILERON)
