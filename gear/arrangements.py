"""Arrangements: the usual gear sets as graphs of shafts and meshes.

Each function is a few lines that name the shafts and say what meshes with what; nothing in the rest of the
project knows these sets. Planets are lumped by count into one shaft: its inertia is that of all of them,
its meshes share their load (`Mesh.count`), and their masses ride on the carrier. `separate` takes them apart again,
where they are not equal or their load is not.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Literal

from annotated_types import Ge, Unit

from gear.elasticity import ElasticityLaws
from gear.friction import FrictionLaws
from gear.geometry import ExternalPair, GivenPair
from gear.internal import InternalPair
from gear.mesh import Mesh
from gear.quantities import Inertia, check, check_count
from gear.shafts import Bearing, Shaft
from gear.transmission import Transmission

CENTERS = 1e-6  # relative difference up to which two center distances are the same


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

    elasticity: ElasticityLaws | None = None
    friction: FrictionLaws | None = None
    stick_by: Literal["mesh speed", "conjugate speed"] = "conjugate speed"

    def mesh(self, a: str, b: str, pair: object, *, carrier: str | None = None, count: int = 1) -> Mesh:
        """A mesh with these laws."""
        return Mesh(
            a=a,
            b=b,
            carrier=carrier,
            pair=pair,  # pyright: ignore[reportArgumentType]
            elasticity=self.elasticity,
            friction=self.friction,
            stick_by=self.stick_by,
            count=count,
        )


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


def train(
    stages: Sequence[ExternalPair | GivenPair],
    inertias: Sequence[float],
    laws: MeshLaws | Sequence[MeshLaws] = MeshLaws(),
    bearings: Mapping[str, Bearing] | None = None,
) -> Transmission:
    """Spur gears one after the other on fixed axes: shafts shaft_0 (input) to shaft_n (output).

    Parameters
    ----------
    stages : sequence of pairs
        Wheel A on the shaft nearer to the input.
    inertias : sequence of float
        Of the shafts [kg m^2], one more than stages.
    laws : MeshLaws or a sequence of them
        For all stages, or per stage.
    bearings : mapping of str to Bearing or None
        By name.
    """
    if len(inertias) != len(stages) + 1:
        raise ValueError(f"train: {len(stages)} stages need {len(stages) + 1} inertias, got {len(inertias)}")
    each = [laws] * len(stages) if isinstance(laws, MeshLaws) else list(laws)
    names = [f"shaft_{k}" for k in range(len(inertias))]
    return Transmission(
        shafts={name: Shaft(inertia=inertia) for name, inertia in zip(names, inertias, strict=True)},
        meshes={
            f"stage_{k + 1}": law.mesh(names[k], names[k + 1], pair)
            for k, (pair, law) in enumerate(zip(stages, each, strict=True))
        },
        bearings=bearings or {},
        input=names[0],
        output=names[-1],
    )


def spur_pair(
    pair: ExternalPair | GivenPair | InternalPair, inertia_a: float, inertia_b: float, laws: MeshLaws = MeshLaws()
) -> Transmission:
    """Two wheels on fixed axes: shafts wheel_a (input) and wheel_b (output)."""
    return Transmission(
        shafts={"wheel_a": Shaft(inertia=inertia_a), "wheel_b": Shaft(inertia=inertia_b)},
        meshes={"mesh": laws.mesh("wheel_a", "wheel_b", pair)},
        input="wheel_a",
        output="wheel_b",
    )


def planetary(  # noqa: PLR0913 - as many as the set has parts
    *,
    sun_planet: ExternalPair,
    planet_ring: InternalPair,
    planets: Planets,
    inertias: Mapping[str, float],
    laws: MeshLaws = MeshLaws(),
    input: str = "sun",  # noqa: A002 - the field of Transmission it fills
    output: str = "carrier",
    fixed: tuple[str, ...] = ("ring",),
) -> Transmission:
    """Simple planetary set: shafts sun, planets, carrier, ring; any of sun, carrier, ring fixed, driven or free.

    Ratio with the ring fixed (Willis): sun / carrier = 1 + z_ring / z_sun.

    Parameters
    ----------
    sun_planet, planet_ring : ExternalPair, InternalPair
        On the same center distance.
    planets : Planets
        Count, inertia and mass.
    inertias : mapping of str to float
        Of sun, carrier and ring [kg m^2].
    input, output, fixed
        Names of shafts.
    """
    distance = _same_centers({"sun_planet": sun_planet, "planet_ring": planet_ring})
    return Transmission(
        shafts={
            "sun": Shaft(inertia=inertias["sun"]),
            "planets": planets.shaft(),
            "carrier": planets.carrier(inertias["carrier"], distance),
            "ring": Shaft(inertia=inertias["ring"]),
        },
        meshes={
            "sun_planet": laws.mesh("sun", "planets", sun_planet, carrier="carrier", count=planets.count),
            "planet_ring": laws.mesh("planets", "ring", planet_ring, carrier="carrier", count=planets.count),
        },
        input=input,
        output=output,
        fixed=fixed,
    )


def stepped_planetary(  # noqa: PLR0913 - as many as the set has parts
    *,
    sun_planet: ExternalPair,
    step_ring: InternalPair,
    planets: Planets,
    inertias: Mapping[str, float],
    laws: MeshLaws = MeshLaws(),
    input: str = "sun",  # noqa: A002
    output: str = "carrier",
    fixed: tuple[str, ...] = ("ring",),
) -> Transmission:
    """Compound planetary set: each planet has two wheels, the larger meshing with the sun, the smaller with the ring.

    Ratio with the ring fixed: sun / carrier = 1 + (z_planet z_ring) / (z_sun z_step). Shafts and arguments
    as for `planetary`.
    """
    return planetary(
        sun_planet=sun_planet,
        planet_ring=step_ring,
        planets=planets,
        inertias=inertias,
        laws=laws,
        input=input,
        output=output,
        fixed=fixed,
    )


def wolfrom(
    *,
    sun_planet: ExternalPair,
    planet_ring: InternalPair,
    step_ring: InternalPair,
    planets: Planets,
    inertias: Mapping[str, float],
    laws: MeshLaws = MeshLaws(),
) -> Transmission:
    """Wolfrom set: the planets' first wheel meshes with sun and fixed ring, their second with the turning output ring.

    Ratio = (1 + z_ring/z_sun) / (1 - (z_ring z_step)/(z_planet z_output)), large where the rings are nearly equal.
    Shafts sun (input), planets, carrier, ring (fixed), output_ring (output).
    """
    distance = _same_centers({"sun_planet": sun_planet, "planet_ring": planet_ring, "step_ring": step_ring})
    base = planetary(sun_planet=sun_planet, planet_ring=planet_ring, planets=planets, inertias=inertias, laws=laws)
    return Transmission(
        shafts={**base.shafts, "output_ring": Shaft(inertia=inertias["output_ring"])}
        | {"carrier": planets.carrier(inertias["carrier"], distance)},
        meshes={
            **base.meshes,
            "step_ring": laws.mesh("planets", "output_ring", step_ring, carrier="carrier", count=planets.count),
        },
        input="sun",
        output="output_ring",
        fixed=("ring",),
    )


def ravigneaux(  # noqa: PLR0913 - as many as the set has parts
    *,
    small_sun: ExternalPair,
    planets_between: ExternalPair,
    large_sun: ExternalPair,
    planet_ring: InternalPair,
    short_planets: Planets,
    long_planets: Planets,
    inertias: Mapping[str, float],
    laws: MeshLaws = MeshLaws(),
    input: str = "small_sun",  # noqa: A002
    output: str = "ring",
    fixed: tuple[str, ...] = ("carrier",),
) -> Transmission:
    """Ravigneaux set: small sun - short planets - long planets - ring, and large sun - long planets, on one carrier.

    Shafts small_sun, large_sun, short_planets, long_planets, carrier, ring. Ratios with the carrier fixed:
    small_sun / ring = z_ring / z_small_sun, large_sun / ring = -z_ring / z_large_sun.

    Parameters
    ----------
    small_sun, planets_between, large_sun, planet_ring
        Pairs small sun - short planet, short - long planet, large sun - long planet, long planet - ring; the
        last two on the same center distance.
    """
    distance = _same_centers({"large_sun": large_sun, "planet_ring": planet_ring})
    short = small_sun.radius_a + small_sun.radius_b
    carrier = long_planets.carrier(short_planets.carrier(inertias["carrier"], short).inertia, distance)
    count = long_planets.count
    if short_planets.count != count:
        raise ValueError(f"ravigneaux: as many short as long planets are needed, got {short_planets.count} and {count}")
    on_carrier = {"carrier": "carrier", "count": count}
    return Transmission(
        shafts={
            "small_sun": Shaft(inertia=inertias["small_sun"]),
            "large_sun": Shaft(inertia=inertias["large_sun"]),
            "short_planets": short_planets.shaft(),
            "long_planets": long_planets.shaft(),
            "carrier": carrier,
            "ring": Shaft(inertia=inertias["ring"]),
        },
        meshes={
            "small_sun": laws.mesh("small_sun", "short_planets", small_sun, **on_carrier),
            "between": laws.mesh("short_planets", "long_planets", planets_between, **on_carrier),
            "large_sun": laws.mesh("large_sun", "long_planets", large_sun, **on_carrier),
            "ring": laws.mesh("long_planets", "ring", planet_ring, **on_carrier),
        },
        input=input,
        output=output,
        fixed=fixed,
    )


def differential(  # noqa: PLR0913 - as many as the set has parts
    *,
    sun_planet: ExternalPair,
    planets_between: ExternalPair,
    planets: Planets,
    inertias: Mapping[str, float],
    laws: MeshLaws = MeshLaws(),
    input: str = "carrier",  # noqa: A002
    output: str = "right_sun",
    fixed: tuple[str, ...] = (),
) -> Transmission:
    """Spur-gear differential: two equal suns, each with its own planets, which mesh in pairs.

    carrier = (left_sun + right_sun) / 2. Shafts left_sun, right_sun, left_planets, right_planets, carrier; fix one
    sun for a single ratio.
    """
    distance = sun_planet.radius_a + sun_planet.radius_b
    return Transmission(
        shafts={
            "left_sun": Shaft(inertia=inertias["sun"]),
            "right_sun": Shaft(inertia=inertias["sun"]),
            "left_planets": planets.shaft(),
            "right_planets": planets.shaft(),
            "carrier": planets.carrier(planets.carrier(inertias["carrier"], distance).inertia, distance),
        },
        meshes={
            "left_sun": laws.mesh("left_sun", "left_planets", sun_planet, carrier="carrier", count=planets.count),
            "between": laws.mesh(
                "left_planets", "right_planets", planets_between, carrier="carrier", count=planets.count
            ),
            "right_sun": laws.mesh("right_sun", "right_planets", sun_planet, carrier="carrier", count=planets.count),
        },
        input=input,
        output=output,
        fixed=fixed,
    )


def separate(gear: Transmission, *shafts: str) -> Transmission:
    """The same set with a shaft and meshes of its own for every planet, so that they can differ.

    Shaft planets becomes planets_1, planets_2, ..., its mesh sun_planet becomes sun_planet_1, sun_planet_2, ...;
    change one with `dataclasses.replace` (another gap, stiffness, transmission error) and the load is shared unequally.
    More meshes can then stick than shafts can move: their friction is the smallest that holds, see `gear.stiction`.

    Parameters
    ----------
    gear : Transmission
        Of this module, with lumped planets and nothing but meshes on them.
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
        if {getattr(part, end, None) for end in ("shaft", "a", "b")} & set(shafts)
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


def _same_centers(pairs: Mapping[str, ExternalPair | InternalPair]) -> float:
    """The common center distance [m] of pairs on one carrier; ValueError where they differ."""
    distances = {name: abs(pair.radius_a + pair.radius_b) for name, pair in pairs.items()}
    largest, smallest = max(distances.values()), min(distances.values())
    if largest - smallest > CENTERS * largest:
        text = ", ".join(f"{name} {1e3 * value:.6g} mm" for name, value in distances.items())
        raise ValueError(
            f"the pairs on one carrier need the same center distance, got {text}; change teeth, module or profile shift"
        )
    return largest
