"""What the temperatures of a thermal network are to the other parts of an actuator, and what they heat."""

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import casadi as ca

from actuator.parts.temperature import MotorTemperature
from actuator.parts.thermal import ThermalNetwork
from actuator.system.builder import SystemBuilder
from actuator.system.parameters import substituted, unchecked
from gear.lubrication.lubricant import MEASURED, oil_temperatures
from gear.quantities import Scalar
from gear.quantities.roles import NodeTemperature

WARM = 1.0  # K, a usual change
# where a loss goes, and to which node, the first there is
NODES = {
    "copper": ("winding", "housing"),
    "iron": ("stator", "housing"),
    "drag": ("housing",),
    "friction": ("oil", "housing"),
    "damping": ("oil", "housing"),
    "inverter": ("inverter",),
    "chopper": ("chopper",),
}


class HeatFlow:
    """The network of one actuator while it is put together; without one, nothing depends on temperature.

    Nodes are known by their names: winding, magnet (else stator, else housing), stator, housing, oil, inverter,
    chopper. A node that is not there neither heats nor is heated.
    """

    def __init__(self, builder: SystemBuilder, network: ThermalNetwork | None) -> None:
        self.builder, self.network = builder, network
        self.at: dict[str, Scalar] = {}
        if network is not None:
            states = {
                name: builder.state(
                    f"thermal.{name}",
                    "K",
                    WARM,
                    initial=network.nodes[name].temperature,
                    roles=(NodeTemperature(name),),
                    owner="thermal network",
                )
                for name in network.free
            }
            self.at = network.all_temperatures(states)

    def _of(self, *names: str) -> Scalar | None:
        return next((self.at[name] for name in names if name in self.at), None)

    def of_motor(self) -> MotorTemperature | None:
        """Of winding and magnets."""
        winding, magnet = self._of("winding", "housing"), self._of("magnet", "stator", "housing")
        return None if winding is None or magnet is None else MotorTemperature(winding, magnet)

    def of_oil(self) -> Scalar | None:
        """Of the oil, or else of the housing it is in."""
        return self._of("oil", "housing")

    def warm_oils(self, gear: Any) -> Any:
        """The gear with its oils at the temperature of the network's oil, where it has that node."""
        oil = self._of("oil")
        if oil is None:
            return gear

        def warm(part: Any) -> Any:
            own = oil_temperatures(part)
            values = {field.name: oil if field.name in own else getattr(part, field.name) for field in fields(part)}
            return unchecked(type(part), **values) if own else None

        return substituted(gear, warm, keep=(MEASURED,))

    def feed(self, losses: Mapping[str, Scalar]) -> None:
        """The losses [W] into the network's nodes."""
        if self.network is None:
            return
        heat: dict[str, Scalar] = {}
        for name, loss in losses.items():
            node = next((node for node in NODES.get(name, ()) if node in self.at), None)
            if node is not None:
                heat[node] = heat.get(node, 0.0) + ca.SX(loss)
        states = {name: self.at[name] for name in self.network.free}
        for name, rate in self.network.rates(states, heat).items():
            self.builder.rate(f"thermal.{name}", rate)
