"""Linear models: one per contact mode, exact, in deviations from an operating point; and their loops and margins."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import casadi as ca
import control
import numpy as np
from scipy.optimize import brentq

from actuator.hybrid import HybridSystem
from actuator.ledger import PREFIX
from actuator.parameters import require_known
from actuator.trim import NoEquilibrium, OperatingPoint, rounding

RESIDUAL = 1e-5  # rate of a state over its nominal size [1/s]
CUT, SLOW = 1e-6, 1e-2  # a loop whose gain is below CUT above SLOW rad/s is cut
UNSTABLE = 1e-9  # part of the fastest pole that a pole may lie to the right of zero by rounding
NOTHING = 1e-9  # loop gain of a loop that is not there: a stuck gear passes nothing on, but for rounding
GRID = np.logspace(-6, 6, 6001)  # rad/s, on which crossings are bracketed


def linearize(
    point: OperatingPoint, inputs: Sequence[str], outputs: Sequence[str], *, drifting: Sequence[str] = ()
) -> control.StateSpace:
    """Linear model of the point's contact mode, in deviations from the point.

    Stuck contacts stay stuck and sliding ones keep their direction, so a stuck contact leaves two poles at
    zero that no input reaches: its locked position and its speed.

    Parameters
    ----------
    point : OperatingPoint
        From `trim`; it carries the mode.
    inputs, outputs : sequence of str
        Names; an output may also be a state.
    drifting : sequence of str
        States that move steadily at the point, with the reason on the caller's side.

    Returns
    -------
    control.StateSpace
        With named states, inputs and outputs.

    Raises
    ------
    NoEquilibrium
        Where another state moves, with its rate.
    """
    system = point.system
    require_known(inputs, [quantity.name for quantity in system.inputs], "input")
    state_names = [quantity.name for quantity in system.states]
    output_names = [quantity.name for quantity in system.outputs]
    require_known(outputs, [*output_names, *state_names], "output")
    require_known(drifting, state_names, "state")
    floor = rounding(system, point.x, point.m, point.u, point.p)
    moving = {
        quantity.name: rate
        for quantity, rate, least in zip(system.states, point.rates, floor, strict=True)
        if abs(rate) > max(RESIDUAL, least) * quantity.nominal and quantity.name not in drifting
    }
    if moving:
        text = ", ".join(f"d({name})/dt = {rate:.4g}" for name, rate in moving.items())
        raise NoEquilibrium(f"{system.name}: cannot linearize where states still move: {text}; trim first", moving)
    a, b, c, d = (part.full() for part in _jacobians(system)(point.x, point.m, point.u, point.p))
    columns = [[quantity.name for quantity in system.inputs].index(name) for name in inputs]
    c, d = np.vstack([c, np.eye(len(state_names))]), np.vstack([d, np.zeros((len(state_names), d.shape[1]))])
    rows = [[*output_names, *state_names].index(name) for name in outputs]
    return control.StateSpace(
        a,
        b[:, columns],
        c[rows],
        d[np.ix_(rows, columns)],
        states=[_signal(name) for name in state_names],
        inputs=[_signal(name) for name in inputs],
        # a state may have the name of an output but for the dot
        outputs=[
            _signal(name) + "_state" * (_signal(name) != name and _signal(name) in output_names) for name in outputs
        ],
    )


def _signal(name: str) -> str:
    """python-control keeps dots for the names of subsystems."""
    return name.replace(".", "_")


@lru_cache(maxsize=32)
def _jacobians(system: HybridSystem) -> ca.Function:
    x, m, u, p = (ca.SX.sym(name, system.flow.size1_in(i)) for i, name in enumerate(("x", "m", "u", "p")))
    rate, output = system.flow(x, m, u, p), system.outputs_function(x, m, u, p)
    return ca.Function(
        "jacobians",
        [x, m, u, p],
        [ca.jacobian(rate, x), ca.jacobian(rate, u), ca.jacobian(output, x), ca.jacobian(output, u)],
    )


def loop_transfer(point: OperatingPoint, at: str, *, drifting: Sequence[str] = ()) -> control.StateSpace:
    """Loop transfer with the loop opened at a named signal, all other loops closed.

    The signal is cut: what goes on is the input u, what comes back is the signal as computed, y. Then

        L = -y/u,    sensitivity = 1/(1 + L)

    so the usual rules for negative feedback hold (stable by the Nyquist criterion about -1).

    Parameters
    ----------
    point : OperatingPoint
        Where and in which contact mode.
    at : str
        A signal with an injection input: position, speed_reference, torque_reference or voltage.
    drifting : sequence of str
        As for `linearize`.
    """
    points = [q.name.removeprefix(PREFIX) for q in point.system.inputs if q.name.startswith(PREFIX)]
    require_known([at], points, "loop signal")
    closed = linearize(point, [PREFIX + at], [at], drifting=drifting)
    # closed:  used = computed + d.  Cut:  d = used - computed, so d = (used - C x)/(1 + D)
    through = 1 / (1 + np.asarray(closed.D).item())
    return control.StateSpace(
        closed.A - through * closed.B @ closed.C,
        through * closed.B,
        -through * closed.C,
        -through * closed.D,
        states=closed.state_labels,
        inputs=[at],
        outputs=[f"{at}_returned"],
    )


@dataclass(frozen=True, kw_only=True)
class Margins:
    """Stability margins of a loop; infinite, with frequency nan, where the loop has no such crossing.

    Attributes
    ----------
    stable : bool
        Whether the closed loop is; where it is not, the delay margin is zero.
    gain : float
        Factor on the loop gain to instability [-], the nearest to one; above one unless the loop is
        conditionally stable.
    phase_rad, delay_s : float
        Phase lag and smallest delay to instability; the phase is negative where the closed loop is unstable.
    gain_frequency, phase_frequency, delay_frequency : float
        Where they are [rad/s].
    peak_sensitivity, sensitivity_frequency : float
        Largest |1/(1 + L)| [-] and where [rad/s].
    """

    stable: bool
    gain: float
    gain_frequency: float
    phase_rad: float
    phase_frequency: float
    delay_s: float
    delay_frequency: float
    peak_sensitivity: float
    sensitivity_frequency: float

    @property
    def gain_db(self) -> float:
        """Gain margin [dB]."""
        return 20 * math.log10(self.gain)

    @property
    def phase_deg(self) -> float:
        """Phase margin [deg]."""
        return math.degrees(self.phase_rad)


def margins(loop: control.StateSpace, frequencies: np.ndarray = GRID) -> Margins:
    """Gain, phase and delay margins from the exact frequency response.

    Crossings are bracketed on the grid and refined on the response itself: the polynomials of a loop with
    eigenvalues from 1 to 1e6 1/s, on which the usual formulas rest, have no correct digits.
    """

    def response(frequency: float) -> complex:
        return complex(loop(1j * frequency))

    values = np.asarray(loop(1j * frequencies))
    if np.abs(values[frequencies > SLOW]).max() < CUT:
        # a stuck gear passes nothing on; the double integrators of what is locked hold nothing but rounding
        return Margins(
            stable=True,
            gain=math.inf,
            gain_frequency=math.nan,
            phase_rad=math.inf,
            phase_frequency=math.nan,
            delay_s=math.inf,
            delay_frequency=math.nan,
            peak_sensitivity=1.0,
            sensitivity_frequency=math.nan,
        )
    gain_crossings = _roots(lambda w: abs(response(w)) - 1, frequencies, abs(values) - 1)
    # on the negative real axis the imaginary part changes sign, away from it the branch at 0 deg does too
    phase_crossings = [
        w for w in _roots(lambda w: response(w).imag, frequencies, np.imag(values)) if response(w).real < -NOTHING
    ]
    gains = [(-1 / response(w).real, w) for w in phase_crossings]
    standing = complex(loop(0.0, warn_infinite=False))  # infinite with an integrator
    if math.isfinite(abs(standing)) and standing.real < -NOTHING:
        gains.append((-1 / standing.real, 0.0))
    phases = [((math.pi + np.angle(response(w))) % (2 * math.pi), w) for w in gain_crossings]
    signed = [(phase - 2 * math.pi if phase > math.pi else phase, w) for phase, w in phases]
    a, b, c, d = (np.asarray(part) for part in (loop.A, loop.B, loop.C, loop.D))
    poles = np.linalg.eigvals(a - b @ c / (1 + d.item()))
    stable = bool((poles.real <= UNSTABLE * np.abs(poles).max(initial=1.0)).all())
    delays = [(phase / w, w) for phase, w in phases] if stable else [(0.0, math.nan)]
    peak = int((1 / abs(1 + values)).argmax())
    nothing = (math.inf, math.nan)
    gain, phase, delay = (
        min(gains, key=lambda pair: abs(math.log(pair[0])), default=nothing),
        min(signed, key=lambda pair: abs(pair[0]), default=nothing),
        min(delays, default=nothing),
    )
    return Margins(
        stable=stable,
        gain=gain[0],
        gain_frequency=gain[1],
        phase_rad=phase[0],
        phase_frequency=phase[1],
        delay_s=delay[0],
        delay_frequency=delay[1],
        peak_sensitivity=float(1 / abs(1 + values[peak])),
        sensitivity_frequency=float(frequencies[peak]),
    )


def _roots(function: Callable[[float], float], grid: np.ndarray, values: np.ndarray) -> list[float]:
    above = values >= 0
    return [_root(function, float(grid[k]), float(grid[k + 1])) for k in np.flatnonzero(above[:-1] != above[1:])]


def _root(function: Callable[[float], float], low: float, high: float) -> float:
    """The root between two frequencies; one of them, where rounding has it there."""
    ends = function(low), function(high)
    if ends[0] * ends[1] >= 0:
        return low if abs(ends[0]) < abs(ends[1]) else high
    return float(brentq(function, low, high, xtol=1e-12 * low, full_output=True)[1].root)
