"""Quantities: that every number of a component has a unit, and the sentence said where a rule is broken."""

import importlib
import inspect
import math
import pkgutil
from dataclasses import dataclass, fields, is_dataclass
from fractions import Fraction
from typing import Annotated, get_args, get_origin, get_type_hints

import numpy as np
import pytest
from annotated_types import Ge, Gt, Le, Lt, Unit

import controllers
import gear
from gear import Backlash, Bearing, Coulomb, Coupling, ExternalPair, Linear, Shaft
from gear.quantities import Length, annotations, check, check_count, show, unit_of

PARTS_OF_AN_ACTUATOR = (
    "actuator.parts.bridge",
    "actuator.parts.current_source",
    "actuator.parts.dc_link",
    "actuator.parts.dc_motor",
    "actuator.parts.derating",
    "actuator.parts.inverter",
    "actuator.parts.load",
    "actuator.parts.noise",
    "actuator.parts.pmsm",
    "actuator.parts.rotor",
    "actuator.parts.saturation",
    "actuator.parts.sensors",
    "actuator.parts.temperature",
    "actuator.parts.thermal",
    "actuator.parts.torque_source",
)


def components():
    """Every public dataclass whose docstring lists parameters (results list attributes)."""
    packages = [info.name for package in (gear, controllers) for info in modules_of(package)]
    modules = [importlib.import_module(name) for name in (*packages, *PARTS_OF_AN_ACTUATOR)]
    return [
        thing
        for module in modules
        for thing in vars(module).values()
        if isinstance(thing, type)
        and is_dataclass(thing)
        and thing.__module__ == module.__name__
        and "Parameters\n" in inspect.getdoc(thing)
    ]


def modules_of(package):
    return pkgutil.walk_packages(package.__path__, f"{package.__name__}.")


def numbers_without_unit(component):
    """Fields that hold a float, or a float or None, and do not say its unit."""
    hints = get_type_hints(component)
    return [f.name for f in fields(component) if is_a_number(hints[f.name]) and not unit_of(component, f.name)]


def is_a_number(hint):
    return get_origin(hint) is not tuple and float in (hint, *get_args(hint))


@pytest.mark.parametrize("component", components(), ids=lambda component: component.__name__)
def test_every_number_of_a_component_has_a_unit(component):
    assert numbers_without_unit(component) == []


def test_components_of_all_three_packages_are_looked_at():
    assert {"ExternalPair", "Bearing", "PI", "PMSM", "Load"} <= {component.__name__ for component in components()}


def test_a_number_without_unit_is_found():
    @dataclass
    class Careless:
        length: Length
        bare: float
        optional: float | None
        table: tuple[float, ...]
        count: int
        name: str

    assert numbers_without_unit(Careless) == ["bare", "optional"]


