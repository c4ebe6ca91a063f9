"""What the parts of a gear have to keep, as small checks: for those of this package and for a user's own.

    for check in friction_contract(law):
        check(law)

A contract yields the checks that suit what the part declares. Each raises AssertionError with the class, the values
and the rule. They take parts with numbers, such as those of `examples()`.
"""

import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass
from typing import Any, get_type_hints

import casadi as ca
import numpy as np
from scipy.integrate import solve_ivp

from gear.couplings.law import Twist
from gear.elasticity.law import AT_REST, has_gap
from gear.motion import MeshMotion, Sliding
from gear.quantities import annotations, unit_of
from gear.quantities.roles import Breakaway, roles_in
from gear.teeth.geometry import ExternalPair

Check = Callable[[Any], None]

CLOSE = 1e-9  # relative: of two ways to work out the same number
SLOPE_STEP = 1e-6  # relative: of a difference quotient
SLOPE_CLOSE = 1e-4  # relative: of a difference quotient and what it should be
PAIR = ExternalPair(teeth_a=20, teeth_b=60, module=1e-3)
SLIDING_STATES = tuple(
    Sliding(speed, force, side, position, PAIR)
    for speed, force, side, position in itertools.product(
        (0.0, 1e-6, 1e-3, 0.1, 3.0), (0.0, 2.0, 500.0), (0.0, 1.0), (0.0, 1e-3)
    )
)
DEFLECTIONS, RATES = (-3e-5, -1e-6, 2e-6, 4e-5), (-1e-2, 0.0, 1e-3)  # m, m/s
TWISTS, TWIST_RATES = (-0.7, -1e-3, 2e-3, 0.9), (-2.0, 0.0, 0.1)  # rad, rad/s
SPEEDS, LOADS = (0.0, 1e-6, 1e-2, 1.0, 200.0), (0.0, 30.0)  # rad/s, N
STEADY = 1e-6  # relative: how exactly an internal state settles


# -- friction of a mesh -------------------------------------------------------------------------------------


def friction_contract(law: Any) -> Iterator[Check]:
    """What a friction law has to keep, by whether it sticks."""
    yield from (check_units, check_friction_symbols, check_never_drives, check_breakaway_role)
    yield check_breakaway_above_sliding if law.sticks else check_settles_to_its_coefficient


def check_friction_symbols(law: Any) -> None:
    """Coefficients are the same for numbers and symbols, and their slopes are finite, also at rest and unloaded."""

    def values(part: Any, speed: Any, force: Any, side: Any, position: Any) -> list:
        sliding = Sliding(speed, force, side, position, PAIR)
        return [part.coefficient(sliding), part.breakaway(sliding)]

    for state in SLIDING_STATES:
        _compare(law, values, state[:4])


def check_never_drives(law: Any) -> None:
    """No coefficient is negative: friction takes power."""
    for state in SLIDING_STATES:
        for name in ("coefficient", "breakaway"):
            value = float(getattr(law, name)(state))
            assert value >= 0, f"{_name(law)}: {name} {value:g} at {_told(state)} would drive the mesh"


def check_breakaway_role(law: Any) -> None:
    """A number has the role of breakaway friction; more of it holds more, and it knows what it may not fall below."""
    found = list(_having(law, Breakaway))
    assert found, f"{_name(law)}: none of its numbers has the role Breakaway (gear.quantities.roles)"
    for owner, name, role in found:
        if isinstance(role.floor, str):
            floor = getattr(owner, role.floor, None)
            assert isinstance(floor, float | int), f"{_name(owner)}.{name}: its floor {role.floor!r} is no number of it"
            assert floor <= getattr(owner, name), (
                f"{_name(owner)}.{name}: it is below its floor {role.floor} = {floor:g}"
            )
    copy, symbols, numbers = _symbolic(law)
    raised = ca.vertcat(*(number * (1.01 if known else 1.0) for number, known in zip(*numbers, strict=True)))
    held = ca.Function("held", [symbols], [copy.breakaway(SLIDING_STATES[-1])])
    before, after = float(held(ca.DM(numbers[0]))), float(held(raised))
    assert after > before, f"{_name(law)}: more of what has the role Breakaway leaves {after:g} of {before:g}"


def check_breakaway_above_sliding(law: Any) -> None:
    """What slides just off standstill is not held harder than it was at rest."""
    for state in SLIDING_STATES:
        if state.speed == 0:
            off, held = float(law.coefficient(state)), float(law.breakaway(state))
            assert off <= held * (1 + CLOSE), (
                f"{_name(law)}: sliding just off standstill {off:g} is above breakaway {held:g}, at {_told(state)}"
            )


