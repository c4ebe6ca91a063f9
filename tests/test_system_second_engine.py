"""A second engine beside the first: SciPy runs the same HybridSystem to the same events.

Oracle: `solve_ivp` (Radau, exact Jacobian) with one terminal event per margin, and a loop of a few lines that knows the
HybridSystem by its four functions only. What SciPy does not do by itself is done here: a falling event that starts at
zero or below is not one, which the MARGIN_BAND of the system rules out, and is checked after every reset.
"""

from itertools import pairwise
from typing import NamedTuple

import casadi as ca
import numpy as np
import pytest
from random_actuators import draw
from scipy.integrate import solve_ivp

from actuator import Actuator, Constant, TorqueSource, simulate
from actuator.simulation.signals import piece_at
from actuator.system.contact_modes import contact_labels
from controllers import PID
from gear import Bearing, Shaft, Transmission
from studies.checks.paper import figure_9, figure_9_inputs, figure_9_start

pytestmark = pytest.mark.thorough


class Second(NamedTuple):
    """What the second engine found."""

    events: list  # (time, modes after), the first at the start
    states: dict  # at the end, by name


class SecondEngine:
    """SciPy on a HybridSystem whose inputs have no break points after time zero."""

    def __init__(self, system, inputs):
        self.system, self.p = system, system.parameter_values()
        self.signals = [inputs.get(quantity.name, Constant(value=0.0)) for quantity in system.inputs]
        x, m, u, p = (ca.SX.sym(name, system.flow.size1_in(k)) for k, name in enumerate("xmup"))
        self.jacobian = ca.Function("jacobian", [x, m, u, p], [ca.jacobian(system.flow(x, m, u, p), x)])

    def at(self, time):
        """Inputs and parameters."""
        return [piece_at(signal, time)(0.0) for signal in self.signals], self.p

    def event(self, row, m):
        """The margin as an event of SciPy."""

        def margin(time, x):
            return float(self.system.margins(x, m, *self.at(time))[row])

        margin.terminal, margin.direction = True, -1
        return margin

    def reset(self, time, x, m, fired=None):
        """State and modes after an event, every margin armed."""
        indicator = np.zeros(len(self.system.margin_names))
        if fired is not None:
            indicator[fired] = 1.0
        x, m, fault = self.system.reset(indicator, x, m, *self.at(time))
        x, m = x.full().ravel(), np.round(m.full().ravel())
        assert not float(fault)
        assert (self.system.margins(x, m, *self.at(time)).full() > 0).all(), "a margin that no event can see"
        return x, m

    def run(self, duration, *, start, tolerance, max_step):
        """From time zero, event by event."""
        rows = range(len(self.system.margin_names))
        scale = np.array([state.nominal for state in self.system.states])
        time = 0.0
        x, m = self.reset(time, self.system.state_vector(start), np.zeros(len(self.system.modes)))
        events = [(time, tuple(int(mode) for mode in m))]
        while time < duration:
            solution = solve_ivp(
                lambda t, y, m=m: self.system.flow(y, m, *self.at(t)).full().ravel(),
                (time, duration),
                x,
                method="Radau",
                jac=lambda t, y, m=m: self.jacobian(y, m, *self.at(t)).full(),
                events=[self.event(row, m) for row in rows],
                rtol=tolerance,
                atol=tolerance * scale,
                max_step=max_step,
            )
            assert solution.success, solution.message
            time, x = solution.t[-1], solution.y[:, -1]
            if solution.status == 1:
                fired = next(row for row, found in enumerate(solution.t_events) if found.size)
                x, m = self.reset(time, x, m, fired)
                events.append((time, tuple(int(mode) for mode in m)))
        return Second(events, {state.name: value for state, value in zip(self.system.states, x, strict=True)})


def mass():
    """A mass on a guide under PID control, which hunts."""
    guide = Bearing(shaft="mass", coulomb=1.0, breakaway=1.5)
    gear = Transmission(shafts={"mass": Shaft(inertia=1.0)}, bearings={"guide": guide}, input="mass", output="mass")
    return Actuator(motor=TorqueSource(), gear=gear, controller=PID(proportional=3, integral=4, derivative=6))


class Case(NamedTuple):
    """A plant, what it is put through, how long the second engine's steps may be, and the changes to be found."""

    plant: Actuator
    duration: float
    inputs: dict
    start: dict
    max_step: float
    changes: int


def paper(arms, duration, changes):
    plant = figure_9(arms)
    return Case(plant, duration, figure_9_inputs(), figure_9_start(plant), 0.05, changes)


CASES = {
    "figure 9, printed arms": paper("printed", 10.0, 20),
    "figure 9, geometric arms": paper("geometric", 2.0, 52),
    "mass on a guide": Case(mass(), 60.0, {"reference": Constant(value=1.0)}, {}, 0.1, 13),
    "two stages": Case(draw(93, 1.0).actuator, 0.1, {"reference": Constant(value=0.05)}, {}, 1e-4, 12),
}


@pytest.fixture(scope="module", params=CASES)
def both(request):
    """The same case by this engine and by SciPy."""
    case = CASES[request.param]
    first = simulate(case.plant, case.duration, inputs=case.inputs, start=case.start, tolerance=1e-8, compiled=False)
    second = SecondEngine(case.plant.system(), case.inputs)
    return case, first, second.run(case.duration, start=case.start, tolerance=1e-7, max_step=case.max_step)


def changes(system, events):
    """Changes of mode of each contact as (contact, mode after), with their times, from all events."""
    found, times = [], []
    for (_, before), (time, after) in pairwise(events):
        was, words = contact_labels(system, before), contact_labels(system, after)
        new = [(contact, word) for contact, word in words.items() if word != was[contact]]
        found, times = found + new, times + [time] * len(new)
    return found, times


def test_both_engines_find_the_same_changes_of_mode_at_the_same_times(both):
    case, first, second = both
    found, times = changes(first.system, second.events)
    assert len(first.changes) == case.changes
    assert found == [(change.contact, change.after) for change in first.changes]
    np.testing.assert_allclose(times, [change.time for change in first.changes], rtol=0, atol=1e-6)


def test_both_engines_end_in_the_same_state(both):
    _, first, second = both
    for state in first.system.states:
        assert second.states[state.name] == pytest.approx(first[state.name][-1], abs=1e-5 * state.nominal), state.name
