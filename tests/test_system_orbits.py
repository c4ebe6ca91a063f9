"""Exact orbits of whole actuators: two sticking meshes, and the built-in aileron.

Oracles: finite differences of the return map, integrated without derivatives;
the period that simulations show; the trivial multiplier.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from actuator import classify, find_equilibrium_set, find_orbit, predict_breakaway, simulate
from actuator.orbits.segments import passage
from studies import load_case

pytestmark = pytest.mark.thorough

DURATION = 20.0  # s


@cache
def aileron():
    return load_case("aileron").actuator


@cache
def two_meshes():
    """The aileron with friction in its two meshes only, which have no backlash: no contact holds another's shaft."""
    gear = aileron().gear
    meshes = {name: replace(mesh, elasticity=mesh.elasticity.law) for name, mesh in gear.meshes.items()}
    load = replace(aileron().load, bias=30.0)
    return replace(aileron(), name="two meshes", gear=replace(gear, meshes=meshes, bearings={}), load=load)


@cache
def orbit_of(plant, segments=1):
    run = simulate(plant, DURATION, inputs={"reference": 0.1}, resolution=2e-3)
    return find_orbit(plant, run, segments=segments), classify(run)


def return_map(orbit, step):
    """Eigenvalues of the slopes of the state after the cycle's last event by the state after its first.

    The slopes are those of cubics through 32 points.
    The state is moved only in directions that its stuck contacts allow, which are those in which it returns.
    """
    scale, m = orbit.map.nominal, orbit.map
    whole = passage(m, orbit.x0, orbit.segments, orbit.u, orbit.p, np.eye(scale.size)).moved
    left, size, _ = np.linalg.svd(whole * scale / scale[:, None])
    allowed = left[:, size > 1e-9 * size[0]]
    # the ends are known to 3e-7 of their size, the tolerance of the integration: many points make the slope sharper
    moves = np.arange(1, 17)
    powers = np.linalg.pinv(np.column_stack([moves, moves**3]))
    matrix = np.zeros((allowed.shape[1], allowed.shape[1]))
    for column, direction in enumerate(allowed.T):
        ends = {
            k: passage(m, orbit.x0 + k * step * direction * scale, orbit.segments, orbit.u, orbit.p).end
            for k in (*moves, *-moves)
        }
        odd = np.array([(ends[k] - ends[-k]) / 2 for k in moves])
        matrix[:, column] = allowed.T @ ((powers @ odd)[0] / scale) / step
    found = np.linalg.eigvals(matrix)
    return found[np.argsort(-abs(found))]


def test_multipliers_of_two_sticking_meshes_are_those_of_difference_quotients_of_the_return_map():
    orbit, verdict = orbit_of(two_meshes())
    assert {event.contact for event in orbit.events} == {"gear.meshes.first", "gear.meshes.second"}
    assert orbit.period == pytest.approx(verdict.period_s, rel=1e-3)
    assert orbit.trivial_error < 1e-6
    found = return_map(orbit, 1.5e-3)
    np.testing.assert_allclose(found[:2], orbit.multipliers[:2], rtol=0, atol=1e-5)
    assert abs(orbit.multipliers[0]) > 0.1  # there is something to compare


@pytest.mark.parametrize("segments", [2, 5])
def test_multipliers_of_two_sticking_meshes_do_not_depend_on_the_number_of_arcs(segments):
    one, many = orbit_of(two_meshes())[0], orbit_of(two_meshes(), segments)[0]
    assert many.period == pytest.approx(one.period, rel=1e-7)
    np.testing.assert_allclose(many.multipliers, one.multipliers, rtol=0, atol=1e-6)


def test_the_aileron_is_on_a_stable_orbit():
    orbit, verdict = orbit_of(aileron())
    assert orbit.period == pytest.approx(verdict.period_s, rel=1e-3)
    assert orbit.load_amplitude == pytest.approx(verdict.amplitude_rad, rel=1e-3)
    assert orbit.motor_amplitude == pytest.approx(verdict.motor_amplitude_rad, rel=1e-3)
    assert orbit.stick_fraction == pytest.approx(verdict.stick_fraction, abs=1e-3)
    assert orbit.trivial_error < 1e-5
    assert orbit.residual < 3e-5
    assert orbit.stable
    assert abs(orbit.multipliers[0]) == pytest.approx(0.407, abs=1e-3)


def test_the_longest_standstill_of_the_aileron_lasts_as_long_as_its_drift_time():
    orbit, _ = orbit_of(aileron())
    longest = max(range(len(orbit.segments)), key=lambda k: orbit.segments[k].duration)
    segment, start = orbit.segments[longest], orbit.starts[longest]
    names = [state.name for state in orbit.system.states]
    state = dict(zip(names, start, strict=True))
    found = predict_breakaway(aileron(), state, inputs={"reference": 0.1})
    assert found.drift_time == pytest.approx(segment.duration, rel=1e-6)
    held, outputs = find_equilibrium_set(aileron(), state), [output.name for output in orbit.system.outputs]
    values = orbit.system.outputs_function(start, segment.modes, orbit.u, orbit.p)
    assert held.lower < float(values[outputs.index("motor_torque")]) < held.upper
