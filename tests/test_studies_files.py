"""Case files: the actuator they describe, their units, and one line for everything that can be wrong."""

import json
import math
from dataclasses import fields, replace
from pathlib import Path

import pytest

from actuator.actuator import Actuator
from actuator.parts.inverter import Inverter
from actuator.parts.load import Load
from actuator.parts.pmsm import PMSM
from actuator.simulation.signals import Chirp, Constant, Ramp, Signal, Sine, Step, Sum, Table
from controllers import PID, Cascade, P
from gear import Backlash, Bearing, Coulomb, ExternalPair, Linear, Mesh, Shaft, Transmission
from gear.quantities import unit_of
from gear.quantities.registry import parts
from studies.cases import Document, built_in, load_case
from studies.files import CaseError
from studies.units import SIGNAL_UNITS, SUFFIXES

SERVO = (Path(__file__).parent / "data" / "servo.toml").read_text(encoding="utf-8")

# the smallest file, in SI and in another order than the dataclasses
SMALL = """
title = "Two wheels"
[scenario]
duration = 1
[motor]
type = "TorqueSource"
[controller]
type = "PID"
proportional = 10
integral = 1.5
derivative = 0.2
[gear]
input = "a"
output = "b"
[gear.shafts]
a.inertia = 1e-4
b.inertia = 1
[gear.meshes.only]
a = "a"
b = "b"
pair = { type = "ExternalPair", teeth_a = 20, teeth_b = 40, module = 1e-3 }
friction = { type = "Coulomb", sliding = 0.1, static = 0.2 }
elasticity = { type = "Linear", stiffness = 1e8, damping = 100 }
"""
ONE_SIGNAL = SMALL + "[scenario.inputs.reference]\n"


@pytest.fixture
def load(tmp_path):
    """Load a case from the text of its file."""

    def load_text(text, name="case"):
        file = tmp_path / f"{name}.toml"
        file.write_bytes(text if isinstance(text, bytes) else text.encode())
        return load_case(file)

    return load_text


@pytest.fixture
def refusal(load, tmp_path):
    """The one-line message about a file, after the name of the file."""

    def message(text):
        with pytest.raises(CaseError) as caught:
            load(text)
        line = str(caught.value)
        assert "\n" not in line
        assert line.startswith(f"{tmp_path / 'case.toml'}: ")
        return line.removeprefix(f"{tmp_path / 'case.toml'}: ")

    return message


def edited(old, new, text=SERVO):
    """The text with one place changed."""
    assert text.count(old) >= 1, f"{old!r} is not in the file"
    return text.replace(old, new, 1)


# -- oracle: the same actuator in Python -----------------------------------------------------------------


def servo():
    """What servo.toml says, written in Python and SI."""
    law = Backlash(gap=20e-6, law=Linear(stiffness=1e8, damping=2e4))
    friction = Coulomb(sliding=0.15, static=0.2)
    return Actuator(
        name="servo",
        motor=PMSM(pole_pairs=4, resistance=0.3, inductance_d=4e-4, inductance_q=4e-4, flux=0.0125, inertia=2e-5),
        inverter=Inverter(dc_voltage=270.0, current_limit=30.0),
        gear=Transmission(
            shafts={"motor": Shaft(inertia=2e-5), "idler": Shaft(inertia=5e-5), "surface": Shaft(inertia=5e-4)},
            meshes={
                "first": Mesh(
                    a="motor",
                    b="idler",
                    pair=ExternalPair(teeth_a=18, teeth_b=90, module=0.8e-3),
                    elasticity=law,
                    friction=friction,
                ),
                "second": Mesh(
                    a="idler",
                    b="surface",
                    pair=ExternalPair(teeth_a=17, teeth_b=119, module=1.25e-3),
                    elasticity=law,
                    friction=friction,
                ),
            },
            bearings={
                "motor": Bearing(shaft="motor", coulomb=0.01, breakaway=0.015, viscous=1e-5),
                "idler": Bearing(shaft="idler", coulomb=0.02, breakaway=0.03),
                "hinge": Bearing(shaft="surface", coulomb=0.5, breakaway=0.8),
            },
            input="motor",
            output="surface",
        ),
        load=Load(inertia=0.03, stiffness=40.0, damping=0.2, bias=8.0),
        controller=Cascade.for_bandwidths(
            position=30.0,
            speed=300.0,
            current=4000.0,
            inertia=8e-5,
            resistance=0.3,
            inductance=4e-4,
            speed_limit=400.0,
        ),
    )


