"""Two hundred actuators drawn at random.

Oracles: what must hold for every one of them. The run is completed, no contact mode is kept that does not hold,
sliding friction turns work into heat, and a stuck contact does not slip.
"""

from dataclasses import replace

import numpy as np
import pytest
from random_actuators import draw

from actuator import simulate
from actuator.system.contact_modes import STUCK
from actuator.system.hybrid import MARGIN_BAND
from gear.mesh import MESH_SPEED_NOMINAL
from gear.transmission import BEARING_SPEED_NOMINAL

pytestmark = pytest.mark.thorough

ACTUATORS = 200
SHORT, FULL = 0.3, 2.0  # s simulated in every test run, and where asked for with `-m slow`
ROUNDING = 1e-9  # of a margin; for a sliding contact that is a part of its usual speed
# margins of up to -1e-6 on output points, and a joint decision that was not found, all of them late
FAILED_ONCE = (7, 20, 21, 33, 71, 83, 88, 92, 111, 147, 149, 151, 160)
# with static = sliding friction: contacts held beyond their limit by less than the joint decision could tell
FAILED_AT_ONE_FRICTION = (42, 49, 50, 53, 63, 79, 85, 118)


def with_one_friction(drawn):
    """The same with breakaway at sliding friction: contacts let go and hold again with no acceleration left."""
    gear = drawn.actuator.gear
    bearings = {name: replace(bearing, breakaway=bearing.coulomb) for name, bearing in gear.bearings.items()}
    meshes = {
        name: replace(mesh, friction=replace(mesh.friction, static=mesh.friction.sliding))
        for name, mesh in gear.meshes.items()
    }
    return drawn._replace(actuator=replace(drawn.actuator, gear=replace(gear, bearings=bearings, meshes=meshes)))


def check(drawn, duration):
    actuator, inputs, stick_by = drawn
    run = simulate(actuator, duration, inputs=inputs, compiled=False, resolution=1e-3 * duration)
    assert run.t[-1] == duration
    assert run.margins.min() >= -ROUNDING, run.system.margin_names[int(run.margins.min(axis=1).argmin())]
    for contact, modes in run.modes.items():
        stuck = modes == STUCK
        assert abs(run[f"{contact}.slip_speed"][stuck]).max(initial=0.0) < 1e-9, contact
        sliding_loss = np.where(stuck, 0.0, run[f"{contact}.friction_loss"])
        assert np.trapezoid(sliding_loss, run.t) >= 0, contact
        if stick_by == "conjugate speed" or "bearings" in contact:
            speed = BEARING_SPEED_NOMINAL if "bearings" in contact else MESH_SPEED_NOMINAL
            assert (sliding_loss >= -(ROUNDING + MARGIN_BAND) * speed * abs(run[f"{contact}.friction"])).all(), contact


@pytest.mark.parametrize("seed", range(ACTUATORS))
def test_a_random_actuator_keeps_its_contact_laws(seed):
    check(draw(seed, SHORT), SHORT)


@pytest.mark.parametrize("seed", FAILED_ONCE)
def test_a_random_actuator_that_failed_once_keeps_its_contact_laws_to_the_end(seed):
    check(draw(seed, FULL), FULL)


@pytest.mark.parametrize("seed", FAILED_AT_ONE_FRICTION)
def test_an_actuator_whose_breakaway_is_its_sliding_friction_keeps_its_contact_laws(seed):
    check(with_one_friction(draw(seed, 0.5)), 0.5)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(ACTUATORS))
def test_a_random_actuator_keeps_its_contact_laws_for_longer(seed):
    check(draw(seed, FULL), FULL)
