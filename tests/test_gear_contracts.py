"""Contracts of friction and elasticity laws, couplings, bearings and drags: kept by every part that registers.

Oracles: parts that are wrong in one way each; every check is caught by one of them.
"""

from dataclasses import dataclass
from typing import Annotated, ClassVar

import casadi as ca
import pytest
from annotated_types import Unit

import gear.contracts
from gear import Backlash, Bearing, Coulomb, Coupling, Linear, LuGre, LuGreBearing, Stribeck
from gear.contracts import (
    bearing_contract,
    check_bearing_never_drives,
    check_bearing_symbols,
    check_breakaway_above_sliding,
    check_breakaway_role,
    check_conservative,
    check_coupling_energy,
    check_coupling_symbols,
    check_damping,
    check_drag,
    check_elasticity_symbols,
    check_force_scale,
    check_friction_symbols,
    check_gap,
    check_holding_above_sliding,
    check_never_drives,
    check_settles_to_its_coefficient,
    check_settles_to_its_sliding,
    check_terminals,
    check_units,
    coupling_contract,
    drag_contract,
    elasticity_contract,
    friction_contract,
)
from gear.couplings import ShaftCoupling, ShaftStop
from gear.elasticity.law import ElasticityLaw
from gear.friction.law import FrictionLaw
from gear.quantities.registry import parts
from gear.quantities.roles import Breakaway
from gear.shafts import Drag, ShaftBearing, ShaftDrag

CONTRACTS = {
    FrictionLaw: friction_contract,
    ElasticityLaw: elasticity_contract,
    ShaftCoupling: coupling_contract,
    ShaftStop: coupling_contract,
    ShaftBearing: bearing_contract,
    ShaftDrag: drag_contract,
}
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
    assert [kind for slot in CONTRACTS for kind in parts(slot).values() if not kind.examples()] == []


# -- one part wrong in one way for each check ---------------------------------------------------------------

DRY, SPRING, GAP = Coulomb.examples()[0], Linear.examples()[0], Backlash.examples()[0]
COUPLING, BEARING, DRAG = Coupling.examples()[0], Bearing.examples()[0], Drag.examples()[0]


def wrong(part, **methods):
    """The same part with other methods, of a class with a name of its own."""
    made = object.__new__(type("Wrong", (type(part),), methods))
    vars(made).update(vars(part))
    return made


@dataclass(frozen=True, kw_only=True)
class Bare(Coulomb):
    """A number without a unit."""

    wear: float = 1.0


@dataclass(frozen=True, kw_only=True)
class Silent(Coulomb):
    """Does not say what its breakaway is."""

    static: Annotated[float, Unit("-")]


@dataclass(frozen=True, kw_only=True)
class Bottomless(Coulomb):
    """Its floor is not there."""

    static: Annotated[float, Unit("-"), Breakaway(floor="kinetic")]


def branching(self, sliding):
    return 0.1 if isinstance(sliding.speed, float) else 0.2


def leaking(self, twist, flank):
    return Coupling.torque(self, twist, flank) + (0.5 if flank == 0 else 0.0)


