"""Families of orbits and where they end.

Oracles: the mass on a guide, whose cycle is proportional to breakaway minus sliding friction and ends where both are
equal, and whose dead band ends the cycle at the value from the closed form; bisection by simulation.
"""

import pytest
from mass_on_guide import MassOnGuide
from test_actuator_orbit import hunting
from test_actuator_sampled_orbit import mass as sampled_mass

from actuator import (
    Actuator,
    NoOrbit,
    TorqueSource,
    bisect_by_simulation,
    continue_orbit,
    find_orbit,
    hunting_boundary,
    hunting_margin,
)
from controllers import PID
from gear import Backlash, Bearing, ExternalPair, Linear, Mesh, Shaft, Transmission

pytestmark = pytest.mark.thorough

# compiled where there is a compiler: a family is many orbits
BREAKAWAY, DEAD = "gear.bearings.guide.breakaway", "controller.remedies.dead_band"


def orbit_of(mass):
    return find_orbit(*hunting(mass))


def test_the_cycle_shrinks_to_nothing_where_breakaway_is_sliding_friction():
    branch = continue_orbit(orbit_of(MassOnGuide()), BREAKAWAY, (0.5, 3.0), upward=False)
    assert branch.end.kind == "amplitude zero"
    assert branch.end.value == pytest.approx(1.0, abs=1e-6)
    assert branch.stable.all()
    published = 0.06724014692
    for value, orbit in zip(branch.values, branch.orbits, strict=True):
        assert orbit.load_amplitude == pytest.approx(published * (value - 1) / 0.5, rel=1e-7)


def test_every_orbit_of_a_family_is_one_of_the_closed_form():
    branch = continue_orbit(orbit_of(MassOnGuide()), "controller.proportional", (2.9, 3.3), upward=True)
    assert branch.end.kind == "bound"
    for value, orbit in list(zip(branch.values, branch.orbits, strict=True))[::2]:
        expected = MassOnGuide(kp=value).cycle()
        assert orbit.period == pytest.approx(expected.period, rel=1e-8)
        assert orbit.multipliers[0] == pytest.approx(expected.multiplier, abs=1e-7)


def test_a_dead_band_ends_the_cycle_where_the_mass_stops_on_its_edge():
    # let go at one edge of the dead band, with z = 1.5 - 3 dead, it creeps to 3 e + z = 1: to the other edge
    edge = (1.5 - 1.0) / (2 * 3.0)
    branch = continue_orbit(orbit_of(MassOnGuide(dead=0.04)), DEAD, (0.0, 0.3), upward=True)
    assert branch.end.kind == "period infinite"
    assert branch.end.value == pytest.approx(edge, rel=1e-4)


def test_the_end_of_the_family_is_where_simulations_cease_to_hunt():
    plant, options = MassOnGuide().actuator(), {"inputs": {"reference": 1.0}, "duration": 300.0}
    exact = hunting_boundary(plant, "controller.integral", (15.0, 30.0), **options)
    assert exact.end.kind == "crossing-sliding"
    assert "and with it all sticking" in exact.end.reason
    assert exact.exact
    assert [interval.ends for interval in exact.intervals] == [exact.value]
    assert exact.branches[0].end == exact.end
    runs = bisect_by_simulation(plant, "controller.integral", (15.0, 30.0), **options)
    assert exact.value == pytest.approx(runs.value, rel=0.01)


def with_backlash():
    """A load that sticks, behind a stage with a gap through which the motor bounces."""
    play = Backlash(gap=5e-5, law=Linear(stiffness=1e6, damping=2e3))
    gear = Transmission(
        shafts={"motor": Shaft(inertia=0.02), "load": Shaft(inertia=1.0)},
        meshes={
            "stage": Mesh(a="motor", b="load", pair=ExternalPair(teeth_a=20, teeth_b=80, module=2e-3), elasticity=play)
        },
        bearings={"load": Bearing(shaft="load", coulomb=0.5, breakaway=0.8, viscous=0.5)},
        input="motor",
        output="load",
    )
    pid = PID(proportional=30.0, integral=30.0, derivative=12.0)
    return Actuator(name="backlash", motor=TorqueSource(), gear=gear, controller=pid)