def leaves(part, path=""):
    """Every number, name and class of a tree of dataclasses, by its path."""
    if isinstance(part, tuple):
        part = dict(enumerate(part))
    if isinstance(part, dict):
        return {key: value for name, item in part.items() for key, value in leaves(item, f"{path}.{name}").items()}
    if not hasattr(part, "__dataclass_fields__"):
        return {path: part}
    found = {f"{path}.class": type(part).__name__}
    for field in fields(part):
        found |= leaves(getattr(part, field.name), f"{path}.{field.name}")
    return found


def assert_same(read, built):
    """Same classes, names and counts; numbers equal but for rounding."""
    read, built = leaves(read), leaves(built)
    assert read.keys() == built.keys()
    for path, value in built.items():
        assert read[path] == (pytest.approx(value, rel=1e-14) if isinstance(value, float) else value), path


def test_a_file_is_the_actuator_built_in_python(load):
    case = load(SERVO, "servo")
    assert_same(case.actuator, servo())
    assert (case.name, case.title, case.duration) == ("servo", "A servo", 0.2)
    assert case.inputs.keys() == {"reference"}
    assert_same(case.inputs["reference"], Step(time=0.05, after=math.radians(5)))


def test_whole_numbers_become_floats_where_a_float_belongs(load):
    controller = load(SMALL).actuator.controller
    assert controller == PID(proportional=10.0, integral=1.5, derivative=0.2)
    assert type(controller.proportional) is float


def test_type_may_be_left_out_where_only_one_class_fits(load):
    assert load(SMALL).actuator.gear.shafts["a"] == Shaft(inertia=1e-4)


def test_the_document_has_the_parts_of_an_actuator():
    parts = {field.name: field.type for field in fields(Actuator)} | {"title": str, "description": str}
    del parts["name"]
    assert {field.name for field in fields(Document)} == parts.keys() | {"scenario"}
    assert {field.name: field.type for field in fields(Document)}.items() >= parts.items()


# -- units -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("si", "other"),
    [
        ("module = 1e-3", "module_mm = 1"),
        ("module = 1e-3", "module_um = 1000"),
        ("teeth_a = 20", f"teeth_a = 20, pressure_angle = {math.radians(20)!r}"),
        ("teeth_a = 20", "teeth_a = 20, pressure_angle_deg = 20"),
        ("teeth_a = 20", "teeth_a = 20, pressure_angle_arcmin = 1200"),
        ("a.inertia = 1e-4", "a.inertia_gcm2 = 1000"),
        ("a.inertia = 1e-4", "a.inertia_kgcm2 = 1"),
        ("duration = 1", "duration_ms = 1000"),
        ("duration = 1", "duration_us = 1e6"),
    ],
)
def test_a_unit_suffix_converts_to_si(load, si, other):
    plain, suffixed = load(SMALL), load(edited(si, other, SMALL))
    assert_same(suffixed.actuator, plain.actuator)
    assert suffixed.duration == pytest.approx(plain.duration)


@pytest.mark.parametrize(
    ("unit", "count"),
    [
        ("deg", 360 / (2 * math.pi)),
        ("arcmin", 360 * 60 / (2 * math.pi)),
        ("rpm", 60 / (2 * math.pi)),
        ("kHz", 1 / 1000),
        ("mm", 1000),
        ("gcm2", 1000 * 100**2),
        ("kgcm2", 100**2),
        ("mPas", 1000),
        ("mm2_per_s", 1000**2),
    ],
)
def test_how_many_make_one_si_unit(unit, count):
    assert SUFFIXES[unit].count == pytest.approx(count, rel=1e-14)


