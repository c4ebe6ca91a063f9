"""What is made of an orbit that is closed: its margins checked, its multipliers found."""

import numpy as np

from actuator.orbits.flow import FlowMap, NoOrbit, along
from actuator.orbits.orbit import Orbit
from actuator.orbits.segments import Passage, Segment, passage

# residual over nominal sizes (1e-4 rad for an angle) above which nothing is an orbit; stiff teeth between absolute
# angles leave breakaway times uncertain by rounding: it falls to 1e-11 in a simple mechanism, to 1e-6 in a stiff one
CLOSED = 3e-5
FINISHED = 1e-11  # at which more steps are not tried
VIOLATED = 1e-6  # a margin below minus this contradicts the modes


def finished(
    machine: FlowMap, x: np.ndarray, u: np.ndarray, p: np.ndarray, passages: list[Passage], residual: float
) -> Orbit:
    """The orbit of closed passages, its margins checked and its multipliers found."""
    segments = tuple(segment for arc in passages for segment in arc.segments)
    starts = tuple(start for arc in passages for start in arc.starts)
    for k, (segment, start) in enumerate(zip(segments, starts, strict=True)):
        _hold(machine, segment, start, u, p, k)
    # in one go: in the product of the arcs' own matrices, fast slips would cancel to nothing
    whole = passage(machine, x, segments, u, p, np.eye(x.size))
    scale = machine.nominal
    multipliers = np.linalg.eigvals(whole.fixed_time * scale / scale[:, None])
    trivial = int(np.argmin(abs(multipliers - 1)))
    others = np.delete(multipliers, trivial).astype(complex)
    return Orbit(
        system=machine.system,
        u=u,
        p=p,
        period=float(sum(segment.duration for segment in segments)),
        x0=x,
        segments=segments,
        starts=starts,
        residual=residual,
        multipliers=others[np.argsort(-abs(others))],
        trivial=complex(multipliers[trivial]),
        map=machine,
    )


def _hold(machine: FlowMap, segment: Segment, start: np.ndarray, u: np.ndarray, p: np.ndarray, k: int) -> None:
    """Raise where a margin does not hold during a segment."""
    system, states = machine.system, machine.path(start, segment.modes, u, p, segment.duration)
    margins = along(system.margins, states, segment.modes, u, p)
    if segment.fired < machine.events:
        margins[segment.fired, -1] = 0.0  # it ends the segment: zero but for the error of these states
    if margins.size and margins.min() < -VIOLATED:
        row, column = np.unravel_index(margins.argmin(), margins.shape)
        raise NoOrbit(
            f"{system.name}: on the closed orbit {system.margin_names[row]} does not hold in segment {k}: its margin "
            f"is {margins.min():.3g} of its usual size {machine.grid[column] * segment.duration:.3g} s after its start"
        )
