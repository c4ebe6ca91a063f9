"""LuGre friction in bearings and meshes, integrated with the actuator.

Oracles: the experiments of the paper that published it (presliding, breakaway, stick-slip) and a pair of wheels, their
equations written out here and solved by Radau to 1e-10; closed forms of steady sliding and of small presliding.
"""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from actuator import (
    Actuator,
    Orbit,
    TorqueSource,
    classify,
    find_equilibrium_set,
    find_orbit,
    hunting_margin,
    linearize,
    linearize_modes,
    predict_breakaway,
    simulate,
    trim,
)
from actuator.orbits.flow import NoOrbit
from actuator.orbits.sampled import SampledOrbit
from actuator.simulation.signals import Constant, Ramp, Sum, Table
from actuator.verdict.verdict import Verdict
from controllers import PID
from gear import (
    Backlash,
    Bearing,
    Coulomb,
    Coupling,
    GivenPair,
    Harmonic,
    Linear,
    LuGre,
    LuGreBearing,
    Mesh,
    PeriodicFriction,
    Shaft,
    Transmission,
)
from gear.quantities.roles import Breakaway, FrictionMemory
from studies.converter import converter

pytestmark = pytest.mark.thorough

# Canudas de Wit, Olsson, Astrom, Lischinsky (1995), table I, for a unit mass
S0, S1, S2, COULOMB, STATIC, STRIBECK = 1e5, math.sqrt(1e5), 0.4, 1.0, 1.5, 1e-3
BRISTLES = LuGreBearing(
    shaft="mass",
    coulomb=COULOMB,
    breakaway=STATIC,
    stribeck_speed=STRIBECK,
    stiffness=S0,
    damping=S1,
    viscous=S2,
)
STATES = ["mass.angle", "mass.speed", "gear.bearings.rail.bristle"]


def mass(spring=None, **more):
    """A unit mass on bristles, with a spring to the housing or without, pushed by a torque."""
    couplings = {} if spring is None else {"spring": Coupling(a="mass", stiffness=spring, damping=0.0)}
    gear = Transmission(
        shafts={"mass": Shaft(inertia=1.0)},
        bearings={"rail": BRISTLES},
        couplings=couplings,
        input="mass",
        output="mass",
    )
    return Actuator(name="mass on bristles", motor=TorqueSource(), gear=gear, **more)


def level(v):
    return COULOMB + (STATIC - COULOMB) * math.exp(-((v / STRIBECK) ** 2))


def published(force, end, times, start=(0.0, 0.0, 0.0), pieces=()):
    """The paper's equations under a force over time and position; solved piece by piece between its corners."""

    def rates(t, y):
        x, v, z = y
        rate = v - S0 * abs(v) / level(v) * z
        return [v, force(t, x) - (S0 * z + S1 * rate + S2 * v), rate]

    found, state, edges = [], start, [0.0, *pieces, end]
    for first, last in zip(edges, edges[1:], strict=False):
        inside = times[(times >= first) & ((times < last) | (last == end))]
        solved = solve_ivp(
            rates, (first, last), state, method="Radau", rtol=1e-10, atol=[1e-12, 1e-12, 1e-14], dense_output=True
        )
        found.append(solved.sol(inside))
        state = solved.y[:, -1]
    return np.concatenate(found, axis=1)


def agrees(run, expected, part):
    """Whether every state differs from the solution by less than a part of its largest value."""
    for name, row in zip(STATES, expected, strict=True):
        assert abs(run[name] - row).max() < part * abs(row).max(), name


def test_the_published_stick_slip_comes_out():
    # the end of a spring of 2 N/m is pulled with 0.1 m/s
    run = simulate(mass(2.0), 20.0, inputs={"torque_reference": Ramp(slope=0.2)}, tolerance=1e-9)
    expected = published(lambda t, x: 0.2 * t - 2 * x, 20.0, run.t)
    agrees(run, expected, 1e-5)
    assert np.sum(np.diff(np.sign(run["mass.speed"] - 0.05)) > 0) == 2  # it slipped twice


def test_the_published_presliding_is_a_loop_of_micrometers():
    # up to 95 % of the breakaway force, down to as much the other way, and up again
    top, rate = 0.95 * STATIC, 0.5
    edges = [top / rate, 3 * top / rate, 5 * top / rate]
    force = Table(times=(0.0, *edges), values=(0.0, top, -top, top))
    run = simulate(mass(), edges[-1], inputs={"torque_reference": force}, tolerance=1e-9)
    at = lambda t, _: np.interp(t, (0.0, *edges), (0.0, top, -top, top))  # noqa: E731
    expected = published(at, edges[-1], run.t, pieces=edges[:-1])
    agrees(run, expected, 1e-5)
    assert 1e-5 < np.ptp(run["mass.angle"]) < 1e-4
    first, last = (run["mass.angle"][np.argmin(abs(run.t - time))] for time in (edges[0], edges[-1]))
    assert last == pytest.approx(first, rel=0.02)  # the loop closes


