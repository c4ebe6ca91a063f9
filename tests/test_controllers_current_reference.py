"""Current references: scipy's constrained optimum, brute force over the voltage ellipse, and the torque given back."""

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import in_symbols, numbers
from scipy.optimize import minimize_scalar

from controllers import CurrentReference
from gear.quantities import Scalar

IPM = CurrentReference(pole_pairs=3, flux=0.545, inductance_d=0.036, inductance_q=0.051)  # 2.2 kW
RELUCTANT = CurrentReference(pole_pairs=2, flux=0.05, inductance_d=0.01, inductance_q=0.06)
ROUND = CurrentReference(pole_pairs=4, flux=0.1, inductance_d=2e-3, inductance_q=2e-3)
INVERSE = CurrentReference(pole_pairs=4, flux=0.1, inductance_d=4e-3, inductance_q=2e-3)
MACHINES = (IPM, RELUCTANT, ROUND, INVERSE)
machines = pytest.mark.parametrize("machine", MACHINES, ids=("ipm", "reluctant", "round", "inverse"))
CURRENT = {id(IPM): 15.0, id(RELUCTANT): 12.0, id(ROUND): 30.0, id(INVERSE): 30.0}


def torque(machine, direct, quadrature):
    """From the flux linkages, 3/2 p (psi_d iq - psi_q id)."""
    psi_d = machine.flux + machine.inductance_d * direct
    return 1.5 * machine.pole_pairs * (psi_d * quadrature - machine.inductance_q * quadrature * direct)


def voltage(machine, direct, quadrature, speed):
    flux = np.hypot(machine.flux + machine.inductance_d * direct, machine.inductance_q * quadrature)
    return machine.pole_pairs * abs(speed) * flux


def least_current(machine, wanted, limit, speed=0.0, largest_voltage=np.inf):
    """Brute force: of all points with the torque and within the voltage, the one of least current."""
    direct = np.linspace(-1.5 * limit, 0.95 * limit, 400001)
    slope = torque(machine, direct, 1.0)
    direct, slope = direct[slope > 1e-6], slope[slope > 1e-6]
    quadrature = wanted / slope
    size = np.hypot(direct, quadrature)
    size[voltage(machine, direct, quadrature, speed) > largest_voltage] = np.inf
    best = np.argmin(size)
    return np.array([direct[best], quadrature[best]])


def most_torque(machine, limit, speed, largest_voltage):
    """Brute force: the largest torque within current and voltage, on a grid of the direct current, twice refined."""
    flux_limit = largest_voltage / (machine.pole_pairs * speed)
    low, high = -limit, limit
    for _ in range(3):
        direct = np.linspace(low, high, 20001)
        inside = flux_limit**2 - (machine.flux + machine.inductance_d * direct) ** 2
        quadrature = np.minimum(
            np.sqrt(np.maximum(limit**2 - direct**2, 0)), np.sqrt(np.maximum(inside, 0)) / machine.inductance_q
        )
        every = np.where(inside >= 0, torque(machine, direct, quadrature), -np.inf)
        best = np.argmax(every)
        low, high = direct[max(best - 1, 0)], direct[min(best + 1, 20000)]
    return every[best]


# -- maximum torque per ampere ------------------------------------------------------------------------


@machines
@settings(deadline=None, max_examples=50)
@given(share=numbers(-3, 3))
def test_least_current_gives_the_torque(machine, share):
    wanted = share * torque(machine, 0.0, CURRENT[id(machine)])
    assert torque(machine, *machine.least(wanted)) == pytest.approx(wanted, rel=1e-12, abs=1e-15)
    assert machine.torque(*machine.least(wanted)) == pytest.approx(wanted, rel=1e-12, abs=1e-15)


@machines
@pytest.mark.parametrize("share", [1e-6, 0.1, 0.7, 1.5])
def test_no_other_current_of_that_torque_is_smaller(machine, share):
    wanted = share * torque(machine, 0.0, CURRENT[id(machine)])
    direct, quadrature = machine.least(wanted)

    def size(other):
        return np.hypot(other, wanted / torque(machine, other, 1.0))

    room = min(1.0, 0.4 * machine.flux / max(abs(machine.inductance_q - machine.inductance_d), 1e-9))
    best = minimize_scalar(size, bounds=(direct - room, direct + room), method="bounded", options={"xatol": 1e-10})
    assert np.hypot(direct, quadrature) <= best.fun * (1 + 1e-12)
    assert direct == pytest.approx(best.x, abs=2e-6 * max(1.0, abs(quadrature)))


