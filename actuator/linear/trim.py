"""Operating points: states at which nothing changes, in a chosen contact mode."""

import contextlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import casadi as ca
import numpy as np

from actuator.actuator import Actuator
from actuator.hybrid import HybridSystem
from actuator.parameters import require_known
from actuator.simulation.run import contact_labels, contact_names

MOTIONS = {"stuck": 0, "forward": 1, "backward": -1}
STEPS = 60  # Newton steps; the equations of a mode are nearly linear
STILL = 1e-9  # rate of a state over its nominal size [1/s] that counts as zero
ROUNDING, MOST_ROUNDING = 100 * np.finfo(float).eps, 1e-2
HOLDS = -1e-6  # a margin below this does not hold
STOPS = "gear.stops."  # what the flanks of end stops are called


class NoEquilibrium(ValueError):
    """No operating point; `rates` are the rates of the states where the search ended, by name."""

    def __init__(self, message: str, rates: dict[str, float]) -> None:
        super().__init__(message)
        self.rates = rates


@dataclass(frozen=True, kw_only=True)
class OperatingPoint:
    """A state of rest, or of steady motion, of a system in one combination of contact modes.

    Attributes
    ----------
    system : HybridSystem
        To which it belongs.
    x, m, u, p : ndarray
        State, modes, inputs, parameters.
    rates : ndarray
        dx/dt; zero but for the states that were allowed to drift. Of what a clock holds, the change at a tick over
        the period.
    """

    system: HybridSystem
    x: np.ndarray
    m: np.ndarray
    u: np.ndarray
    p: np.ndarray
    rates: np.ndarray

    @property
    def states(self) -> dict[str, float]:
        """States by name."""
        return {quantity.name: float(value) for quantity, value in zip(self.system.states, self.x, strict=True)}

    @property
    def flanks(self) -> dict[str, int]:
        """Flank of each mesh, coupling and end stop that has one, by name."""
        named = zip(self.system.modes, self.m, strict=True)
        return {name.removesuffix(".flank"): int(mode) for name, mode in named if name.endswith(".flank")}

    @property
    def outputs(self) -> dict[str, float]:
        """Outputs by name."""
        values = self.system.outputs_function(self.x, self.m, self.u, self.p).full().ravel()
        return {quantity.name: float(value) for quantity, value in zip(self.system.outputs, values, strict=True)}


def modes_of(
    system: HybridSystem, contacts: str | Mapping[str, str], flanks: Mapping[str, int] | None = None
) -> np.ndarray:
    """Mode vector from words.

    One word for all contacts is about the output: "stuck", or all contacts sliding as they do when the output
    moves "forward" or "backward" (some of them backward, then). Words per contact are about its own slip
    speed. Flanks that are not given are +1, those of end stops 0.
    """
    names = contact_names(system.modes)
    if isinstance(contacts, str):
        require_known([contacts], MOTIONS, "contact mode")
        values = {f"{name}.motion": MOTIONS[contacts] * system.travel[name] for name in names}
    else:
        require_known(contacts, names, "contact")
        require_known(contacts.values(), MOTIONS, "contact mode")
        missing = [name for name in names if name not in contacts]
        if missing:
            raise KeyError(f"no mode given for contact {', '.join(missing)}; each needs stuck, forward or backward")
        values = {f"{name}.motion": MOTIONS[word] for name, word in contacts.items()}
    flank_names = [name for name in system.modes if name.endswith(".flank")]
    given = {f"{name}.flank": value for name, value in (flanks or {}).items()}
    require_known(given, flank_names, "flank")
    return system.mode_vector(values | {name: given.get(name, _usual_flank(name)) for name in flank_names})


def _usual_flank(name: str) -> int:
    """Teeth and couplings transmit; an end stop is not touched."""
    return 0 if name.startswith(STOPS) else 1


