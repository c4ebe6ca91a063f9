"""Motors, inverter, load, signals and parameters against phasors, power balances, direct evaluation and numpy."""

import math

import casadi as ca
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from oracles import PAPER_PAIR, in_symbols, numbers

from actuator.parts.dc_motor import DCMotor
from actuator.parts.inverter import Inverter
from actuator.parts.load import Load
from actuator.parts.pmsm import PMSM
from actuator.parts.torque_source import TorqueSource
from actuator.simulation.signals import (
    Chirp,
    Constant,
    Piece,
    Ramp,
    Sine,
    Staircase,
    Step,
    Sum,
    Table,
    Wave,
    break_points,
    piece_at,
)
from actuator.system.parameters import parameterize
from gear import Backlash, Bearing, Coulomb, Linear, Mesh, Shaft, Transmission
from gear.quantities import require_known

ROUND = PMSM(pole_pairs=4, resistance=0.5, inductance_d=2e-3, inductance_q=2e-3, flux=0.05, inertia=1e-4)
SALIENT = PMSM(pole_pairs=3, resistance=0.8, inductance_d=3e-3, inductance_q=8e-3, flux=0.1, inertia=1e-4)
BRUSHED = DCMotor(resistance=0.7, inductance=1e-3, torque_constant=0.06, inertia=2e-5)

currents, voltages, speeds = numbers(-50, 50), numbers(-300, 300), numbers(-1000, 1000)
dq_currents, dq_voltages = st.tuples(currents, currents), st.tuples(voltages, voltages)
synchronous = pytest.mark.parametrize("motor", (ROUND, SALIENT), ids=("round", "salient"))


def phases(direct, quadrature, angle):
    """Amplitude-invariant inverse Park transform: the three phase quantities."""
    thirds = angle - 2 * math.pi / 3 * np.arange(3)
    return direct * np.cos(thirds) - quadrature * np.sin(thirds)


# -- motors -------------------------------------------------------------------------------------------


@synchronous
@settings(deadline=None, max_examples=50)
@given(current=dq_currents, voltage=dq_voltages, speed=speeds, angle=numbers(0, 7))
def test_power_into_the_phases_is_heat_motion_and_stored_energy(motor, current, voltage, speed, angle):
    into_the_phases = phases(*voltage, angle) @ phases(*current, angle)
    heat = motor.resistance * sum(phases(*current, angle) ** 2)
    inductances = (motor.inductance_d, motor.inductance_q)
    rates = motor.derivatives(list(current), list(voltage), speed)
    stored = 1.5 * sum(h * i * rate for h, i, rate in zip(inductances, current, rates, strict=True))
    assert heat + motor.torque(current) * speed + stored == pytest.approx(into_the_phases, rel=1e-9, abs=1e-6)


@settings(deadline=None, max_examples=50)
@given(current=dq_currents, speed=speeds)
def test_steady_state_of_a_round_rotor_is_one_phasor_equation(current, speed):
    """V = (R + j we L) I + j we psi; Krause, Wasynczuk, Sudhoff, ch. 11."""
    electrical = 4 * speed
    voltage = (0.5 + 2e-3j * electrical) * complex(*current) + 0.05j * electrical
    assert ROUND.derivatives(list(current), [voltage.real, voltage.imag], speed) == pytest.approx([0, 0], abs=1e-6)


@synchronous
@settings(deadline=None, max_examples=50)
@given(torque=numbers(-20, 20))
def test_current_for_a_torque_gives_that_torque(motor, torque):
    references = motor.references(motor.current_for(torque))
    assert references[0] == 0
    assert motor.torque(references) == pytest.approx(torque, abs=1e-12)


def test_torque_of_a_synchronous_motor_with_its_reluctance_part():
    """3/2 p (psi iq + (Ld - Lq) id iq) by hand."""
    assert ROUND.torque([-7.0, 10.0]) == pytest.approx(1.5 * 4 * 0.05 * 10)
    assert SALIENT.torque([-4.0, 10.0]) == pytest.approx(1.5 * 3 * (0.1 * 10 + 5e-3 * 4 * 10))


@settings(deadline=None, max_examples=50)
@given(current=currents, voltage=voltages, speed=speeds)
def test_power_into_a_dc_motor_is_heat_motion_and_stored_energy(current, voltage, speed):
    (rate,) = BRUSHED.derivatives([current], [voltage], speed)
    balance = 0.7 * current**2 + BRUSHED.torque([current]) * speed + 1e-3 * current * rate
    assert balance == pytest.approx(voltage * current, rel=1e-9, abs=1e-6)


