"""The search for operating points: states at which nothing changes, in a chosen contact mode."""

import contextlib
from collections.abc import Mapping, Sequence

import numpy as np

from actuator.actuator import Actuator
from actuator.linear.jacobians import eliminate, rates_function, rates_jacobian, rounding, slip_rows
from actuator.linear.operating_point import NoEquilibrium, OperatingPoint, gaps, modes_of, usual_flanks
from actuator.system.contact_modes import STUCK, contact_labels
from actuator.system.hybrid import EventKind, HybridSystem, ModeKind
from gear.quantities import require_known

STEPS = 60  # Newton steps; the equations of a mode are nearly linear
POLISH = 3  # more of them once the residual is small, as long as it falls
SETTLING = 1e-5 * 2.0 ** np.arange(34)  # s, up to a day
SLOWEST = 1e-6  # rate [1/s] of a row that still counts in full: of what no state moves, rounding would count for all
HOLDS = -1e-6  # a margin below this does not hold


class Balance:
    """The equations of a contact mode, in states over their nominal sizes, without what stuck contacts lock."""

    def __init__(  # noqa: PLR0913, PLR0917 - a place in a mode of a system
        self, system: HybridSystem, x: np.ndarray, m: np.ndarray, u: np.ndarray, p: np.ndarray, free: np.ndarray
    ) -> None:
        self.system, self.m, self.u, self.p, self.free = system, m, u, p, free
        self.scale = np.array([quantity.nominal for quantity in system.states])
        # what stuck contacts lock is no unknown: the balance of its torques holds whatever they are, but for rounding
        start = OperatingPoint(system=system, x=x, m=m, u=u, p=p, rates=np.zeros_like(x))
        self.expressed, self.kept = eliminate([row * self.scale for row in slip_rows(start)], len(x))
        unknown = np.flatnonzero(free[self.kept])  # a drifting state may have any constant rate
        self.equations, self.moves = np.array(self.kept)[unknown], self.expressed[:, unknown]

    def express(self, state: np.ndarray) -> np.ndarray:
        """The state, with those that stuck contacts make redundant as the others have it."""
        return self.scale * (self.expressed @ (state / self.scale)[self.kept])

    def flow(self, state: np.ndarray) -> np.ndarray:
        """dx/dt."""
        return rates_function(self.system)(state, self.m, self.u, self.p).full().ravel()

    def residual(self, state: np.ndarray) -> np.ndarray:
        """Rates that should be zero."""
        return (self.flow(state) / self.scale)[self.equations]

    def slopes(self, state: np.ndarray) -> np.ndarray:
        """Their derivatives by the unknowns."""
        matrix = rates_jacobian(self.system)(state, self.m, self.u, self.p).full()
        return (matrix / self.scale[:, None] * self.scale)[self.equations] @ self.moves

    def rounding(self, state: np.ndarray) -> np.ndarray:
        """What is left of the rates by rounding."""
        return rounding(self.system, state, self.m, self.u, self.p)

    def left(self, state: np.ndarray) -> np.ndarray:
        """Sizes of all rates that should be zero."""
        return abs(np.where(self.free, self.express(self.flow(state)) / self.scale, 0.0))

    def holds(self, state: np.ndarray) -> bool:
        """Whether nothing changes, but for rounding."""
        return bool((self.left(state) <= self.rounding(state)).all())


def _turn_flanks(system: HybridSystem, margins: np.ndarray, flanks: Mapping[str, int]) -> dict[str, int]:
    """The other flank where the present one does not hold; from a gap, the one that was passed or none."""
    violated = [event for event, margin in zip(system.events, margins, strict=True) if margin < 0]
    passed: dict[str, list[int]] = {}
    for event in violated:
        if event.kind is EventKind.GAP:
            passed.setdefault(event.at, []).append(event.side)
    pushed_off = {event.at for event in violated if event.kind is EventKind.FORCE}
    usual, found = usual_flanks(system), {}
    for name, flank in flanks.items():
        broken = passed.get(name, [])
        if flank == 0:
            found[name] = broken[0] if broken else 0
        elif flank in broken or name in pushed_off:
            found[name] = -flank if usual[name] else 0  # an end stop is left
        else:
            found[name] = flank
    return found


