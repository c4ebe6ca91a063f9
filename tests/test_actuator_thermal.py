"""Thermal networks against the matrix exponential, series resistances, the heat they balance, and a data sheet."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from oracles import in_symbols, numbers
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from actuator.parts.thermal import ThermalNetwork, ThermalNode, ThermalPath
from actuator.system.parameters import parameterize

AMBIENT = 263.15
NETWORK = ThermalNetwork(
    nodes={
        "winding": ThermalNode(temperature=AMBIENT, capacity=20.0),
        "housing": ThermalNode(temperature=AMBIENT, capacity=180.0),
        "oil": ThermalNode(temperature=AMBIENT, capacity=60.0),
        "ambient": ThermalNode(temperature=AMBIENT),
    },
    paths={
        "slot": ThermalPath(a="winding", b="housing", resistance=1.9),
        "gear": ThermalPath(a="housing", b="oil", resistance=0.8),
        "skin": ThermalPath(a="housing", b="ambient", resistance=4.7),
        "gear_skin": ThermalPath(a="oil", b="ambient", resistance=9.0),
    },
)
LOSSES = {"winding": 12.0, "oil": 3.0, "housing": 1.0}
watts, kelvins = numbers(0, 100), numbers(200, 450)


def linear(network):
    """Matrix and constant of T' = A T + b, by hand from the resistances of NETWORK."""
    slot, gear, skin, gear_skin = (1 / path.resistance for path in network.paths.values())
    flow = np.array([[-slot, slot, 0], [slot, -slot - gear - skin, gear], [0, gear, -gear - gear_skin]])
    constant = np.array([12.0, 1.0 + skin * AMBIENT, 3.0 + gear_skin * AMBIENT])
    capacity = np.array([20.0, 180.0, 60.0])
    return flow / capacity[:, None], constant / capacity


@pytest.mark.parametrize("time", [3.0, 200.0, 5000.0])
def test_warming_up_is_the_matrix_exponential(time):
    names = NETWORK.free
    assert names == ("winding", "housing", "oil")
    run = solve_ivp(
        lambda _, T: list(NETWORK.rates(dict(zip(names, T, strict=True)), LOSSES).values()),
        (0, time),
        [AMBIENT] * 3,
        method="LSODA",
        rtol=1e-10,
        atol=1e-9,
    )
    A, b = linear(NETWORK)
    steady = -np.linalg.solve(A, b)
    assert run.y[:, -1] == pytest.approx(steady + expm(A * time) @ (AMBIENT - steady), abs=1e-6)


@settings(deadline=None, max_examples=50)
@given(winding=watts, housing=watts, oil=watts)
def test_nothing_warms_in_the_steady_state(winding, housing, oil):
    losses = {"winding": winding, "housing": housing, "oil": oil}
    steady = NETWORK.steady_state(losses)
    assert steady["ambient"] == AMBIENT
    rates = NETWORK.rates({name: steady[name] for name in NETWORK.free}, losses)
    assert list(rates.values()) == pytest.approx([0, 0, 0], abs=1e-9)


def test_one_way_to_the_ambient_is_a_sum_of_resistances():
    chain = replace(NETWORK, paths={name: NETWORK.paths[name] for name in ("slot", "gear", "skin")})
    steady = chain.steady_state({"winding": 10.0})
    assert steady["winding"] == pytest.approx(AMBIENT + 10 * (1.9 + 4.7))
    assert steady["oil"] == pytest.approx(steady["housing"]) == pytest.approx(AMBIENT + 10 * 4.7)


@settings(deadline=None, max_examples=50)
@given(winding=kelvins, housing=kelvins, oil=kelvins)
def test_heat_is_stored_or_leaves(winding, housing, oil):
    temperatures = {"winding": winding, "housing": housing, "oil": oil}
    rates = NETWORK.rates(temperatures, LOSSES)
    stored = sum(NETWORK.nodes[name].capacity * rate for name, rate in rates.items())
    flows = NETWORK.flows(temperatures)
    assert stored + flows["skin"] + flows["gear_skin"] == pytest.approx(sum(LOSSES.values()), abs=1e-9)