def test_dc_motor_stalls_and_runs_free_as_its_data_sheet_says():
    assert BRUSHED.derivatives([24 / 0.7], [24.0], 0.0) == pytest.approx([0], abs=1e-9)
    assert BRUSHED.derivatives([0.0], [24.0], 24 / 0.06) == pytest.approx([0], abs=1e-9)
    assert BRUSHED.torque(BRUSHED.references(BRUSHED.current_for(0.3))) == pytest.approx(0.3)


@pytest.mark.parametrize("motor", (ROUND, SALIENT, BRUSHED), ids=("round", "salient", "brushed"))
def test_coupling_voltages_fed_forward_leave_a_resistance_and_an_inductance(motor):
    current = [3.0, -5.0][: len(motor.axes)]
    still = motor.derivatives(current, [1.0, 2.0][: len(motor.axes)], 0.0)
    fed = [v + motion for v, motion in zip([1.0, 2.0], motor.coupling_voltages(current, 80.0), strict=False)]
    assert motor.derivatives(current, fed, 80.0) == pytest.approx(still)


# -- inverter and load --------------------------------------------------------------------------------

INVERTER = Inverter(dc_voltage=300.0, current_limit=20.0)
CIRCLE = 300 / math.sqrt(3)


@settings(deadline=None, max_examples=50)
@given(wanted=st.tuples(numbers(-1000, 1000), numbers(-1000, 1000)))
def test_voltage_vector_keeps_its_direction_and_ends_on_the_circle(wanted):
    got, size = INVERTER.realize(list(wanted)), math.hypot(*wanted)
    assert math.hypot(*got) == pytest.approx(min(size, CIRCLE))
    assert got == pytest.approx([part * min(1, CIRCLE / max(size, 1e-9)) for part in wanted], abs=1e-9)


@settings(deadline=None, max_examples=20)
@given(wanted=voltages.map(lambda v: 2 * v), asked=currents)
def test_voltage_of_one_axis_and_current_are_clipped(wanted, asked):
    assert INVERTER.realize([wanted]) == [np.clip(wanted, -300, 300)]
    assert INVERTER.allow(asked) == np.clip(asked, -20, 20)


def test_voltage_vector_has_a_slope_of_one_at_zero():
    symbols = ca.SX.sym("v", 2)
    slope = ca.jacobian(ca.vertcat(*INVERTER.realize([symbols[0], symbols[1]])), symbols)
    assert np.array(ca.Function("slope", [symbols], [slope])([0, 0])) == pytest.approx(np.eye(2))


def test_load_holds_back_what_moves_and_is_bent():
    load = Load(inertia=0.1, stiffness=20.0, damping=3.0, bias=5.0)
    assert load.torque(0.5, -2.0) == 5 - 20 * 0.5 + 3 * 2
    assert Load().torque(1.0, 1.0) == 0
    assert Load(stiffness=-2.0).torque(1.0, 0.0) == 2


@pytest.mark.parametrize(
    ("law", "values"),
    [
        (lambda d, q: SALIENT.torque([d, q]), (-3.0, 5.0)),
        (lambda d, q, w: SALIENT.derivatives([d, q], [10.0, 20.0], w), (-3.0, 5.0, 100.0)),
        (lambda i, w: BRUSHED.derivatives([i], [12.0], w), (3.0, 100.0)),
        (lambda d, q: INVERTER.realize([d, q]), (200.0, 150.0)),
        (lambda d, q: INVERTER.realize([d, q]), (20.0, -15.0)),
        (lambda v: INVERTER.realize([v]), (-400.0,)),
        (INVERTER.allow, (25.0,)),
        (Load(stiffness=20.0, damping=3.0, bias=5.0).torque, (0.5, -2.0)),
    ],
)
def test_parts_are_the_same_in_numbers_and_in_symbols(law, values):
    assert in_symbols(law, *values) == pytest.approx(law(*values))


# -- signals ------------------------------------------------------------------------------------------


def chirp(t):
    tau = np.clip(t - 0.5, 0, 2)
    return 1 + (0.5 < t < 2.5) * 3 * math.sin(2 * math.pi * (2 * tau + (10 - 2) / 2 * tau**2 / 2))


def sine(t):
    return 0.5 + (t >= 1) * 2 * math.sin(2 * math.pi * 3 * (t - 1) + 0.7)


