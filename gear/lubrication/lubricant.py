"""What lubricates a mesh: a given viscosity, or an oil at a temperature; and oils of aircraft and spacecraft."""

from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Annotated, Any, Literal, TypeVar

from gear.lubrication.law import Lubricant, OilProperties
from gear.lubrication.oil import Oil
from gear.lubrication.viscosity import Vogel, Walther
from gear.quantities import Density, DynamicViscosity, Scalar, Temperature, annotations, check
from gear.quantities.registry import part
from gear.quantities.roles import OilTemperature, roles_in

CELSIUS = 273.15  # K at 0 degC
MM2 = 1e-6  # m^2
MEASURED = "measured_with"  # field with the lubricant of a measurement, which is over

Part = TypeVar("Part")

# The numbers are typical values as the sources below state them, known second-hand only, from
# copies, and not measured by us; for a design take those of the batch, `Oil` holds any.
# The points a law goes through are the ones in it; what else a source gives is in the comment and checks it.
# Expansion of the first two: slope of the specific gravity of their specifications between -60 and 160 degC in
# The Lee Company, Technical Hydraulic Handbook, "Specific gravity of typical fluids vs. temperature".
# Where the range begins at -55 degC and the coldest viscosity is known at -40 degC, the law is continued; Walther
# and Vogel through the same points then differ by a fifth at -55 degC.

MOBIL_JET_OIL_II = Oil(
    # Polyol ester for turbines and gearboxes, MIL-PRF-23699 STD. ExxonMobil, product data sheet "Mobil Jet Oil II",
    # typical values: 11 000 (-40 degC), 27.6 (40 degC) and 5.1 mm^2/s (100 degC), 1.0035 kg/l at 15 degC, pour point
    # -59 degC. Vogel goes through all three; below -40 degC nothing checks it.
    name="Mobil Jet Oil II",
    law=Vogel(
        cold_temperature=CELSIUS - 40,
        cold_viscosity=11_000 * MM2,
        middle_temperature=CELSIUS + 40,
        middle_viscosity=27.6 * MM2,
        hot_temperature=CELSIUS + 100,
        hot_viscosity=5.1 * MM2,
    ),
    density=1003.5,
    density_temperature=CELSIUS + 15,
    expansion=8.0e-4,
    lowest=CELSIUS - 55,
    highest=CELSIUS + 150,
)

XC_5606J = Oil(
    # Red hydraulic fluid with viscosity improver, also a light lubricant for the cold, MIL-PRF-5606J. Phillips 66,
    # technical data sheet "X/C Aviation Hydraulic Fluid 5606J", typical values: 2 450 (-54 degC), 495 (-40 degC),
    # 13.5 (40 degC) and 5.1 mm^2/s (100 degC), specific gravity 0.871 at 60 degF, pour point -64 degC. Vogel goes
    # through all but -40 degC, where it is 5 % off.
    name="X/C 5606J",
    law=Vogel(
        cold_temperature=CELSIUS - 54,
        cold_viscosity=2_450 * MM2,
        middle_temperature=CELSIUS + 40,
        middle_viscosity=13.5 * MM2,
        hot_temperature=CELSIUS + 100,
        hot_viscosity=5.1 * MM2,
    ),
    density=870.2,
    density_temperature=CELSIUS + 15.56,
    expansion=8.0e-4,
    lowest=CELSIUS - 55,
    highest=CELSIUS + 135,
)

PENNZANE_X2000 = Oil(
    # Multiply alkylated cyclopentane, base oil of space greases (Rheolube 2000). P. A. Bessette in NASA CP-3350,
    # 31st Aerospace Mechanisms Symposium (1997), Table 6: 80 500 (-40 degC), 107 (40 degC) and 14.3 mm^2/s (100 degC),
    # 0.84 g/ml at 25 degC, 8e-4 per K, pour point -55 degC. Walther goes through the first two and is 7 % off at the
    # third. At -55 degC the oil is at its pour point, and the value there is the continued law's, nothing measured.
    name="Pennzane SHF X-2000",
    law=Walther(
        cold_temperature=CELSIUS - 40,
        cold_viscosity=80_500 * MM2,
        hot_temperature=CELSIUS + 40,
        hot_viscosity=107 * MM2,
    ),
    density=840.0,
    density_temperature=CELSIUS + 25,
    expansion=8.0e-4,
    lowest=CELSIUS - 55,
    highest=CELSIUS + 125,
)

