"""Planets and the laws of their meshes, as every arrangement has them; and planets that are not all equal.

Planets are lumped by count into one shaft: its inertia is that of all of them, its meshes share their load
(`Mesh.count`), and their masses ride on the carrier. `separate` takes them apart again, where they are not equal or
their load is not.
"""

from dataclasses import dataclass, replace
from typing import Annotated, Literal

from annotated_types import Ge, Unit

from gear.elasticity.law import ElasticityLaw
from gear.friction.law import FrictionLaw
from gear.mesh import Mesh
from gear.quantities import Inertia, check, check_count
from gear.shafts.law import Shaft
from gear.teeth.pair import Pair
from gear.transmission import Transmission


@dataclass(frozen=True, kw_only=True)
class MeshLaws:
    """What all meshes of an arrangement have in common; the defaults are rigid and lossless.

    Parameters
    ----------
    elasticity, friction
        As for `Mesh`, per tooth contact: `count` planets are that many times as stiff.
    stick_by : "conjugate speed" or "mesh speed"
        As for `Mesh`, but the conjugate speed by default: a light planet in a ring cannot stick by mesh speed.
    """

    elasticity: ElasticityLaw | None = None
    friction: FrictionLaw | None = None
    stick_by: Literal["mesh speed", "conjugate speed"] = "conjugate speed"

    def mesh(self, a: str, b: str, pair: Pair, *, carrier: str | None = None, count: int = 1) -> Mesh:
        """A mesh with these laws."""
        return Mesh(
            a=a,
            b=b,
            carrier=carrier,
            pair=pair,
            elasticity=self.elasticity,
            friction=self.friction,
            stick_by=self.stick_by,
            count=count,
        )


RIGID = MeshLaws()


@dataclass(frozen=True, kw_only=True)
class Planets:
    """Equal planets on one carrier.

    Parameters
    ----------
    count : int
        How many.
    inertia : float
        Of one about its own axis [kg m^2].
    mass : float
        Of one [kg]; it rides on the carrier.
    """

    count: int
    inertia: Inertia
    mass: Annotated[float, Unit("kg"), Ge(0)] = 0.0

    def __post_init__(self) -> None:
        check(self)
        check_count(self, "count")

    def shaft(self) -> Shaft:
        """All planets as one shaft."""
        return Shaft(inertia=self.count * self.inertia)

    def carrier(self, inertia: float, distance: float) -> Shaft:
        """The carrier [kg m^2] with the planets' masses at the center distance [m]."""
        return Shaft(inertia=inertia + self.count * self.mass * distance**2)


def separate(gear: Transmission, *shafts: str) -> Transmission:
    """The same set with a shaft and meshes of its own for every planet, so that they can differ.

    Shaft planets becomes planets_1, planets_2, ..., its mesh sun_planet becomes sun_planet_1, sun_planet_2, ...;
    change one with `dataclasses.replace` (another gap, stiffness, transmission error) and the load is shared unequally.
    More meshes can then stick than shafts can move: their friction is the smallest that holds, see `gear.stiction`.

    Parameters
    ----------
    gear : Transmission
        Of `gear.arrangements`, with lumped planets and nothing but meshes on them.
    shafts : str
        Names of the planets' shafts; both of sets with short and long planets.

    Raises
    ------
    ValueError
        Where a shaft is not that of several planets, or carries more than meshes.
    """
    counts = {name: {mesh.count for mesh in gear.meshes.values() if name in (mesh.a, mesh.b)} for name in shafts}
    found = set().union(*counts.values())
    if len(found) != 1 or min(found) == 1 or not all(counts.values()):
        raise ValueError(
            f"separate: shafts {', '.join(shafts)} must be those of equally many lumped planets, got meshes with count "
            f"{', '.join(map(str, sorted(found))) or 'none'}"
        )
    loaded = [
        f"{kind}.{name}"
        for kind in ("bearings", "couplings", "drags")
        for name, part in getattr(gear, kind).items()
        if set(part.terminals().values()) & set(shafts)
    ]
    if loaded:
        raise ValueError(f"separate: {loaded[0]} is that of all planets together; add it to the separate ones instead")
    numbers = range(1, found.pop() + 1)

    def own(name: str, k: int) -> str:
        return f"{name}_{k}" if name in shafts else name

    apart: dict[str, Shaft] = {}
    for name, shaft in gear.shafts.items():
        share = shaft.inertia / len(numbers)
        apart |= {own(name, k): Shaft(inertia=share) for k in numbers} if name in shafts else {name: shaft}
    meshes: dict[str, Mesh] = {}
    for name, mesh in gear.meshes.items():
        split = not {mesh.a, mesh.b}.isdisjoint(shafts)
        meshes |= (
            {f"{name}_{k}": replace(mesh, a=own(mesh.a, k), b=own(mesh.b, k), count=1) for k in numbers}
            if split
            else {name: mesh}
        )
    return replace(gear, shafts=apart, meshes=meshes)
