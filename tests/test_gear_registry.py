"""The registry of parts: slots, their defaults, and files that name their parts.

Oracles: a slot of this file with parts of this file; what a file says, written in Python.
"""

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Protocol

import pytest
from annotated_types import Gt, Unit

from gear.quantities import check
from gear.quantities.registry import PartError, default_part, is_slot, part, parts, slots
from studies.converter import Refused, converter


class Spring(Protocol):
    """What the frame of this file asks of its spring."""

    @abstractmethod
    def force(self, stretch: float) -> float:
        """[N]."""

    def energy(self, stretch: float) -> float:
        """[J]."""
        return self.force(stretch) * stretch / 2


class Fixing(Protocol):
    """A slot with two parts of which none is the default."""

    @abstractmethod
    def holds(self) -> bool:
        """Whether it does."""


@part(Spring, default=True)
@dataclass(frozen=True, kw_only=True)
class Coil(Spring):
    """A linear spring."""

    rate: Annotated[float, Unit("N/m"), Gt(0)]

    def __post_init__(self):
        check(self)

    def force(self, stretch):
        return self.rate * stretch


@part(Fixing)
@dataclass(frozen=True)
class Glue(Fixing):
    """Holds."""

    def holds(self):
        return True


@part(Fixing)
@dataclass(frozen=True)
class Hope(Fixing):
    """Does not."""

    def holds(self):
        return False


@dataclass(frozen=True, kw_only=True)
class Frame:
    """Has slots in all the places that a file may have."""

    spring: Spring
    spare: Spring | None = None
    more: Mapping[str, Spring] | None = None
    fixing: Fixing | None = None


def read(table):
    return converter().structure(table, Frame)


def refusals(error):
    """All texts in a tree of exceptions."""
    for inner in getattr(error, "exceptions", [error]):
        if inner is error:
            yield error
        else:
            yield from refusals(inner)


def refused(table):
    with pytest.raises(Exception) as caught:  # noqa: PT011 - cattrs wraps them
        read(table)
    return [(str(each), each.steps) for each in refusals(caught.value) if isinstance(each, Refused)]


def test_a_slot_is_filled_by_any_of_its_parts_and_by_its_default_without_a_type():
    table = {"spring": {"rate": 2.0}, "spare": {"type": "Coil", "rate": 3}, "fixing": {"type": "Hope"}}
    assert read(table) == Frame(spring=Coil(rate=2.0), spare=Coil(rate=3.0), fixing=Hope())
    assert read({"spring": {"rate": 2.0}, "more": {"left": {"rate": 1.0}}}).more == {"left": Coil(rate=1.0)}


def test_a_second_kind_breaks_no_file_and_is_known_at_once():
    assert read({"spring": {"rate": 2.0}}) == Frame(spring=Coil(rate=2.0))

    @part(Spring)
    @dataclass(frozen=True, kw_only=True)
    class Bow(Spring):
        """Not linear."""

        limit: Annotated[float, Unit("N"), Gt(0)]

        def force(self, stretch):
            return self.limit * stretch / (1 + abs(stretch))

    assert list(parts(Spring)) == ["Bow", "Coil"]
    assert read({"spring": {"rate": 2.0}, "spare": {"type": "Bow", "limit": 1.0}}) == Frame(
        spring=Coil(rate=2.0), spare=Bow(limit=1.0)
    )
    assert refused({"spring": {"type": "Rope"}}) == [("must be one of Bow, Coil", ("type",))]


def test_without_a_default_the_type_has_to_be_given():
    assert default_part(Fixing) is None
    table = {"spring": {"rate": 2.0}, "fixing": {}}
    assert refused(table) == [("is missing; it must be one of Glue, Hope", ("type",))]


def test_slots_are_protocols_that_have_parts():
    assert is_slot(Spring)
    assert not is_slot(Coil)
    assert not is_slot(Protocol)
    assert {Spring, Fixing} <= set(slots())


def not_a_spring(**methods):
    return type("Thing", (), methods)


def derived(**methods):
    return type("Thing", (Spring,), methods)


@pytest.mark.parametrize(
    ("kind", "text"),
    [
        (not_a_spring(energy=lambda self, stretch: 0.0), r"Thing is no Spring: it lacks force\(self, stretch"),
        (derived(), r"Thing is no Spring: it lacks force\(self, stretch"),
        (derived(force=lambda self, angle: 0.0), r"force\(self, angle\) should take \(self, stretch"),
        (derived(force=lambda self, stretch, speed: 0.0), r"force\(self, stretch, speed\) should take"),
        (derived(force=3.0), "force is no method"),
    ],
)
def test_what_does_not_keep_the_contract_is_refused_by_name(kind, text):
    with pytest.raises(PartError, match=text):
        part(Spring)(kind)


def test_a_name_or_default_that_is_taken_is_refused():
    with pytest.raises(PartError, match="Spring Coil of elsewhere: there is one of that name in"):
        part(Spring)(type("Coil", (Spring,), {"force": lambda self, stretch: 0.0, "__module__": "elsewhere"}))
    with pytest.raises(PartError, match="Spring: the default is Coil already, not Thing"):
        part(Spring, default=True)(derived(force=lambda self, stretch: 0.0))


class Damper(Spring, Protocol):
    """A slot that refines another one, with an attribute that its parts declare."""

    sealed: bool

    @abstractmethod
    def loss(self, rate: float) -> float:
        """[W]."""


def test_a_part_is_one_of_the_slots_that_its_slot_refines():
    @part(Damper)
    @dataclass(frozen=True, kw_only=True)
    class Strut(Damper):
        """Springs and damps."""

        sealed: bool

        def force(self, stretch):
            return stretch

        def loss(self, rate):
            return rate**2

    assert parts(Damper) == {"Strut": Strut}
    assert parts(Spring)["Strut"] is Strut
    assert (default_part(Damper), default_part(Spring)) == ("Strut", "Coil")


def test_what_the_refined_slot_asks_is_asked_and_attributes_are_declared():
    with pytest.raises(PartError, match=r"Thing is no Spring: it lacks force\(self, stretch"):
        part(Damper)(type("Thing", (Damper,), {"loss": lambda self, rate: 0.0, "sealed": True}))
    with pytest.raises(PartError, match="Thing is no Damper: it does not declare sealed"):
        part(Damper)(type("Thing", (Damper,), {"force": lambda self, stretch: 0.0, "loss": lambda self, rate: 0.0}))


def test_a_field_does_not_take_the_place_of_a_method():
    with pytest.raises(PartError, match="Thing is no Spring: energy is no method"):

        @part(Spring)
        @dataclass(frozen=True, kw_only=True)
        class Thing(Spring):
            """Its energy is a number."""

            energy: Annotated[float, Unit("J")]

            def force(self, stretch):
                return stretch
