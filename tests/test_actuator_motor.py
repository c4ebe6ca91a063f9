"""Motors against energy balances, coenergy, circuits at the terminals, data sheets and another simulator."""

import math
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import gradient_in_symbols, in_symbols, numbers
from scipy.integrate import solve_ivp

from actuator.parts.current_source import CurrentSource
from actuator.parts.dc_motor import DCMotor
from actuator.parts.park import to_axes, to_phases
from actuator.parts.pmsm import PMSM
from actuator.parts.rotor import Cogging, Rotor, RotorDrag
from actuator.parts.saturation import Saturation
from actuator.parts.temperature import COPPER, MotorTemperature, TemperatureDependence
from actuator.system.parameters import parameterize

ROTOR = Rotor(
    cogging=Cogging(amplitude=0.02, periods=24, phase=0.3), drag=RotorDrag(eddy=2e-4, viscous=1e-4, windage=1e-7)
)
WARM = TemperatureDependence(copper=3.93e-3, magnet=-1.2e-3, reference=293.15)
SATURATION = Saturation(lost_q=5e-3, current_d=20.0, current_q=12.0, magnet_current=15.0)

IDEAL = PMSM(pole_pairs=3, resistance=0.8, inductance_d=4e-3, inductance_q=8e-3, flux=0.1, inertia=1e-4)
REAL = replace(IDEAL, rotor=ROTOR, temperature_dependence=WARM)
SATURATED = replace(REAL, saturation=SATURATION)
BRUSHED = DCMotor(resistance=0.7, inductance=1e-3, torque_constant=0.06, inertia=2e-5)
REAL_BRUSHED = replace(BRUSHED, rotor=ROTOR, temperature_dependence=WARM)

currents, voltages, speeds, kelvins = numbers(-50, 50), numbers(-300, 300), numbers(-1000, 1000), numbers(220, 420)
every_motor = pytest.mark.parametrize("motor", (REAL, SATURATED, REAL_BRUSHED), ids=("salient", "saturated", "brushed"))


def slope(function, at, along, step=1e-4):
    """Central difference of a function of a vector."""
    at, along = np.array(at), np.array(along)
    return (function(list(at + step * along)) - function(list(at - step * along))) / (2 * step)


# -- energy -------------------------------------------------------------------------------------------


@every_motor
@settings(deadline=None, max_examples=100)
@given(
    current=st.tuples(currents, currents),
    voltage=st.tuples(voltages, voltages),
    speed=speeds,
    angle=numbers(-7, 7),
    kelvin=st.tuples(kelvins, kelvins),
)
def test_electrical_power_is_shaft_power_losses_and_stored_energy(motor, current, voltage, speed, angle, kelvin):
    """By casadi's derivative of the energies along the motion; none of the motor's own derivatives is trusted."""
    count, temperature = len(motor.axes), MotorTemperature(*kelvin)
    i, v = list(current)[:count], list(voltage)[:count]
    rates = motor.derivatives(i, v, speed, temperature)
    stored = gradient_in_symbols(lambda *i: motor.magnetic_energy(list(i)), *i) @ rates
    stored += gradient_in_symbols(motor.rotor.energy, angle)[0] * speed
    shaft = motor.shaft_torque(i, angle, speed, temperature) * speed
    balance = shaft + sum(motor.losses(i, speed, temperature)) + stored
    scale = abs(shaft) + abs(stored) + sum(motor.losses(i, speed, temperature))
    assert balance == pytest.approx(motor.electrical_power(i, v), rel=1e-9, abs=1e-9 * scale + 1e-9)


@settings(deadline=None, max_examples=50)
@given(current=st.tuples(currents, currents))
def test_inductances_are_the_slopes_of_the_flux_linkages(current):
    found = in_symbols(
        lambda d, q: ca.vec(ca.jacobian(ca.vertcat(*SATURATED.flux_linkages([d, q])), ca.vertcat(d, q))), *current
    )
    own = SATURATED.inductances(list(current))
    assert [own.d, own.mutual, own.mutual, own.q] == pytest.approx(found, rel=1e-9, abs=1e-15)
    assert own.d > 0 and own.d * own.q > own.mutual**2


@settings(deadline=None, max_examples=50)
@given(current=st.tuples(currents, currents))
def test_lost_flux_is_the_slope_of_its_coenergy(current):
    found = gradient_in_symbols(SATURATION.lost_coenergy, *current)
    assert SATURATION.lost_flux(*current) == pytest.approx(found, rel=1e-9, abs=1e-12)


