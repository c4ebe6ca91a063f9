"""A jam: a shaft that something holds."""

from dataclasses import replace

from gear.shafts import Bearing
from gear.transmission import Transmission


def jam(gear: Transmission, shaft: str, torque: float) -> Transmission:
    """The same transmission with one shaft held to the housing until `torque` [N m] is exceeded.

    A jam is a bearing, named after the shaft as `jam_<shaft>`, that rubs with `torque` at every speed: stiction decides
    together with all other contacts whether it holds. For a jam in the middle of a run, build it with torque 0,
    and go on from the run's last state with the parameters `gear.bearings.jam_<shaft>.coulomb` and `.breakaway`.
    A shaft that nothing can turn is `fixed` in the Transmission.
    """
    held = Bearing(shaft=shaft, coulomb=torque, breakaway=torque)
    return replace(gear, bearings={**gear.bearings, f"jam_{shaft}": held})
