"""All linear models of an actuator at one operating point: one per contact mode that it can reach there."""

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import control
import numpy as np

from actuator.actuator import Actuator
from actuator.linear.loop import loop_transfer
from actuator.linear.margins.crossings import Margins, margins
from actuator.linear.model import linearize
from actuator.linear.operating_point import NoEquilibrium, OperatingPoint, gaps
from actuator.linear.sampled import without_quantization
from actuator.linear.trim import trim
from actuator.system.contact_modes import FORWARD, FREE, MOTIONS, STUCK, contact_labels
from actuator.system.hybrid import HybridSystem, Place, require_sticking
from gear.quantities import require_known

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, kw_only=True)
class ModeModel:
    """One contact mode at an operating point.

    Attributes
    ----------
    name : str
        "stuck", "forward", "backward" (of the output), with the contacts that differ.
    direction : str
        Of the output: "stuck", "forward" or "backward".
    point : OperatingPoint
        State and modes; `linearize`, `loop_transfer` and `poles` take it.
    equilibrium : bool
        Whether the point is an equilibrium. With the teeth separated there is none: the model is valid only meanwhile.
    """

    name: str
    direction: str
    point: OperatingPoint = field(repr=False)
    equilibrium: bool

    @property
    def contacts(self) -> dict[str, str]:
        """Mode of each contact, in words."""
        return contact_labels(self.point.system, self.point.m)

    @property
    def drifting(self) -> list[str]:
        """States that may move at the point."""
        return [] if self.equilibrium else [quantity.name for quantity in self.point.system.states]

    def linear(self, inputs: Sequence[str], outputs: Sequence[str]) -> control.StateSpace:
        """As `linearize`, without states that stuck contacts make redundant."""
        return linearize(self.point, inputs, outputs, drifting=self.drifting, minimal=True)

    def loop(self, at: str) -> control.StateSpace:
        """As `loop_transfer`, without states that stuck contacts make redundant."""
        return loop_transfer(self.point, at, drifting=self.drifting, minimal=True)


@dataclass(frozen=True, kw_only=True)
class ModeModels:
    """The linear models of all modes that can be reached at an operating point.

    Attributes
    ----------
    models : tuple of ModeModel
        In the order stuck, forward, backward, then mixed ones, then with a mesh in its gap.
    unreachable : mapping of str to str
        Modes that cannot be, and why.
    """

    models: tuple[ModeModel, ...]
    unreachable: Mapping[str, str]

    def __iter__(self) -> Iterator[ModeModel]:
        return iter(self.models)

    def __len__(self) -> int:
        return len(self.models)

    def __getitem__(self, name: str) -> ModeModel:
        """A model by the name of its mode; KeyError with the nearest names where there is none."""
        require_known([name], [model.name for model in self.models], "reachable mode")
        return next(model for model in self.models if model.name == name)

    @property
    def directions(self) -> dict[str, str]:
        """Direction of the output by mode."""
        return {model.name: model.direction for model in self.models}

    def loops(self, at: str) -> dict[str, control.StateSpace]:
        """Loop transfer in each mode, opened at a named signal."""
        return {model.name: model.loop(at) for model in self.models}

    def margins(self, at: str) -> dict[str, Margins]:
        """Margins of the loop in each mode."""
        return {name: margins(loop) for name, loop in self.loops(at).items()}

    def responses(self, given: str, seen: str) -> dict[str, control.StateSpace]:
        """Response of one output to one input in each mode, all loops closed."""
        return {model.name: model.linear([given], [seen]) for model in self.models}

    def plot(self, at: str) -> "Figure":
        """Bode plot of the loop opened at a named signal, a line per mode in front of the envelope."""
        from actuator.plots.bode import plot_modes

        return plot_modes(self.loops(at), f"loop opened at {at.replace('_', ' ')}", directions=self.directions)


def linearize_modes(
    plant: Actuator | HybridSystem,
    *,
    inputs: Mapping[str, float] | None = None,
    guess: Mapping[str, float] | None = None,
    parameters: Mapping[str, float] | None = None,
    partial: bool = False,
) -> ModeModels:
    """One linear model per contact mode that can be reached at an operating point.

    A mode can be reached where there is a state of rest in it in which friction holds the contacts that are stuck;
    flanks follow from the load. Each mesh or coupling with a gap adds the model with its teeth separated and all else
    sliding.
    Sensors are taken to read between their counts, without noise: a step has no derivative.

    Parameters
    ----------
    plant : Actuator or HybridSystem
        What to linearize.
    inputs, guess, parameters : mapping of str to float
        As for `trim`.
    partial : bool
        Whether modes are tried in which some contacts slide and others are stuck: 2^(contacts + 1) - 1 in all.

    Returns
    -------
    ModeModels

    Raises
    ------
    NoEquilibrium
        Where no mode can be reached at all, with the reason of the first.
    """
    system = without_quantization(plant).system() if isinstance(plant, Actuator) else plant
    require_sticking(system, "linearize_modes")
    found: list[ModeModel] = []
    reasons: dict[str, NoEquilibrium] = {}

    def attempt(name: str, direction: str, contacts: str | dict[str, str], start: Mapping[str, float] | None) -> None:
        try:
            point = trim(system, contacts, inputs=inputs, guess=start, parameters=parameters)
        except NoEquilibrium as error:
            reasons[name] = error
        else:
            found.append(ModeModel(name=name, direction=direction, point=point, equilibrium=True))

    contacts = [contact.name for contact in system.contacts]
    for word in MOTIONS if contacts else [FORWARD]:
        attempt(word, word, word, guess)
    if not found:
        raise next(iter(reasons.values()))
    sliding = [model for model in found if model.name != STUCK]
    for model in sliding if partial else []:
        for stuck in _mixed(contacts):
            words = {name: STUCK if name in stuck else model.contacts[name] for name in contacts}
            attempt(f"{model.name}, stuck {_short(stuck)}", model.direction, words, model.point.states)
    separated = [_in_gap(model, name) for model in sliding for name in _find_gaps(system)]
    return ModeModels(models=(*found, *separated), unreachable={name: str(reason) for name, reason in reasons.items()})


def _mixed(contacts: Sequence[str]) -> Iterator[tuple[str, ...]]:
    """Some of the contacts, but not all and not none."""
    for count in range(1, len(contacts)):
        yield from itertools.combinations(contacts, count)


def _short(contacts: Sequence[str]) -> str:
    return " ".join(name.replace("gear.", "") for name in contacts)


def _find_gaps(system: HybridSystem) -> list[str]:
    """Meshes and couplings with a gap, by path; not the end stops, which are mostly not touched."""
    return [name for name, place in gaps(system).items() if place is not Place.STOP]


def _in_gap(model: ModeModel, name: str) -> ModeModel:
    """The same with one mesh or coupling in its gap."""
    point, system = model.point, model.point.system
    inside = np.array([mode.at == name for mode in system.mode_variables])
    m = np.where(inside, 0.0, point.m)
    separated = OperatingPoint(system=system, x=point.x, m=m, u=point.u, p=point.p, rates=point.rates)
    label = f"{model.name}, {FREE} {_short([name])}"
    return ModeModel(name=label, direction=model.direction, point=separated, equilibrium=False)