def test_saturation_takes_nothing_at_rest_and_its_share_at_large_current():
    assert SATURATED.flux_linkages([0.0, 0.0]) == [0.1, 0.0]
    assert SATURATION.lost_coenergy(0.0, 0.0) == 0
    large = SATURATED.inductances([0.0, 1e6])
    assert large.q == pytest.approx(8e-3 - 5e-3, rel=1e-6)
    assert large.d == pytest.approx(4e-3 - 5e-3 * (12 / 20) ** 2, rel=1e-3)


def test_saturation_by_hand_and_through_the_axes():
    """One axis without magnets is psi = L_end i + lost i/sqrt(1 + (i/I)^2); the other axis weakens it."""
    plain = replace(SATURATED, saturation=replace(SATURATION, magnet_current=0.0), temperature_dependence=None)
    assert plain.flux_linkages([0.0, 9.0])[1] == pytest.approx(3e-3 * 9 + 5e-3 * 9 / math.sqrt(1 + (9 / 12) ** 2))
    assert plain.flux_linkages([30.0, 9.0])[1] < plain.flux_linkages([0.0, 9.0])[1]
    assert plain.flux_linkages([-30.0, 9.0])[1] == plain.flux_linkages([30.0, 9.0])[1]
    # against the magnets, direct current desaturates
    assert SATURATED.flux_linkages([-15.0, 9.0])[1] > SATURATED.flux_linkages([0.0, 9.0])[1]


def test_torque_of_a_saturated_motor_is_the_slope_of_its_coenergy_over_the_angle():
    """Phase currents held, the rotor turned: energy stored plus work done is what the phases take, 3/2 i psi."""
    phase_currents = to_phases([-6.0, 14.0], 0.4)

    def coenergy(angle):
        d, q = to_axes(phase_currents, angle[0])
        flux_d, flux_q = SATURATED.flux_linkages([d, q])
        return 1.5 * (d * flux_d + q * flux_q) - SATURATED.magnetic_energy([d, q])

    assert 3 * slope(coenergy, [0.4], [1.0]) == pytest.approx(SATURATED.torque([-6.0, 14.0]), rel=1e-6)


# -- what the rotor adds ------------------------------------------------------------------------------


@settings(deadline=None, max_examples=50)
@given(angle=numbers(-10, 10))
def test_cogging_is_the_slope_of_its_energy_and_repeats(angle):
    cogging = ROTOR.cogging
    assert -gradient_in_symbols(cogging.energy, angle)[0] == pytest.approx(cogging.torque(angle), abs=1e-12)
    assert cogging.torque(angle + 2 * math.pi / 24) == pytest.approx(cogging.torque(angle), abs=1e-12)


def test_cogging_of_twelve_slots_and_ten_poles_comes_sixty_times_a_turn_and_holds():
    cogging = Cogging.of_slots(amplitude=0.1, slots=12, poles=10)
    assert cogging == Cogging(amplitude=0.1, periods=60)
    assert cogging.torque(math.pi / 120) == pytest.approx(-0.1)
    assert cogging.torque(-math.pi / 120) == pytest.approx(0.1)


@settings(deadline=None, max_examples=50)
@given(speed=speeds)
def test_drag_turns_its_power_into_heat(speed):
    drag = ROTOR.drag
    assert -drag.torque(speed) * speed == pytest.approx(drag.iron_loss(speed) + drag.friction_loss(speed))
    assert drag.torque(-speed) == -drag.torque(speed)
    assert drag.torque(100.0) == pytest.approx(-(2e-4 + 1e-4 + 1e-7 * 100) * 100)


@pytest.mark.parametrize("plain", (IDEAL, BRUSHED), ids=("synchronous", "brushed"))
@settings(deadline=None, max_examples=20)
@given(current=st.tuples(currents, currents), speed=speeds, angle=numbers(-7, 7))
def test_every_imperfection_of_size_zero_is_exactly_the_ideal_motor(plain, current, speed, angle):
    none = Rotor(cogging=Cogging(amplitude=0.0, periods=6), drag=RotorDrag())
    constant = TemperatureDependence(copper=0.0, magnet=0.0)
    dressed = replace(plain, rotor=none, temperature_dependence=constant)
    i, v = list(current)[: len(plain.axes)], [10.0, 20.0][: len(plain.axes)]
    hot = MotorTemperature(400.0, 380.0)
    assert dressed.derivatives(i, v, speed, hot) == plain.derivatives(i, v, speed)
    assert dressed.shaft_torque(i, angle, speed, hot) == plain.torque(i) == plain.shaft_torque(i, angle, speed)
    assert dressed.losses(i, speed, hot) == plain.losses(i, speed)


