"""A lumped thermal network: masses that warm, and the ways of the heat between them."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Annotated

import casadi as ca

from actuator.parts.electrical import HeatCapacity, HeatResistance
from gear.quantities import Scalar, Temperature, check, require_known
from gear.quantities.roles import NodeTemperature


@dataclass(frozen=True, kw_only=True)
class ThermalNode:
    """A part with one temperature.

    Parameters
    ----------
    temperature : float
        At the start, or for good [K].
    capacity : float or None
        Heat capacity [J/K]; None where the temperature stays what it is.
    """

    temperature: Annotated[Temperature, NodeTemperature()]
    capacity: HeatCapacity | None = None

    def __post_init__(self) -> None:
        check(self)


@dataclass(frozen=True, kw_only=True)
class ThermalPath:
    """A way of the heat between two nodes.

    Parameters
    ----------
    a, b : str
        Names of the nodes.
    resistance : float
        [K/W].
    """

    a: str
    b: str
    resistance: HeatResistance

    def __post_init__(self) -> None:
        check(self)


@dataclass(frozen=True, kw_only=True)
class ThermalNetwork:
    """Nodes with heat capacity, fed by losses and joined by resistances.

        capacity T' = loss + sum over its paths of (T_other - T)/resistance

    A node without a capacity (ambient air, an oil held warm) has a fixed temperature.

    Parameters
    ----------
    nodes : mapping
        ThermalNode by name.
    paths : mapping
        ThermalPath by name.

    Raises
    ------
    ValueError, KeyError
        For a path between what is not two nodes.
    """

    nodes: Mapping[str, ThermalNode]
    paths: Mapping[str, ThermalPath]

    def __post_init__(self) -> None:
        for name, path in self.paths.items():
            require_known((path.a, path.b), self.nodes, f"thermal node for path {name!r}")
            if path.a == path.b:
                raise ValueError(f"ThermalNetwork: path {name!r} must join two nodes, got {path.a!r} twice")

    @classmethod
    def of_motor(
        cls,
        *,
        winding_to_housing: float,
        housing_to_ambient: float,
        winding_time_constant: float,
        motor_time_constant: float,
        ambient: float,
    ) -> "ThermalNetwork":
        """Winding, housing and ambient from the numbers of a motor's data sheet, all at the ambient temperature.

            capacity of the winding = winding_time_constant/winding_to_housing
            capacity of the housing = motor_time_constant/housing_to_ambient

        Parameters
        ----------
        winding_to_housing, housing_to_ambient : float
            Thermal resistances [K/W].
        winding_time_constant, motor_time_constant : float
            [s].
        ambient : float
            [K].
        """
        winding, housing = winding_time_constant / winding_to_housing, motor_time_constant / housing_to_ambient
        return cls(
            nodes={
                "winding": ThermalNode(temperature=ambient, capacity=winding),
                "housing": ThermalNode(temperature=ambient, capacity=housing),
                "ambient": ThermalNode(temperature=ambient),
            },
            paths={
                "winding_housing": ThermalPath(a="winding", b="housing", resistance=winding_to_housing),
                "housing_ambient": ThermalPath(a="housing", b="ambient", resistance=housing_to_ambient),
            },
        )

    @property
    def free(self) -> tuple[str, ...]:
        """Names of the nodes whose temperatures are states."""
        return tuple(name for name, node in self.nodes.items() if node.capacity is not None)

    def all_temperatures(self, temperatures: Mapping[str, Scalar]) -> dict[str, Scalar]:
        """Temperatures [K] of all nodes, from those of the free ones."""
        require_known(temperatures, self.free, "free thermal node")
        missing = [name for name in self.free if name not in temperatures]
        if missing:
            raise KeyError(
                f"ThermalNetwork needs the temperature of every free node, got none for {', '.join(missing)}"
            )
        return {name: temperatures.get(name, node.temperature) for name, node in self.nodes.items()}

    def flows(self, temperatures: Mapping[str, Scalar]) -> dict[str, Scalar]:
        """Heat flow [W] along each path from its `a` to its `b`, at the temperatures of the free nodes."""
        at = self.all_temperatures(temperatures)
        return {name: (at[path.a] - at[path.b]) / path.resistance for name, path in self.paths.items()}

    def rates(self, temperatures: Mapping[str, Scalar], losses: Mapping[str, Scalar]) -> dict[str, Scalar]:
        """Time derivatives [K/s] of the free nodes' temperatures.

        Parameters
        ----------
        temperatures : mapping
            Of the free nodes [K].
        losses : mapping
            Heat made in a node [W]; a node without is not named, and what goes into a fixed one is taken away.
        """
        require_known(losses, self.nodes, "thermal node")
        heat: dict[str, Scalar] = {name: losses.get(name, 0.0) for name in self.nodes}
        for name, flow in self.flows(temperatures).items():
            heat[self.paths[name].a] -= flow
            heat[self.paths[name].b] += flow
        return {name: heat[name] / self.nodes[name].capacity for name in self.free}

    def steady_state(self, losses: Mapping[str, Scalar]) -> dict[str, Scalar]:
        """Temperatures [K] of all nodes at which nothing warms or cools, with constant losses [W].

        Raises
        ------
        ValueError
            For a free node without a way to a fixed temperature.
        """
        require_known(losses, self.nodes, "thermal node")
        self._require_ways_out()
        if not self.free:
            return self.all_temperatures({})
        place = {name: k for k, name in enumerate(self.free)}
        matrix = [[0.0] * len(place) for _ in place]
        heat: list[Scalar] = [losses.get(name, 0.0) for name in self.free]
        for path in self.paths.values():
            conductance = 1 / path.resistance
            for here, there in ((path.a, path.b), (path.b, path.a)):
                if here in place:
                    matrix[place[here]][place[here]] += conductance
                    if there in place:
                        matrix[place[here]][place[there]] -= conductance
                    else:
                        heat[place[here]] += conductance * self.nodes[there].temperature
        solution = ca.solve(ca.vertcat(*(ca.horzcat(*row) for row in matrix)), ca.vertcat(*heat))
        values = [float(value) if isinstance(value, ca.DM) else value for value in ca.vertsplit(solution)]
        return self.all_temperatures(dict(zip(self.free, values, strict=True)))

    def _require_ways_out(self) -> None:
        reached = {name for name in self.nodes if name not in self.free}
        for _ in self.nodes:
            reached |= {end for path in self.paths.values() for end in _ends_beyond(path, reached)}
        lost = [name for name in self.free if name not in reached]
        if lost:
            raise ValueError(
                f"ThermalNetwork: {', '.join(lost)} has no steady temperature without a path to a node of fixed "
                "temperature; add one"
            )


def _ends_beyond(path: ThermalPath, reached: Iterable[str]) -> tuple[str, ...]:
    return (path.a, path.b) if path.a in reached or path.b in reached else ()