def test_with_backlash_too_the_last_family_ends_where_simulations_cease_to_hunt():
    start = {"load.angle": 0.08, "motor.angle": -0.32}
    options = {"inputs": {"reference": 0.1}, "start": start, "duration": 20.0}
    exact = hunting_boundary(with_backlash(), "controller.integral", (365.0, 420.0), **options)
    assert exact.exact
    assert exact.end.kind == "crossing-sliding"
    assert "and with it all sticking" in exact.end.reason
    runs = bisect_by_simulation(with_backlash(), "controller.integral", (365.0, 420.0), **options)
    assert exact.value == pytest.approx(runs.value, rel=0.01)


def test_sampled_families_lead_to_where_simulations_cease_to_hunt():
    options = {"inputs": {"reference": 0.0}, "start": {"mass.angle": 0.1}, "duration": 300.0}
    exact = hunting_boundary(sampled_mass(5e-2), "controller.integral", (15.0, 18.0), **options)
    assert exact.branches[0].orbits[0].stable
    runs = bisect_by_simulation(sampled_mass(5e-2), "controller.integral", (15.0, 18.0), **options)
    assert exact.value == pytest.approx(runs.value, rel=0.01)


def test_the_stiction_margin_of_the_sampled_mass_ends_near_its_sliding_friction():
    options = {"inputs": {"reference": 0.0}, "start": {"mass.angle": 0.1}, "duration": 100.0}
    margin = hunting_margin(sampled_mass(5e-2), "stiction", **options)
    assert margin.factor == pytest.approx(1.0 / 1.5, rel=0.03)


def test_hunting_that_goes_on_to_the_other_bound_has_no_boundary_there():
    plant, options = MassOnGuide().actuator(), {"inputs": {"reference": 1.0}, "duration": 300.0}
    with pytest.raises(NoOrbit, match=r"goes on up to the other bound, controller.integral = 4.5"):
        hunting_boundary(plant, "controller.integral", (4.0, 4.5), **options)


def test_bounds_must_hold_the_orbit():
    with pytest.raises(ValueError, match=r"breakaway = 1.5 must lie between its bounds 2, 3"):
        continue_orbit(orbit_of(MassOnGuide()), BREAKAWAY, (2.0, 3.0), upward=True)


def test_an_unknown_parameter_is_named():
    with pytest.raises(KeyError, match="no parameter named 'controller.integrl'; did you mean controller.integral"):
        continue_orbit(orbit_of(MassOnGuide()), "controller.integrl", (0.0, 3.0), upward=True)


def test_the_stiction_margin_of_the_mass_ends_at_its_sliding_friction():
    plant, options = MassOnGuide(breakaway=1.3).actuator(), {"inputs": {"reference": 1.0}, "compiled": False}
    margin = hunting_margin(plant, "stiction", duration=600.0, **options)
    assert margin.parameters == (BREAKAWAY,)
    assert margin.factor == pytest.approx(1.0 / 1.3, rel=0.02)
    assert margin.db < 0


def test_the_integral_gain_margin_is_the_boundary_over_the_gain():
    plant = MassOnGuide(breakaway=1.0).actuator()  # it rests, and its linear loop is stable up to 6 * 3 = 18
    start = {"mass.angle": 0.9}
    margin = hunting_margin(
        plant, "integral gain", inputs={"reference": 1.0}, start=start, duration=300.0, compiled=False
    )
    assert margin.factor > 1
    assert [verdict for factor, verdict in margin.runs if factor == 1.0] == ["rest"]


def test_a_margin_of_nothing_is_refused():
    with pytest.raises(ValueError, match="kind must be one of stiction, backlash, integral gain, got 'luck'"):
        hunting_margin(MassOnGuide().actuator(), "luck")
    with pytest.raises(ValueError, match=r"mass on a guide has no backlash, so there is no backlash margin"):
        hunting_margin(MassOnGuide().actuator(), "backlash")