TIMES, VALUES = (0.0, 0.5, 1.25, 3.0), (1.0, -2.0, 0.5, 4.0)
TABLE = Table(times=TIMES, values=VALUES)
STEP = Step(time=0.3, before=-1.0, after=2.0)
CHIRP = Chirp(amplitude=3.0, first_frequency=2.0, last_frequency=10.0, duration=2.0, time=0.5, offset=1.0)
SIGNALS = (
    (Constant(value=2.5), lambda t: 2.5),
    (STEP, lambda t: 2.0 if t >= 0.3 else -1.0),
    (Ramp(time=0.5, start=1.0, slope=-2.0), lambda t: 1 - 2 * max(t - 0.5, 0)),
    (Ramp(time=0.5, start=1.0, slope=-2.0, end=2.0), lambda t: 1 - 2 * np.clip(t - 0.5, 0, 1.5)),
    (Sine(amplitude=2.0, frequency=3.0, time=1.0, offset=0.5, phase=0.7), sine),
    (CHIRP, chirp),
    (TABLE, lambda t: np.interp(t, TIMES, VALUES)),
    (Table(times=(1.0,), values=(3.0,)), lambda t: 3.0),
    (Staircase(times=TIMES, values=VALUES), lambda t: VALUES[max(sum(time <= t for time in TIMES), 1) - 1]),
    (Sum(parts=(TABLE, STEP, CHIRP)), lambda t: np.interp(t, TIMES, VALUES) + (2 if t >= 0.3 else -1) + chirp(t)),
    (Sum(parts=(Sum(parts=(TABLE, TABLE)), Constant(value=1.0))), lambda t: 2 * np.interp(t, TIMES, VALUES) + 1),
    (Sum(parts=()), lambda t: 0.0),
)
every_signal = pytest.mark.parametrize(("signal", "direct"), SIGNALS, ids=lambda value: type(value).__name__)


@every_signal
@settings(deadline=None, max_examples=50)
@given(time=numbers(-2, 5))
def test_a_piece_starts_with_the_value_of_its_signal(signal, direct, time):
    assert piece_at(signal, time)(0) == pytest.approx(direct(time), abs=1e-9)


@every_signal
@settings(deadline=None, max_examples=50)
@given(time=numbers(-2, 5), later=numbers(0, 1))
def test_a_piece_holds_until_the_next_break_point(signal, direct, time, later):
    assume(not any(time < point <= time + later for point in break_points(signal)))
    assert piece_at(signal, time)(later) == pytest.approx(direct(time + later), abs=1e-9)


@every_signal
def test_break_points_ascend_and_are_where_new_pieces_start(signal, direct):
    points = break_points(signal)
    assert points == sorted(set(points))
    for point in points:
        before, after = piece_at(signal, point - 1e-9), piece_at(signal, point)
        assert after(0) == pytest.approx(direct(point), abs=1e-9)
        assert before(0) == pytest.approx(direct(point - 1e-9), abs=1e-6)


@settings(deadline=None, max_examples=50)
@given(
    offset=numbers(-5, 5),
    slope=numbers(-5, 5),
    waves=st.lists(st.builds(Wave, numbers(-3, 3), numbers(-4, 4), numbers(-50, 50), numbers(-20, 20)), max_size=3),
    delay=numbers(-2, 2),
    tau=numbers(-2, 2),
)
def test_a_piece_counted_from_later_is_the_same_curve(offset, slope, waves, delay, tau):
    piece = Piece(offset, slope, tuple(waves))
    assert piece.after(delay)(tau) == pytest.approx(piece(delay + tau), abs=1e-9)
    assert piece.after(delay).after(-delay)(tau) == pytest.approx(piece(tau), abs=1e-9)


def test_a_chirp_runs_from_its_first_frequency_to_its_last():
    for time, frequency in ((0.5, 2.0), (1.5, 6.0), (2.5 - 1e-9, 10.0)):
        (wave,) = piece_at(CHIRP, time).waves
        assert wave.frequency == pytest.approx(2 * math.pi * frequency, rel=1e-6)


# -- parameters ---------------------------------------------------------------------------------------

GEAR = Transmission(
    shafts={"motor": Shaft(inertia=1e-5), "load": Shaft(inertia=1e-3)},
    meshes={
        "only": Mesh(
            a="motor",
            b="load",
            pair=PAPER_PAIR,
            elasticity=Backlash(gap=15e-6, law=Linear(stiffness=2e8, damping=2e5)),
            friction=Coulomb(sliding=0.1, static=0.2),
        )
    },
    bearings={"seal": Bearing(shaft="load", coulomb=0.05, breakaway=0.1)},
    input="motor",
    output="load",
)


