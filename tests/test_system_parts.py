"""Actuators composed at random of all parts there are.

Oracles: what must hold for every one of them. It is assembled, begins consistently, is simulated without a contact mode
kept that does not hold, every loss is a loss, and in continuous time it has a linear model, whose rates agree with
difference quotients of the model itself.
"""

import contextlib

import numpy as np
import pytest
from random_parts import draw

from actuator import NoEquilibrium, linearize, simulate, trim

pytestmark = pytest.mark.thorough

COMPOSITIONS, MORE = 40, 400
SHORT, LONG = 0.02, 0.2  # s
# a mesh that rests in its gap; compensation at standstill, twice; a load in its dead band; a motor at its limit
CORNERS = (53, 56, 75, 200, 277)
ROUNDING, QUOTIENT = 1e-9, 1e-10  # of margins and losses; of a difference quotient over a small step
LOSSES = ("copper", "iron", "drag", "inverter", "damping", "link", "chopper")


def check_run(seed, duration):
    actuator, _, inputs, _ = draw(seed)
    run = simulate(actuator, duration, inputs=inputs, resolution=duration / 100, compiled=False)
    assert run.t[-1] == pytest.approx(duration, rel=1e-12)
    assert run.margins.min(initial=0.0) >= -ROUNDING, run.system.margin_names[int(run.margins.min(axis=1).argmin())]
    for name, values in run.signals.items():
        assert np.isfinite(values).all(), name
    for name in LOSSES:
        loss = run.signals.get(f"{name}_loss")
        assert loss is None or loss.min() >= -ROUNDING * (1 + loss.max()), name


def check_linear(seed):
    _, design, _, drifting = draw(seed)
    points = list(rests(design, drifting))
    assert points
    # at rest the boost of friction compensation is at its peak, a corner that torque, current and integral see
    boosted = getattr(getattr(design.controller, "remedies", None), "compensation", None) is not None
    for point in points:
        system = point.system
        names = [quantity.name for quantity in system.inputs]
        model = linearize(point, names, ["load_angle"], drifting=drifting)
        rng = np.random.default_rng(seed)
        dx = 1e-6 * rng.standard_normal(len(point.x)) * [state.nominal for state in system.states]
        at, ahead, behind = (
            system.flow(point.x + sign * dx, point.m, point.u, point.p).full().ravel() for sign in (0, 1, -1)
        )
        size = np.abs(model.A) @ np.abs(dx) + np.abs(point.rates)
        smooth = abs(ahead + behind - 2 * at) <= 1e-5 * size + QUOTIENT  # elsewhere is a corner: a limit, a dead band
        assert (abs(model.A @ dx - (ahead - behind) / 2) <= 1e-4 * size + QUOTIENT)[smooth].all()
        assert smooth.mean() > (0.7 if boosted else 0.8)


def rests(design, drifting):
    """Where it rests, stuck and sliding."""
    for mode in ("stuck", "forward"):
        with contextlib.suppress(NoEquilibrium):
            yield trim(design, mode, inputs={"load_torque": 0.5}, drifting=drifting)


@pytest.mark.parametrize("seed", range(COMPOSITIONS))
def test_a_composition_runs(seed):
    check_run(seed, SHORT)


@pytest.mark.parametrize("seed", [*range(COMPOSITIONS), *CORNERS])
def test_a_composition_has_a_linear_model(seed):
    check_linear(seed)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(MORE))
def test_more_compositions_run_for_longer_and_have_linear_models(seed):
    check_run(seed, LONG)
    check_linear(seed)
