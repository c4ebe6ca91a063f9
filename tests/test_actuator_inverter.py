"""Inverter, bridge, modulation and DC link against hexagons drawn, pulses integrated, and energy balances."""

import math
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from oracles import gradient_in_symbols, in_symbols, numbers
from scipy.integrate import solve_ivp

from actuator.parts.bridge import Bridge
from actuator.parts.dc_link import BrakingChopper, DCLink
from actuator.parts.derating import OverheatDerating, UndervoltageDerating
from actuator.parts.inverter import Inverter
from actuator.parts.park import to_axes, to_phases
from actuator.parts.pmsm import PMSM
from actuator.parts.pwm import bridge_duties, carrier, duties, leg_voltages, pulse
from actuator.parts.rotor import Rotor, RotorDrag
from actuator.parts.saturation import Saturation
from actuator.system.parameters import parameterize

LINK = 300.0
CIRCLE = Inverter(dc_voltage=LINK, current_limit=20.0)
HEXAGON = replace(CIRCLE, limit="hexagon")
BRIDGE = Bridge(dead_time=2e-6, switching_frequency=10e3, threshold=0.5, forward_drop=0.8, on_resistance=0.05)
REAL = replace(CIRCLE, bridge=BRIDGE)
FOLDING = replace(
    CIRCLE,
    undervoltage=UndervoltageDerating(full=250.0, none=200.0),
    overheat=OverheatDerating(full=390.0, none=420.0),
)
EVERYTHING = replace(FOLDING, limit="hexagon", bridge=BRIDGE)

demands = st.tuples(numbers(-1000, 1000), numbers(-1000, 1000))
angles, currents = numbers(-7, 7), numbers(-20, 20)


# -- hexagon ------------------------------------------------------------------------------------------


@settings(deadline=None, max_examples=100)
@given(wanted=demands, angle=angles)
def test_hexagonal_limit_keeps_the_direction_and_ends_on_the_hexagon(wanted, angle):
    """A vector at angle a from a corner is at most (2/3 dc cos 30 deg)/cos(a - 30 deg) long, a from 0 to 60 deg."""
    size = math.hypot(*wanted)
    assume(size > 1e-3)
    got = HEXAGON.realize(list(wanted), angle)
    from_corner = (angle + math.atan2(wanted[1], wanted[0])) % (math.pi / 3)
    edge = LINK / math.sqrt(3) / math.cos(from_corner - math.pi / 6)
    assert got == pytest.approx([part * min(1, edge / size) for part in wanted], rel=1e-9, abs=1e-9)


@settings(deadline=None, max_examples=50)
@given(wanted=demands, angle=angles)
def test_hexagon_lies_around_the_circle_and_touches_it(wanted, angle):
    inside, outside = CIRCLE.realize(list(wanted)), HEXAGON.realize(list(wanted), angle)
    assert math.hypot(*outside) >= math.hypot(*inside) * (1 - 1e-12)
    assert HEXAGON.realize(inside, angle) == pytest.approx(inside)
    assert math.hypot(*HEXAGON.realize([1e4, 0.0], 0.0)) == pytest.approx(2 / 3 * LINK)
    assert math.hypot(*HEXAGON.realize([1e4, 0.0], math.pi / 6)) == pytest.approx(LINK / math.sqrt(3))


def test_limits_follow_the_voltage_of_the_link():
    assert CIRCLE.realize([1e3, 0.0], dc_voltage=150.0) == pytest.approx([150 / math.sqrt(3), 0])
    assert HEXAGON.realize([1e3, 0.0], 0.0, dc_voltage=150.0) == pytest.approx([100, 0])
    assert HEXAGON.realize([120.0, 0.0], 0.0, dc_voltage=150.0) == pytest.approx([100, 0])
    assert CIRCLE.realize([100.0, 0.0], dc_voltage=150.0) == pytest.approx([150 / math.sqrt(3), 0])
    assert [CIRCLE.realize([v], dc_voltage=150.0) for v in (-200.0, 100.0, 200.0)] == [[-150], [100], [150]]
    assert HEXAGON.realize([-1e3]) == [-300]  # one axis has no angle


# -- bridge -------------------------------------------------------------------------------------------


def test_ideal_bridge_changes_nothing_and_a_bridge_of_zeros_neither():
    zero = replace(CIRCLE, bridge=Bridge(dead_time=0.0, switching_frequency=1e4, threshold=1.0))
    for inverter in (CIRCLE, zero):
        assert inverter.terminal_voltages([30.0, -40.0], [3.0, 4.0], 0.3) == [30.0, -40.0]
        assert inverter.terminal_voltages([30.0], [3.0]) == [30.0]
        assert inverter.conduction_loss([3.0, 4.0], 0.3) == 0


