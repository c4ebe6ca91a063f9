"""Contracts of motors, loads and controllers: kept by every part that registers, and each check is caught by a part.

Oracles: parts that are wrong in one way each.
"""

from dataclasses import dataclass, fields, replace
from typing import Annotated

import casadi as ca
import numpy as np
import pytest
from annotated_types import Unit

from actuator import PMSM, DCMotor, Load
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
    check_offers,
    check_power_balance,
    check_sampled,
    check_stands_still,
    check_torque_of_its_current,
    check_tunable,
    check_units,
    check_winding_symbols,
    controller_contract,
    load_contract,
    motor_contract,
)
from actuator.parts.current_source import CurrentSource
from actuator.parts.load import OutputLoad
from actuator.parts.motor import Motor
from actuator.parts.torque_source import TorqueSource
from controllers import PID, StateFeedback
from controllers.controller import Controller
from controllers.countermeasures import Countermeasure
from gear.quantities.registry import parts

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
    check_winding_symbols: like(Hidden, PMSM.examples()[0]),
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