# -- temperature --------------------------------------------------------------------------------------


def test_a_hot_winding_has_more_resistance_and_a_hot_magnet_less_flux():
    hot = MotorTemperature(winding=393.15, magnet=353.15)
    assert REAL.resistance_at(hot) == pytest.approx(0.8 * 1.393)
    assert REAL.flux_at(hot) == pytest.approx(0.1 * (1 - 0.072))
    assert REAL_BRUSHED.torque([2.0], hot) == pytest.approx(0.06 * 2 * (1 - 0.072))
    assert REAL.torque([0.0, 5.0], hot) == pytest.approx(1.5 * 3 * 0.1 * 5 * (1 - 0.072))
    assert REAL.losses([3.0, 4.0], 0.0, hot).copper == pytest.approx(1.5 * 0.8 * 1.393 * 25)


def test_without_a_temperature_the_numbers_are_those_of_the_reference():
    at_reference = MotorTemperature(293.15, 293.15)
    assert REAL.resistance_at() == REAL.resistance_at(at_reference) == 0.8
    assert IDEAL.flux_at(MotorTemperature(400.0, 400.0)) == 0.1


def test_copper_follows_its_standard():
    """IEC 60034-1: R2/R1 = (235 + t2)/(235 + t1) for copper, t in degC."""
    law = TemperatureDependence(copper=COPPER)
    for celsius in (-55, 0, 100, 155):
        factor = law.resistance_factor(MotorTemperature(273.15 + celsius, 293.15))
        assert factor == pytest.approx((235 + celsius) / (235 + 20), rel=2e-3)


# -- data sheets --------------------------------------------------------------------------------------

# maxon RE 40, 150 W, order number 148867, catalog values
RE40 = DCMotor.from_data_sheet(
    terminal_resistance_ohm=0.299,
    terminal_inductance_mH=0.0823,
    rotor_inertia_gcm2=142.0,
    torque_constant_mNm_per_A=30.2,
)


def test_maxon_re_40_has_the_stall_and_dynamics_of_its_data_sheet():
    """24 V: stall 80.2 A and 2420 mNm, 317 rpm/V, 3.14 rpm/mNm, mechanical time constant 4.67 ms."""
    assert RE40.derivatives([80.2], [24.0], 0.0)[0] * RE40.inductance == pytest.approx(0, abs=0.05)
    assert RE40.torque([80.2]) == pytest.approx(2.42, rel=1e-3)
    assert RE40.torque_constant == pytest.approx(60 / (2 * math.pi * 317), rel=3e-3)
    gradient = RE40.resistance / RE40.torque_constant**2
    assert gradient * 60 / (2 * math.pi) / 1000 == pytest.approx(3.14, rel=5e-3)
    assert gradient * RE40.inertia == pytest.approx(4.67e-3, rel=5e-3)


def test_maxon_re_40_by_its_speed_constant_is_the_same_motor():
    by_speed = DCMotor.from_data_sheet(
        terminal_resistance_ohm=0.299,
        terminal_inductance_mH=0.0823,
        rotor_inertia_gcm2=142.0,
        speed_constant_rpm_per_V=317.0,
    )
    assert by_speed.torque_constant == pytest.approx(RE40.torque_constant, rel=3e-3)
    no_load = by_speed.derivatives([0.0], [1.0], 317 * 2 * math.pi / 60)
    assert no_load == pytest.approx([0.0], abs=1e-9)


SHEET = {"pole_pairs": 5, "resistance_line_to_line": 1.2, "inductance_line_to_line": 3e-3, "inertia": 1e-4}
EMF = 0.4  # V s/rad, line to line, rms


@pytest.mark.parametrize(
    "constant",
    [
        {"voltage_constant_line_to_line_rms": EMF},
        {"torque_constant_per_A_rms": math.sqrt(3) * EMF},
        {"torque_constant_per_A_peak": math.sqrt(3 / 2) * EMF},
    ],
    ids=lambda constant: next(iter(constant)),
)
def test_constants_of_any_convention_give_one_motor(constant):
    """Measured as on the bench: torque of sinusoidal currents of 1 A rms, and the open terminals of a driven motor."""
    motor = PMSM.from_data_sheet(**SHEET, **constant)
    emf = motor.coupling_voltages([0.0, 0.0], 100.0)
    turn = [to_phases(emf, angle) for angle in np.arange(20) * 2 * math.pi / 20]
    assert np.sqrt(np.mean([(a - b) ** 2 for a, b, _ in turn])) == pytest.approx(100 * EMF, rel=1e-12)
    assert motor.torque([0.0, math.sqrt(2)]) == pytest.approx(math.sqrt(3) * EMF, rel=1e-12)