def _open_gaps(system: HybridSystem, flanks: Mapping[str, int], found: Mapping[str, int]) -> dict[str, int]:
    """What has a gap stands in it, where it is pushed off one flank and off the other."""
    can_open = gaps(system)
    return {name: 0 if flank != flanks[name] and name in can_open else flank for name, flank in found.items()}


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
    Flanks follow from the load, and teeth that neither flank would hold stand in their gap, free; for a point of rest
    against an end stop, give a guess beyond it.

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
    if guess is None and contacts == STUCK:
        with contextlib.suppress(NoEquilibrium):  # without one, the search starts from zero
            before = trim(system, "forward", inputs=inputs, parameters=parameters, drifting=drifting)
            guess, flanks = before.states, before.flanks
    u, p = system.input_vector(inputs), system.parameter_values(parameters)
    x = system.state_vector(guess, p)
    free = np.array([name not in drifting for name in names])
    usual = usual_flanks(system)
    at_guess = system.margins(x, modes_of(system, contacts, usual), u, p).full().ravel()
    stops = {name: 0 for name, flank in usual.items() if flank == 0}
    flanks = usual | _turn_flanks(system, at_guess, stops) | flanks
    tried = []
    for _ in range(2 + 2 * len(flanks)):
        m = modes_of(system, contacts, flanks)
        x, rates = _solve(Balance(system, x, m, u, p, free), x)
        margins = system.margins(x, m, u, p).full().ravel()
        found = _turn_flanks(system, margins, flanks)
        if found == flanks:
            break
        tried.append(flanks)
        flanks = _open_gaps(system, flanks, found) if found in tried else found
    if margins.size and margins.min() < HOLDS:
        m, rates, held = _held_by_others(Balance(system, x, m, u, p, free), x, rates)
        margins = np.zeros(1) if held else margins
    if margins.size and margins.min() < HOLDS:
        raise NoEquilibrium(
            f"{system.name}: {system.margin_names[int(margins.argmin())]} does not hold at this operating point "
            f"(margin {margins.min():.3g} of its usual size); choose a mode in which it slides, or another load",
            dict(zip(names, rates, strict=True)),
        )
    return OperatingPoint(system=system, x=x, m=m, u=u, p=p, rates=rates)


def _held_by_others(balance: Balance, x: np.ndarray, rates: np.ndarray) -> tuple[np.ndarray, np.ndarray, bool]:
    """Modes and rates with contacts at their limit, where others that lock the same shaft take over, and whether so."""
    system, m, u, p = balance.system, balance.m, balance.u, balance.p
    _, modes, fault = system.reset(np.zeros(len(system.margin_names)), x, m, u, p)
    after = np.round(modes.full().ravel())
    same = contact_labels(system, m) == contact_labels(system, after) and all(
        before == now
        for mode, before, now in zip(system.mode_variables, m, after, strict=True)
        if mode.kind is ModeKind.FLANK
    )
    taken = Balance(system, x, after, u, p, balance.free)
    if float(fault) or not same or not taken.holds(x):
        return m, rates, False
    return after, taken.express(taken.flow(x)), True


def _solve(balance: Balance, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """State and rates after least-norm Newton steps, damped until the residual falls.

    Where they do not arrive, as a limit has no slope that leads back, they go on from where time would lead.
    """
    x = balance.express(x)
    arrived = _steps(balance, x)
    if not balance.holds(arrived):
        with contextlib.suppress(np.linalg.LinAlgError):  # nowhere, where time leads to infinity
            later = _steps(balance, _settle(balance, x))
            if balance.holds(later):
                return later, balance.express(balance.flow(later))
        system, rates = balance.system, balance.express(balance.flow(arrived))
        worst = np.argsort(-balance.left(arrived))[:3]
        named = dict(zip([quantity.name for quantity in system.states], rates, strict=True))
        text = ", ".join(f"d({system.states[i].name})/dt = {rates[i]:.4g} {system.states[i].unit}/s" for i in worst)
        raise NoEquilibrium(
            f"{system.name}: no equilibrium found in this contact mode; what remains is {text}. "
            "Check the load against the torque and voltage limits, or let states that move steadily drift",
            named,
        )
    return arrived, balance.express(balance.flow(arrived))


def _steps(balance: Balance, state: np.ndarray) -> np.ndarray:
    """The state after Newton steps, and some more once the residual is small."""
    rate, polished = balance.residual(state), 0
    for _ in range(STEPS):
        polished += bool((abs(rate) <= balance.rounding(state)[balance.equations]).all())
        if polished > POLISH:
            break
        matrix = balance.slopes(state)
        rows = 1 / np.maximum(np.linalg.norm(matrix, axis=1), SLOWEST)  # stiff rows would drown the others
        change = np.linalg.lstsq(rows[:, None] * matrix, -rows * rate, rcond=1e-13)[0]
        step = balance.scale * (balance.moves @ change)
        for damping in (1.0, 0.5, 0.1, 0.01):
            trial = balance.residual(state + damping * step)
            if np.linalg.norm(rows * trial) < np.linalg.norm(rows * rate):
                break
        else:
            if polished:
                break
        state, rate = state + damping * step, trial
    return state


def _settle(balance: Balance, state: np.ndarray) -> np.ndarray:
    """After steps of implicit Euler, each twice as long as the one before."""
    for duration in SETTLING:
        matrix = np.eye(len(balance.equations)) / duration - balance.slopes(state)
        state = state + balance.scale * (balance.moves @ np.linalg.solve(matrix, balance.residual(state)))
    return state
