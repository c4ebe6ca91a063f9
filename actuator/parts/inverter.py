"""The inverter, averaged over its switching period."""

import math
from dataclasses import dataclass
from typing import Annotated, Literal, get_args

import casadi as ca

from actuator.parts.bridge import Bridge
from actuator.parts.derating import OverheatDerating, UndervoltageDerating
from actuator.parts.electrical import Current, Voltage
from actuator.parts.park import to_axes, to_phases
from gear.quantities import Scalar, check
from gear.quantities.roles import Limit

VoltageLimit = Literal["circle", "hexagon"]


@dataclass(frozen=True, kw_only=True)
class Inverter:
    """Averaged voltage source with the limits of its DC link and its current.

        one axis (DC motor):      |v| <= dc_voltage
        two axes (dq, peak):      sqrt(vd^2 + vq^2) <= dc_voltage / sqrt(3)     (circle)
                                  line to line <= dc_voltage                    (hexagon around that circle)

    What the legs lose on the way to the motor is that of the `bridge`; without one they are ideal.

    Parameters
    ----------
    dc_voltage : float
        Voltage of the DC link [V], where no other is given.
    current_limit : float
        Largest torque-producing current it is asked for [A peak].
    limit : "circle" or "hexagon"
        Of the voltage of two axes: linear modulation, or all that the link has.
    bridge : Bridge or None
        Dead time and conduction drops.
    undervoltage : UndervoltageDerating or None
        Of the current limit, by the link's voltage.
    overheat : OverheatDerating or None
        Of the current limit, by a temperature.
    """

    dc_voltage: Annotated[Voltage, Limit()]
    current_limit: Annotated[Current, Limit()]
    limit: VoltageLimit = "circle"
    bridge: Bridge | None = None
    undervoltage: UndervoltageDerating | None = None
    overheat: OverheatDerating | None = None

    def __post_init__(self) -> None:
        check(self)
        if self.limit not in get_args(VoltageLimit):
            raise ValueError(f"Inverter.limit must be one of circle, hexagon, got {self.limit!r}")

    def realize(
        self, voltages: list[Scalar], angle: Scalar | None = None, dc_voltage: Scalar | None = None
    ) -> list[Scalar]:
        """The voltages within the limit [V] from those demanded; the direction of the vector is kept.

        Parameters
        ----------
        voltages : list
            Demanded [V], one an axis.
        angle : float or None
            Electrical angle of the d axis [rad]; the hexagon needs it.
        dc_voltage : float or None
            Of the link [V]; None for the inverter's own.

        Raises
        ------
        ValueError
            For a hexagon without an angle.
        """
        link = self.dc_voltage if dc_voltage is None else dc_voltage
        if len(voltages) == 1:
            return [ca.fmax(-link, ca.fmin(link, voltages[0]))]
        if self.limit == "hexagon":
            a, b, c = to_phases(voltages, self._need(angle))
            line_to_line = ca.fmax(ca.fmax(a, b), c) - ca.fmin(ca.fmin(a, b), c)
            scale = link / ca.fmax(line_to_line, link)
        else:
            limit = link / math.sqrt(3)
            # scaled by the larger of demand and limit: smooth at zero, where a norm would not be
            square = sum(voltage**2 for voltage in voltages)
            scale = limit / ca.sqrt(ca.fmax(square, limit**2))
        return [scale * voltage for voltage in voltages]

    def terminal_voltages(
        self,
        realized: list[Scalar],
        currents: list[Scalar],
        angle: Scalar | None = None,
        dc_voltage: Scalar | None = None,
    ) -> list[Scalar]:
        """The voltages the motor gets [V]: those realized, less what the bridge takes from each leg.

        A DC motor is fed by two legs, its current leaving one and entering the other.

        Raises
        ------
        ValueError
            For a bridge and two axes without an electrical angle [rad].
        """
        if self.bridge is None:
            return list(realized)
        link = self.dc_voltage if dc_voltage is None else dc_voltage
        if len(realized) == 1:
            return [realized[0] + 2 * self.bridge.error(currents[0], link)]
        phases = to_phases(currents, self._need(angle))
        errors = to_axes([self.bridge.error(current, link) for current in phases], angle)
        return [voltage + error for voltage, error in zip(realized, errors, strict=True)]

    def conduction_loss(self, currents: list[Scalar], angle: Scalar | None = None) -> Scalar:
        """Heat of the bridge [W]; dead time makes none, it only shortens the pulses."""
        if self.bridge is None:
            return 0.0
        legs = [currents[0], -currents[0]] if len(currents) == 1 else to_phases(currents, self._need(angle))
        return sum(self.bridge.conduction_drop(current) * current for current in legs)

    def _need(self, angle: Scalar | None) -> Scalar:
        if angle is None:
            what = "a hexagonal limit" if self.limit == "hexagon" else "a bridge"
            raise ValueError(f"Inverter: {what} needs the electrical angle [rad] of the d axis, got None; pass `angle`")
        return angle

    def allow(self, current: Scalar, dc_voltage: Scalar | None = None, temperature: Scalar | None = None) -> Scalar:
        """The torque-producing current [A] that may be asked for, at a link voltage [V] and a temperature [K]."""
        limit = self.current_limit_at(dc_voltage, temperature)
        return ca.fmax(-limit, ca.fmin(limit, current))

    def current_limit_at(self, dc_voltage: Scalar | None = None, temperature: Scalar | None = None) -> Scalar:
        """Current limit [A] after derating; what is not given does not derate."""
        limit = self.current_limit
        if self.undervoltage is not None and dc_voltage is not None:
            limit = limit * self.undervoltage.share(dc_voltage)
        if self.overheat is not None and temperature is not None:
            limit = limit * self.overheat.share(temperature)
        return limit
