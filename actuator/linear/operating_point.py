"""Operating points: a state in which nothing changes, the contact modes it is in, and what they are called."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from actuator.system.contact_modes import MOTIONS
from actuator.system.hybrid import EventKind, HybridSystem, Mode, ModeKind, Place
from gear.quantities import require_known


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
        values = dict(zip(self.system.modes, self.m, strict=True))
        return {mode.at: int(values[mode.name]) for mode in flank_modes(self.system)}

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
    speed. Flanks that are not given are +1, those of end stops 0; a contact on no flank is free, whatever its word.
    """
    names = [contact.name for contact in system.contacts]
    if isinstance(contacts, str):
        require_known([contacts], MOTIONS, "contact mode")
        values = {contact.motion: MOTIONS[contacts] * contact.direction for contact in system.contacts}
    else:
        require_known(contacts, names, "contact")
        require_known(contacts.values(), MOTIONS, "contact mode")
        missing = [name for name in names if name not in contacts]
        if missing:
            raise KeyError(f"no mode given for contact {', '.join(missing)}; each needs stuck, forward or backward")
        values = {contact.motion: MOTIONS[contacts[contact.name]] for contact in system.contacts}
    sides = usual_flanks(system)
    require_known(flanks or {}, sides, "flank")
    sides |= flanks or {}
    values |= {mode.name: sides[mode.at] for mode in flank_modes(system)}
    values |= {contact.motion: 0 for contact in system.contacts if contact.flank and values[contact.flank] == 0}
    return system.mode_vector(values)


def flank_modes(system: HybridSystem) -> list[Mode]:
    """Mode variables of the flanks of meshes, couplings and end stops."""
    return [mode for mode in system.mode_variables if mode.kind is ModeKind.FLANK]


def usual_flanks(system: HybridSystem) -> dict[str, int]:
    """Teeth and couplings transmit; an end stop is not touched."""
    return {mode.at: 0 if mode.place is Place.STOP else 1 for mode in flank_modes(system)}


def gaps(system: HybridSystem) -> dict[str, Place]:
    """What can be in a gap, between two flanks, by path."""
    return {event.at: event.place for event in system.events if event.kind is EventKind.GAP}
