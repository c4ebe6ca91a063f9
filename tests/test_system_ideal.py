"""Imperfections of size zero, and limits that are never met: the same actuator to the last digits.

Oracle: the ideal actuator.
"""

from dataclasses import replace

import numpy as np
import pytest
from test_system_energy import CYCLE, drive

from actuator import (
    AngleSensor,
    Bridge,
    Cogging,
    CurrentSensor,
    Gravity,
    OverheatDerating,
    Rotor,
    RotorDrag,
    Sensors,
    TemperatureDependence,
    ThermalNetwork,
    ThermalNode,
    UndervoltageDerating,
    simulate,
)
from actuator.parts.temperature import ROOM
from controllers import (
    FrictionCompensation,
    IntegralRemedies,
    Remedies,
    Sampling,
    ScheduledGain,
)
from gear import Shaft, Transmission
from gear.shafts import Drag

SAMPLED = drive(sampling=Sampling(current=1e-4, speed=2e-4, position=1e-3))
IDEAL = {
    name: replace(
        plant,
        # no events, which make much of the last digit
        gear=Transmission(shafts={"surface": Shaft(inertia=0.01)}, input="surface", output="surface"),
        load=replace(plant.load, gravity=None),
        motor=replace(plant.motor, rotor=Rotor()),
        inverter=replace(plant.inverter, bridge=None),
    )
    for name, plant in (("continuous", drive()), ("sampled", SAMPLED))
}


def controller(plant, **more):
    return replace(plant, controller=replace(plant.controller, **more))


def speed_law(plant, **more):
    return controller(plant, speed=replace(plant.controller.speed, **more))


def inverter(plant, **more):
    return replace(plant, inverter=replace(plant.inverter, **more))


def at_room(plant):
    nodes = {name: ThermalNode(temperature=ROOM) for name in ("winding", "magnet", "housing", "oil")}
    return replace(plant, thermal=ThermalNetwork(nodes=nodes, paths={}))


SWITCHED_OFF = {
    "sensors": lambda a: replace(a, sensors=Sensors(motor=AngleSensor(), load=AngleSensor(), current=CurrentSensor())),
    "cogging and drag": lambda a: replace(
        a, motor=replace(a.motor, rotor=Rotor(cogging=Cogging(amplitude=0.0, periods=24), drag=RotorDrag()))
    ),
    "bridge": lambda a: inverter(a, bridge=Bridge(dead_time=0.0, switching_frequency=2e4, threshold=0.5)),
    "temperature": lambda a: at_room(
        replace(a, motor=replace(a.motor, temperature_dependence=TemperatureDependence()))
    ),
    "fold-back": lambda a: inverter(
        at_room(a),
        undervoltage=UndervoltageDerating(full=100.0, none=50.0),
        overheat=OverheatDerating(full=400.0, none=450.0),
    ),
    "remedies": lambda a: controller(
        a, remedies=Remedies(compensation=FrictionCompensation(coulomb=0.0, breakaway=0.0, standstill=1.0, width=0.1))
    ),
    "remedies of the integral": lambda a: speed_law(a, remedies=IntegralRemedies(leakage=0.0)),
    "limit and set-point weight": lambda a: speed_law(a, limit=1e6, setpoint_weight=1.0),
    "schedule": lambda a: controller(
        at_room(a), schedule=ScheduledGain(over="temperature", points=(250.0, 300.0), values=(1.0, 1.0))
    ),
    "gravity": lambda a: replace(a, load=replace(a.load, gravity=Gravity(moment=0.0))),
    "drag": lambda a: replace(
        a, gear=replace(a.gear, drags={"air": Drag(shaft="surface", speeds=(0.0, 100.0), torques=(0.0, 0.0))})
    ),
}


@pytest.fixture(scope="module", params=IDEAL)
def ideal(request):
    return IDEAL[request.param], run_of(IDEAL[request.param])


def run_of(plant):
    return simulate(plant, 0.05, inputs=CYCLE, resolution=1e-3, compiled=False)


@pytest.mark.parametrize("name", SWITCHED_OFF)
def test_what_is_switched_off_leaves_no_trace(ideal, name):
    plant, expected = ideal
    run = run_of(SWITCHED_OFF[name](plant))
    np.testing.assert_array_equal(run.t, expected.t)
    for signal, values in expected.signals.items():
        np.testing.assert_allclose(run[signal], values, rtol=1e-12, atol=1e-12 * abs(values).max(), err_msg=signal)