OILS = {oil.name: oil for oil in (MOBIL_JET_OIL_II, XC_5606J, PENNZANE_X2000)}


@part(OilProperties)
@dataclass(frozen=True, kw_only=True)
class KnownOil(OilProperties):
    """One of the oils above by its name, for files; its numbers are not parameters.

    Parameters
    ----------
    name : str
        "Mobil Jet Oil II", "X/C 5606J" or "Pennzane SHF X-2000".
    """

    name: Literal["Mobil Jet Oil II", "X/C 5606J", "Pennzane SHF X-2000"]

    def __post_init__(self) -> None:
        if self.name not in OILS:
            raise ValueError(f"KnownOil.name must be one of {', '.join(OILS)}, got {self.name!r}")

    def dynamic_viscosity(self, temperature: Scalar) -> Scalar:
        """[Pa s] at a temperature [K]."""
        return OILS[self.name].dynamic_viscosity(temperature)

    def kinematic_viscosity(self, temperature: Scalar) -> Scalar:
        """[m^2/s] at a temperature [K]."""
        return OILS[self.name].kinematic_viscosity(temperature)


@part(Lubricant)
@dataclass(frozen=True, kw_only=True)
class GivenViscosity(Lubricant):
    """A lubricant of which only the viscosity is known.

    Parameters
    ----------
    viscosity : float
        Dynamic viscosity [Pa s].
    density : float or None
        [kg/m^3]; None where nothing asks for the kinematic viscosity.
    """

    viscosity: DynamicViscosity
    density: Density | None = None

    def __post_init__(self) -> None:
        check(self)

    def dynamic_viscosity(self) -> Scalar:
        """[Pa s]."""
        return self.viscosity

    def kinematic_viscosity(self) -> Scalar:
        """[m^2/s]."""
        if self.density is None:
            raise ValueError("GivenViscosity.density is needed for the kinematic viscosity; give it in kg/m^3")
        return self.viscosity / self.density


@part(Lubricant)
@dataclass(frozen=True, kw_only=True)
class OilAt(Lubricant):
    """An oil at a temperature: cold start, room and warm are one argument.

    Parameters
    ----------
    oil : OilProperties
        Which.
    temperature : float
        [K]; within the range of the oil, as a parameter of a simulation too.
    """

    oil: OilProperties
    temperature: Annotated[Temperature, OilTemperature()]

    def __post_init__(self) -> None:
        check(self)
        self.dynamic_viscosity()  # for its range

    def dynamic_viscosity(self) -> Scalar:
        """[Pa s]."""
        return self.oil.dynamic_viscosity(self.temperature)

    def kinematic_viscosity(self) -> Scalar:
        """[m^2/s]."""
        return self.oil.kinematic_viscosity(self.temperature)


def at_temperature(part: Part, temperature: float) -> Part:
    """The same transmission, mesh, law or bearing with every oil in it at another temperature [K].

    The lubricant a law was measured with keeps its own.

    Raises
    ------
    ValueError
        Where no law of the part has an oil, or the temperature is out of the range of one.
    """
    changed = _at(part, temperature)
    if changed is part:
        raise ValueError(
            f"at_temperature: no law of {type(part).__name__} has an oil that could be at {temperature:g} K; give it "
            "one with lubricant=OilAt(...)"
        )
    return changed


def oil_temperatures(part: Any) -> list[str]:
    """Names of the fields of a component that are the temperature of its oil."""
    found = annotations(part).items()
    return [name for name, notes in found if any(isinstance(role, OilTemperature) for role in roles_in(notes))]


def _at(part: Any, temperature: float) -> Any:
    if isinstance(part, Mapping):
        items = {name: _at(item, temperature) for name, item in part.items()}
        return items if any(items[name] is not item for name, item in part.items()) else part
    if not is_dataclass(part) or isinstance(part, type):
        return part
    old = {field.name: getattr(part, field.name) for field in fields(part) if field.name != MEASURED}
    own = oil_temperatures(part)
    new = {name: temperature if name in own else _at(value, temperature) for name, value in old.items()}
    changes = {name: value for name, value in new.items() if name in own or value is not old[name]}
    return replace(part, **changes) if changes else part
