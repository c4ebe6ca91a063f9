"""Drag of oil in bearings and housings, and a whole transmission at another temperature.

Oracles: Palmgren's formula in his own units; the ratio of viscosities; power balance of a steady run; a sweep over the
named temperatures against a transmission built anew at each.
"""

import math
from dataclasses import replace

import pytest
from hypothesis import given, settings
from oracles import PAPER_PAIR, gradient_in_symbols, in_symbols, numbers

from actuator import Actuator, Load, Sine, TorqueSource, simulate
from gear import (
    AtViscosity,
    Bearing,
    Coulomb,
    Din3990,
    GivenViscosity,
    KnownOil,
    Linear,
    OilAt,
    Palmgren,
    Stribeck,
    Thickening,
    at_temperature,
)
from gear.arrangements import spur_pair
from gear.balance import balance
from gear.breakout import breakout
from gear.efficiency import efficiency_map
from gear.planets import MeshLaws
from gear.shafts import Drag
from studies.converter import converter

COLD, ROOM, WARM = (273.15 + temperature for temperature in (-55, 20, 70))
JET_OIL = KnownOil(name="Mobil Jet Oil II")
FILM = Palmgren(diameter=30e-3, factor=1.5, lubricant=OilAt(oil=JET_OIL, temperature=ROOM))
THICK = Thickening(
    lubricant=OilAt(oil=JET_OIL, temperature=ROOM), measured_with=OilAt(oil=JET_OIL, temperature=ROOM), exponent=0.5
)
OILY = replace(
    spur_pair(
        PAPER_PAIR,
        1e-4,
        1e-3,
        MeshLaws(
            elasticity=Linear(stiffness=2e8, damping=2e5),
            friction=Din3990(
                static=0.2, lubricant=OilAt(oil=JET_OIL, temperature=ROOM), roughness=0.8e-6, face_width=10e-3
            ),
        ),
    ),
    bearings={
        "front": Bearing(shaft="wheel_a", coulomb=0.01, breakaway=0.02, film=FILM),
        "seal": Bearing(shaft="wheel_b", coulomb=0.0, breakaway=0.0, viscous=1e-3, thickening=THICK),
    },
    drags={"oil": Drag(shaft="wheel_b", speeds=(0.0, 10.0), torques=(0.0, 0.1), thickening=THICK)},
)


def test_a_bearing_turns_as_hard_as_palmgren_says_in_his_own_units():
    """10 000 1/min in oil of 20 mm^2/s, mean diameter 30 mm: 1e-7 * 1.5 * 200 000^(2/3) * 27 000 = 13.8 N mm."""
    thin = replace(FILM, lubricant=GivenViscosity(viscosity=20e-6 * 900, density=900.0))
    in_newton_millimeters = 1e-7 * 1.5 * (20 * 10_000) ** (2 / 3) * 30**3
    assert thin.torque(10_000 * math.pi / 30) == pytest.approx(1e-3 * in_newton_millimeters, rel=1e-12)
    assert thin.torque(10_000 * math.pi / 30) == pytest.approx(13.85e-3, rel=1e-3)


def test_slow_bearings_turn_as_hard_as_at_the_boundary():
    """Palmgren prints 160e-7 there: 2000^(2/3) is 158.7."""
    assert FILM.torque(0.0) == pytest.approx(160e-7 * 1.5 * 30**3 * 1e-3, rel=0.01)
    boundary = 2000 / (JET_OIL.kinematic_viscosity(ROOM) * 1e6) * math.pi / 30
    assert FILM.torque(0.999 * boundary) == FILM.torque(0.0)
    assert FILM.torque(8 * boundary) == pytest.approx(4 * FILM.torque(0.0))


@settings(deadline=None, max_examples=30)
@given(speed=numbers(0.0, 1e3))
def test_film_is_the_same_in_numbers_and_in_symbols_with_a_finite_slope(speed):
    assert in_symbols(FILM.torque, speed) == pytest.approx(FILM.torque(speed), rel=1e-12)
    assert math.isfinite(gradient_in_symbols(FILM.torque, speed)[0])


@pytest.mark.parametrize(("exponent", "factor"), [(0.0, 1.0), (2 / 3, 4.0), (1.0, 8.0)])
def test_drag_grows_with_a_power_of_the_viscosity(exponent, factor):
    thickening = Thickening(
        lubricant=GivenViscosity(viscosity=0.8), measured_with=GivenViscosity(viscosity=0.1), exponent=exponent
    )
    assert thickening.factor() == pytest.approx(factor)
    bearing = Bearing(shaft="a", coulomb=0.1, breakaway=0.2, viscous=0.01, thickening=thickening)
    assert bearing.viscous_torque(-5.0) == pytest.approx(0.05 * factor)
    assert (bearing.sliding(0.0, 5.0), bearing.holding(0.0)) == (0.1, 0.2)
    drag = Drag(shaft="a", speeds=(0.0, 10.0), torques=(0.0, 1.0), thickening=thickening)
    assert drag.torque(5.0) == pytest.approx(-0.5 * factor)


def test_film_adds_to_what_holds_and_to_what_brakes_and_so_keeps_their_order():
    bearing = OILY.bearings["front"]
    assert bearing.holding(3.0) == 0.02 + FILM.torque(0.0)
    assert bearing.sliding(3.0, 200.0) == 0.01 + FILM.torque(200.0)
    assert bearing.sliding(3.0, 0.0) < bearing.holding(3.0)