@machines
def test_largest_torque_of_a_current_is_the_best_angle(machine):
    limit = CURRENT[id(machine)]
    angle = minimize_scalar(
        lambda a: -torque(machine, limit * np.cos(a), limit * np.sin(a)),
        bounds=(0, np.pi), method="bounded", options={"xatol": 1e-10},
    )  # fmt: skip
    direct, quadrature = machine.largest(limit)
    assert np.hypot(direct, quadrature) == pytest.approx(limit, rel=1e-12)
    assert torque(machine, direct, quadrature) == pytest.approx(-angle.fun, rel=1e-12)
    assert machine.least(torque(machine, direct, quadrature)) == pytest.approx([direct, quadrature], rel=1e-9)


def test_a_round_rotor_needs_no_direct_current():
    assert ROUND.least(0.9) == [0.0, pytest.approx(0.9 / 0.6)]
    assert IPM.least(0.0) == [0.0, 0.0]


# -- field weakening ----------------------------------------------------------------------------------

states = {
    "speed": st.one_of(numbers(-800, -1), numbers(1, 800)),
    "share": numbers(-1.5, 1.5),
    "largest_voltage": numbers(20, 400),
}


@machines
@settings(deadline=None, max_examples=150)
@given(**states)
def test_voltage_and_current_stay_within_their_limits_wherever_both_can(machine, speed, share, largest_voltage):
    limit = CURRENT[id(machine)]
    wanted = share * torque(machine, 0.0, limit)
    direct, quadrature = machine.references(wanted, speed, largest_voltage, limit)
    given_back = torque(machine, direct, quadrature)
    assert abs(given_back) <= abs(wanted) * (1 + 1e-9) + 1e-12
    assert given_back * wanted >= 0
    assert np.hypot(direct, quadrature) <= limit * (1 + 1e-9)
    if machine.flux - machine.inductance_d * limit < largest_voltage / (machine.pole_pairs * abs(speed)):
        assert voltage(machine, direct, quadrature, speed) <= largest_voltage * (1 + 1e-9)


@machines
@settings(deadline=None, max_examples=25)
@given(**states)
def test_the_torque_is_met_or_the_largest_there_is(machine, speed, share, largest_voltage):
    limit = CURRENT[id(machine)]
    flux_limit = largest_voltage / (machine.pole_pairs * abs(speed))
    if machine.flux - machine.inductance_d * limit > 0.99 * flux_limit:
        return  # no room within both limits
    wanted = abs(share) * torque(machine, 0.0, limit)
    largest = most_torque(machine, limit, abs(speed), largest_voltage)
    direct, quadrature = machine.references(wanted, speed, largest_voltage, limit)
    assert torque(machine, direct, quadrature) == pytest.approx(min(wanted, largest), rel=1e-8, abs=1e-12)


@machines
@pytest.mark.parametrize("speed", [30.0, 150.0, 300.0, 450.0])
@pytest.mark.parametrize("share", [0.05, 0.4, 0.8])
def test_it_is_done_with_the_least_current(machine, speed, share):
    limit, largest_voltage = CURRENT[id(machine)], 250.0
    wanted = share * most_torque(machine, limit, speed, largest_voltage)
    found = machine.references(wanted, speed, largest_voltage, limit)
    assert torque(machine, *found) == pytest.approx(wanted, rel=1e-11)
    best = least_current(machine, wanted, limit, speed, largest_voltage)
    assert np.hypot(*found) == pytest.approx(np.hypot(*best), rel=1e-4)
    assert found == pytest.approx(best, abs=2e-2 * limit)


