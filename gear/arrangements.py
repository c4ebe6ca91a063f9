"""Arrangements: the usual gear sets as graphs of shafts and meshes.

Each function is a few lines that name the shafts and say what meshes with what; nothing in the rest of the
project knows these sets. For planets that are lumped here and can be taken apart, see `gear.planets`.
"""

from collections.abc import Mapping, Sequence

from gear.planets import RIGID, MeshLaws, Planets
from gear.shafts.law import Shaft, ShaftBearing
from gear.teeth.geometry import ExternalPair, GivenPair
from gear.teeth.internal import InternalPair
from gear.transmission import Transmission

CENTERS = 1e-6  # relative difference up to which two center distances are the same


def train(
    stages: Sequence[ExternalPair | GivenPair],
    inertias: Sequence[float],
    laws: MeshLaws | Sequence[MeshLaws] = RIGID,
    bearings: Mapping[str, ShaftBearing] | None = None,
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
    bearings : mapping of str to ShaftBearing or None
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
    pair: ExternalPair | GivenPair | InternalPair, inertia_a: float, inertia_b: float, laws: MeshLaws = RIGID
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
    laws: MeshLaws = RIGID,
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
    laws: MeshLaws = RIGID,
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
    laws: MeshLaws = RIGID,
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
    laws: MeshLaws = RIGID,
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
    laws: MeshLaws = RIGID,
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