OILY = """
friction = { type = "Din3990", static = 0.2, roughness_um = 0.8, face_width_mm = 10, lubricant = LUBRICANT }
elasticity"""
KNOWN_OIL = '{ type = "OilAt", oil = { type = "KnownOil", name = "Mobil Jet Oil II" }, TEMPERATURE }'
GIVEN_OIL = """{
    type = "OilAt",
    temperature_degC = 70,
    oil = { type = "Oil", density = 900, density_temperature_degC = 15, expansion = 8e-4, lowest_degC = -40,
        highest_degC = 120, law = { type = "Walther", cold_temperature_degC = 40, cold_viscosity_mm2_per_s = 100,
        hot_temperature_degC = 100, hot_viscosity_mm2_per_s = 11 } } }"""


def oily(lubricant):
    """The smallest file with a friction law that has an oil."""
    with_law = edited('friction = { type = "Coulomb", sliding = 0.1, static = 0.2 }\n', "", SMALL)
    return edited("elasticity", OILY.strip("\n").replace("LUBRICANT", " ".join(lubricant.split())), with_law)


@pytest.mark.parametrize(("celsius", "kelvin"), [("-55", 218.15), ("20", 293.15), ("70.0", 343.15)])
def test_degrees_celsius_are_counted_from_where_water_freezes(load, celsius, kelvin):
    case = load(oily(KNOWN_OIL.replace("TEMPERATURE", f"temperature_degC = {celsius}")))
    lubricant = case.actuator.gear.meshes["only"].friction.lubricant
    assert lubricant.temperature == pytest.approx(kelvin, rel=1e-15)
    assert lubricant.dynamic_viscosity() > 0


def test_an_oil_of_ones_own_is_written_as_its_data_sheet_has_it(load):
    oil = load(oily(GIVEN_OIL)).actuator.gear.meshes["only"].friction.lubricant.oil
    assert (oil.lowest, oil.highest, oil.density_temperature) == pytest.approx((233.15, 393.15, 288.15))
    assert (oil.law.cold_viscosity, oil.law.hot_viscosity) == (100e-6, 11e-6)
    assert oil.kinematic_viscosity(313.15) == pytest.approx(100e-6)


@pytest.mark.parametrize(
    ("temperature", "message"),
    [
        ("temperature_degC = 200", "temperature must be from 218.15 K to 423.15 K, got 473.15 K"),
        ("temperature_degC = -300", "temperature_degC = -300 must be > 0 K, got -26.85 K"),
        (
            "temperature_deg = 20",
            "has a suffix for rad, but temperature is in K; allowed: temperature, temperature_degC",
        ),
        (
            "temperature = 293.15, temperature_degC = 20",
            "is given more than once, as temperature and as temperature_degC",
        ),
    ],
)
def test_temperatures_that_cannot_be_are_refused(refusal, temperature, message):
    assert message in refusal(oily(KNOWN_OIL.replace("TEMPERATURE", temperature)))


DEGREE = math.pi / 180


@pytest.mark.parametrize(
    ("table", "signal"),
    [
        ('type = "Constant"\nvalue_deg = 2', Constant(value=2 * DEGREE)),
        ('type = "Step"\nafter_deg = 5\ntime_ms = 20', Step(time=0.02, after=5 * DEGREE)),
        ('type = "Ramp"\nslope_rpm = 30\nend = 1', Ramp(slope=math.pi, end=1.0)),
        ('type = "Ramp"\nslope_deg_per_s = 30', Ramp(slope=30 * DEGREE)),
        ('type = "Sine"\namplitude_arcmin = 60\nfrequency_kHz = 0.01', Sine(amplitude=DEGREE, frequency=10.0)),
        (
            'type = "Chirp"\namplitude = 1\nfirst_frequency = 0\nlast_frequency_kHz = 1\nduration_ms = 500',
            Chirp(amplitude=1.0, first_frequency=0.0, last_frequency=1000.0, duration=0.5),
        ),
        (
            'type = "Table"\ntimes_ms = [0, 10]\nvalues_deg = [0, 1]',
            Table(times=(0.0, 0.01), values=(0.0, DEGREE)),
        ),
        (
            'type = "Sum"\nparts = [{ type = "Constant", value = 1 }, { type = "Step", after_deg = 1 }]',
            Sum(parts=(Constant(value=1.0), Step(after=DEGREE))),
        ),
    ],
)
def test_signals_are_in_the_unit_of_their_input(load, table, signal):
    assert_same(load(ONE_SIGNAL + table).inputs["reference"], signal)