BROKEN = [
    (check_units, Bare(sliding=0.1, static=0.2), "wear has no unit"),
    (check_friction_symbols, wrong(DRY, coefficient=branching), "for numbers"),
    (
        check_friction_symbols,
        wrong(DRY, coefficient=lambda self, sliding: self.sliding * ca.sqrt(sliding.speed)),
        "a slope at .* is not finite",
    ),
    (check_never_drives, wrong(DRY, coefficient=lambda self, sliding: 0.1 - sliding.speed), "would drive the mesh"),
    (check_breakaway_role, Silent(sliding=0.1, static=0.2), "none of its numbers has the role Breakaway"),
    (check_breakaway_role, Bottomless(sliding=0.1, static=0.2), "its floor 'kinetic' is no number of it"),
    (check_breakaway_role, wrong(DRY, breakaway=lambda self, sliding: self.sliding), "leaves 0.1 of 0.1"),
    (
        check_breakaway_above_sliding,
        wrong(DRY, coefficient=lambda self, sliding: self.static + 0.1 * sliding.a_drives),
        "just off standstill 0.25 is above breakaway 0.15, at 0 m/s, 0 N, A driving",
    ),
    (
        check_settles_to_its_coefficient,
        wrong(LuGre.examples()[0], coefficient=lambda self, sliding: self.static),
        "in steady motion its friction settles to 1.49506, and not to 1.5",
    ),
    (
        check_settles_to_its_coefficient,
        wrong(LuGre.examples()[0], rates=lambda self, memory, sliding: [], friction=lambda self, memory, sliding: 1.0),
        "it declares 1 states, and has 0 rates",
    ),
    (
        check_elasticity_symbols,
        wrong(SPRING, spring=lambda self, x: 0.0 if isinstance(x, float) else self.stiffness * x),
        "for numbers",
    ),
    (check_conservative, wrong(SPRING, energy=lambda self, x: self.stiffness * x**2), "what it stores grows by"),
    (check_damping, wrong(SPRING, damper=lambda self, x, rate: -self.damping * rate), "which drives the mesh"),
    (check_force_scale, wrong(SPRING, force_scale=lambda self: -1.0), "its force_scale is -1 N"),
    (check_gap, wrong(GAP, force=lambda self, motion, flank: 1.0), "in its gap it has a force of 1 N"),
    (
        check_gap,
        wrong(GAP, force=lambda self, motion, flank: -flank * ca.fabs(motion.deflection)),
        "it pulls with",
    ),
    (check_terminals, wrong(COUPLING, terminals=lambda self: {"a": self.a}), r"names the shafts \['a'\], and twists"),
    (
        check_coupling_symbols,
        wrong(COUPLING, torque=lambda self, twist, flank: 0.0 if isinstance(flank, float) else 1.0),
        "for numbers",
    ),
    (check_coupling_energy, wrong(COUPLING, stored=lambda self, twist, flank: twist.angle**2), "what it stores grows"),
    (
        check_coupling_energy,
        wrong(COUPLING, torque=lambda self, twist, flank: self.stiffness * twist.angle - twist.rate),
        "which drives the shafts",
    ),
    (
        check_coupling_energy,
        wrong(Coupling.examples()[1], torque=leaking),
        "in its gap it has a torque of",
    ),
    (
        check_bearing_symbols,
        wrong(BEARING, holding=lambda self, load: 1.0 if isinstance(load, float) else 2.0),
        "for numbers",
    ),
    (check_bearing_never_drives, wrong(BEARING, viscous_torque=lambda self, speed: 0.1 * speed), "torque gives"),
    (check_bearing_never_drives, wrong(BEARING, holding=lambda self, load: -1.0), "it holds with -1 N m"),
    (
        check_holding_above_sliding,
        wrong(BEARING, holding=lambda self, load: 0.05),
        "sliding just off standstill 0.1 N m",
    ),
    (
        check_settles_to_its_sliding,
        wrong(LuGreBearing.examples()[0], sliding=lambda self, load, speed: self.coulomb),
        "in steady motion its friction settles to",
    ),
    (check_drag, wrong(DRAG, torque=lambda self, speed: speed), "drives the shaft"),
    (check_drag, wrong(DRAG, torque=lambda self, speed: -0.1 if speed >= 0 else 0.1), "N m at rest"),
]


@pytest.mark.parametrize(("check", "part", "message"), BROKEN, ids=[check.__name__ for check, _, _ in BROKEN])
def test_what_breaks_a_contract_is_caught(check, part, message):
    with pytest.raises(AssertionError, match=message):
        check(part)


def test_each_check_is_tested_by_a_part_that_breaks_it():
    checks = {thing for name, thing in vars(gear.contracts).items() if name.startswith("check_")}
    assert {check for check, _, _ in BROKEN} == checks


def test_a_law_is_judged_by_what_it_declares():
    assert check_breakaway_above_sliding in friction_contract(DRY)
    assert check_settles_to_its_coefficient in friction_contract(LuGre.examples()[0])
    assert check_gap in elasticity_contract(GAP)
    assert check_gap not in elasticity_contract(SPRING)


def test_a_users_own_law_is_judged_without_being_registered():
    class Own(Stribeck):
        sticks: ClassVar[bool] = True

    for check in friction_contract(Own(static=0.2, coulomb=0.1, stribeck_speed=0.01)):
        check(Own(static=0.2, coulomb=0.1, stribeck_speed=0.01))