def _turned(margins: Mapping[str, float], flanks: Mapping[str, int]) -> dict[str, int]:
    """The other flank where the present one does not hold; of an end stop, the one that was passed or none."""
    found = {}
    for name, flank in flanks.items():
        broken = [side for side, sign in ((1, "+"), (-1, "-")) if margins.get(f"{name} flank {sign}", 0.0) < 0]
        if flank == 0:
            found[name] = broken[0] if broken else 0
        elif flank in broken or margins.get(f"{name} flank", 0.0) < 0:
            found[name] = 0 if name.startswith(STOPS) else -flank
        else:
            found[name] = flank
    return found


def trim(  # noqa: PLR0913 - what may be held and where to start are all choices of the user
    plant: Actuator | HybridSystem,
    contacts: str | Mapping[str, str],
    *,
    inputs: Mapping[str, float] | None = None,
    guess: Mapping[str, float] | None = None,
    parameters: Mapping[str, float] | None = None,
    drifting: Sequence[str] = (),
) -> OperatingPoint:
    """Find the operating point of a system in the given contact modes.

    In a sliding mode at speed zero, friction acts with its full sliding value in that direction: the limit
    from which the contact starts, or to which it comes. In a stuck mode many points are at rest; the one
    nearest to the guess is taken, or where no guess is given the one that forward motion leaves behind.
    Flanks follow from the load; for a point of rest against an end stop, give a guess beyond it.

    Parameters
    ----------
    plant : Actuator or HybridSystem
        What to trim.
    contacts : str or mapping of str to str
        "stuck", or the direction of the output, "forward" or "backward"; or words by contact.
    inputs, guess, parameters : mapping of str to float
        Constant inputs, states to start the search from, and parameters, by name.
    drifting : sequence of str
        States that may move steadily (the angles of a drive at constant speed); they keep their guess.

    Returns
    -------
    OperatingPoint

    Raises
    ------
    NoEquilibrium
        Where there is none near the guess, with the remaining rates; or where friction cannot hold it.
    """
    system = plant.system() if isinstance(plant, Actuator) else plant
    names = [quantity.name for quantity in system.states]
    require_known(drifting, names, "state")
    flanks: dict[str, int] = {}
    if guess is None and contacts == "stuck":
        with contextlib.suppress(NoEquilibrium):  # without one, the search starts from zero
            before = trim(system, "forward", inputs=inputs, parameters=parameters, drifting=drifting)
            guess, flanks = before.states, before.flanks
    u, p = system.input_vector(inputs), system.parameter_values(parameters)
    x = system.state_vector(guess, p)
    scale = np.array([quantity.nominal for quantity in system.states])
    free = np.array([name not in drifting for name in names])
    flank_names = [name.removesuffix(".flank") for name in system.modes if name.endswith(".flank")]
    usual = {name: _usual_flank(name) for name in flank_names}
    at_guess = system.margins(x, modes_of(system, contacts, usual), u, p).full().ravel()
    stops = {name: 0 for name in flank_names if name.startswith(STOPS)}
    flanks = usual | _turned(dict(zip(system.margin_names, at_guess, strict=True)), stops) | flanks
    for _ in range(2 + len(flanks)):
        m = modes_of(system, contacts, flanks)
        x, rates = _newton(system, x, m, u, p, scale, free)
        margins = system.margins(x, m, u, p).full().ravel()
        found = _turned(dict(zip(system.margin_names, margins, strict=True)), flanks)
        if found == flanks:
            break
        flanks = found
    if margins.size and margins.min() < HOLDS:
        m, held = _held_by_others(system, x, m, u, p)
        margins = np.zeros(1) if held else margins
    if margins.size and margins.min() < HOLDS:
        raise NoEquilibrium(
            f"{system.name}: {system.margin_names[int(margins.argmin())]} does not hold at this operating point "
            f"(margin {margins.min():.3g} of its usual size); choose a mode in which it slides, or another load",
            dict(zip(names, rates, strict=True)),
        )
    return OperatingPoint(system=system, x=x, m=m, u=u, p=p, rates=rates)