@pytest.mark.parametrize("current", [4.0, -4.0, 0.2, 0.0])
def test_error_of_one_leg_by_hand(current):
    """2 us at 10 kHz and 300 V: 6 V, opposed to the current; below half an ampere in proportion."""
    direction = max(-1, min(1, current / 0.5))
    assert BRIDGE.error(current, LINK) == pytest.approx(-(6.0 + 0.8) * direction - 0.05 * current)
    assert BRIDGE.error(current, LINK / 2) == pytest.approx(-(3.0 + 0.8) * direction - 0.05 * current)


def test_dead_time_is_the_part_of_the_period_in_which_the_diode_decides():
    """Positive current: the leg rises late by the dead time; integrated over one period's pulse."""
    ratio, period = 0.6, 1 / BRIDGE.switching_frequency
    rise, fall = pulse(ratio)
    t = (np.arange(200_000) + 0.5) / 200_000
    late = (t > rise + BRIDGE.dead_time / period) & (t <= fall)
    ideal = (t > rise) & (t <= fall)
    lossless = replace(BRIDGE, forward_drop=0.0, on_resistance=0.0)
    assert (late.mean() - ideal.mean()) * LINK == pytest.approx(lossless.error(5.0, LINK), rel=1e-3)


@settings(deadline=None, max_examples=50)
@given(current=st.tuples(currents, currents), angle=angles)
def test_bridge_takes_power_and_its_heat_is_its_conduction(current, angle):
    taken = -1.5 * np.dot(REAL.terminal_voltages([0.0, 0.0], list(current), angle), current)
    dead = replace(REAL, bridge=replace(BRIDGE, forward_drop=0.0, on_resistance=0.0))
    by_dead_time = -1.5 * np.dot(dead.terminal_voltages([0.0, 0.0], list(current), angle), current)
    loss = REAL.conduction_loss(list(current), angle)
    assert loss >= 0 and by_dead_time >= 0
    assert taken == pytest.approx(loss + by_dead_time, rel=1e-9, abs=1e-9)
    assert dead.conduction_loss(list(current), angle) == 0


def test_large_current_loses_the_fundamental_of_a_square_wave():
    """4/pi times the error of one leg, opposite to the current, averaged over a turn; Jeong & Park."""
    lossless = replace(REAL, bridge=replace(BRIDGE, threshold=1e-6, forward_drop=0.0, on_resistance=0.0))
    turn = (np.arange(3600) + 0.5) * 2 * math.pi / 3600  # the legs change over between these points
    mean = np.mean([lossless.terminal_voltages([0.0, 0.0], [0.0, 10.0], angle) for angle in turn], axis=0)
    assert mean == pytest.approx([0, -4 / math.pi * 6.0], abs=1e-3)


def test_a_dc_motor_hangs_between_two_legs():
    assert REAL.terminal_voltages([50.0], [4.0]) == pytest.approx([50 + 2 * BRIDGE.error(4.0, LINK)])
    assert REAL.conduction_loss([4.0]) == pytest.approx(2 * (0.8 * 4 + 0.05 * 16))


# -- current ------------------------------------------------------------------------------------------


def test_current_folds_back_in_a_straight_line():
    limits = [FOLDING.current_limit_at(dc_voltage=voltage) for voltage in (300.0, 250.0, 225.0, 200.0, 100.0)]
    assert limits == pytest.approx([20, 20, 10, 0, 0])
    limits = [FOLDING.current_limit_at(temperature=kelvin) for kelvin in (300.0, 390.0, 405.0, 420.0, 500.0)]
    assert limits == pytest.approx([20, 20, 10, 0, 0])
    assert FOLDING.current_limit_at(225.0, 405.0) == pytest.approx(5)
    assert FOLDING.allow(-30.0, 225.0, 405.0) == pytest.approx(-5)
    assert FOLDING.allow(-30.0) == CIRCLE.allow(-30.0, 100.0, 500.0) == -20


# -- switching ----------------------------------------------------------------------------------------


def averaged(ratios, count=20_000):
    """Leg voltages, integrated numerically over one period of the carrier."""
    parts = (np.arange(count) + 0.5) / count
    return np.mean([leg_voltages(ratios, part, LINK) for part in parts], axis=0)


@settings(deadline=None, max_examples=15)
@given(wanted=st.tuples(numbers(-200, 200), numbers(-200, 200)), angle=angles)
def test_switched_legs_give_the_averaged_voltage(wanted, angle):
    realized = HEXAGON.realize(list(wanted), angle)
    ratios = duties(to_phases(realized, angle), LINK)
    assert -1e-9 <= min(ratios) and max(ratios) <= 1 + 1e-9
    assert min(ratios) + max(ratios) == pytest.approx(1)  # centered
    assert to_axes(list(averaged(ratios)), angle) == pytest.approx(realized, abs=2 * LINK / 20_000)