def check_settles_to_its_coefficient(law: Any) -> None:
    """In steady motion, either way, the internal state settles and gives the friction of `coefficient`."""
    for speed, direction in itertools.product((1e-4, 0.1), (1.0, -1.0)):
        state = Sliding(direction * speed, 100.0, 1.0, 0.0, PAIR)
        expected = direction * float(law.coefficient(state._replace(speed=speed)))
        _check_settles(
            law, expected, lambda memory, at=state: law.rates(memory, at), lambda m, at=state: law.friction(m, at)
        )


# -- elasticity of a mesh -----------------------------------------------------------------------------------


def elasticity_contract(law: Any) -> Iterator[Check]:
    """What an elasticity law has to keep, by whether it has a gap."""
    yield from (check_units, check_elasticity_symbols, check_conservative, check_damping, check_force_scale)
    if has_gap(law):
        yield check_gap


def _motion(deflection: Any, rate: Any) -> MeshMotion:
    return AT_REST._replace(deflection=deflection, rate=rate, pair=PAIR)


def check_elasticity_symbols(law: Any) -> None:
    """Force and stored energy are the same for numbers and symbols, and their slopes are finite."""
    for point in itertools.product((*DEFLECTIONS, 0.0), RATES, (1.0, -1.0)):
        _compare(
            law, lambda part, x, v, flank: [part.force(_motion(x, v), flank), part.stored(_motion(x, v), flank)], point
        )


def check_conservative(law: Any) -> None:
    """Without a rate the force is the slope of what is stored."""
    for deflection in DEFLECTIONS:
        flank = np.sign(deflection)
        force = float(law.force(_motion(deflection, 0.0), flank))
        slope = _slope(lambda x, flank=flank: law.stored(_motion(x, 0.0), flank), deflection)
        engaged = not has_gap(law) or float(law.penetration(_motion(deflection, 0.0), flank)) > 0
        assert not engaged or _near(force, slope), (
            f"{_name(law)}: at {deflection:g} m its force is {force:g} N, and what it stores grows by {slope:g} J/m"
        )


def check_damping(law: Any) -> None:
    """What the rate adds to the force takes power."""
    for deflection, rate in itertools.product(DEFLECTIONS, RATES):
        flank = np.sign(deflection)
        if has_gap(law) and float(law.penetration(_motion(deflection, 0.0), flank)) <= 0:
            continue
        added = float(law.force(_motion(deflection, rate), flank)) - float(law.force(_motion(deflection, 0.0), flank))
        assert added * rate >= 0, f"{_name(law)}: at a rate of {rate:g} m/s it adds {added:g} N, which drives the mesh"


def check_force_scale(law: Any) -> None:
    """A usual force is positive."""
    scale = float(law.force_scale())
    assert scale > 0, f"{_name(law)}: its force_scale is {scale:g} N"


def check_gap(law: Any) -> None:
    """In the gap there is no force; on a flank that is penetrated, it pushes."""
    for deflection in DEFLECTIONS:
        at, flank = _motion(deflection, 0.0), np.sign(deflection)
        free, force = float(law.force(at, 0.0)), float(law.force(at, flank))
        assert free == 0, f"{_name(law)}: in its gap it has a force of {free:g} N"
        assert float(law.penetration(at, flank)) <= 0 or flank * force >= 0, (
            f"{_name(law)}: at {deflection:g} m it pulls with {force:g} N"
        )


# -- couplings and end stops --------------------------------------------------------------------------------


def coupling_contract(spring: Any) -> Iterator[Check]:
    """What a coupling or an end stop has to keep."""
    yield from (check_units, check_terminals, check_coupling_symbols, check_coupling_energy)


def check_terminals(spring: Any) -> None:
    """Its twist is that of the shafts that it names."""
    named, twisted = set(spring.terminals().values()), set(spring.twist_per_shaft())
    assert named == twisted, f"{_name(spring)}: it names the shafts {sorted(named)}, and twists with {sorted(twisted)}"


def check_coupling_symbols(spring: Any) -> None:
    """Torque and stored energy are the same for numbers and symbols, and their slopes are finite."""
    for point in itertools.product((*TWISTS, 0.0), TWIST_RATES, (1.0, -1.0)):
        _compare(
            spring, lambda part, x, v, flank: [part.torque(Twist(x, v), flank), part.stored(Twist(x, v), flank)], point
        )


