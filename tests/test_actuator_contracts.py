"""Contracts of motors, loads and controllers: kept by every part that registers, and each check is caught by a part.

Oracles: parts that are wrong in one way each.
"""

from dataclasses import dataclass, fields, replace
from typing import Annotated

import casadi as ca
import numpy as np
import pytest
from annotated_types import Unit

from actuator import PMSM, DCMotor, Load, remove_drive, simulate
from actuator.contracts import (
    check_contributions,
    check_demanded_current,
    check_drives,
    check_gains,
    check_inertia,
    check_limit,
    check_load_power,
    check_load_symbols,
    check_loop_signals,
    check_motor_symbols,
    check_offers,
    check_power_balance,
    check_sampled,
    check_stands_still,
    check_torque_of_its_current,
    check_tunable,
    check_units,
    controller_contract,
    load_contract,
    motor_contract,
)
from actuator.parts.current_source import CurrentSource
from actuator.parts.load import OutputLoad
from actuator.parts.motor import CurrentDriven, Motor
from actuator.parts.torque_source import TorqueSource
from controllers import PID, StateFeedback
from controllers.controller import Controller
from controllers.countermeasures import Countermeasure
from gear.quantities import registry
from gear.quantities.registry import parts
from studies.cases import load_case

CONTRACTS = {Motor: motor_contract, OutputLoad: load_contract, Controller: controller_contract}
KEPT = [
    (part, check)
    for slot, contract in CONTRACTS.items()
    for kind in parts(slot).values()
    for part in kind.examples()
    for check in contract(part)
]


@pytest.mark.parametrize(
    ("part", "check"), KEPT, ids=[f"{type(part).__name__}-{check.__name__}" for part, check in KEPT]
)
def test_every_part_keeps_its_contract(part, check):
    check(part)


def test_every_part_has_examples():
    for slot in CONTRACTS:
        assert [name for name, kind in parts(slot).items() if not kind.examples()] == []


# -- one part wrong in one way for each check ---------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class Bare(TorqueSource):
    """A number without a unit."""

    weight: float = 1.0


class Amplifying(TorqueSource):
    """Gives more than it is asked for."""

    def allow_torque(self, torque):
        return 2 * torque


class Reversed(TorqueSource):
    """Turns the other way."""

    def allow_torque(self, torque):
        return -torque


class WrongConstant(DCMotor):
    """Asks for twice the current."""

    def current_for(self, torque):
        return 2 * torque / self.torque_constant


class Runaway(CurrentSource):
    """Its current moves away from the one demanded."""

    def derivatives(self, currents, demanded):
        return [-rate for rate in super().derivatives(currents, demanded)]


class Perpetual(DCMotor):
    """Feels no voltage from its motion."""

    def coupling_voltages(self, currents, speed, temperature=None):
        return [0.0]


class Hidden(PMSM):
    """A law that is another one for numbers."""

    def torque(self, currents, temperature=None):
        return super().torque(currents, temperature) * (1.0 if isinstance(currents[0], ca.SX) else 1.5)


class Negative(Load):
    """An inertia that pulls."""

    def inertia_at(self, angle):
        return self.inertia * ca.cos(10 * angle)


class Windmill(Load):
    """Takes power that it does not give."""

    def power(self, angle, speed):
        return super().power(angle, speed) + 1.0


class Rounded(Load):
    """A law that is another one for symbols."""

    def torque(self, angle, speed):
        return super().torque(angle, speed) if isinstance(angle, float) else 0 * angle


class Undeclared(PID):
    """Its loop can be opened at a signal that it does not declare."""

    def loop_signals(self):
        return ("torque_reference",)


@dataclass(frozen=True, kw_only=True)
class Roleless(Controller):
    """Gains without a role."""

    stiffness: Annotated[float, Unit("N m/rad")] = 1.0

    def loops(self):
        return ("position",)

    def reads(self):
        return {"load": "it"}

    def drive(self, plant):
        loop = plant.loop("position")
        error = plant.input("reference", "rad") - plant.measure("load")
        return plant.actuate(loop, self.stiffness * error, 0.0, 0.0)


class Twitching(PID):
    """Begins with a torque."""

    def proposed(self, state, error, rate, reference=None):
        return super().proposed(state, error, rate, reference) + 1.0


class Scalar(PID):
    """A contribution that is no signal."""

    def contributions(self, signals, ratio):
        return {"proportional action": np.zeros(3)}


class Misnamed(PID):
    """Ticks in other loops than it says."""

    def loops(self):
        return super().loops()

    def in_continuous_time(self):
        raise AssertionError("Misnamed has no continuous form")