def test_a_node_without_capacity_keeps_its_temperature_and_takes_the_heat():
    warm_oil = ThermalNetwork(nodes={**NETWORK.nodes, "oil": ThermalNode(temperature=330.0)}, paths=dict(NETWORK.paths))
    assert warm_oil.free == ("winding", "housing")
    steady = warm_oil.steady_state({"oil": 1000.0})
    assert steady["oil"] == 330
    # housing between oil (0.8 K/W) and ambient (4.7 K/W)
    assert steady["housing"] == pytest.approx((330 / 0.8 + AMBIENT / 4.7) / (1 / 0.8 + 1 / 4.7))
    fixed = ThermalNetwork(nodes={"oil": ThermalNode(temperature=330.0)}, paths={})
    assert fixed.rates({}, {"oil": 5.0}) == {}
    assert fixed.steady_state({"oil": 5.0}) == {"oil": 330.0}


def test_a_motor_by_its_data_sheet_has_its_resistances_and_time_constants():
    """maxon RE 40, 148867: 1.9 and 4.7 K/W, 41.5 s and 1120 s."""
    motor = ThermalNetwork.of_motor(
        winding_to_housing=1.9,
        housing_to_ambient=4.7,
        winding_time_constant=41.5,
        motor_time_constant=1120.0,
        ambient=298.15,
    )
    assert motor.steady_state({"winding": 10.0})["winding"] == pytest.approx(298.15 + 66)
    held = motor.rates({"winding": 298.15 + 1.9, "housing": 298.15}, {})
    assert held["winding"] == pytest.approx(-1.9 / 41.5)
    whole = motor.rates({"winding": 298.15 + 4.7, "housing": 298.15 + 4.7}, {})
    assert whole["housing"] == pytest.approx(-4.7 / 1120)


def test_networks_are_the_same_in_numbers_and_in_symbols():
    def laws(network, *temperatures):
        rates = network.rates(dict(zip(network.free, temperatures, strict=True)), LOSSES)
        return [*rates.values(), *network.steady_state(LOSSES).values()]

    at = (300.0, 290.0, 280.0)
    assert in_symbols(lambda *T: laws(NETWORK, *T), *at) == pytest.approx(laws(NETWORK, *at))
    copy, found = parameterize(NETWORK, "thermal")
    assert {"thermal.nodes.oil.capacity", "thermal.nodes.ambient.temperature", "thermal.paths.slot.resistance"} <= {
        parameter.name for parameter in found
    }
    value = ca.Function("value", [p.symbol for p in found], [ca.vertcat(*laws(copy, *at))])(*(p.default for p in found))
    assert np.array(value).ravel() == pytest.approx(laws(NETWORK, *at))


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        (lambda: ThermalNode(temperature=-5.0), "ThermalNode.temperature must be > 0 K, got -5 K"),
        (lambda: ThermalNode(temperature=300.0, capacity=0.0), "ThermalNode.capacity must be > 0 J/K, got 0 J/K"),
        (lambda: ThermalPath(a="x", b="y", resistance=0.0), "ThermalPath.resistance must be > 0 K/W, got 0 K/W"),
        (
            lambda: replace(NETWORK, paths={"loop": ThermalPath(a="oil", b="oil", resistance=1.0)}),
            "ThermalNetwork: path 'loop' must join two nodes, got 'oil' twice",
        ),
        (
            lambda: replace(NETWORK, paths={"slot": NETWORK.paths["slot"]}).steady_state({}),
            "winding, housing, oil has no steady temperature without a path to a node of fixed temperature",
        ),
    ],
)
def test_networks_without_meaning_are_refused(ask, message):
    with pytest.raises(ValueError, match=message):
        ask()


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        (
            lambda: replace(NETWORK, paths={"x": ThermalPath(a="windings", b="oil", resistance=1.0)}),
            "no thermal node for path .* named .*windings.*; did you mean winding",
        ),
        (
            lambda: NETWORK.rates({"winding": 300.0}, {}),
            "every free node, got none for housing, oil",
        ),
        (lambda: NETWORK.steady_state({"copper": 1.0}), "no thermal node named 'copper'"),
    ],
)
def test_unknown_nodes_are_named(ask, message):
    with pytest.raises(KeyError, match=message):
        ask()