def test_an_input_with_a_dot_in_its_name(load):
    case = load(SMALL + '[scenario.inputs."inject.position"]\ntype = "Constant"\nvalue_deg = 1')
    assert case.inputs == {"inject.position": Constant(value=pytest.approx(DEGREE))}


def test_every_number_of_a_signal_has_a_unit():
    names = {(kind, field.name) for kind in parts(Signal).values() for field in fields(kind) if kind is not Sum}
    assert [(kind, name) for kind, name in names if unit_of(kind, name) is None and name not in SIGNAL_UNITS] == []


# -- base ------------------------------------------------------------------------------------------------


def test_a_base_gives_what_the_file_does_not(load):
    case, base = (
        load('base = "aileron"\ntitle = "Softer"\n[controller.position]\ngain = 5', "softer"),
        load_case("aileron"),
    )
    assert_same(
        case.actuator,
        replace(base.actuator, name="softer", controller=replace(base.actuator.controller, position=P(gain=5.0))),
    )
    assert (case.name, case.title, case.description) == ("softer", "Softer", base.description)
    assert case.inputs == base.inputs


def test_a_base_by_relative_path(load, tmp_path):
    (tmp_path / "below").mkdir()
    (tmp_path / "below" / "small.toml").write_text(SMALL)
    assert load('base = "below/small.toml"\nscenario.duration = 3').duration == 3


def test_a_number_of_the_base_may_be_given_in_another_unit(load, tmp_path):
    (tmp_path / "small.toml").write_text(SMALL)
    case = load('base = "small.toml"\n[gear.meshes.only.pair]\nmodule_mm = 2')
    assert case.actuator.gear.meshes["only"].pair.module == 2e-3


def test_another_type_replaces_the_table_of_the_base(load, tmp_path):
    (tmp_path / "small.toml").write_text(SMALL)
    text = """
    base = "small.toml"
    [gear.meshes.only.elasticity]
    type = "Backlash"
    gap_um = 10
    law = { type = "Linear", stiffness = 1e7, damping = 0 }
    """
    elasticity = load(text).actuator.gear.meshes["only"].elasticity
    assert elasticity == Backlash(gap=10e-6, law=Linear(stiffness=1e7, damping=0.0))


def test_a_mistake_is_reported_where_it_stands(load, tmp_path):
    base = tmp_path / "small.toml"
    base.write_text(edited("teeth_a = 20", "teeth_a = 20.5", SMALL))
    with pytest.raises(CaseError, match=r"small\.toml: gear\.meshes\.only\.pair\.teeth_a = 20\.5 must be"):
        load('base = "small.toml"\n[gear.meshes.only.pair]\nmodule_mm = 2')
    base.write_text(SMALL)
    with pytest.raises(CaseError, match=r"case\.toml: gear\.meshes\.only\.pair\.module_mm = -2 must be > 0 m"):
        load('base = "small.toml"\n[gear.meshes.only.pair]\nmodule_mm = -2')


def test_bases_in_a_circle(load, tmp_path):
    (tmp_path / "other.toml").write_text('base = "case.toml"')
    with pytest.raises(
        CaseError, match=r"case\.toml: base goes in a circle: .*case\.toml -> .*other\.toml -> .*case\.toml$"
    ):
        load('base = "other.toml"')


