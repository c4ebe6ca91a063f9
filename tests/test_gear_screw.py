"""The friction of a screw as that of a mesh.

Oracles: the textbook's torques to raise and to lower a load (Budynas and Nisbett, "Shigley's Mechanical Engineering
Design", eqs. 8-1, 8-2 and 8-6); power balance; the limit of self-locking.
"""

import math
from dataclasses import replace

import pytest
from hypothesis import given
from oracles import numbers

from gear import Coulomb, Linear, Mesh, ScrewPair, Shaft, Transmission
from gear.efficiency import efficiency

RADIUS, LEAD = 10e-3, 4e-3
TURN = LEAD / (2 * math.pi)
LEAD_ANGLE = math.atan(LEAD / (2 * math.pi * RADIUS))

frictions, flank_angles, forces = numbers(0.0, 0.3), numbers(0.0, 0.3), numbers(1.0, 1e5)


def screw(flank_angle, sliding=0.1):
    return Mesh(
        a="spindle",
        b="nut",
        pair=ScrewPair(mean_radius=RADIUS, lead=LEAD, flank_angle=flank_angle),
        elasticity=Linear(stiffness=1e9, damping=1e3),
        friction=Coulomb(sliding=sliding, static=sliding),
        stick_by="conjugate speed",
    )


def torques(mesh, normal, friction):
    """Torques on spindle and nut."""
    per_normal, per_friction = mesh.torque_per_normal(), mesh.torque_per_friction()
    return [normal * per_normal[shaft] + friction * per_friction[shaft] for shaft in ("spindle", "nut")]


@given(friction=frictions, flank_angle=flank_angles, normal=forces)
def test_raising_and_lowering_a_load_takes_the_textbook_torque(friction, flank_angle, normal):
    mean, effective = 2 * RADIUS, friction / math.cos(flank_angle)  # flank angle in the normal section
    mesh = screw(flank_angle)
    on_spindle, on_nut = torques(mesh, normal, friction * normal)
    thrust = on_nut / TURN
    raising = thrust * mean / 2 * (LEAD + math.pi * effective * mean) / (math.pi * mean - effective * LEAD)
    assert -on_spindle == pytest.approx(raising, rel=1e-9)
    on_spindle, on_nut = torques(mesh, normal, -friction * normal)
    thrust = on_nut / TURN
    lowering = thrust * mean / 2 * (math.pi * effective * mean - LEAD) / (math.pi * mean + effective * LEAD)
    assert on_spindle == pytest.approx(lowering, rel=1e-9, abs=1e-9 * normal)


@given(flank_angle=flank_angles, normal=forces, friction=numbers(-0.3, 0.3), speed=numbers(-100, 100))
def test_friction_takes_the_power_that_slides_along_the_thread(flank_angle, normal, friction, speed):
    mesh = screw(flank_angle)
    slip = sum(c * speed for c in mesh.slip_per_shaft().values())
    assert slip == pytest.approx(RADIUS * speed / math.cos(LEAD_ANGLE), rel=1e-9)
    power = speed * sum(torques(mesh, normal, friction * normal))
    assert -power == pytest.approx(friction * normal * slip, rel=1e-9, abs=1e-9 * normal)


def test_steady_efficiency_of_a_transmission_is_that_of_the_inclined_thread():
    gear = Transmission(
        shafts={"spindle": Shaft(inertia=1e-5), "nut": Shaft(inertia=1e-6)},
        meshes={"screw": screw(0.0)},
        input="spindle",
        output="nut",
    )
    tangent, mu = math.tan(LEAD_ANGLE), 0.1
    assert gear.ratio() == pytest.approx(1)
    expected = tangent * (1 - mu * tangent) / (tangent + mu)
    assert efficiency(gear, torque=2.0, speed=5.0) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(("excess", "holds"), [(0.999, False), (1.001, True)])
def test_a_screw_locks_itself_where_friction_exceeds_the_slope_of_the_thread(excess, holds):
    """Nut pushed, spindle free: at the limit of friction the torque left on the spindle opposes the motion, or not."""
    flank_angle = 0.25
    limit = math.tan(LEAD_ANGLE) * math.cos(flank_angle)
    on_spindle, _ = torques(screw(flank_angle), 1.0, -excess * limit)
    assert (on_spindle > 0) == holds  # the thread alone drives the spindle backward


def test_a_thread_sticks_along_its_slope_only():
    with pytest.raises(ValueError, match='stick_by must be "conjugate speed" for a ScrewPair, got "mesh speed"'):
        replace(screw(0.0), stick_by="mesh speed")