def test_every_number_becomes_a_parameter_with_path_unit_and_default():
    _, found = parameterize(GEAR, "gear")
    named = {parameter.name: (parameter.unit, parameter.default) for parameter in found}
    assert {
        "gear.shafts.motor.inertia": ("kg m^2", 1e-5),
        "gear.shafts.load.inertia": ("kg m^2", 1e-3),
        "gear.meshes.only.pair.module": ("m", 1e-3),
        "gear.meshes.only.pair.pressure_angle": ("rad", math.radians(20)),
        "gear.meshes.only.pair.addendum_b": ("-", 1.0),
        "gear.meshes.only.elasticity.gap": ("m", 15e-6),
        "gear.meshes.only.elasticity.law.stiffness": ("N/m", 2e8),
        "gear.meshes.only.elasticity.law.damping": ("N s/m", 2e5),
        "gear.meshes.only.friction.sliding": ("-", 0.1),
        "gear.meshes.only.friction.static": ("-", 0.2),
        "gear.bearings.seal.coulomb": ("N m", 0.05),
        "gear.bearings.seal.breakaway": ("N m", 0.1),
        "gear.bearings.seal.viscous": ("N m s/rad", 0.0),
    }.items() <= named.items()
    assert len(named) == len(found)
    assert [p.symbol.name() for p in found] == [p.name for p in found]


def test_counts_names_choices_and_what_is_missing_stay_what_they_are():
    copy, _ = parameterize(GEAR, "gear")
    mesh = copy.meshes["only"]
    assert (mesh.pair.teeth_a, mesh.a, mesh.stick_by, mesh.carrier) == (20, "motor", "mesh speed", None)
    assert parameterize(ROUND, "motor")[0].pole_pairs == 4
    assert parameterize(TorqueSource(), "motor") == (TorqueSource(), [])
    assert GEAR.shafts["motor"].inertia == 1e-5


@pytest.mark.parametrize(
    ("component", "law"),
    [
        (SALIENT, lambda motor: motor.torque([-3.0, 5.0])),
        (SALIENT, lambda motor: motor.derivatives([-3.0, 5.0], [10.0, 20.0], 100.0)),
        (BRUSHED, lambda motor: motor.derivatives([3.0], [12.0], 100.0)),
        (INVERTER, lambda inverter: inverter.realize([200.0, 150.0])),
        (Load(stiffness=20.0, damping=3.0, bias=5.0), lambda load: load.torque(0.5, -2.0)),
        (PAPER_PAIR, lambda pair: [pair.friction_factor, pair.friction_arm_a, pair.friction_arm_b, pair.radius_b]),
        (GEAR, lambda gear: [*gear.meshes["only"].slip_per_shaft().values()]),
    ],
    ids=lambda value: type(value).__name__,
)
def test_a_component_of_symbols_at_its_defaults_is_the_component_of_numbers(component, law):
    copy, found = parameterize(component, "part")
    built, direct = law(copy), law(component)
    rows = ca.vertcat(*(built if isinstance(built, list) else [built]))
    value = ca.Function("value", [p.symbol for p in found], [rows])(*(p.default for p in found))
    assert np.array(value).ravel() == pytest.approx(direct)


# -- errors -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: TorqueSource(torque_limit=-1.0), "TorqueSource.torque_limit must be > 0 N m, got -1 N m"),
        (
            lambda: DCMotor(resistance=0.0, inductance=1.0, torque_constant=1.0, inertia=1.0),
            "DCMotor.resistance must be > 0 ohm, got 0 ohm",
        ),
        (
            lambda: PMSM(pole_pairs=1.5, resistance=1.0, inductance_d=1.0, inductance_q=1.0, flux=1.0, inertia=1.0),
            "PMSM.pole_pairs must be a whole number >= 1, got 1.5",
        ),
        (lambda: Inverter(dc_voltage=-48.0, current_limit=1.0), "Inverter.dc_voltage must be > 0 V, got -48 V"),
        (lambda: Load(inertia=-1.0), r"Load.inertia must be >= 0 kg m\^2, got -1 kg m\^2"),
        (lambda: Table(times=(0.0, 1.0), values=(1.0,)), "Table needs as many values as times, got 1 and 2"),
        (lambda: Staircase(times=(0.0,), values=()), "Staircase needs as many values as times, got 0 and 1"),
        (lambda: Staircase(times=(1.0, 0.0), values=(1.0, 2.0)), "Staircase.times must increase from point to point"),
        (lambda: Table(times=(), values=()), "Table needs as many values as times, got 0 and 0"),
        (lambda: Table(times=(0.0, 1.0, 1.0), values=(1.0, 2.0, 3.0)), "Table.times must increase from point to point"),
    ],
)
def test_parts_without_meaning_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_an_unknown_name_is_answered_with_the_nearest():
    require_known(["motor_angle"], ["motor_angle", "load_angle"], "signal")
    with pytest.raises(KeyError, match="no signal named 'load_angel'; did you mean load_angle or motor_angle"):
        require_known(["load_angel"], ["motor_angle", "load_angle"], "signal")
    with pytest.raises(KeyError, match="no mode named 'xyz'; did you mean a or b"):
        require_known(["xyz"], ["a", "b"], "mode")