def test_voltage_constants_of_a_published_motor_agree_with_its_torque_constant():
    """Modelica's ActuatorWithNoise: 112.3 V rms per phase at 50 Hz, 2 pole pairs, 2.145 N m per A rms."""
    emf = math.sqrt(3) * 112.3 / (2 * math.pi * 50 / 2)
    motor = PMSM.from_data_sheet(**{**SHEET, "pole_pairs": 2}, voltage_constant_line_to_line_rms=emf)
    assert motor.torque([0.0, math.sqrt(2)]) == pytest.approx(2.145, rel=2e-4)
    assert motor.flux == pytest.approx(112.3 * math.sqrt(2) / (2 * math.pi * 50))


@pytest.mark.parametrize("angle", np.arange(0, 6.3, 0.7))
def test_terminals_have_the_resistance_and_inductance_of_the_data_sheet(angle):
    """Current in at terminal a, out at b, rotor held at some angle; c open."""
    sheet = {**SHEET, "largest_inductance_line_to_line": 5e-3}
    motor = PMSM.from_data_sheet(**sheet, torque_constant_per_A_rms=1.0)
    axes = to_axes([1.0, -1.0, 0.0], angle)
    flux = np.array(motor.flux_linkages(axes)) - motor.flux_linkages([0.0, 0.0])
    a, b, _ = to_phases(list(flux), angle)
    assert motor.losses(axes, 0.0).copper == pytest.approx(1.2)
    assert 3e-3 - 1e-12 <= a - b <= 5e-3 + 1e-12
    assert a - b == pytest.approx(4e-3 + 1e-3 * math.cos(2 * (angle - math.pi / 3)))


DRIVE = PMSM(pole_pairs=3, resistance=3.6, inductance_d=0.036, inductance_q=0.051, flux=0.545, inertia=0.015)
DUTIES = (
    (0.529774344, 0.575799234, 0.424200766),
    (0.548607024, 0.646457461, 0.353542539),
    (0.551786991, 0.694143564, 0.305856436),
    (0.546576145, 0.727230049, 0.272769951),
    (0.537207447, 0.750845106, 0.249154894),
    (0.525471907, 0.766567807, 0.233432193),
    (0.51258978, 0.775596888, 0.224403112),
    (0.499542057, 0.779255569, 0.220744431),
)


def test_a_published_drive_moves_as_in_another_simulator():
    """motulator 0.18's 2.2 kW interior PMSM at 540 V: the first 8 of its 125 us samples after a step of the speed."""

    def rates(_, x, legs):
        d, q, speed, angle = x
        electrical = DRIVE.derivatives([d, q], to_axes(legs, 3 * angle), speed)
        return [*electrical, DRIVE.torque([d, q]) / DRIVE.inertia, speed]

    state = [0.0, 0.0, 0.0, 0.0]
    for ratios in DUTIES:
        legs = [540 * ratio for ratio in ratios]
        state = solve_ivp(rates, (0, 125e-6), state, args=(legs,), rtol=1e-10, atol=1e-12).y[:, -1]
    assert state[:3] == pytest.approx([0.2961746809, 2.5453182502, 0.1733985371], rel=1e-7)


def test_a_published_drive_settles_at_the_torque_of_its_load():
    """14 N m at the currents that motulator's run settles at."""
    assert DRIVE.torque([-0.8348, 5.5813]) == pytest.approx(14.0, rel=1e-3)


# -- current source -----------------------------------------------------------------------------------


def test_current_source_follows_with_its_lag_or_at_once():
    lagging = CurrentSource(torque_constant=2.0, inertia=1e-3, lag=1e-3, torque_limit=10.0)
    assert lagging.axes == ("current",)
    assert lagging.derivatives([1.0], 3.0) == [2.0 / 1e-3]
    assert [lagging.allow_torque(torque) for torque in (-18.0, 8.0, 12.0)] == [-10.0, 8.0, 10.0]
    assert lagging.torque([lagging.current_for(3.0)]) == 3.0
    at_once = CurrentSource(torque_constant=2.0, inertia=1e-3)
    assert (at_once.axes, at_once.derivatives([], 3.0), at_once.allow_torque(1e9)) == ((), [], 1e9)
    dragging = replace(at_once, rotor=ROTOR)
    assert dragging.shaft_torque([1.0], 0.2, 50.0) == 2.0 + ROTOR.torque(0.2, 50.0)


