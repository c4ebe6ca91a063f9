"""What the load feels of an actuator that is shaken: dynamic stiffness, powered and not."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray

from actuator.actuator import Actuator
from actuator.parts.torque_source import TorqueSource
from actuator.response.frequency_response import FrequencyResponse, frequency_response
from actuator.system.hybrid import HybridSystem
from gear.shafts.brake import Brake

if TYPE_CHECKING:
    from matplotlib.figure import Figure

BLOCK = 1e6  # N m that a blocked shaft holds


def remove_drive(actuator: Actuator) -> Actuator:
    """The same actuator with its motor switched off: open circuit, no torque, its inertia on the input shaft.

    Raises
    ------
    ValueError
        Where the rotor has cogging or drag of its own, which would stay.
    """
    motor, gear = actuator.motor, actuator.gear
    if motor.has_rotor_torque():
        raise ValueError(
            f"{actuator.name}: remove_drive has no place for the cogging and drag of a rotor; put its drag into a "
            f"bearing of the shaft {gear.input!r}, and leave them out of the motor"
        )
    shaft = gear.shafts[gear.input]
    heavier = replace(shaft, inertia=shaft.inertia + motor.rotor_inertia())
    return Actuator(
        motor=TorqueSource(),
        gear=replace(gear, shafts={**gear.shafts, gear.input: heavier}),
        load=actuator.load,
        thermal=actuator.thermal,
        name=f"{actuator.name}, unpowered",
    )


def block_motor(actuator: Actuator) -> Actuator:
    """The same actuator, unpowered, with its motor shaft blocked: for the play and the stiffness of the gear alone."""
    loose = remove_drive(actuator)
    gear = loose.gear
    others = {name: bearing for name, bearing in gear.bearings.items() if bearing.shaft != gear.input}
    block = Brake(shaft=gear.input, torque=BLOCK)
    return replace(
        loose, gear=replace(gear, bearings={**others, "block": block}), name=f"{actuator.name}, motor blocked"
    )


@dataclass(frozen=True, kw_only=True)
class DynamicStiffness:
    """Compliance, stiffness and impedance at the load over frequency, for every amplitude of the torque.

    Attributes
    ----------
    measured : FrequencyResponse
        Of the load angle, to a sine of the load torque.
    """

    measured: FrequencyResponse = field(repr=False)

    @property
    def data(self) -> xarray.Dataset:
        """Over set, load, amplitude [N m] and frequency [Hz], complex; infinite where nothing moves.

        compliance angle/torque [rad/(N m)], stiffness its inverse [N m/rad], impedance torque/speed [N m s/rad].
        """
        source = self.measured.data
        compliance = source.response.isel(output=0, drop=True)
        compliance = compliance.where(source.moves, 0.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            stiffness = xarray.where(compliance == 0, complex(math.inf, 0.0), 1 / compliance)
            impedance = xarray.where(
                compliance == 0, complex(math.inf, 0.0), stiffness / (2j * np.pi * source.frequency)
            )
        return xarray.Dataset(
            {
                "compliance": compliance.assign_attrs(units="rad/(N m)"),
                "stiffness": stiffness.assign_attrs(units="N m/rad"),
                "impedance": impedance.assign_attrs(units="N m s/rad"),
                "moves": source.moves,
                "settled": source.settled,
                "note": source.note,
            },
            attrs=source.attrs,
        )

    def plot(self, **where: Any) -> "Figure":
        """Size and phase of the stiffness over frequency, a line per amplitude."""
        from actuator.plots.response import plot_stiffness

        return plot_stiffness(self, **where)


def dynamic_stiffness(
    plant: Actuator | HybridSystem,
    *,
    amplitudes: Sequence[float],
    frequencies: Sequence[float] | np.ndarray,
    **options: Any,
) -> DynamicStiffness:
    """Sines of torque on the load, of every amplitude [N m] and frequency [Hz].

    Of an actuator with its controller, or of `remove_drive(actuator)`.

    Parameters
    ----------
    plant, amplitudes, frequencies
        As for `frequency_response`.
    options
        The other choices of `frequency_response`: inputs, loads, sets, workers, done, progress, ...
    """
    return DynamicStiffness(
        measured=frequency_response(
            plant, amplitudes=amplitudes, frequencies=frequencies, given="load_torque", seen=("load_angle",), **options
        )
    )