@pytest.mark.parametrize("name", ["\0", "line\n", "x" * 5000])
def test_a_base_that_can_be_no_file_is_refused_in_one_short_line(load, name):
    with pytest.raises(
        CaseError, match=r"case\.toml: base = \"[^\n]{1,70}: no such file; the built-in cases are aileron"
    ) as found:
        load(f"base = {json.dumps(name)}")
    assert str(found.value).isprintable()


def test_a_base_that_is_no_toml_is_named_with_the_file_that_asks_for_it(load, tmp_path):
    (tmp_path / "notes.toml").write_text("root:x:0")
    with pytest.raises(CaseError, match=r'case\.toml: base = "notes\.toml": .*notes\.toml: not valid TOML: Expected'):
        load('base = "notes.toml"')


def test_a_file_that_is_nested_too_deeply_says_so(load):
    with pytest.raises(CaseError, match=r"case\.toml: not valid TOML: nested too deeply$"):
        load("title = " + "[" * 1000 + "]" * 1000)


# -- wrong files -----------------------------------------------------------------------------------------

FIRST = "gear.meshes.first"
WRONG = [
    # an unknown key, with the nearest valid ones
    (
        "flux = 0.0125",
        "fluks = 0.0125",
        "motor.fluks = 0.0125 is not allowed: no key named 'fluks'; did you mean flux?",
    ),
    ("[load]", "[laod]", "laod = a table is not allowed: no key named 'laod'; did you mean load"),
    (
        "module_mm = 0.8",
        "modul_mm = 0.8",
        f"{FIRST}.pair.modul_mm = 0.8 is not allowed: no key named 'modul'; did you mean module",
    ),
    (
        "[scenario.inputs.reference]",
        "[scenario.inputs.refrence]",
        "scenario.inputs.refrence is not allowed: no input named 'refrence'; did you mean reference",
    ),
    ("[scenario.inputs.reference]", '[scenario.inputs."ref rence"]', 'scenario.inputs."ref rence" is not allowed'),
    # an unknown or missing type
    ('type = "PMSM"', 'type = "PMSN"', 'motor.type = "PMSN" must be one of CurrentSource, DCMotor, PMSM, TorqueSource'),
    ('type = "PMSM"', "type = 3", "motor.type = 3 must be one of CurrentSource, DCMotor, PMSM, TorqueSource"),
    ('type = "PMSM"', "", "motor.type is missing; it must be one of CurrentSource, DCMotor, PMSM, TorqueSource"),
    (
        'friction = { type = "Coulomb", sliding',
        'friction = { type = "Dahl", sliding',
        f'{FIRST}.friction.type = "Dahl" must be one of AtViscosity, Coulomb, Din3990',
    ),
    (
        'type = "Step"',
        'type = "Stop"',
        'scenario.inputs.reference.type = "Stop" must be one of Chirp, Constant, Gust, Ramp, Sine, Staircase, Step',
    ),
    # a missing key, with its unit
    ("flux = 0.0125", "", "motor.flux is missing; it must be a number [V s]"),
    ("pole_pairs = 4", "", "motor.pole_pairs is missing; it must be a whole number"),
    ("sliding = 0.15, ", "", f"{FIRST}.friction.sliding is missing; it must be a number"),
    ("gap_um = 20", "", f"{FIRST}.elasticity.gap is missing; it must be a number [m]"),
    ('input = "motor"', "", "gear.input is missing; it must be a string"),
    ("after_deg = 5", "", "scenario.inputs.reference.after is missing; it must be a number [rad]"),
    ('title = "A servo"', "", "title is missing; it must be a string"),
    # a number against the rule of its field
    ("resistance = 0.3", "resistance = -0.3", "motor.resistance must be > 0 ohm, got -0.3 ohm"),
    ("module_mm = 0.8", "module_mm = -0.8", f"{FIRST}.pair.module_mm = -0.8 must be > 0 m, got -0.0008 m"),
    (
        "pressure_angle_deg = 20",
        "pressure_angle_deg = 50",
        f"{FIRST}.pair.pressure_angle_deg = 50 must be < 0.785398 rad, got 0.872665 rad",
    ),
    ("static = 0.20", "static = -1", f"{FIRST}.friction.static must be >= 0, got -1"),
    ("pole_pairs = 4", "pole_pairs = 0", "motor.pole_pairs must be a whole number >= 1, got 0"),
    ("speed_limit = 400", "speed_limit_rpm = -1", "controller.speed_limit_rpm = -1 must be > 0 rad/s, got -0.104"),
    ("duration = 0.2", "duration = 0", "scenario.duration must be > 0 s, got 0 s"),
    # a rule between the numbers of a table, or between tables
    (
        "static = 0.20",
        "static = 0.1",
        f"{FIRST}.friction is refused: Coulomb needs sliding <= static, got sliding=0.15",
    ),
    ("teeth_a = 18", "teeth_a = 10", f"{FIRST}.pair is refused: ExternalPair: the tip of wheel b reaches"),
    ('b = "idler"', 'b = "idle"', f"{FIRST}.b names shaft 'idle'; the shafts are motor, idler, surface"),
    ('input = "motor"', 'input = "moter"', "gear.input names shaft 'moter'; the shafts are motor, idler, surface"),
    ("[inverter]\ndc_voltage = 270\ncurrent_limit = 30", "", "Actuator: a PMSM needs an inverter and a Cascade"),
    # strict types
    ("resistance = 0.3", 'resistance = "0.3"', 'motor.resistance = "0.3" must be a number [ohm]'),
    ("resistance = 0.3", "resistance = true", "motor.resistance = true must be a number [ohm]"),
    ("resistance = 0.3", "resistance = nan", "motor.resistance = nan must be a number [ohm]"),
    ("resistance = 0.3", "resistance = inf", "motor.resistance = inf must be a number [ohm]"),
    ("resistance = 0.3", f"resistance = 1{'0' * 400}", f"motor.resistance = 1{'0' * 59}... must be a number [ohm]"),
    ("resistance = 0.3", f"resistance = 1{'0' * 5000}", "not valid TOML: Exceeds the limit"),
    ("resistance = 0.3", "resistance = 1979-05-27", "motor.resistance = 1979-05-27 must be a number [ohm]"),
    ("resistance = 0.3", "resistance = [0.3]", "motor.resistance = a list must be a number [ohm]"),
    ("resistance = 0.3", "resistance.value = 0.3", "motor.resistance = a table must be a number [ohm]"),
    ("gap_um = 20", 'gap_um = "20"', f'{FIRST}.elasticity.gap_um = "20" must be a number [m]'),
    ("teeth_a = 18", "teeth_a = 18.5", f"{FIRST}.pair.teeth_a = 18.5 must be a whole number"),
    ("teeth_a = 18", "teeth_a = 18.0", f"{FIRST}.pair.teeth_a = 18.0 must be a whole number"),
    ("teeth_a = 18", "teeth_a = true", f"{FIRST}.pair.teeth_a = true must be a whole number"),
    ('input = "motor"', "input = 1", "gear.input = 1 must be a string"),
    ('feedback = "load"', 'feedback = "laod"', 'controller.feedback = "laod" must be "load" or "motor"'),
    ('feedback = "load"', "decoupling = 1", "controller.decoupling = 1 must be true or false"),
    (
        'law = { type = "Linear", stiffness = 1e8, damping = 2e4 }',
        "law = 3",
        f"{FIRST}.elasticity.law = 3 must be a table",
    ),
    ("after_deg = 5", 'after_deg = "5"', 'scenario.inputs.reference.after_deg = "5" must be a number [rad]'),
    # units
    (
        "pressure_angle_deg = 20",
        "pressure_angle_deg = 20, pressure_angle = 0.35",
        f"{FIRST}.pair.pressure_angle is given more than once, as pressure_angle_deg and as pressure_angle; keep one",
    ),
    ("module_mm = 0.8", "module_mm = 0.8, module_um = 800", f"{FIRST}.pair.module"),
    (
        "stiffness = 1e8",
        "stiffness_mm = 1e8",
        f"{FIRST}.elasticity.law.stiffness_mm = 100000000.0 has a suffix for m, but stiffness is in N/m; allowed: ",
    ),
    ("resistance = 0.3", "resistance_mm = 0.3", "allowed: resistance, resistance_mohm"),
    ("teeth_a = 18", "teeth_a_mm = 18", "teeth_a has no unit; allowed: teeth_a"),
    ("after_deg = 5", "after_mm = 5", "after is in rad; allowed: after, after_deg, after_arcmin"),
    # not TOML
    (
        "flux = 0.0125",
        "flux 0.0125",
        "not valid TOML: Expected '=' after a key in a key/value pair (at line 10, column 6)",
    ),
    ("flux = 0.0125", "flux = 1\nflux = 2", "not valid TOML: Cannot overwrite a value (at line 11, column 9)"),
]