@settings(deadline=None, max_examples=50)
@given(wanted=st.tuples(numbers(-200, 200), numbers(-200, 200)), angle=angles)
def test_switching_instants_give_the_averaged_voltage_exactly(wanted, angle):
    realized = HEXAGON.realize(list(wanted), angle)
    pulses = [pulse(ratio) for ratio in duties(to_phases(realized, angle), LINK)]
    legs = [(high.fall - high.rise - 0.5) * LINK for high in pulses]
    assert to_axes(legs, angle) == pytest.approx(realized, abs=1e-9)


@settings(deadline=None, max_examples=50)
@given(ratio=numbers(0.01, 0.99))
def test_a_leg_switches_where_its_pulse_says(ratio):
    rise, fall = pulse(ratio)
    assert carrier(rise) == pytest.approx(ratio) and carrier(fall) == pytest.approx(ratio)
    states = [leg_voltages([ratio], part, LINK)[0] for part in (rise - 1e-6, rise + 1e-6, fall - 1e-6, fall + 1e-6)]
    assert states == [-150, 150, 150, -150]


def test_two_legs_give_a_dc_motor_its_voltage():
    for voltage in (-300.0, -20.0, 0.0, 120.0):
        high, low = averaged(bridge_duties(voltage, LINK))
        assert high - low == pytest.approx(voltage, abs=0.1)


# -- DC link ------------------------------------------------------------------------------------------

CHOPPER = BrakingChopper(resistance=20.0, start=310.0, full=330.0)
BATTERY = DCLink(source_voltage=300.0, source_resistance=0.5, capacitance=1e-3)
RECTIFIER = replace(BATTERY, source="rectifier", chopper=CHOPPER)


@pytest.mark.parametrize("link", (BATTERY, RECTIFIER), ids=("battery", "rectifier with chopper"))
@settings(deadline=None, max_examples=50)
@given(voltage=numbers(100, 400), drawn=numbers(-50, 50))
def test_power_of_the_source_is_heat_stored_or_drawn(link, voltage, drawn):
    powers = link.powers(voltage)
    stored = link.capacitance * voltage * link.rate(voltage, drawn)
    assert min(powers.source_loss, powers.chopper_loss) >= 0
    assert powers.source == pytest.approx(sum(powers[1:]) + stored + voltage * drawn, abs=1e-6)


def test_link_sags_under_load_with_its_time_constant():
    run = solve_ivp(lambda _, u: [BATTERY.rate(u[0], 40.0)], (0, 1e-3), [300.0], rtol=1e-10, atol=1e-9)
    assert run.y[0, -1] == pytest.approx(300 - 20 * (1 - math.exp(-1e-3 / (0.5 * 1e-3))), abs=1e-6)
    assert in_symbols(BATTERY.energy, 300.0) == BATTERY.energy(300.0) == 45.0


def test_braking_settles_where_the_chopper_takes_it():
    """5 A back: duty u/R = 5 A with duty = (u - 310)/20 is a quadratic."""
    run = solve_ivp(lambda _, u: [RECTIFIER.rate(u[0], -5.0)], (0, 1.0), [300.0], method="LSODA", rtol=1e-9, atol=1e-9)
    assert run.y[0, -1] == pytest.approx((310 + math.sqrt(310**2 + 4 * 5 * 20 * 20)) / 2, abs=1e-5)
    assert RECTIFIER.source_current(run.y[0, -1]) == 0
    assert BATTERY.rate(302.5, -5.0) == pytest.approx(0)  # a battery takes it back
    assert [CHOPPER.current(voltage) for voltage in (300.0, 320.0, 340.0)] == pytest.approx([0, 8, 17])


# -- the whole electrical side ------------------------------------------------------------------------

MOTOR = PMSM(
    pole_pairs=3,
    resistance=0.8,
    inductance_d=4e-3,
    inductance_q=8e-3,
    flux=0.1,
    inertia=1e-4,
    rotor=Rotor(drag=RotorDrag(eddy=2e-4, viscous=1e-4)),
    saturation=Saturation(lost_q=4e-3, current_d=15.0, current_q=10.0),
)


