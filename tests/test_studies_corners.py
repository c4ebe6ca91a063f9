"""Corners: what names stand for, how settings are applied, and that breakaway does not fall below sliding friction.

Oracles: products by hand with the numbers of the built-in aileron actuator.
"""

from dataclasses import replace

import numpy as np
import pytest

from controllers.cascade import Remedies
from controllers.compensation import FrictionCompensation
from gear import Stribeck
from studies.cases import load_case
from studies.corners import AS_IS, Corner, CornerSettings, Setting, apply_settings, find_corner, read_corners, select
from studies.files import StudyError
from studies.specification import Change, Specification, load_specification

STATIC, HINGE = "gear.meshes.first.friction.static", "gear.bearings.hinge"
PATTERN = "*.breakaway+*.static"


@pytest.fixture(scope="module")
def system():
    return load_case("aileron").actuator.system()


@pytest.fixture(scope="module")
def compensated():
    """The aileron with a compensation of its friction, whose setting is called breakaway, too."""
    actuator = load_case("aileron").actuator
    compensation = FrictionCompensation(coulomb=0.01, breakaway=0.02, standstill=0.1, width=1e-3)
    return replace(actuator, controller=replace(actuator.controller, remedies=Remedies(compensation=compensation)))


# -- names ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", [PATTERN, "breakaway"])
def test_a_name_may_be_a_factor_on_many(system, name):
    factor = select(system.parameters, name)
    assert factor.factor and not factor.single
    assert len(factor.parameters) == 5
    changed = apply_settings(system.parameters, [Setting(name, 2.0)])
    assert changed[f"{HINGE}.breakaway"] == 18.0
    assert changed[STATIC] == pytest.approx(0.6)
    least = apply_settings(system.parameters, [Setting(name, 0.1)])
    assert least[f"{HINGE}.breakaway"] == 5.0
    assert least[STATIC] == 0.15


def test_settings_are_applied_one_after_another_and_one_value_may_be_for_many(system):
    found = apply_settings(system.parameters, [Setting("=*.friction.static", 0.2), Setting("*.static", 1.5)])
    np.testing.assert_allclose(list(found.values()), [0.3, 0.3], rtol=1e-12)
    assert select(system.parameters, "load.bias").single
    for name, message in (
        ("load.biass", "did you mean load.bias"),
        ("*.nothing", "no parameter matches"),
        ("=*inertia*+*.bias", "of different units"),
    ):
        with pytest.raises(StudyError, match=message):
            select(system.parameters, name)


def test_a_role_that_nothing_has_is_refused(system):
    parameters = [parameter for parameter in system.parameters if not parameter.name.startswith("gear.")]
    with pytest.raises(StudyError, match="no parameter has the role 'backlash'"):
        select(parameters, "backlash")


def test_a_compensation_is_not_the_friction_that_it_compensates(compensated):
    parameters = compensated.system().parameters
    name = "controller.remedies.compensation.breakaway"
    assert name in select(parameters, "*.breakaway").parameters  # a pattern is what it says
    assert name not in select(parameters, "breakaway").parameters
    assert name not in apply_settings(parameters, [Setting("breakaway", 2.0)])


# -- breakaway and sliding ------------------------------------------------------------------------------------


def test_a_factor_on_sliding_friction_takes_breakaway_with_it(system):
    found = apply_settings(system.parameters, [Setting(f"{HINGE}.coulomb", 3.0, factor=True)])
    assert found == {f"{HINGE}.coulomb": 15.0, f"{HINGE}.breakaway": 15.0}


def test_a_value_that_is_set_is_kept_or_breaks_the_rule(system):
    with pytest.raises(StudyError, match="low: .*needs coulomb <= breakaway"):
        find_corner(system, CornerSettings("low", (Setting(f"{HINGE}.breakaway", 1.0),)))
    corner = CornerSettings("both", (Setting(f"{HINGE}.coulomb", 8.0), Setting(f"{HINGE}.breakaway", 0.5, factor=True)))
    assert find_corner(system, corner) == Corner("both", {f"{HINGE}.coulomb": 8.0, f"{HINGE}.breakaway": 8.0})


def test_a_specification_keeps_the_rule_as_well():
    task, case = load_specification("aileron")
    low = replace(task, corners={"friction": {"low": Change(factors={f"{HINGE}.breakaway": 0.1})}})
    assert low.all_corners(case.actuator) == [Corner("low", {f"{HINGE}.breakaway": 5.0})]
    assert isinstance(low, Specification)


def test_every_law_keeps_it(system):
    actuator = load_case("aileron").actuator
    law = Stribeck(static=0.12, coulomb=0.1, stribeck_speed=0.01)
    mesh = replace(actuator.gear.meshes["first"], friction=law)
    plant = replace(actuator, gear=replace(actuator.gear, meshes={**actuator.gear.meshes, "first": mesh}))
    for name in (PATTERN, "breakaway"):
        assert apply_settings(plant.system().parameters, [Setting(name, 0.5)])[STATIC] == 0.1
        assert apply_settings(plant.system().parameters, [Setting(name, 2.0)])[STATIC] == 0.24


# -- texts ----------------------------------------------------------------------------------------------------


def test_texts_are_corners_with_a_label_or_without():
    found = read_corners(["cold: *.coulomb=3,load.bias=0", "motor.resistance=0.5", AS_IS])
    assert found == (
        CornerSettings("cold", (Setting("*.coulomb", 3.0), Setting("load.bias", 0.0))),
        CornerSettings("motor.resistance=0.5", (Setting("motor.resistance", 0.5),)),
        CornerSettings(AS_IS),
    )
    assert read_corners(["=*.static=0.2"])[0].settings == (Setting("=*.static", 0.2),)


@pytest.mark.parametrize(
    ("texts", "message"),
    [
        (["load.bias"], "a corner is NAME=VALUE,NAME=VALUE with numbers, got 'load.bias'"),
        (["load.bias=nan"], "with numbers"),
        (["a: load.bias=1", "a: load.bias=2"], "two corners are called 'a'"),
        (["as it is: load.bias=1"], "two corners are called 'as it is'"),
    ],
)
def test_other_texts_are_refused(texts, message):
    with pytest.raises(StudyError, match=message):
        read_corners(texts)