def test_the_published_breakaway_falls_with_the_rate_of_the_force():
    peaks = []
    for rate in (1.0, 5.0, 20.0):
        end = 2 * STATIC / rate
        run = simulate(mass(), end, inputs={"torque_reference": Ramp(slope=rate)}, tolerance=1e-9)
        expected = published(lambda t, _, rate=rate: rate * t, end, run.t)
        agrees(run, expected, 1e-5)
        peaks.append(run["gear.bearings.rail.friction"][run["mass.speed"] < 10 * STRIBECK].max())
    assert STATIC > peaks[0] > peaks[1] > peaks[2] > COULOMB


@pytest.mark.parametrize("torque", [1.2, -3.0])
def test_steady_sliding_is_the_stribeck_curve(torque):
    run = simulate(mass(), 40.0, inputs={"torque_reference": torque})
    speed = (abs(torque) - COULOMB) / S2  # far above the Stribeck speed
    assert run["mass.speed"][-1] == pytest.approx(math.copysign(speed, torque), rel=1e-5)
    assert run["gear.bearings.rail.friction"][-1] == pytest.approx(torque, rel=1e-5)
    assert run["gear.bearings.rail.bristle"][-1] == pytest.approx(math.copysign(COULOMB / S0, torque), rel=1e-5)
    assert BRISTLES.sliding(0.0, speed) == pytest.approx(abs(torque))
    assert BRISTLES.sliding(0.0, 0.0) == BRISTLES.holding(0.0) == STATIC


def test_small_presliding_is_a_damped_oscillator():
    push = 1e-4 * STATIC
    run = simulate(mass(), 0.1, inputs={"torque_reference": push}, tolerance=1e-10)
    decay = (S1 + S2) / 2
    omega = math.sqrt(S0 - decay**2)
    shape = np.exp(-decay * run.t) * (np.cos(omega * run.t) + decay / omega * np.sin(omega * run.t))
    assert run["mass.angle"] == pytest.approx(push / S0 * (1 - shape), abs=1e-3 * push / S0)
    model = linearize(trim(mass(), "stuck"), ["torque_reference"], ["load_angle"])
    poles = sorted(np.linalg.eigvals(model.A), key=lambda pole: pole.imag)
    assert poles == pytest.approx([-decay - 1j * omega, 0.0, -decay + 1j * omega], rel=1e-6, abs=1e-6)


def test_what_the_force_does_is_stored_and_lost():
    run = simulate(mass(2.0), 20.0, inputs={"torque_reference": Ramp(slope=0.2)}, resolution=1e-3, tolerance=1e-8)
    work, lost = (
        np.trapezoid(power, run.t) for power in (run["motor_torque"] * run["mass.speed"], run["friction_loss"])
    )
    assert work == pytest.approx(lost + run["mechanical_energy"][-1] - run["mechanical_energy"][0], rel=1e-4)
    assert lost > 1.0
    assert abs(run["damping_loss"]).max() < 1e-12


# -- in a mesh ------------------------------------------------------------------------------------------

PAIR = GivenPair(radius_a=0.01, radius_b=0.03, friction_arm_a=1e-3, friction_arm_b=2e-3)
TEETH = Linear(stiffness=1e6, damping=1e3)
LAW = LuGre(sliding=0.1, static=0.15, stribeck_speed=1e-3, stiffness=1e4, damping=10.0, viscous=0.5)


def wheels(law, elasticity=TEETH, bearings=None):
    mesh = Mesh(a="a", b="b", pair=PAIR, elasticity=elasticity, friction=law)
    gear = Transmission(
        shafts={"a": Shaft(inertia=1e-4), "b": Shaft(inertia=1e-3)},
        meshes={"mesh": mesh},
        bearings=bearings or {},
        input="a",
        output="b",
    )
    return Actuator(name="wheels", motor=TorqueSource(), gear=gear)


def two_wheels(drive, load, factor, times):
    """Angles, speeds and bristle of two wheels by sections 2 and 3 of the gear contact's equations."""
    l_a, l_b = (radius * math.cos(math.radians(20)) for radius in (0.01, 0.03))

    def rates(t, y):
        a, b, w_a, w_b, z = y
        normal = 1e6 * (0.01 * a + 0.03 * b) + 1e3 * (0.01 * w_a + 0.03 * w_b)
        v = (0.01 * w_a - 0.03 * w_b) / 2
        rate = v - 1e4 * abs(v) / (0.1 + 0.05 * math.exp(-((v / 1e-3) ** 2))) * z
        s = factor((0.01 * a - 0.03 * b) / 2) * (1e4 * z + 10.0 * rate + 0.5 * v) * abs(normal)
        return [
            w_a,
            w_b,
            (drive(t) - normal * l_a - s * 1e-3) / 1e-4,
            (load - normal * l_b + s * 2e-3) / 1e-3,
            rate,
        ]

    solved = solve_ivp(rates, (0, times[-1]), np.zeros(5), method="Radau", rtol=1e-10, atol=1e-13, t_eval=times)
    return dict(zip(["a.angle", "b.angle", "a.speed", "b.speed", "gear.meshes.mesh.bristle"], solved.y, strict=True))