@pytest.mark.parametrize(("old", "new", "message"), WRONG, ids=[f"{old} -> {new}"[:60] for old, new, _ in WRONG])
def test_a_wrong_file_says_what_is_wrong_and_what_is_allowed(refusal, old, new, message):
    assert message in refusal(edited(old, new))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "title is missing"),
        ('title = ""\nmotor = 3', "motor = 3 must be a table"),
        (
            SMALL.replace("[gear.meshes.only]", "[gear.meshes]\nonly = 3\n[gear.bearings.any]"),
            "gear.meshes.only = 3 must be a table",
        ),
        (SMALL + "[gear]", "not valid TOML: Cannot declare ('gear',) twice (at line"),
        ("base = 3", "base = 3 must be the name of a built-in case or a relative path"),
        (b"title = '\xff'", "not valid TOML: not UTF-8 text at byte 9"),
        (
            edited("a.inertia = 1e-4", "", SMALL).replace("b.inertia = 1\n", "b = 1\n"),
            "gear.shafts.b = 1 must be a table",
        ),
        (ONE_SIGNAL + 'type = "Table"\ntimes = 3\nvalues = [1]', "inputs.reference.times = 3 must be a list"),
        (
            ONE_SIGNAL + 'type = "Table"\ntimes = [0, 1]\nvalues_deg = [1, "x"]',
            'scenario.inputs.reference.values_deg[1] = "x" must be a number [rad]',
        ),
        (ONE_SIGNAL + 'type = "Table"\ntimes = [1, 0]\nvalues = [1, 1]', "reference.times must increase"),
        (
            ONE_SIGNAL + 'type = "Sum"\nparts = [{ type = "Step", after = 1 }, { type = "Stop" }]',
            'scenario.inputs.reference.parts[1].type = "Stop" must be one of',
        ),
    ],
)
def test_other_wrong_files(refusal, text, message):
    assert message in refusal(text)


def test_a_missing_file_names_the_built_in_cases(tmp_path):
    with pytest.raises(
        CaseError, match=r"none\.toml: cannot be read: No such file or directory; .* are aileron, aileron-retuned"
    ):
        load_case(tmp_path / "none.toml")
    with pytest.raises(CaseError, match="aleron: cannot be read"):
        load_case("aleron")
    with pytest.raises(CaseError, match="cannot be read: Is a directory"):
        load_case(tmp_path)


def test_a_missing_base_names_the_file_that_asks_for_it(refusal):
    assert refusal('base = "none.toml"').startswith('base = "none.toml": ')


# -- built-in cases --------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", built_in())
def test_a_built_in_case_loads_and_assembles(name):
    case = load_case(name)
    inputs = {quantity.name for quantity in case.actuator.system().inputs}
    assert (case.name, case.actuator.name) == (name, name)
    assert case.title and case.description and case.inputs.keys() <= inputs


def test_the_retuned_aileron_differs_in_its_gains_only():
    first, second = (leaves(load_case(name).actuator) for name in ("aileron", "aileron-retuned"))
    different = {path for path in first if first[path] != second[path]}
    assert different - {".name"}
    assert all(path.startswith(".controller.") for path in different - {".name"})