def test_every_oil_of_a_transmission_is_at_the_temperature_asked_for():
    cold = at_temperature(OILY, COLD)
    front, seal = cold.bearings["front"].film, cold.bearings["seal"].thickening
    assert [part.lubricant.temperature for part in (front, seal, cold.meshes["mesh"].friction)] == [COLD] * 3
    assert cold.drags["oil"].thickening.lubricant.temperature == COLD
    assert seal.measured_with.temperature == ROOM  # a measurement is over
    assert at_temperature(cold, ROOM) == OILY
    assert OILY.bearings["front"].film.lubricant.temperature == ROOM


def test_oils_inside_of_wrapped_laws_are_found():
    law = AtViscosity(
        law=Stribeck(static=0.2, coulomb=0.1, stribeck_speed=0.1),
        lubricant=OilAt(oil=JET_OIL, temperature=ROOM),
        measured_with=OilAt(oil=JET_OIL, temperature=WARM),
    )
    cold = at_temperature(law, COLD)
    assert (cold.lubricant.temperature, cold.measured_with.temperature) == (COLD, WARM)


def test_a_temperature_that_nothing_could_have_is_refused():
    with pytest.raises(ValueError, match="at_temperature: no law of Coulomb has an oil that could be at 218.15 K"):
        at_temperature(Coulomb(sliding=0.1, static=0.2), COLD)
    with pytest.raises(ValueError, match="Mobil Jet Oil II: temperature must be from 218.15 K to 423.15 K, got 200 K"):
        at_temperature(OILY, 200.0)
    with pytest.raises(ValueError, match="GivenViscosity.density is needed for the kinematic viscosity"):
        replace(FILM, lubricant=GivenViscosity(viscosity=0.1))
    with pytest.raises(ValueError, match="Thickening.exponent must be <= 1, got 2"):
        replace(THICK, exponent=2.0)


def test_the_cold_takes_its_part_in_every_steady_answer():
    gears = {kelvin: at_temperature(OILY, kelvin) for kelvin in (COLD, ROOM, WARM)}
    data = efficiency_map(gears, torques=[2.0, 10.0], speeds=[5.0, 20.0])
    assert (data.forward.sel(temperature=COLD) < data.forward.sel(temperature=ROOM)).all()
    points = [balance(gear, output_torque=-5.0, output_speed=20.0) for gear in gears.values()]
    for path in ("bearings.front", "bearings.seal", "drags.oil"):
        cold, room, warm = (point.loss[path] for point in points)
        assert cold > room > warm > 0
    thicker = JET_OIL.dynamic_viscosity(COLD) / JET_OIL.dynamic_viscosity(ROOM)
    assert points[0].loss["drags.oil"] / points[1].loss["drags.oil"] == pytest.approx(thicker**0.5)
    assert points[0].loss["drags.oil"] == pytest.approx(0.1 * 20.0 * thicker**0.5)
    still = breakout(OILY, torque=5.0).input_torque
    bare = breakout(replace(OILY, bearings={}), torque=5.0).input_torque
    assert still - bare == pytest.approx(0.02 + FILM.torque(0.0))


@pytest.mark.parametrize("kelvin", [COLD, WARM])
def test_temperatures_are_parameters_of_a_run_and_give_the_transmission_built_there(kelvin):
    def plant(gear):
        return Actuator(motor=TorqueSource(), gear=gear, load=Load(damping=0.25))

    names = [
        f"gear.{path}.lubricant.temperature"
        for path in ("meshes.mesh.friction", "bearings.front.film", "bearings.seal.thickening", "drags.oil.thickening")
    ]
    options = {"inputs": {"torque_reference": 1.0}, "resolution": 0.1, "compiled": False}
    swept = simulate(plant(OILY), 8.0, parameters=dict.fromkeys(names, kelvin), **options)
    built = simulate(plant(at_temperature(OILY, kelvin)), 8.0, **options)
    room = simulate(plant(OILY), 8.0, **options)
    assert swept["load_speed"] == pytest.approx(built["load_speed"], rel=1e-6, abs=1e-6)
    assert abs(built["load_speed"][-1] / room["load_speed"][-1] - 1) > 0.01
    speed = built["load_speed"][-1]
    point = balance(at_temperature(OILY, kelvin), output_torque=-0.25 * speed, output_speed=speed)
    assert point.input_torque == pytest.approx(1.0, rel=1e-6)


@pytest.mark.parametrize("kelvin", [COLD, ROOM])
def test_an_oily_gear_sticks_and_slips_without_creating_energy(kelvin):
    plant = Actuator(motor=TorqueSource(), gear=at_temperature(OILY, kelvin), load=Load(damping=0.01, stiffness=5.0))
    run = simulate(plant, 2.0, inputs={"torque_reference": Sine(amplitude=1.0, frequency=1.0)}, compiled=False)
    assert run.margins.min() > -1e-9
    modes = {change.after for change in run.changes if change.contact == "gear.bearings.front"}
    assert {"stuck", "forward", "backward"} <= modes
    assert run["gear.bearings.front.friction_loss"].min() > -1e-9


def test_bearings_in_oil_can_be_read_from_a_file():
    oil = {"type": "OilAt", "oil": {"type": "KnownOil", "name": JET_OIL.name}, "temperature_degC": -55}
    measured = {"type": "GivenViscosity", "viscosity_mPas": 50}
    table = {
        "shaft": "a",
        "coulomb": 0.1,
        "breakaway": 0.2,
        "viscous": 1e-3,
        "film": {"diameter_mm": 30, "factor": 1.5, "lubricant": oil},
        "thickening": {"lubricant": oil, "measured_with": measured},
    }
    bearing = converter().structure(table, Bearing)
    assert bearing.film.lubricant.temperature == pytest.approx(COLD)
    assert bearing.film == at_temperature(FILM, -55 + 273.15)
    assert bearing.thickening.measured_with == GivenViscosity(viscosity=0.05)