def test_the_weak_end_of_the_torque_is_named_by_its_bound():
    """Far above the base speed the largest torque for the flux bounds RELUCTANT, not the current limit (MTPV)."""
    direct, quadrature = RELUCTANT.references(100.0, 2000.0, 50.0, 12.0)
    assert np.hypot(direct, quadrature) < 11.0
    assert voltage(RELUCTANT, direct, quadrature, 2000.0) == pytest.approx(50.0)
    angles = np.linspace(0, np.pi, 200001)
    flux = 50.0 / (2 * 2000.0)
    every = torque(RELUCTANT, (flux * np.cos(angles) - 0.05) / 0.01, flux * np.sin(angles) / 0.06)
    assert torque(RELUCTANT, direct, quadrature) == pytest.approx(every.max(), rel=1e-9)


def test_the_current_limit_stands_where_the_flux_cannot_be_weakened_enough():
    direct, quadrature = ROUND.references(1.0, 1000.0, 50.0, 10.0)  # 400 V at 4000 rad/s against 2 mH and 10 A
    assert direct == -10.0
    assert quadrature == pytest.approx(0.0, abs=1e-4)


@machines
@pytest.mark.parametrize("quadrature", [0.0, 1.0, -2.0])
def test_weakened_current_lies_on_the_voltage_ellipse(machine, quadrature):
    flux_limit = 0.7 * machine.flux + 2 * machine.inductance_q
    direct = machine.weakened(quadrature, flux_limit)
    assert voltage(machine, direct, quadrature, 1 / machine.pole_pairs) == pytest.approx(flux_limit)
    assert machine.weakened(2 * flux_limit / machine.inductance_q, flux_limit) == -machine.flux / machine.inductance_d


def test_the_references_are_continuous_where_weakening_begins():
    def at(speed):
        return np.array(IPM.references(14.0, speed, 300.0, 15.0))

    speeds = np.linspace(150, 200, 2001)
    steps = np.abs(np.diff([at(speed) for speed in speeds], axis=0)).max()
    assert steps < 3e-3


@machines
@pytest.mark.parametrize("values", [(1.0, 0.0), (-1.0, 200.0), (50.0, -400.0), (0.0, 700.0), (0.5, 5000.0)])
def test_references_and_their_slopes_are_finite_and_the_same_in_symbols(machine, values):
    def references(wanted: Scalar, speed: Scalar) -> list[Scalar]:
        return machine.references(wanted, speed, 200.0, 15.0)

    assert in_symbols(references, *values) == pytest.approx(references(*values), abs=1e-12)
    slopes = in_symbols(lambda t, w: list(ca.vertsplit(ca.vec(ca.jacobian(ca.vertcat(*references(t, w)),
                                                                          ca.vertcat(t, w))))), *values)  # fmt: skip
    assert np.isfinite(slopes).all()


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"flux": 0.0}, "CurrentReference.flux must be > 0 V s, got 0 V s"),
        ({"inductance_q": -1.0}, "CurrentReference.inductance_q must be > 0 H, got -1 H"),
        ({"pole_pairs": 0}, "CurrentReference.pole_pairs must be a whole number >= 1, got 0"),
        ({"pole_pairs": 2.0}, "CurrentReference.pole_pairs must be a whole number >= 1, got 2.0"),
    ],
)
def test_machines_that_are_none_are_refused(values, message):
    with pytest.raises(ValueError, match=message):
        CurrentReference(**{"pole_pairs": 2, "flux": 0.1, "inductance_d": 1e-3, "inductance_q": 2e-3} | values)


@machines
@pytest.mark.parametrize("left", [0.0, -5.0])
def test_where_no_voltage_is_left_the_current_cancels_the_flux_but_at_standstill(machine, left):
    limit, wanted = CURRENT[id(machine)], machine.torque(0.0, 1.0)
    against = -min(limit, machine.flux / machine.inductance_d)
    for speed in (100.0, -100.0):
        assert numbers_of(machine, wanted, speed, left, limit) == pytest.approx([against, 0.0], abs=1e-2)
    at_rest = numbers_of(machine, wanted, 0.0, left, limit)
    assert at_rest == pytest.approx([float(part) for part in machine.least(wanted)], rel=1e-12)


def numbers_of(machine, *asked):
    return [float(part) for part in machine.references(*asked)]