@pytest.mark.parametrize("wave", [0.0, 0.3])
def test_bristles_in_a_mesh_rub_with_the_normal_force(wave):
    law = LAW if not wave else PeriodicFriction(law=LAW, harmonics=(Harmonic(sine=wave),), pitch=0.002)
    inputs = {"torque_reference": Sum(parts=(Constant(value=1.0), Ramp(slope=0.5))), "load_torque": 3.05}
    run = simulate(wheels(law), 1.0, inputs=inputs, tolerance=1e-9)
    factor = lambda x: 1 + wave * math.sin(2 * math.pi * x / 0.002)  # noqa: E731
    expected = two_wheels(lambda t: 1.0 + 0.5 * t, 3.05, factor, run.t)
    for name, row in expected.items():
        assert abs(run[name] - row).max() < 1e-4 * abs(row).max(), name


def test_separated_teeth_do_not_rub():
    run = simulate(wheels(LAW, Backlash(gap=1e-3, law=TEETH)), 1e-3, inputs={"torque_reference": 0.01})
    assert run.modes["gear.meshes.mesh"][-1] == "free" if "gear.meshes.mesh" in run.modes else True
    assert run["a.speed"][-1] == pytest.approx(0.01 * 1e-3 / 1e-4, rel=1e-6)
    assert not run["gear.meshes.mesh.friction"].any()
    assert run["gear.meshes.mesh.bristle"][-1] > 0  # which follow the motion all the same


# -- what it is not --------------------------------------------------------------------------------------


def test_only_what_sticks_is_decided_jointly():
    bearings = {"rail": Bearing(shaft="a", coulomb=0.01, breakaway=0.02)}
    system = wheels(LAW, bearings=bearings).system()
    assert [contact.name for contact in system.contacts] == ["gear.bearings.rail"]
    assert [mode.name for mode in system.mode_variables] == ["gear.bearings.rail.motion", "gear.meshes.mesh.flank"]
    (memory,) = system.signals_having(FrictionMemory)
    assert (memory.name, memory.unit, memory.owner) == ("gear.meshes.mesh.bristle", "m", "LuGre of gear.meshes.mesh")
    assert {parameter.name for parameter in system.parameters_having(Breakaway)} == {
        "gear.bearings.rail.breakaway",
        "gear.meshes.mesh.friction.static",
    }


def held():
    return mass(controller=PID(proportional=3.0, integral=4.0, derivative=6.0))


@pytest.mark.parametrize(
    ("analysis", "asked"),
    [
        ("find_equilibrium_set", lambda: find_equilibrium_set(mass(), {})),
        ("predict_breakaway", lambda: predict_breakaway(mass(), {})),
        ("linearize_modes", lambda: linearize_modes(mass())),
        ("the stiction margin", lambda: hunting_margin(held(), "stiction")),
    ],
)
def test_what_asks_for_modes_says_by_name_that_it_does_not_apply(analysis, asked):
    with pytest.raises(ValueError, match=f"{analysis} does not apply to .*LuGreBearing of gear.bearings.rail never"):
        asked()


def test_files_name_the_laws():
    made = converter().structure(
        {
            "type": "LuGre",
            "sliding": 0.1,
            "static": 0.15,
            "stribeck_speed": 1e-3,
            "stiffness": 1e4,
            "damping": 10,
            "viscous": 0.5,
        },
        Mesh.__dataclass_fields__["friction"].type,
    )
    assert made == LAW


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: LuGre(sliding=0.2, static=0.1, stribeck_speed=1.0, stiffness=1.0), "LuGre needs sliding <= static"),
        (
            lambda: LuGreBearing(shaft="a", coulomb=2.0, breakaway=1.0, stribeck_speed=1.0, stiffness=1.0),
            "LuGreBearing on shaft 'a' needs coulomb <= breakaway, got coulomb=2 N m and breakaway=1 N m",
        ),
        (lambda: Coulomb(sliding=0.1, static=0.2).friction([], None), "Coulomb.friction: a law that sticks has no"),
        (
            lambda: Bearing(shaft="a", coulomb=0.1, breakaway=0.2).friction([], 0.0, 0.0),
            "Bearing.friction: a bearing that sticks has no friction without a mode",
        ),
    ],
)
def test_what_has_no_meaning_is_refused(make, message):
    with pytest.raises((ValueError, TypeError), match=message):
        make()


def test_it_hunts_without_ever_sticking():
    run = simulate(held(), 140.0, inputs={"reference": 1.0})
    assert classify(run).verdict == Verdict.LIMIT_CYCLE
    with pytest.raises(NoOrbit, match="no event in .* a cycle without any is linear, or one with friction"):
        find_orbit(held(), run)


@pytest.mark.parametrize("kind", [Orbit, SampledOrbit])
def test_an_orbit_has_no_stuck_share(kind):
    orbit = object.__new__(kind)
    object.__setattr__(orbit, "system", held().system())
    with pytest.raises(ValueError, match="the stuck share of an orbit does not apply to mass on bristles"):
        orbit.stick_fraction  # noqa: B018 - a property that raises