def _held_by_others(
    system: HybridSystem, x: np.ndarray, m: np.ndarray, u: np.ndarray, p: np.ndarray
) -> tuple[np.ndarray, bool]:
    """Modes with contacts at their limit, where others that lock the same shaft take over, and whether all hold."""
    _, modes, fault = system.reset(np.zeros(len(system.margin_names)), x, m, u, p)
    after = np.round(modes.full().ravel())
    same = contact_labels(system.modes, m) == contact_labels(system.modes, after)
    return (after, True) if same and not float(fault) else (m, False)


def _newton(
    system: HybridSystem,
    x: np.ndarray,
    m: np.ndarray,
    u: np.ndarray,
    p: np.ndarray,
    scale: np.ndarray,
    free: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Least-norm Newton steps, in states over their nominal sizes, damped until the residual falls."""
    flow, jacobian = rates_function(system), _jacobian(system)
    drifts = ~free  # a drifting state may have any constant rate

    def residual(state: np.ndarray) -> np.ndarray:
        return np.where(drifts, 0.0, flow(state, m, u, p).full().ravel() / scale)

    rate = residual(x)
    for _ in range(STEPS):
        if (abs(rate) < STILL).all():
            break
        matrix = jacobian(x, m, u, p).full() / scale[:, None] * scale[None, :]
        rows = 1 / np.maximum(np.linalg.norm(matrix, axis=1), 1e-12)  # stiff rows would drown the others
        step = np.zeros_like(x)
        step[free] = np.linalg.lstsq((rows[:, None] * matrix)[free][:, free], -(rows * rate)[free], rcond=1e-13)[0]
        for damping in (1.0, 0.5, 0.1, 0.01):
            trial = residual(x + damping * scale * step)
            if np.linalg.norm(rows * trial) < np.linalg.norm(rows * rate):
                break
        x, rate = x + damping * scale * step, trial
    rates = flow(x, m, u, p).full().ravel()
    worst = np.argsort(-abs(rate))[:3]
    if (abs(rate) > rounding(system, x, m, u, p)).any():
        named = dict(zip([quantity.name for quantity in system.states], rates, strict=True))
        text = ", ".join(f"d({system.states[i].name})/dt = {rates[i]:.4g} {system.states[i].unit}/s" for i in worst)
        raise NoEquilibrium(
            f"{system.name}: no equilibrium found in this contact mode; what remains is {text}. "
            "Check the load against the torque and voltage limits, or let states that move steadily drift",
            named,
        )
    return x, rates


def rounding(system: HybridSystem, x: np.ndarray, m: np.ndarray, u: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Rates of the states over their nominal sizes [1/s] that are rounding: stiff teeth make much of little."""
    scale = np.array([quantity.nominal for quantity in system.states])
    matrix = np.abs(_jacobian(system)(x, m, u, p).full())
    return STILL + np.minimum(ROUNDING * (matrix @ np.abs(x)) / scale, MOST_ROUNDING)


@lru_cache(maxsize=32)
def _jacobian(system: HybridSystem) -> ca.Function:
    x, m, u, p = (ca.SX.sym(name, system.flow.size1_in(i)) for i, name in enumerate(("x", "m", "u", "p")))
    return ca.Function("jacobian", [x, m, u, p], [ca.jacobian(rates_function(system)(x, m, u, p), x)])


@lru_cache(maxsize=32)
def rates_function(system: HybridSystem) -> ca.Function:
    """(x, m, u, p) -> dx/dt; of what a clock holds, the change at a tick at which all are due, over the period."""
    if system.tick is None or system.period is None:
        return system.flow
    x, m, u, p = (ca.SX.sym(name, system.flow.size1_in(i)) for i, name in enumerate(("x", "m", "u", "p")))
    changes = (system.tick(ca.SX.ones(len(system.clocks)), x, m, u, p) - x) / system.period(p)
    return ca.Function("rates", [x, m, u, p], [system.flow(x, m, u, p) + changes])