class Offering(PID):
    """A countermeasure for numbers that it has not."""

    def countermeasures(self, cycle):
        return [Countermeasure("magic", "", self, {"wand": 1.0})]


class Untuned(PID):
    """Gains that it has not."""

    def tunable_gains(self):
        return ("proportional", "magic")


def like(kind, made):
    """The same numbers in another class."""
    return kind(**{field.name: getattr(made, field.name) for field in fields(made)})


LAW = PID.examples()[0]
BROKEN = {
    check_units: Bare(),
    check_limit: Amplifying(),
    check_drives: Reversed(),
    check_torque_of_its_current: like(WrongConstant, DCMotor.examples()[0]),
    check_demanded_current: like(Runaway, CurrentSource.examples()[1]),
    check_power_balance: like(Perpetual, DCMotor.examples()[0]),
    check_motor_symbols: like(Hidden, PMSM.examples()[0]),
    check_inertia: Negative(inertia=1.0),
    check_load_power: Windmill(inertia=1.0),
    check_load_symbols: Rounded(inertia=1.0, bias=1.0),
    check_loop_signals: like(Undeclared, LAW),
    check_gains: Roleless(),
    check_stands_still: like(Twitching, LAW),
    check_contributions: like(Scalar, LAW),
    check_sampled: like(Misnamed, LAW),
    check_offers: like(Offering, LAW),
    check_tunable: like(Untuned, LAW),
}


@pytest.mark.parametrize(("check", "broken"), BROKEN.items(), ids=[check.__name__ for check in BROKEN])
def test_the_contract_catches(check, broken):
    with pytest.raises(AssertionError, match=type(broken).__name__):
        check(broken)


def test_every_check_is_caught_by_a_part():
    assert {check for _, check in KEPT} == set(BROKEN)


def test_a_contract_is_of_what_is_declared():
    assert check_power_balance not in motor_contract(TorqueSource())
    assert check_demanded_current in motor_contract(CurrentSource.examples()[0])
    assert len(list(controller_contract(replace(StateFeedback.examples()[0], limit=1.0)))) == 8


# -- a new motor is one class ---------------------------------------------------------------------------------

STEPPER = """
title = "A stepper that holds"
[scenario]
duration = 0.1
inputs.reference = { type = "Step", time = 0.0, after = 0.002 }
[motor]
type = "Stepper"
holding_torque = 2.0
rated_current = 4.0
inertia = 1e-4
teeth = 50
[controller]
type = "Cascade"
position = { type = "P", gain = 20 }
speed = { proportional = 0.05, integral = 0.5 }
speed_limit = 100
[gear]
input = "arm"
output = "arm"
shafts.arm.inertia = 1e-3
"""


@dataclass(frozen=True, kw_only=True)
class Stepper(CurrentDriven):
    """Two-phase stepper, commutated by its angle, with the detent torque of its teeth."""

    holding_torque: Annotated[float, Unit("N m")]
    rated_current: Annotated[float, Unit("A")]
    inertia: Annotated[float, Unit("kg m^2")]
    teeth: int
    detent: Annotated[float, Unit("N m")] = 0.02

    @classmethod
    def examples(cls):
        return (cls(holding_torque=2.0, rated_current=4.0, inertia=1e-4, teeth=50),)

    def rotor_inertia(self):
        return self.inertia

    def has_rotor_torque(self):
        return True

    def current_for(self, torque):
        return torque * self.rated_current / self.holding_torque

    def torque(self, currents):
        return currents[0] * self.holding_torque / self.rated_current

    def shaft_torque(self, currents, angle, speed):
        return self.torque(currents) - self.detent * ca.sin(4 * self.teeth * angle)


def test_a_new_motor_is_one_class_that_registers(monkeypatch, tmp_path):
    monkeypatch.setattr(registry, "_parts", {slot: dict(kinds) for slot, kinds in registry._parts.items()})
    registry.part(CurrentDriven)(Stepper)
    for check in motor_contract(Stepper.examples()[0]):
        check(Stepper.examples()[0])
    file = tmp_path / "stepper.toml"
    file.write_text(STEPPER)
    case = load_case(file)
    assert isinstance(case.actuator.motor, Stepper)
    run = simulate(case.actuator, 4.0, inputs=case.inputs, compiled=False)
    assert run["load_angle"][-1] == pytest.approx(0.002, abs=1e-4)
    with pytest.raises(ValueError, match="cogging and drag"):
        remove_drive(case.actuator)
