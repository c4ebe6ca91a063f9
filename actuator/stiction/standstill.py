"""Where an actuator rests before a test: half way between the limits of friction."""

from collections.abc import Mapping, Sequence

import numpy as np

from actuator.actuator import Actuator
from actuator.linear.model import linearize
from actuator.linear.operating_point import NoEquilibrium, OperatingPoint
from actuator.linear.trim import trim
from actuator.system.hybrid import HybridSystem
from gear.quantities.roles import NodeTemperature, ShaftAngle

SLOWEST = 1e-6  # part of the fastest pole below which a pole never decays


def rest_state(
    plant: Actuator | HybridSystem,
    inputs: Mapping[str, float] | None = None,
    parameters: Mapping[str, float] | None = None,
) -> dict[str, float]:
    """States at rest by name, half way between the limits of friction; where there are none, the nearest to it.

    Thermal nodes have the temperatures they are given.
    """
    system = plant.system() if isinstance(plant, Actuator) else plant
    rest, sliding = find_rest(plant, inputs or {}, parameters or {})
    x = soak_nodes(system, mean_state(system, sliding) if rest is None else rest.x, parameters or {})
    return dict(zip([quantity.name for quantity in system.states], x.tolist(), strict=True))


def find_rest(
    plant: Actuator | HybridSystem, inputs: Mapping[str, float], parameters: Mapping[str, float]
) -> tuple[OperatingPoint | None, list[OperatingPoint]]:
    """The stuck point half way between the limits of friction, and those limits, as far as there are any."""
    system = plant.system() if isinstance(plant, Actuator) else plant
    names = [quantity.name for quantity in system.states]
    near = {}
    if isinstance(plant, Actuator):
        # all shafts where the reference is: an integrator that has no gain would hold any other angle
        turns, reference = plant.gear.speed_ratios(), inputs.get("reference", 0.0)
        angles = {state.name: state.role(ShaftAngle) for state in system.states}
        near = {name: float(turns[role.shaft] * reference) for name, role in angles.items() if role is not None}

    def attempt(word: str, guess: Mapping[str, float]) -> OperatingPoint | None:
        try:
            return trim(system, word, inputs=inputs, guess=guess, parameters=parameters)
        except NoEquilibrium:
            return None

    sliding = [found for found in (attempt(word, near) for word in ("forward", "backward")) if found is not None]
    start = mean_state(system, sliding) if sliding else system.state_vector(near)
    return attempt("stuck", dict(zip(names, start.tolist(), strict=True))), sliding


def soak_nodes(system: HybridSystem, x: np.ndarray, parameters: Mapping[str, float]) -> np.ndarray:
    """The same state with thermal nodes at the temperatures they are given, not warmed by what holds the load."""
    begun = system.state_vector(p=system.parameter_values(parameters))
    nodes = np.array([state.role(NodeTemperature) is not None for state in system.states], bool)
    return np.where(nodes, begun, x)


def mean_state(system: HybridSystem, points: Sequence[OperatingPoint]) -> np.ndarray:
    """Mean state of some points; the initial state of none."""
    return np.mean([point.x for point in points], axis=0) if points else system.state_vector({})


def slowest_constant(point: OperatingPoint) -> float:
    """The slowest time constant of a linear model [s]; 0 where nothing decays or there is no linear model."""
    try:
        model = linearize(point, [], [], minimal=True)
    except (ValueError, ArithmeticError):
        return 0.0
    values = np.linalg.eigvals(model.A)
    if model.dt:
        values = np.array([np.log(complex(z)) / model.dt for z in values if z])
    rates = -np.real(values)
    decaying = rates[rates > SLOWEST * abs(values).max(initial=0.0)]
    return float(1 / decaying.min()) if decaying.size else 0.0