@settings(deadline=None, max_examples=50)
@given(
    current=st.tuples(currents, currents),
    wanted=demands,
    angle=angles,
    speed=numbers(-500, 500),
    link_voltage=numbers(250, 350),
)
def test_power_of_the_source_reaches_the_shaft_or_is_accounted_for(current, wanted, angle, speed, link_voltage):
    inverter, i = EVERYTHING, list(current)
    realized = inverter.realize(list(wanted), angle, link_voltage)
    terminal = inverter.terminal_voltages(realized, i, angle, link_voltage)
    conduction = inverter.conduction_loss(i, angle)
    drawn = (MOTOR.electrical_power(i, terminal) + conduction) / link_voltage
    in_link = RECTIFIER.capacitance * link_voltage * RECTIFIER.rate(link_voltage, drawn)
    slopes = gradient_in_symbols(lambda d, q: MOTOR.magnetic_energy([d, q]), *i)
    in_iron = slopes @ MOTOR.derivatives(i, terminal, speed)
    powers = RECTIFIER.powers(link_voltage)
    heat = powers.source_loss + powers.chopper_loss + conduction + sum(MOTOR.losses(i, speed))
    shaft = MOTOR.shaft_torque(i, 0.0, speed) * speed
    scale = abs(in_link) + abs(in_iron) + heat + abs(shaft)
    assert heat + shaft + in_link + in_iron == pytest.approx(powers.source, abs=1e-9 * scale + 1e-9)


# -- symbols and errors -------------------------------------------------------------------------------


def laws(inverter, *values):
    d, q, angle, link, kelvin = values
    realized = inverter.realize([d, q], angle, link)
    return [
        *realized,
        *inverter.terminal_voltages(realized, [3.0, -4.0], angle, link),
        inverter.conduction_loss([3.0, -4.0], angle),
        inverter.allow(30.0, link, kelvin),
        *leg_voltages(duties(to_phases(realized, angle), link), 0.3, link),
    ]


@pytest.mark.parametrize("at", [(250.0, 150.0, 0.4, 240.0, 400.0), (20.0, -5.0, 4.0, 300.0, 300.0)])
def test_inverters_are_the_same_in_numbers_and_in_symbols(at):
    assert in_symbols(lambda *values: laws(EVERYTHING, *values), *at) == pytest.approx(laws(EVERYTHING, *at))
    copy, found = parameterize(EVERYTHING, "inverter")
    value = ca.Function("value", [p.symbol for p in found], [ca.vertcat(*laws(copy, *at))])(*(p.default for p in found))
    assert np.array(value).ravel() == pytest.approx(laws(EVERYTHING, *at))
    assert {"inverter.bridge.dead_time", "inverter.overheat.none"} <= {p.name for p in found}


def test_links_are_the_same_in_numbers_and_in_symbols():
    def both(link, voltage):
        return [link.rate(voltage, 7.0), *link.powers(voltage)]

    copy, found = parameterize(RECTIFIER, "link")
    for at in (290.0, 325.0):
        built = ca.Function("value", [p.symbol for p in found], [ca.vertcat(*both(copy, at))])
        assert np.array(built(*(p.default for p in found))).ravel() == pytest.approx(both(RECTIFIER, at))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: HEXAGON.realize([1.0, 2.0]), "a hexagonal limit needs the electrical angle .* pass `angle`"),
        (lambda: REAL.terminal_voltages([1.0, 2.0], [1.0, 2.0]), "a bridge needs the electrical angle .* pass `angle`"),
        (lambda: replace(CIRCLE, limit="square"), "Inverter.limit must be one of circle, hexagon, got 'square'"),
        (lambda: replace(CIRCLE, current_limit=0.0), "Inverter.current_limit must be > 0 A, got 0 A"),
        (
            lambda: replace(BRIDGE, dead_time=60e-6),
            "Bridge.dead_time must be < 5e-05 s, half a period of 10000 Hz, got 6e-05 s",
        ),
        (lambda: replace(BRIDGE, threshold=0.0), "Bridge.threshold must be > 0 A, got 0 A"),
        (
            lambda: UndervoltageDerating(full=200.0, none=250.0),
            "UndervoltageDerating.none must be < 200 V, `full`, got 250 V",
        ),
        (lambda: OverheatDerating(full=420.0, none=390.0), "OverheatDerating.none must be > 420 K, `full`, got 390 K"),
        (
            lambda: replace(CHOPPER, full=305.0),
            "BrakingChopper.full must be > 310 V, `start`, got 305 V",
        ),
        (lambda: replace(RECTIFIER, source="mains"), "DCLink.source must be one of battery, rectifier, got 'mains'"),
        (
            lambda: replace(RECTIFIER, source_voltage=320.0),
            "DCLink.chopper.start must be > 320 V, the source's voltage, or it never rests; got 310 V",
        ),
    ],
)
def test_what_has_no_meaning_is_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()