def check_coupling_energy(spring: Any) -> None:
    """Without a rate the torque is the slope of what is stored; a rate takes power; in a gap there is no torque."""
    gapped = spring.penetration(Twist(0.0, 0.0), 1.0) is not None
    for twist, rate in itertools.product(TWISTS, TWIST_RATES):
        flank = np.sign(twist)
        if gapped and float(spring.penetration(Twist(twist, 0.0), flank)) <= 0:
            free = float(spring.torque(Twist(twist, rate), 0.0))
            assert free == 0, f"{_name(spring)}: in its gap it has a torque of {free:g} N m"
            continue
        torque = float(spring.torque(Twist(twist, 0.0), flank))
        slope = _slope(lambda x, flank=flank: spring.stored(Twist(x, 0.0), flank), twist)
        assert _near(torque, slope), (
            f"{_name(spring)}: at {twist:g} rad its torque is {torque:g} N m, and what it stores grows by {slope:g} N m"
        )
        added = float(spring.torque(Twist(twist, rate), flank)) - torque
        assert added * rate >= 0, f"{_name(spring)}: at {rate:g} rad/s it adds {added:g} N m, which drives the shafts"


# -- bearings and drags -------------------------------------------------------------------------------------


def bearing_contract(bearing: Any) -> Iterator[Check]:
    """What a bearing has to keep, by whether it sticks."""
    yield from (check_units, check_bearing_symbols, check_bearing_never_drives)
    yield check_holding_above_sliding if bearing.sticks else check_settles_to_its_sliding


def check_bearing_symbols(bearing: Any) -> None:
    """Torques are the same for numbers and symbols, and their slopes are finite, also at rest and unloaded."""

    def values(part: Any, load: Any, speed: Any) -> list:
        return [part.holding(load), part.sliding(load, speed), part.viscous_torque(speed)]

    for point in itertools.product(LOADS, SPEEDS):
        _compare(bearing, values, point)


def check_bearing_never_drives(bearing: Any) -> None:
    """Friction is not negative, and what is viscous opposes the motion."""
    for load, speed in itertools.product(LOADS, SPEEDS):
        held, rubbed = float(bearing.holding(load)), float(bearing.sliding(load, speed))
        power = float(bearing.viscous_torque(speed)) * speed + float(bearing.viscous_torque(-speed)) * -speed
        assert min(held, rubbed, -power) >= 0, (
            f"{_name(bearing)}: at {speed:g} rad/s and {load:g} N it holds with {held:g} N m, slides with {rubbed:g} "
            f"N m, and its viscous torque gives {power:g} W"
        )


def check_holding_above_sliding(bearing: Any) -> None:
    """What slides just off standstill is not held harder than it was at rest."""
    for load in LOADS:
        off, held = float(bearing.sliding(load, 0.0)), float(bearing.holding(load))
        assert off <= held * (1 + CLOSE), (
            f"{_name(bearing)}: sliding just off standstill {off:g} N m is above {held:g} N m"
        )


def check_settles_to_its_sliding(bearing: Any) -> None:
    """In steady motion, either way, the internal state settles and gives the torque of `sliding`."""
    for speed, direction in itertools.product((1e-4, 0.1), (1.0, -1.0)):
        at = (10.0, direction * speed)
        expected = direction * float(bearing.sliding(at[0], speed))
        _check_settles(
            bearing, expected, lambda m, at=at: bearing.rates(m, *at), lambda m, at=at: bearing.friction(m, *at)
        )


def drag_contract(drag: Any) -> Iterator[Check]:
    """What a drag has to keep."""
    yield from (check_units, check_drag)


def check_drag(drag: Any) -> None:
    """Its torque opposes the motion, vanishes at rest, and is the same for numbers and symbols."""
    fast = abs(float(drag.torque(SPEEDS[-1])))
    for speed in (*SPEEDS, *(-speed for speed in SPEEDS)):
        torque = float(drag.torque(speed))
        assert torque * speed <= 0, f"{_name(drag)}: {torque:g} N m at {speed:g} rad/s drives the shaft"
        assert speed or abs(torque) <= CLOSE * fast, f"{_name(drag)}: it has {torque:g} N m at rest"
        _compare(drag, lambda part, speed: [part.torque(speed)], (speed,))


# -- for all ------------------------------------------------------------------------------------------------


