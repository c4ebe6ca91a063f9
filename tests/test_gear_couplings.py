"""Couplings with free play, end stops and jams: the laws alone.

Oracles: the backlash between teeth, of which a coupling with a gap is the torsional counterpart; stiffness and
damping by hand; torque as the slope of the stored energy; gear ratios of trains with mountings and return springs.
"""

import math
from dataclasses import replace

import pytest
from hypothesis import given, settings
from oracles import gradient_in_symbols, in_symbols, numbers, pressed, signs

from gear import (
    Backlash,
    Brake,
    Coupling,
    EndStop,
    ExternalPair,
    Linear,
    Mesh,
    Shaft,
    Transmission,
    add_brake,
)
from gear.balance import balance
from gear.couplings import Twist
from gear.efficiency import efficiency

STIFFNESS, DAMPING, GAP = 2e4, 30.0, 0.02
PLAIN = Coupling(a="a", b="b", stiffness=STIFFNESS, damping=DAMPING)
LOOSE = Coupling(a="a", b="b", stiffness=STIFFNESS, damping=DAMPING, gap=GAP)
STOP = EndStop(shaft="a", lower=-0.3, upper=0.5, stiffness=STIFFNESS, damping=DAMPING)

angles, rates, penetrations = numbers(-1.0, 1.0), numbers(-20.0, 20.0), numbers(0.0, 0.1)


def engaged(spring, penetration, flank):
    """The twist at a penetration on one flank."""
    return flank * penetration + {LOOSE: flank * GAP / 2, STOP: 0.5 if flank > 0 else -0.3}[spring]


@given(angle=angles, rate=rates)
def test_a_coupling_without_gap_is_a_spring_and_a_damper(angle, rate):
    twist = Twist(angle, rate)
    assert PLAIN.torque(twist, 1.0) == STIFFNESS * angle + DAMPING * rate
    assert PLAIN.stored(twist, 1.0) == STIFFNESS * angle**2 / 2
    assert PLAIN.penetration(twist, 1.0) is None


@given(angle=angles, rate=rates, flank=signs())
def test_a_coupling_with_a_gap_is_to_a_shaft_what_backlash_is_to_teeth(angle, rate, flank):
    teeth = Backlash(gap=GAP, law=Linear(stiffness=STIFFNESS, damping=DAMPING))
    twist, motion = Twist(angle, rate), pressed(angle, rate)
    assert LOOSE.torque(twist, flank) == pytest.approx(teeth.force(motion, flank), rel=1e-12)
    assert LOOSE.penetration(twist, flank) == teeth.penetration(motion, flank)
    assert LOOSE.torque(twist, 0.0) == 0


@given(angle=angles, flank=signs())
def test_a_gap_of_zero_gives_the_torque_of_the_plain_coupling(angle, flank):
    closed = Coupling(a="a", b="b", stiffness=STIFFNESS, damping=0.0, gap=0.0)
    twist = Twist(flank * abs(angle), 0.0)
    assert closed.torque(twist, flank) == PLAIN.torque(twist, flank)
    assert closed.stored(twist, flank) == PLAIN.stored(twist, flank)


@given(angle=angles, rate=rates, flank=signs())
def test_stops_at_equal_angles_are_a_gap_to_the_housing(angle, rate, flank):
    stop = EndStop(shaft="a", lower=-GAP / 2, upper=GAP / 2, stiffness=STIFFNESS, damping=DAMPING)
    twist = Twist(angle, rate)
    assert stop.torque(twist, flank) == pytest.approx(LOOSE.torque(twist, flank), rel=1e-12)
    assert stop.stored(twist, flank) == pytest.approx(LOOSE.stored(twist, flank), rel=1e-12)


def test_each_stop_pushes_back_from_its_own_angle():
    assert STOP.torque(Twist(0.51, 0.0), 1.0) == pytest.approx(STIFFNESS * 0.01)
    assert STOP.torque(Twist(-0.32, 0.0), -1.0) == pytest.approx(-STIFFNESS * 0.02)
    assert STOP.stored(Twist(0.51, 0.0), 1.0) == pytest.approx(STIFFNESS * 0.01**2 / 2)


@pytest.mark.parametrize("spring", [LOOSE, STOP])
@given(penetration=penetrations, rate=rates, flank=signs())
def test_what_has_a_gap_cannot_pull_and_never_creates_energy(spring, penetration, rate, flank):
    twist = Twist(engaged(spring, penetration, flank), rate)
    still = flank * spring.torque(twist._replace(rate=0.0), flank)
    assert -1e-9 <= flank * spring.torque(twist, flank) <= 2 * still + 1e-9
    assert (spring.torque(twist, flank) - flank * still) * rate >= -1e-9


@pytest.mark.parametrize("spring", [PLAIN, LOOSE, STOP])
@settings(deadline=None)
@given(penetration=penetrations, flank=signs())
def test_torque_is_the_slope_of_the_energy_and_the_same_in_symbols(spring, penetration, flank):
    angle = flank * penetration if spring is PLAIN else engaged(spring, penetration, flank)
    torque = spring.torque(Twist(angle, 0.0), flank)
    slope = gradient_in_symbols(lambda x: spring.stored(Twist(x, 0.0), flank), angle)
    assert slope.item() == pytest.approx(torque, rel=1e-9, abs=1e-9)
    symbolic = in_symbols(lambda *x: spring.torque(Twist(x[0], x[1]), x[2]), angle, 0.3, flank)
    assert symbolic.item() == pytest.approx(spring.torque(Twist(angle, 0.3), flank), rel=1e-12)


