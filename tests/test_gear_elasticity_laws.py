"""Progressive teeth, backlash as printed, periodic stiffness, tooth faults and transmission errors.

Oracles: the piecewise formulas with plain ifs, the differential equation of a law integrated numerically, the
energy (force is its derivative), difference quotients, the laws themselves in symbols, and runs of one stage
whose deflection must repeat what its wheels were given.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from oracles import PAPER_PAIR, gradient_in_symbols, in_symbols, numbers, pressed, signs
from scipy.integrate import solve_ivp

from actuator import Actuator, Load, Sine, TorqueSource, simulate
from gear import (
    Backlash,
    BacklashAsPrinted,
    Coulomb,
    ErrorHarmonic,
    GivenPair,
    Harmonic,
    Linear,
    Mesh,
    PeriodicStiffness,
    ProgressiveISO,
    ProgressiveNiemann,
    Shaft,
    ToothFault,
    ToothFaults,
    Transmission,
    TransmissionError,
    elasticity_curves,
)
from gear.elasticity.law import has_gap
from gear.motion import MeshMotion
from studies.converter import converter

STIFFNESS, DAMPING, ROUGHNESS = 2e8, 2e5, 0.8e-6  # van der Linden, Tables 3 and 4
GAP = 15e-6  # m, total: van der Linden, Table 4
PITCH = math.pi * 1e-3  # m, module 1 mm
TEETH = 20
NOTHING = 5e-4  # N
ISO = ProgressiveISO(stiffness=STIFFNESS, damping=DAMPING, roughness=ROUGHNESS)
NIEMANN = ProgressiveNiemann(stiffness=STIFFNESS, nominal_force=280.0, damping=DAMPING)
SPRINGS = (ISO, NIEMANN, ProgressiveNiemann(stiffness=1e8, nominal_force=5e3, damping=0.0, initial=0.01))
GAPPED = (Backlash(gap=GAP, law=ISO), Backlash(gap=GAP, law=NIEMANN), BacklashAsPrinted(gap=GAP, law=ISO))
OVER_A_TOOTH = (Harmonic(cosine=0.2, sine=0.05), Harmonic(), Harmonic(sine=0.04))
WEAK = ToothFault(wheel="a", teeth=TEETH, remaining=0.6, angle=1.0)
WORN = ToothFault(wheel="b", teeth=3 * TEETH, remaining=0.9, angle=-2.0, edge=0.5)
HARMONICS = {
    "eccentricity": ErrorHarmonic(wheel="a", order=1, amplitude=10e-6, phase=0.4),
    "teeth": ErrorHarmonic(wheel="b", order=60, amplitude=0.5e-6),
}


def periodic(law):
    return PeriodicStiffness(law=law, pitch=PITCH, harmonics=OVER_A_TOOTH)


def faulty(law):
    return ToothFaults(law=law, faults={"weak": WEAK, "worn": WORN})


def with_error(law):
    return TransmissionError(law=law, harmonics=HARMONICS)


LAWS = (
    *(SPRINGS),
    *GAPPED,
    *(periodic(law) for law in (ISO, *GAPPED)),
    *(faulty(law) for law in (ISO, *GAPPED)),
    *(with_error(law) for law in (ISO, *GAPPED)),
    with_error(faulty(periodic(Backlash(gap=GAP, law=ISO)))),
)

springy = pytest.mark.parametrize("law", SPRINGS, ids=str)
elastic = pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)
deflections, rates, flanks = numbers(-5e-5, 5e-5), numbers(-1e-1, 1e-1), st.sampled_from((-1.0, 0.0, 1.0))
motions = st.builds(
    MeshMotion,
    deflection=deflections,
    rate=rates,
    position=numbers(-1.0, 1.0),
    speed=numbers(-1.0, 1.0),
    turn_a=numbers(-50.0, 50.0),
    turn_b=numbers(-50.0, 50.0),
    speed_a=numbers(-100.0, 100.0),
    speed_b=numbers(-100.0, 100.0),
    pair=st.none(),
)
few, many = settings(deadline=None, max_examples=20), settings(deadline=None, max_examples=60)


# -- oracles ------------------------------------------------------------------------------------------


def iso_by_pieces(deflection, stiffness=STIFFNESS, roughness=ROUGHNESS):
    """Van der Linden, eq. (41), with the sign of the outer branch that makes it continuous."""
    size, sign = abs(deflection), math.copysign(1.0, deflection)
    if size <= roughness:
        return stiffness / (2 * roughness) * deflection**2 * sign
    return stiffness * (size - roughness / 2) * sign


def niemann_integrated(law, deflection):
    """Force at a positive deflection from dF/dx = stiffness (initial + (1 - initial) F / F_nom), at most stiffness."""

    def slope(_, force):
        return [law.stiffness * (law.initial + (1 - law.initial) * min(force[0] / law.nominal_force, 1.0))]

    found = solve_ivp(slope, (0.0, deflection), [0.0], rtol=1e-10, atol=1e-9, max_step=deflection / 50)
    return found.y[0, -1]


def engaged(law, motion, flank, penetration):
    """The same motion with the teeth pressed into each other on a flank; as it is without a gap."""
    if not has_gap(law):
        return motion
    return motion._replace(deflection=motion.deflection + flank * (penetration - law.penetration(motion, flank)))


def quotient(function, x, step):
    return (function(x + step) - function(x - step)) / (2 * step)


# -- progressive springs ------------------------------------------------------------------------------


@many
@given(deflection=deflections)
def test_iso_teeth_are_a_parabola_and_then_a_line(deflection):
    assert ISO.spring(deflection) == pytest.approx(iso_by_pieces(deflection), rel=1e-12, abs=1e-18)


@pytest.mark.parametrize(("deflection", "force"), [(0.4e-6, 20.0), (0.8e-6, 80.0), (1.8e-6, 280.0), (-1.8e-6, -280.0)])
def test_iso_teeth_by_hand(deflection, force):
    assert ISO.spring(deflection) == pytest.approx(force)


@pytest.mark.parametrize("law", SPRINGS[1:], ids=str)
@pytest.mark.parametrize("part", [0.1, 0.5, 0.99, 1.0, 1.5, 4.0])
def test_niemann_teeth_solve_their_differential_equation(law, part):
    deflection = part * law.nominal_deflection()
    assert law.spring(deflection) == pytest.approx(niemann_integrated(law, deflection), rel=1e-6)


def test_niemann_teeth_bear_the_nominal_force_at_the_nominal_deflection():
    assert NIEMANN.nominal_deflection() == pytest.approx(math.log(1 / 0.546) / (0.454 * 2e8 / 280.0))
    assert NIEMANN.spring(NIEMANN.nominal_deflection()) == pytest.approx(280.0, rel=1e-12)


def test_niemann_teeth_deflect_at_the_nominal_force_as_with_the_fourth_root_of_the_standards():
    """dF/dx = c (F/F_nom)^(1/4) gives x = 4/3 F_nom/c, if `initial` is left as it is."""
    assert NIEMANN.nominal_deflection() == pytest.approx(4 / 3 * 280.0 / STIFFNESS, rel=1e-3)


@springy
@many
@given(deflection=deflections, rate=rates)
def test_springs_and_dampers_are_odd(law, deflection, rate):
    assert law.spring(-deflection) == -law.spring(deflection)
    assert law.damper(-deflection, -rate) == -law.damper(deflection, rate)
    assert law.energy(-deflection) == law.energy(deflection)


@springy
@many
@given(deflection=numbers(1e-9, 5e-5))
def test_spring_force_is_the_derivative_of_its_energy(law, deflection):
    assert gradient_in_symbols(law.energy, deflection) == pytest.approx(law.spring(deflection), rel=1e-6)
    assert quotient(law.energy, deflection, deflection / 1e3) == pytest.approx(law.spring(deflection), rel=1e-4)


@springy
def test_energy_is_the_area_under_the_force(law):
    grid = np.linspace(0.0, 2e-5, 200_001)
    area = np.trapezoid([law.spring(x) for x in grid[::100]], grid[::100])
    assert law.energy(2e-5) == pytest.approx(area, rel=1e-4)


@springy
@many
@given(deflection=deflections)
def test_stiffness_grows_with_the_deflection_and_never_above_its_end(law, deflection):
    slope, further = (gradient_in_symbols(law.spring, part * deflection).item() for part in (1.0, 1.1))
    assert 0 <= slope <= law.stiffness * (1 + 1e-12)
    assert further >= slope * (1 - 1e-12)


@pytest.mark.parametrize(
    ("law", "edge"), [(ISO, ROUGHNESS), (NIEMANN, NIEMANN.nominal_deflection())], ids=["ISO", "Niemann"]
)
def test_force_and_slope_do_not_jump_where_the_stiffness_is_reached(law, edge):
    near = 1e-6 * edge
    inside, outside = (gradient_in_symbols(law.spring, edge + side * near).item() for side in (-1, 1))
    assert law.spring(edge + near) - law.spring(edge - near) == pytest.approx(2 * near * law.stiffness, rel=1e-5)
    assert inside == pytest.approx(outside, rel=1e-5)
    assert gradient_in_symbols(law.spring, edge).item() == pytest.approx(law.stiffness, rel=1e-12)


@pytest.mark.parametrize(("law", "initial"), [(ISO, 0.0), (NIEMANN, 0.546 * STIFFNESS)], ids=["ISO", "Niemann"])
def test_stiffness_without_load(law, initial):
    assert gradient_in_symbols(law.spring, 0.0).item() == pytest.approx(initial)
    assert law.spring(1e-12) == pytest.approx(initial * 1e-12, rel=1e-3, abs=1e-9)


# -- every law ----------------------------------------------------------------------------------------


@elastic
@many
@given(motion=motions, flank=flanks)
def test_laws_are_the_same_in_numbers_and_in_symbols(law, motion, flank):
    for of in (law.force, law.stored):
        number = of(motion, flank)
        assert isinstance(number, float)
        symbolic = in_symbols(lambda *x, of=of: of(MeshMotion(*x[:-1]), x[-1]), *motion[:-1], flank)
        assert symbolic == pytest.approx(number, rel=1e-9, abs=1e-9)


@elastic
@many
@given(motion=motions, flank=flanks)
def test_symbolic_slopes_of_the_force_are_its_difference_quotients(law, motion, flank):
    steps = {"deflection": 1e-9, "rate": 1e-6, "position": 1e-7, "turn_a": 1e-5, "turn_b": 1e-6, "speed_a": 1e-3}
    slopes = gradient_in_symbols(lambda *x: law.force(MeshMotion(*x), flank), *motion[:-1])
    for name, step in steps.items():

        def along(value, name=name):
            return law.force(motion._replace(**{name: value}), flank)

        value = getattr(motion, name)
        here, ahead, behind = along(value), along(value + step), along(value - step)
        assume(ahead - here == pytest.approx(here - behind, rel=1e-2, abs=NOTHING))  # not across an edge of the law
        slope = slopes[MeshMotion._fields.index(name)]
        assert slope * 2 * step == pytest.approx(ahead - behind, rel=1e-2, abs=NOTHING)


@elastic
@many
@given(motion=motions, penetration=numbers(1e-9, 5e-5), flank=signs())
def test_static_force_is_the_derivative_of_the_stored_energy(law, motion, penetration, flank):
    still = engaged(law, motion, flank, penetration)._replace(rate=0.0, speed_a=0.0, speed_b=0.0)
    slope = gradient_in_symbols(lambda x: law.stored(still._replace(deflection=x), flank), still.deflection).item()
    assert slope == pytest.approx(law.force(still, flank), rel=1e-6, abs=1e-9)


@elastic
@many
@given(motion=motions, flank=signs())
def test_a_gap_is_that_of_the_innermost_law(law, motion, flank):
    if not has_gap(law):
        assert law.penetration(motion, flank) is None
    else:
        assert law.penetration(motion, flank) + law.penetration(motion, -flank) == pytest.approx(-GAP, rel=1e-9)


@elastic
@few
@given(motion=motions)
def test_there_is_no_force_in_the_gap(law, motion):
    if has_gap(law):
        assert law.force(motion, 0.0) == 0
        assert law.stored(motion, 0.0) == 0


@elastic
def test_usual_force_is_that_of_a_micrometer_of_sound_teeth(law):
    spring = next(part for part in (NIEMANN, *SPRINGS) if str(part) in str(law))
    assert law.force_scale() == spring.spring(1e-6)


# -- backlash -----------------------------------------------------------------------------------------

PUSHING = [law for law in LAWS if has_gap(law) and "AsPrinted" not in str(law)]


@pytest.mark.parametrize("law", PUSHING, ids=lambda law: type(law).__name__)
@many
@given(motion=motions, penetration=numbers(0.0, 5e-5), flank=signs())
def test_teeth_with_backlash_cannot_pull_whatever_is_around_it(law, motion, penetration, flank):
    pressed_on = engaged(law, motion, flank, penetration)
    rounding = 1e-12 * STIFFNESS * GAP
    assert flank * law.force(pressed_on, flank) >= -rounding


@few
@given(penetration=numbers(0.0, 5e-5), flank=signs())
def test_backlash_goes_around_progressive_teeth(penetration, flank):
    static = GAPPED[0].force(pressed(flank * (GAP / 2 + penetration)), flank)
    assert static == pytest.approx(flank * iso_by_pieces(penetration), rel=1e-6, abs=1e-6)


@few
@given(penetration=numbers(0.0, 5e-5), rate=rates, flank=signs())
def test_backlash_as_printed_is_spring_and_damper_on_the_engaged_flank(penetration, rate, flank):
    """Van der Linden, eq. (43)."""
    force = GAPPED[2].force(pressed(flank * (GAP / 2 + penetration), flank * rate), flank)
    assert force == pytest.approx(flank * (iso_by_pieces(penetration) + DAMPING * rate), rel=1e-6, abs=1e-6)


def test_backlash_as_printed_jumps_at_engagement_and_pulls_at_separation_and_backlash_does_neither():
    edge = GAP / 2
    printed, limited = GAPPED[2], GAPPED[0]
    assert [printed.force(pressed(edge, rate), 1.0) for rate in (1e-3, -1e-3)] == pytest.approx([200.0, -200.0])
    assert [printed.force(pressed(-edge, rate), -1.0) for rate in (-1e-3, 1e-3)] == pytest.approx([-200.0, 200.0])
    assert [limited.force(pressed(edge, rate), 1.0) for rate in (1e-3, -1e-3)] == [0.0, 0.0]


# -- periodic stiffness and faults --------------------------------------------------------------------


@few
@given(position=numbers(-1.0, 1.0))
def test_stiffness_repeats_with_every_tooth_and_is_the_mean_on_average(position):
    law = periodic(ISO)
    assert law.factor(position + 7 * PITCH) == pytest.approx(law.factor(position), rel=1e-9)
    cycle = [law.factor(PITCH * k / 64) for k in range(64)]
    assert np.mean(cycle) == pytest.approx(1.0, rel=1e-12)
    assert min(cycle) > 0


def test_periodic_stiffness_by_hand():
    law = PeriodicStiffness(law=ISO, pitch=PITCH, harmonics=(Harmonic(cosine=0.3), Harmonic(sine=0.1)))
    factors = [law.factor(part * PITCH) for part in (0.0, 0.125, 0.25, 0.5)]
    assert factors == pytest.approx([1.3, 1.1 + 0.3 * math.sqrt(0.5), 1.0, 0.7])


def test_pitch_of_a_pair_is_pi_times_its_module():
    assert PAPER_PAIR.tooth_pitch == pytest.approx(PITCH)
    own, given = (PeriodicStiffness(law=ISO, pitch=pitch, harmonics=OVER_A_TOOTH) for pitch in (None, PITCH))
    motion = pressed(2e-6)._replace(position=0.4e-3, pair=PAPER_PAIR)
    assert own.force(motion, 1.0) == pytest.approx(given.force(motion, 1.0))


def test_a_sweep_over_the_module_moves_the_teeth_of_a_periodic_law():
    law = PeriodicStiffness(law=Linear(stiffness=1e7, damping=1e3), harmonics=OVER_A_TOOTH)

    def run(module, parameters=None):
        pair = replace(PAPER_PAIR, module=module)
        gear = Transmission(
            shafts={"a": Shaft(inertia=5e-4), "b": Shaft(inertia=1e-3)},
            meshes={"mesh": Mesh(a="a", b="b", pair=pair, elasticity=law)},
            input="a",
            output="b",
        )
        plant = Actuator(motor=TorqueSource(), gear=gear, load=Load(damping=0.05))
        inputs = {"torque_reference": 1.0}
        return simulate(plant, 0.2, inputs=inputs, parameters=parameters, resolution=1e-3, compiled=False)

    swept, built, plain = run(1e-3, {"gear.meshes.mesh.pair.module": 2e-3}), run(2e-3), run(1e-3)
    deflection = "gear.meshes.mesh.deflection"
    assert swept[deflection] == pytest.approx(built[deflection], rel=1e-6, abs=1e-12)
    assert abs(swept[deflection] - plain[deflection]).max() > 1e-7


def test_a_periodic_law_without_pitch_needs_a_pair_with_teeth():
    law = PeriodicStiffness(law=ISO, harmonics=OVER_A_TOOTH)
    message = "PeriodicStiffness.pitch is needed, in m: there is no pair that knows its teeth to take it from"
    with pytest.raises(ValueError, match=message):
        law.force(pressed(2e-6), 1.0)
    bare = {"radius_a": 10e-3, "radius_b": 30e-3, "friction_arm_a": 1e-3, "friction_arm_b": 2e-3}
    with pytest.raises(ValueError, match=message):
        Mesh(a="a", b="b", pair=GivenPair(**bare), elasticity=law)
    assert Mesh(a="a", b="b", pair=GivenPair(**bare, tooth_pitch=PITCH), elasticity=law)


@few
@given(motion=motions, flank=flanks)
def test_periodic_stiffness_and_faults_multiply_force_and_energy(motion, flank):
    law = GAPPED[0]
    for around, factor in (
        (periodic(law), periodic(law).factor(motion.position)),
        (faulty(law), WEAK.factor(motion) * WORN.factor(motion)),
    ):
        assert around.force(motion, flank) == pytest.approx(factor * law.force(motion, flank))
        assert around.stored(motion, flank) == pytest.approx(factor * law.stored(motion, flank))
        assert around.penetration(motion, flank) == law.penetration(motion, flank)


@pytest.mark.parametrize("teeth", [3, 17, 20, 120, 400])
@pytest.mark.parametrize("edge", [0.1, 0.25, 0.5])
def test_fault_window_is_one_tooth_wide_and_leaves_the_neighbors_alone(teeth, edge):
    fault = ToothFault(wheel="a", teeth=teeth, remaining=0.5, angle=2.0, edge=edge)
    tooth = 2 * math.pi / teeth
    assert fault.window(2.0) == pytest.approx(1.0)
    assert [fault.window(2.0 + side * tooth / 2) for side in (-1, 1)] == pytest.approx([0.5, 0.5], abs=0.06)
    assert [fault.window(2.0 + side * tooth) for side in (-1, 1)] == pytest.approx([0.0, 0.0], abs=0.03)
    assert fault.window(2.0 + math.pi) == pytest.approx(0.0, abs=1e-3)


def test_fault_window_rises_from_10_to_90_percent_over_its_edge():
    fault, tooth = ToothFault(wheel="a", teeth=60, remaining=0.5, edge=0.2), 2 * math.pi / 60
    levels = [fault.window(tooth * (0.5 + side * 0.1)) for side in (1, -1)]
    assert levels == pytest.approx([0.1, 0.9], abs=0.02)


@few
@given(turn=numbers(-50.0, 50.0))
def test_fault_comes_back_once_per_turn_of_its_own_wheel(turn):
    on_b = ToothFault(wheel="b", teeth=60, remaining=0.3)
    motion = pressed(0.0)._replace(turn_a=123.0, turn_b=turn)
    assert on_b.factor(motion) == on_b.factor(motion._replace(turn_a=-4.0))
    assert on_b.factor(motion._replace(turn_b=0.0)) == pytest.approx(0.3)
    assert WEAK.factor(motion._replace(turn_a=1.0)) == pytest.approx(0.6)
    assert on_b.factor(motion) == pytest.approx(on_b.factor(motion._replace(turn_b=turn + 6 * math.pi)), abs=1e-6)
    assert 0.3 <= on_b.factor(motion) <= 1.0


def test_fault_leaves_what_remains_in_the_middle_of_the_tooth_and_derivatives_everywhere():
    middle = pressed(0.0)._replace(turn_a=1.0 + 2 * math.pi)
    assert WEAK.factor(middle) == pytest.approx(0.6)
    for turn in np.linspace(0.0, 2 * math.pi, 41):
        slope = gradient_in_symbols(WEAK.window, turn).item()
        assert slope == pytest.approx(quotient(WEAK.window, turn, 1e-6), abs=1e-5)


# -- transmission error -------------------------------------------------------------------------------


@few
@given(motion=motions, flank=flanks)
def test_error_is_added_to_the_deflection(motion, flank):
    law = GAPPED[0]
    error = 10e-6 * math.cos(motion.turn_a + 0.4) + 0.5e-6 * math.cos(60 * motion.turn_b)
    rate = -10e-6 * math.sin(motion.turn_a + 0.4) * motion.speed_a
    rate -= 30e-6 * math.sin(60 * motion.turn_b) * motion.speed_b
    felt = motion._replace(deflection=motion.deflection + error, rate=motion.rate + rate)
    for of in ("force", "stored", "penetration"):
        expected = getattr(law, of)(felt, flank)
        assert getattr(with_error(law), of)(motion, flank) == pytest.approx(expected, rel=1e-9, abs=1e-12)


@few
@given(motion=motions)
def test_rate_of_the_error_is_its_time_derivative(motion):
    def error(time):
        moved = motion._replace(
            turn_a=motion.turn_a + motion.speed_a * time, turn_b=motion.turn_b + motion.speed_b * time
        )
        return sum(harmonic.error(moved) for harmonic in HARMONICS.values())

    rate = sum(harmonic.rate(motion) for harmonic in HARMONICS.values())
    assert rate == pytest.approx(quotient(error, 0.0, 1e-7), rel=1e-4, abs=1e-8)


@few
@given(motion=motions, flank=flanks)
def test_errors_faults_and_periodic_stiffness_act_alike_in_any_order(motion, flank):
    law = GAPPED[1]
    one, other = with_error(faulty(periodic(law))), periodic(faulty(with_error(law)))
    assert one.force(motion, flank) == pytest.approx(other.force(motion, flank), rel=1e-12)
    assert one.penetration(motion, flank) == other.penetration(motion, flank)


# -- curves -------------------------------------------------------------------------------------------


def test_curves_hold_force_and_stiffness_by_law_and_deflection():
    grid = np.linspace(-2e-5, 2e-5, 41)
    linear = Linear(stiffness=STIFFNESS, damping=DAMPING)
    curves = elasticity_curves({"linear": linear, "ISO": ISO, "ISO, backlash": GAPPED[0]}, grid)
    assert curves.sizes == {"law": 3, "deflection": 41}
    assert (curves.force.units, curves.stiffness.units, curves.deflection.units) == ("N", "N/m", "m")
    np.testing.assert_allclose(curves.force.sel(law="linear"), STIFFNESS * grid)
    np.testing.assert_allclose(curves.force.sel(law="ISO"), [iso_by_pieces(x) for x in grid], atol=1e-12)
    beyond = [math.copysign(max(abs(x) - GAP / 2, 0.0), x) for x in grid]
    np.testing.assert_allclose(curves.force.sel(law="ISO, backlash"), [iso_by_pieces(x) for x in beyond], atol=1e-6)
    steep = np.abs(grid) > GAP / 2 + ROUGHNESS
    np.testing.assert_allclose(curves.stiffness.sel(law="ISO, backlash")[steep], STIFFNESS)
    np.testing.assert_allclose(curves.stiffness.sel(law="ISO, backlash")[np.abs(grid) < GAP / 2], 0.0, atol=1e-6)


# -- files and parameters -----------------------------------------------------------------------------


def test_a_stack_of_laws_is_read_from_a_file():
    table = {
        "type": "TransmissionError",
        "law": {
            "type": "ToothFaults",
            "law": {
                "type": "PeriodicStiffness",
                "law": {
                    "type": "Backlash",
                    "gap_um": 15.0,
                    "law": {"type": "ProgressiveISO", "stiffness": 2e8, "damping": 2e5, "roughness": 0.8e-6},
                },
                "pitch": PITCH,
                "harmonics": [{"cosine": 0.2, "sine": 0.05}, {}, {"sine": 0.04}],
            },
            "faults": {
                "weak": {"wheel": "a", "teeth": 20, "remaining": 0.6, "angle": 1.0},
                "worn": {"wheel": "b", "teeth": 60, "remaining": 0.9, "angle": -2.0, "edge": 0.5},
            },
        },
        "harmonics": {
            "eccentricity": {"wheel": "a", "order": 1, "amplitude_um": 10.0, "phase": 0.4},
            "teeth": {"wheel": "b", "order": 60, "amplitude_um": 0.5},
        },
    }
    mesh = {"a": "pinion", "b": "wheel", "pair": {"type": "ExternalPair", "teeth_a": 20, "teeth_b": 60, "module": 1e-3}}
    read = converter().structure(mesh | {"elasticity": table}, Mesh)
    assert read.elasticity == with_error(faulty(periodic(Backlash(gap=GAP, law=ISO))))


# -- errors -------------------------------------------------------------------------------------------


def niemann(**changes):
    values = {"stiffness": 2e8, "nominal_force": 300.0, "damping": 0.0}
    return ProgressiveNiemann(**values | changes)


def fault(**changes):
    return ToothFault(**{"wheel": "a", "teeth": 20, "remaining": 0.5} | changes)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: ProgressiveISO(stiffness=2e8, damping=0.0, roughness=0.0),
            "ProgressiveISO.roughness must be > 0 m, got 0 m",
        ),
        (lambda: niemann(nominal_force=0.0), "ProgressiveNiemann.nominal_force must be > 0 N, got 0 N"),
        (lambda: niemann(initial=0.0), "ProgressiveNiemann.initial must be > 0, got 0"),
        (lambda: niemann(initial=1.0), "ProgressiveNiemann.initial must be < 1, got 1"),
        (lambda: BacklashAsPrinted(gap=-1e-6, law=ISO), "BacklashAsPrinted.gap must be >= 0 m, got -1e-06 m"),
        (
            lambda: PeriodicStiffness(law=ISO, pitch=PITCH, harmonics=(Harmonic(cosine=0.6), Harmonic(sine=0.6))),
            r"PeriodicStiffness.harmonics must leave a factor >= 0.01 everywhere, got -0\.\d+ at its lowest",
        ),
        (lambda: PeriodicStiffness(law=ISO, pitch=0.0, harmonics=()), "PeriodicStiffness.pitch must be > 0 m, got 0 m"),
        (lambda: fault(wheel="c"), 'ToothFault.wheel must be "a" or "b", got \'c\''),
        (lambda: fault(teeth=2), "ToothFault.teeth must be a whole number >= 3, got 2"),
        (lambda: fault(remaining=0.0), "ToothFault.remaining must be > 0, got 0"),
        (lambda: fault(remaining=1.1), "ToothFault.remaining must be <= 1, got 1.1"),
        (
            lambda: ErrorHarmonic(wheel="c", order=1, amplitude=1e-6),
            'ErrorHarmonic.wheel must be "a" or "b", got \'c\'',
        ),
        (
            lambda: ErrorHarmonic(wheel="a", order=1.5, amplitude=1e-6),
            "ErrorHarmonic.order must be a whole number >= 1, got 1.5",
        ),
        (
            lambda: ErrorHarmonic(wheel="a", order=1, amplitude=-1e-6),
            "ErrorHarmonic.amplitude must be >= 0 m, got -1e-06 m",
        ),
    ],
)
def test_laws_without_meaning_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


# -- one stage in motion ------------------------------------------------------------------------------

MESH = "gear.meshes.mesh"
SOFT = ProgressiveISO(stiffness=1e7, damping=200.0, roughness=ROUGHNESS)
TURNS = 6  # of the pinion, over which spectra are taken


def stage(elasticity, damping=0.3):
    """A pinion on a wheel that drags; 1 N m turns the pinion at about 30 rad/s."""
    mesh = Mesh(
        a="pinion", b="wheel", pair=PAPER_PAIR, elasticity=elasticity, friction=Coulomb(sliding=0.05, static=0.08)
    )
    gear = Transmission(
        shafts={"pinion": Shaft(inertia=5e-5), "wheel": Shaft(inertia=1e-3)},
        meshes={"mesh": mesh},
        input="pinion",
        output="wheel",
    )
    return Actuator(motor=TorqueSource(), gear=gear, load=Load(damping=damping))


def driven(elasticity):
    """A run with 1 N m on the pinion."""
    return simulate(stage(elasticity), 2.0, inputs={"torque_reference": 1.0}, compiled=False, tolerance=1e-8)


def steady(run, name):
    """A signal over whole turns of the pinion at steady speed, evenly spaced in time, without its mean."""
    end, turn = run.t[-1], run["pinion.angle"]
    begin = np.interp(turn[-1] - TURNS * 2 * math.pi, turn, run.t)
    values = np.interp(np.linspace(begin, end, 2048, endpoint=False), run.t, run[name])
    return values - values.mean()


def lines(values):
    """Amplitudes of the Fourier lines of whole turns; line TURNS is once per turn."""
    return abs(np.fft.rfft(values)) * 2 / values.size


@pytest.fixture(scope="module")
def eccentric():
    harmonics = {"eccentricity": ErrorHarmonic(wheel="a", order=1, amplitude=10e-6)}
    return driven(TransmissionError(law=Backlash(gap=GAP, law=SOFT), harmonics=harmonics))


def test_eccentricity_shows_once_per_turn_with_its_own_amplitude(eccentric):
    deflection = lines(steady(eccentric, f"{MESH}.deflection"))
    assert deflection.argmax() == TURNS
    assert deflection[TURNS] == pytest.approx(10e-6, rel=1e-3)
    assert lines(steady(eccentric, f"{MESH}.normal_force"))[1:].argmax() + 1 == TURNS


def test_a_stack_of_laws_runs_and_keeps_every_margin():
    run = driven(with_error(faulty(periodic(Backlash(gap=GAP, law=SOFT)))))
    assert run.margins.min() >= -1e-9
    deflection = lines(steady(run, f"{MESH}.deflection"))
    assert deflection.argmax() == TURNS
    assert deflection[TURNS] == pytest.approx(10e-6, rel=0.05)
    assert f"{MESH}.elasticity.harmonics.eccentricity.amplitude" in [p.name for p in run.system.parameters]


def test_a_weak_tooth_deflects_more_once_per_turn_where_it_is():
    weak = ToothFault(wheel="a", teeth=TEETH, remaining=0.5, angle=1.0)
    run = driven(ToothFaults(law=Backlash(gap=GAP, law=SOFT), faults={"weak": weak}))
    settled = run["pinion.angle"] > run["pinion.angle"][-1] - TURNS * 2 * math.pi
    turn = np.mod(run["pinion.angle"][settled] - 1.0 + math.pi, 2 * math.pi) - math.pi
    deflection = run[f"{MESH}.deflection"][settled]
    force = run[f"{MESH}.normal_force"][settled].mean()
    sound, soft = (GAP / 2 + force / (part * SOFT.stiffness) + SOFT.roughness / 2 for part in (1.0, 0.5))
    assert np.median(deflection) == pytest.approx(sound, rel=1e-3)
    assert deflection.max() == pytest.approx(soft, rel=0.02)
    assert abs(turn[deflection.argmax()]) < math.pi / TEETH
    assert deflection[abs(turn) > 2 * math.pi / TEETH + 0.1].max() < sound + 0.05 * (soft - sound)


def reversed_load(backlash):
    """A run in which the flanks change ten times a second."""
    run = simulate(
        stage(with_error(backlash), damping=0.02),
        0.5,
        inputs={"torque_reference": Sine(amplitude=0.2, frequency=10.0)},
        compiled=False,
    )
    flank = run.mode_values[run.system.modes.index(f"{MESH}.flank")]
    return run, flank * run[f"{MESH}.normal_force"]


@pytest.mark.parametrize("printed", [False, True])
def test_flanks_engage_and_let_go_and_only_as_printed_they_pull(printed):
    run, push = reversed_load((BacklashAsPrinted if printed else Backlash)(gap=GAP, law=SOFT))
    assert run.margins.min() >= -1e-9
    assert {change.after for change in run.changes} >= {"free", "forward", "backward"}
    assert (push.min() < -0.1) == printed
    assert push.min() >= (-10.0 if printed else 0.0)
