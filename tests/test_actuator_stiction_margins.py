"""What the factor of a margin is on, and how it is found.

Oracles: a rule that says from its parameters alone whether an actuator hunts, in place of simulations, so that the
factor is known exactly; lists of parameters by hand.
"""

import math
from dataclasses import replace
from types import SimpleNamespace

import pytest
from test_actuator_roles import SPEED_LOOP, names, servo

from actuator import Hunting, hunting_margin, hunting_margins
from actuator.stiction import margins
from actuator.stiction.margins import find_onset, find_scaled
from actuator.verdict.verdict import HUNTING, REST, UNDECIDED
from controllers import PI, Cascade, DisturbanceObserver, FrictionCompensation, Remedies
from gear import Backlash, EfficiencyPoint, FrictionPoint, FrictionTable, Linear, TabulatedEfficiency

TABLE = FrictionTable(
    points=(FrictionPoint(speed=0.0, coefficient=0.22), FrictionPoint(speed=1.0, coefficient=0.15)), static=0.3
)
EFFICIENCY = TabulatedEfficiency(points=(EfficiencyPoint(speed=0.0, a_drives=0.8, b_drives=0.7),), breakout=1.4)
STATIC, BREAKOUT = "gear.meshes.teeth.friction.static", "gear.meshes.teeth.friction.breakout"
HINGE = "gear.bearings.hinge.breakaway"
EVERYTHING = Cascade(
    position=PI(proportional=10.0, integral=5.0),
    speed=SPEED_LOOP,
    current=None,
    speed_limit=50.0,
    disturbance_observer=DisturbanceObserver(inertia=1e-3, bandwidth=100.0),
    remedies=Remedies(compensation=FrictionCompensation(coulomb=0.1, breakaway=0.2, standstill=0.01, width=1e-3)),
)


def with_gap(plant):
    mesh = plant.gear.meshes["teeth"]
    play = Backlash(gap=1e-4, law=Linear(stiffness=1e7, damping=1e3))
    return replace(plant, gear=replace(plant.gear, meshes={"teeth": replace(mesh, elasticity=play)}))


def test_a_factor_is_on_all_that_have_the_role_and_on_nothing_else():
    system = with_gap(servo(TABLE, EVERYTHING)).system()
    assert names(find_scaled(system, "stiction")) == [STATIC, HINGE]
    assert names(find_scaled(system, "backlash")) == ["gear.meshes.teeth.elasticity.gap"]
    assert names(find_scaled(system, "integral gain")) == [
        "controller.position.integral",
        "controller.speed.integral",
        "controller.disturbance_observer.bandwidth",
    ]


@pytest.fixture
def rule(monkeypatch):
    """Decides runs by their parameters; the parameters of all runs are kept."""
    tried = []

    def install(verdict_of):
        def decide(plant, duration, *, parameters, start, **options):
            tried.append(parameters)
            run = SimpleNamespace(state=lambda: {"load.angle": 1.0})
            return run, Hunting(verdict=verdict_of(parameters, start), reason="by rule", longer_s=1.0)

        monkeypatch.setattr(margins, "decide", decide)
        return tried

    return install


@pytest.mark.parametrize(
    ("law", "name", "value", "floor"), [(TABLE, STATIC, 0.3, 0.22), (EFFICIENCY, BREAKOUT, 1.4, 1)]
)
@pytest.mark.parametrize("at", [0.9, 1.1, 7.0])
def test_the_stiction_margin_scales_every_law_down_to_its_sliding_friction(rule, law, name, value, floor, at):
    rule(lambda parameters, start: HUNTING if parameters[name] > at * value else REST)
    found = hunting_margin(servo(law), "stiction")
    assert found.parameters == (name, HINGE)
    assert found.factor == pytest.approx(at, rel=0.011)
    tried = rule(lambda parameters, start: HUNTING)
    assert hunting_margin(servo(law), "stiction").factor == 0  # it hunts with breakaway as small as sliding friction
    assert min(parameters[name] for parameters in tried) == floor
    assert min(parameters[HINGE] for parameters in tried) == 0.5


def test_what_comes_to_rest_at_every_factor_has_an_infinite_margin(rule):
    tried = rule(lambda parameters, start: REST)
    found = hunting_margin(servo(TABLE), "stiction")
    assert (found.factor, found.db) == (math.inf, math.inf)
    assert [factor for factor, _ in found.runs] == [1, 2, 4, 8, 16]
    assert tried[-1][STATIC] == pytest.approx(16 * 0.3)


def test_a_cycle_that_only_a_run_begun_on_it_reaches_counts(rule):
    rule(lambda parameters, start: HUNTING if parameters[STATIC] > (0.3 if start is None else 0.25) else REST)
    found = hunting_margin(replace(servo(TABLE)), "stiction", parameters={STATIC: 0.31})
    assert found.factor == pytest.approx(0.25 / 0.31, rel=0.011)


def test_what_never_decides_does_not_hunt(rule):
    rule(lambda parameters, start: UNDECIDED)
    found = hunting_margin(servo(TABLE), "stiction")
    assert found.factor == math.inf
    assert {verdict for _, verdict in found.runs} == {"undecided"}


def test_all_margins_are_those_that_the_actuator_has_parameters_for(rule):
    rule(lambda parameters, start: REST)
    assert list(hunting_margins(servo(TABLE))) == ["stiction"]
    assert list(hunting_margins(with_gap(servo(TABLE, EVERYTHING)))) == ["stiction", "backlash", "integral gain"]


@pytest.mark.parametrize(
    ("begins", "factors", "options", "rests", "hunts", "count"),
    [
        (3.3, (1, 2, 4, 8), {}, 2, 4, 3),
        (3.3, (8, 4, 2, 1), {}, 2, 4, 3),  # downward, from one that hunts
        (0.5, (2, 1), {}, None, 1, 2),
        (9.0, (1, 2), {}, 2, None, 2),
        (1.1, (1, 1.4, 2, 2.8, 4), {"first": False, "monotonic": True}, 1, 1.4, 2),
        (9.0, (1, 1.4, 2, 2.8, 4), {"first": False, "monotonic": True}, 4, None, 3),
        (3.3, (1, 2, 4), {"tolerance": math.sqrt(2.001)}, math.sqrt(8), 4, 4),
    ],
)
def test_the_onset_lies_between_the_nearest_factors(begins, factors, options, rests, hunts, count):
    tried = []

    def moves(factor):
        tried.append(factor)
        return factor >= begins

    found = find_onset(moves, factors, **options)
    assert (found.rests, found.hunts) == (pytest.approx(rests), pytest.approx(hunts))
    assert len(tried) == count