# -- axes, symbols and errors -------------------------------------------------------------------------


@settings(deadline=None, max_examples=50)
@given(axes=st.tuples(currents, currents), angle=numbers(-7, 7), common=currents)
def test_axes_become_phases_and_come_back(axes, angle, common):
    phases = to_phases(list(axes), angle)
    assert sum(phases) == pytest.approx(0, abs=1e-9)
    assert to_axes([phase + common for phase in phases], angle) == pytest.approx(axes, abs=1e-9)


def test_the_d_axis_at_angle_zero_is_phase_a_and_q_is_a_quarter_ahead():
    assert to_phases([1.0, 0.0], 0.0) == pytest.approx([1, -0.5, -0.5])
    assert to_phases([0.0, 1.0], -math.pi / 2) == pytest.approx([1, -0.5, -0.5])


@pytest.mark.parametrize(
    "motor", (REAL, SATURATED, REAL_BRUSHED, CurrentSource(torque_constant=2.0, inertia=1e-3, lag=1e-3, rotor=ROTOR))
)
def test_motors_are_the_same_in_numbers_and_in_symbols(motor):
    def everything(part):
        i, hot = [-3.0, 5.0][: len(part.axes)], MotorTemperature(350.0, 330.0)
        if isinstance(part, CurrentSource):
            return [part.shaft_torque(i, 0.3, 80.0), *part.derivatives(i, 7.0)]
        rates = part.derivatives(i, [10.0, 20.0][: len(i)], 80.0, hot)
        return [part.shaft_torque(i, 0.3, 80.0, hot), *rates, *part.losses(i, 80.0, hot), part.magnetic_energy(i)]

    copy, found = parameterize(motor, "motor")
    value = ca.Function("value", [p.symbol for p in found], [ca.vertcat(*everything(copy))])(
        *(p.default for p in found)
    )
    assert np.array(value).ravel() == pytest.approx(everything(motor))
    assert "motor.rotor.cogging.amplitude" in [p.name for p in found]


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Cogging(amplitude=-1.0, periods=6), "Cogging.amplitude must be >= 0 N m, got -1 N m"),
        (lambda: Cogging(amplitude=1.0, periods=0), "Cogging.periods must be a whole number >= 1, got 0"),
        (lambda: RotorDrag(eddy=-1.0), "RotorDrag.eddy must be >= 0 N m s/rad, got -1 N m s/rad"),
        (
            lambda: replace(IDEAL, saturation=replace(SATURATION, lost_q=9e-3)),
            "PMSM.saturation must leave an inductance: lost_q must be < 0.008 H, the motor's inductance_q, got 0.009 H",
        ),
        (
            lambda: replace(IDEAL, saturation=Saturation(lost_q=5e-3, current_d=10.0, current_q=10.0)),
            "lost_d must be < 0.004 H, the motor's inductance_d, got 0.005 H",
        ),
        (
            lambda: PMSM.from_data_sheet(**SHEET, torque_constant_per_A_rms=1.0, torque_constant_per_A_peak=1.0),
            "PMSM.from_data_sheet needs one of torque_constant_per_A_rms, torque_constant_per_A_peak, "
            "voltage_constant_line_to_line_rms; got torque_constant_per_A_rms, torque_constant_per_A_peak",
        ),
        (lambda: PMSM.from_data_sheet(**SHEET), "got none"),
        (
            lambda: DCMotor.from_data_sheet(
                terminal_resistance_ohm=1.0, terminal_inductance_mH=1.0, rotor_inertia_gcm2=1.0
            ),
            "needs one of torque_constant_mNm_per_A, speed_constant_rpm_per_V; got None and None",
        ),
        (lambda: CurrentSource(torque_constant=1.0, inertia=1.0, lag=0.0), "CurrentSource.lag must be > 0 s, got 0 s"),
        (lambda: TemperatureDependence(reference=-1.0), "TemperatureDependence.reference must be > 0 K, got -1 K"),
    ],
)
def test_motors_without_meaning_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()