# -- in a transmission --------------------------------------------------------------------------------

SHAFTS = {"motor": Shaft(inertia=1e-3), "wheel": Shaft(inertia=1e-2), "housing": Shaft(inertia=1.0)}
PAIR = ExternalPair(teeth_a=20, teeth_b=60, module=1e-3)


def mounted(**options):
    """A pinion on a wheel in a housing that stands on a spring."""
    return Transmission(
        shafts=SHAFTS,
        meshes={"m": Mesh(a="motor", b="wheel", carrier="housing", pair=PAIR)},
        couplings={"mounting": Coupling(a="housing", stiffness=1e4, damping=0.0)},
        input="motor",
        output="wheel",
        **options,
    )


def test_torque_of_a_coupling_acts_on_both_shafts_and_that_of_a_mounting_on_one():
    gear = mounted(stops={"end": EndStop(shaft="wheel", lower=-1.0, upper=0.2, stiffness=100.0)})
    angle = {"motor": 0.0, "wheel": 0.25, "housing": 1e-3}
    flank = {"meshes.m": 1.0, "couplings.mounting": 1.0, "stops.end": 1.0}
    still = dict.fromkeys(SHAFTS, 0.0)
    passed = gear.passed_torques(gear.twists(angle, still), flank)
    assert passed == pytest.approx({"couplings.mounting": 10.0, "stops.end": 5.0})
    assert gear.torques(still, {}, passed) == pytest.approx({"motor": 0.0, "wheel": -5.0, "housing": -10.0})
    assert gear.elastic_energy({}, angle, flank) == pytest.approx(1e4 * 1e-3**2 / 2 + 100 * 0.05**2 / 2)


def test_a_mounting_stands_still_and_a_return_spring_does_not_lock():
    assert mounted().ratio() == pytest.approx(-3)
    sprung = Transmission(
        shafts={name: SHAFTS[name] for name in ("motor", "wheel")},
        meshes={"m": Mesh(a="motor", b="wheel", pair=PAIR)},
        couplings={"return": Coupling(a="wheel", stiffness=10.0, damping=0.0)},
        input="motor",
        output="wheel",
    )
    assert sprung.ratio() == pytest.approx(-3)


def test_a_spring_of_the_output_to_the_housing_is_not_its_mounting():
    springs = {**mounted().couplings, "return": Coupling(a="wheel", stiffness=10.0, damping=0.0)}
    assert replace(mounted(), couplings=springs).ratio() == pytest.approx(-3)


def test_couplings_and_mountings_pass_the_steady_torque_on():
    """Output 3 N m through a shaft and a lossless pair of 3, whose housing stands on a spring: 1 N m at the motor."""
    gear = replace(
        mounted(),
        shafts=SHAFTS | {"surface": Shaft(inertia=1.0)},
        couplings={**mounted().couplings, "shaft": Coupling(a="wheel", b="surface", stiffness=1e3, damping=1.0)},
        output="surface",
    )
    assert balance(gear, output_torque=-3.0, output_speed=1.0).input_torque == pytest.approx(-1.0)
    assert efficiency(gear, torque=3.0, speed=1.0) == pytest.approx(1.0)


def test_range_of_the_output_is_that_of_the_nearest_stop_through_the_gear():
    stops = {
        "wheel": EndStop(shaft="wheel", lower=-0.5, upper=0.4, stiffness=1.0),
        "motor": EndStop(shaft="motor", lower=-0.9, upper=6.0, stiffness=1.0),
    }
    assert mounted(stops=stops).output_range() == pytest.approx((-0.5, 0.3))
    assert mounted().output_range() == (-math.inf, math.inf)


def test_a_brake_is_a_bearing_that_rubs_at_every_speed():
    jammed = add_brake(mounted(), "wheel", 40.0)
    assert jammed.bearings == {"brake_wheel": Brake(shaft="wheel", torque=40.0)}
    assert jammed.shafts == SHAFTS


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: EndStop(shaft="a", lower=0.5, upper=0.5, stiffness=1.0),
            "EndStop on shaft 'a' needs lower < upper, got lower=0.5 rad and upper=0.5 rad",
        ),
        (
            lambda: Coupling(a="a", b="b", stiffness=1.0, damping=0.0, gap=-0.1),
            "Coupling.gap must be >= 0 rad, got -0.1 rad",
        ),
        (
            lambda: mounted(stops={"end": EndStop(shaft="flap", lower=-1.0, upper=1.0, stiffness=1.0)}),
            "Transmission.stops.end.shaft names shaft 'flap'; the shafts are motor, wheel, housing",
        ),
        (
            lambda: Transmission(
                shafts=SHAFTS,
                couplings={
                    "c": Coupling(a="motor", b="wheel", stiffness=1.0, damping=0.0),
                    "m": Coupling(a="housing", stiffness=1.0, damping=0.0),
                },
                input="motor",
                output="wheel",
            ),
            "shaft 'housing' is not joined to the input 'motor'",
        ),
    ],
)
def test_what_cannot_be_is_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()