@dataclass(frozen=True, kw_only=True)
class Sample:
    """One field per rule."""

    above: Annotated[float, Unit("m"), Gt(0)] = 1.0
    least: Annotated[float, Unit("N"), Ge(-2.5)] = 0.0
    below: Annotated[float, Unit("-"), Lt(1)] = 0.0
    most: Annotated[float, Unit("rad"), Gt(0), Le(math.pi)] = 1.0
    choice: Annotated[float, Unit("s"), Gt(0)] | None = None
    count: int = 1
    name: str = ""

    def __post_init__(self):
        check(self)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"above": 0.0}, "Sample.above must be > 0 m, got 0 m"),
        ({"least": -3}, "Sample.least must be >= -2.5 N, got -3 N"),
        ({"below": 1.0}, "Sample.below must be < 1, got 1"),
        ({"most": 4.0}, "Sample.most must be <= 3.14159 rad, got 4 rad"),
        ({"most": -1.0}, "Sample.most must be > 0 rad, got -1 rad"),
        ({"choice": -1.0}, "Sample.choice must be > 0 s, got -1 s"),
        ({"above": math.nan}, r"Sample.above must be a finite number \[m\], got nan"),
        ({"above": math.inf}, r"Sample.above must be a finite number \[m\], got inf"),
        ({"above": True}, r"Sample.above must be a finite number \[m\], got True"),
        ({"above": "1 m"}, r"Sample.above must be a finite number \[m\], got '1 m'"),
        ({"above": np.float32(-0.5)}, "Sample.above must be > 0 m, got -0.5 m"),
        ({"least": np.int64(-3)}, "Sample.least must be >= -2.5 N, got -3 N"),
        ({"above": np.bool_(True)}, r"Sample.above must be a finite number \[m\], got np.True_"),
        ({"above": np.array([1.0])}, r"Sample.above must be a finite number \[m\], got array"),
    ],
)
def test_a_broken_rule_names_class_field_rule_value_and_unit(values, message):
    with pytest.raises(ValueError, match=message):
        Sample(**values)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Shaft(inertia=0.0), r"Shaft.inertia must be > 0 kg m\^2, got 0 kg m\^2"),
        (lambda: Bearing(shaft="a", coulomb=-1.0, breakaway=1.0), "Bearing.coulomb must be >= 0 N m, got -1 N m"),
        (
            lambda: Bearing(shaft="a", coulomb=0.2, breakaway=0.1),
            "Bearing on shaft 'a' needs coulomb <= breakaway, got coulomb=0.2 N m and breakaway=0.1 N m",
        ),
        (
            lambda: Coupling(a="a", b="b", stiffness=0.0, damping=0.0),
            "Coupling.stiffness must be > 0 N m/rad, got 0 N m/rad",
        ),
        (
            lambda: Coupling(a="a", b="a", stiffness=1.0, damping=0.0),
            "Coupling needs two different shafts, got 'a' twice",
        ),
    ],
)
def test_shafts_and_what_stands_beside_them_refuse_what_they_cannot_be(make, message):
    with pytest.raises(ValueError, match=message):
        make()


@pytest.mark.parametrize("value", [np.float64(0.5), np.float32(0.5), np.int64(2), Fraction(1, 2)])
def test_numbers_of_other_libraries_are_numbers(value):
    assert Sample(above=value).above == value


@pytest.mark.parametrize("count", [1, np.int64(3), np.uint8(2)])
def test_whole_numbers_of_other_libraries_count(count):
    check_count(Sample(count=count), "count")


@pytest.mark.parametrize("count", [0, 2.0, np.float64(2.0), True, np.bool_(True), "2"])
def test_what_does_not_count_is_refused(count):
    with pytest.raises(ValueError, match="Sample.count must be a whole number of planets >= 1, got"):
        check_count(Sample(count=count), "count", of="planets")


def test_values_on_the_edge_of_a_rule_are_taken():
    assert Sample(least=-2.5, most=math.pi, choice=1e-300).most == math.pi


@pytest.mark.parametrize(
    ("owner", "name", "unit"),
    [
        (Linear, "stiffness", "N/m"),
        (Linear(stiffness=1.0, damping=0.0), "damping", "N s/m"),
        (Backlash, "gap", "m"),
        (Backlash, "law", None),
        (Coulomb, "static", "-"),
        (ExternalPair, "teeth_a", None),
        (Sample, "choice", "s"),
        (Sample, "unknown", None),
    ],
)
def test_unit_stands_in_the_annotation(owner, name, unit):
    assert unit_of(owner, name) == unit


def test_annotations_see_through_optional_fields():
    assert annotations(Sample)["choice"] == (Unit("s"), Gt(0))
    assert annotations(Sample)["count"] == ()


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [(0.01, "m", "0.01 m"), (1 / 3, "-", "0.333333"), (2e8, "N/m", "2e+08 N/m"), (3, "m", "3 m"), (0.5, None, "0.5")],
)
def test_values_are_shown_as_a_person_writes_them(value, unit, text):
    assert show(value, unit) == text