def check_units(part: Any) -> None:
    """Each number of it has a unit, without which no parameter is made of it."""
    if not is_dataclass(part):
        raise AssertionError(f"{_name(part)} is no dataclass, so it has no parameters")
    hints = get_type_hints(type(part))
    bare = [each.name for each in fields(part) if hints[each.name] in (float, float | None)]
    bare = [name for name in bare if unit_of(part, name) is None]
    assert not bare, f"{_name(part)}: {', '.join(bare)} has no unit: declare it, Annotated[float, Unit(...)]"


def _name(part: Any) -> str:
    return type(part).__name__


def _told(state: Sliding) -> str:
    side = "A" if state.a_drives else "B"
    return f"{state.speed:g} m/s, {state.force:g} N, {side} driving"


def _close(one: float, other: float) -> bool:
    return abs(one - other) <= CLOSE * max(1.0, abs(one), abs(other))


def _near(one: float, other: float) -> bool:
    return abs(one - other) <= SLOPE_CLOSE * max(abs(one), abs(other))


def _slope(function: Callable[[float], Any], at: float) -> float:
    step = SLOPE_STEP * abs(at)
    return (float(function(at + step)) - float(function(at - step))) / (2 * step)


def _having(part: Any, kind: type) -> Iterator[tuple[Any, str, Any]]:
    """Component, field and role of each number that has a role, in a part and in what it is made of."""
    for field in fields(part):
        value = getattr(part, field.name)
        yield from ((part, field.name, r) for r in roles_in(annotations(part)[field.name]) if isinstance(r, kind))
        if is_dataclass(value):
            yield from _having(value, kind)


def _symbolic(part: Any) -> tuple[Any, ca.SX, tuple[list[float], list[bool]]]:
    """A copy with symbols for its numbers, the symbols, and the numbers with whether each is breakaway friction."""
    symbols: list[ca.SX] = []
    numbers: tuple[list[float], list[bool]] = ([], [])

    def copied(part: Any) -> Any:
        if isinstance(part, Mapping):
            return {name: copied(each) for name, each in part.items()}
        if not is_dataclass(part) or isinstance(part, type):
            return part
        copy = object.__new__(type(part))
        for field in fields(part):
            value = getattr(part, field.name)
            if unit_of(part, field.name) is not None and value is not None:
                symbols.append(ca.SX.sym(field.name))
                numbers[0].append(float(value))
                numbers[1].append(any(isinstance(r, Breakaway) for r in roles_in(annotations(part)[field.name])))
                value = symbols[-1]
            object.__setattr__(copy, field.name, copied(value) if not isinstance(value, ca.SX) else value)
        return copy

    made = copied(part)
    return made, ca.vertcat(*symbols), numbers


def _compare(part: Any, laws: Callable[..., list], point: Sequence[float]) -> None:
    """Hold laws of numbers against the same laws of symbols, and their slopes over all of them against infinity."""
    copy, own, (numbers, _) = _symbolic(part)
    symbols = [ca.SX.sym("x") for _ in point]
    values = ca.SX(ca.vertcat(*laws(copy, *symbols)))
    slopes = ca.jacobian(values, ca.vertcat(*symbols, own))
    function = ca.Function("laws", [ca.vertcat(*symbols), own], [values, slopes])
    found, steep = (result.full() for result in function(ca.DM(list(point)), ca.DM(numbers)))
    expected = [float(value) for value in laws(part, *point)]
    for one, other in zip(found.ravel(), expected, strict=True):
        assert _close(one, other), (
            f"{_name(part)}: at {tuple(point)} it is {expected} for numbers, {found.ravel()} for symbols"
        )
    assert np.isfinite(steep).all(), f"{_name(part)}: a slope at {tuple(point)} is not finite"


def _check_settles(
    part: Any, expected: float, rates: Callable[[Sequence], list], friction: Callable[[Sequence], Any]
) -> None:
    """The internal state has a rate each, comes to rest at constant speed, and gives the friction that is expected."""
    memory = part.memory()
    start = [kept.initial for kept in memory]
    count = len(rates(start))
    assert memory and count == len(memory), f"{_name(part)}: it declares {len(memory)} states, and has {count} rates"
    scale = np.array([kept.nominal for kept in memory])
    solved = solve_ivp(
        lambda _, y: np.array([float(rate) for rate in rates(list(y * scale))]) / scale,
        (0.0, 1e3),
        np.array(start) / scale,
        method="LSODA",
        rtol=CLOSE,
        atol=CLOSE,
    )
    got = float(friction(list(solved.y[:, -1] * scale)))
    assert abs(got - expected) <= STEADY * abs(expected), (
        f"{_name(part)}: in steady motion its friction settles to {got:g}, and not to {expected:g}"
    )
