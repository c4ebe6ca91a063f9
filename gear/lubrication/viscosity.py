"""Laws of viscosity over temperature, through the points of a data sheet."""

from dataclasses import dataclass

import casadi as ca

from gear.lubrication.law import DensityLaw, ViscosityLaw
from gear.quantities import KinematicViscosity, Scalar, Temperature, check, show
from gear.quantities.registry import part

SQUARE_MILLIMETER = 1e-6  # m^2; the viscosities of ASTM D341 are in mm^2/s
THINNEST = 2e-6  # m^2/s, below which ASTM D341 needs further terms


@part(ViscosityLaw)
@dataclass(frozen=True, kw_only=True)
class Walther(ViscosityLaw):
    """Kinematic viscosity through two points.

        lg lg(nu + 0.7) = A - B lg T            nu in mm^2/s, T in K

    Parameters
    ----------
    cold_temperature, hot_temperature : float
        Of the two points [K].
    cold_viscosity, hot_viscosity : float
        Kinematic viscosity there [m^2/s]; not below 2 mm^2/s, where the law in this form ends.

    References
    ----------
    ASTM D341, "Standard practice for viscosity-temperature charts for liquid petroleum products", after C. Walther.
    """

    cold_temperature: Temperature
    cold_viscosity: KinematicViscosity
    hot_temperature: Temperature
    hot_viscosity: KinematicViscosity

    def __post_init__(self) -> None:
        check(self)
        _require_thinner(
            "Walther", self.cold_temperature, self.cold_viscosity, self.hot_temperature, self.hot_viscosity
        )
        if self.hot_viscosity < THINNEST:
            raise ValueError(
                f"Walther.hot_viscosity must be >= {show(THINNEST, 'm^2/s')}, got {show(self.hot_viscosity, 'm^2/s')}"
            )

    def dynamic_viscosity(self, temperature: Scalar, density: DensityLaw) -> Scalar:
        """[Pa s] at a temperature [K], for an oil with this density over temperature."""
        cold, hot = (
            ca.log10(ca.log10(viscosity / SQUARE_MILLIMETER + 0.7))
            for viscosity in (self.cold_viscosity, self.hot_viscosity)
        )
        slope = (cold - hot) / ca.log10(self.hot_temperature / self.cold_temperature)
        kinematic = 10 ** (10 ** (cold - slope * ca.log10(temperature / self.cold_temperature))) - 0.7
        return kinematic * SQUARE_MILLIMETER * density(temperature)

    def lowest(self, density: DensityLaw) -> Scalar:
        """Zero [K]: the law is finite at every temperature."""
        return 0.0


@part(ViscosityLaw)
@dataclass(frozen=True, kw_only=True)
class Vogel(ViscosityLaw):
    """Dynamic viscosity through three points.

        eta = a exp(b / (T - c))                c < T

    With l = ln eta at the points 1 (cold), 2 (middle) and 3 (hot), and the ratio of mean slopes
    q = (l1 - l2)/(T2 - T1) (T3 - T2)/(l2 - l3) > 1:

        c = T1 - (T3 - T1)/(q - 1)

    Parameters
    ----------
    cold_temperature, middle_temperature, hot_temperature : float
        Of the three points [K].
    cold_viscosity, middle_viscosity, hot_viscosity : float
        Kinematic viscosity there [m^2/s], as data sheets give it.

    References
    ----------
    H. Vogel, Physikalische Zeitschrift 22 (1921), 645-646.
    """

    cold_temperature: Temperature
    cold_viscosity: KinematicViscosity
    middle_temperature: Temperature
    middle_viscosity: KinematicViscosity
    hot_temperature: Temperature
    hot_viscosity: KinematicViscosity

    def __post_init__(self) -> None:
        check(self)
        (cold, thick), (middle, medium), (hot, thin) = points = self._points()
        for first, second in zip(points, points[1:], strict=False):
            _require_thinner("Vogel", *first, *second)
        steep, flat = ca.log(thick / medium) / (middle - cold), ca.log(medium / thin) / (hot - middle)
        if steep <= flat:
            raise ValueError(
                f"Vogel needs a viscosity that falls less and less, got -{steep:.4g} per K from the cold to the middle "
                f"point and -{flat:.4g} per K from there to the hot one"
            )

    def _points(self) -> list[tuple[Scalar, Scalar]]:
        return [
            (self.cold_temperature, self.cold_viscosity),
            (self.middle_temperature, self.middle_viscosity),
            (self.hot_temperature, self.hot_viscosity),
        ]

    def dynamic_viscosity(self, temperature: Scalar, density: DensityLaw) -> Scalar:
        """[Pa s] at a temperature [K], for an oil with this density over temperature."""
        pole = self.lowest(density)
        (cold, thick), _, (hot, thin) = self._points()
        near, far = 1 / (cold - pole), 1 / (hot - pole)
        share = (1 / (temperature - pole) - far) / (near - far)  # 1 at the cold point, 0 at the hot one
        thick, thin = thick * density(cold), thin * density(hot)
        return thin * ca.exp(share * ca.log(thick / thin))

    def lowest(self, density: DensityLaw) -> Scalar:
        """Temperature c [K], at which the law has its pole."""
        (cold, thick), (middle, medium), (hot, thin) = [(t, nu * density(t)) for t, nu in self._points()]
        ratio = ca.log(thick / medium) / (middle - cold) * (hot - middle) / ca.log(medium / thin)
        return cold - (hot - cold) / (ratio - 1)


def _require_thinner(owner: str, cold: float, thick: float, hot: float, thin: float) -> None:
    """Points are given coldest first, and oil is thinner where it is hotter."""
    if not (cold < hot and thick > thin):
        raise ValueError(
            f"{owner} needs points with rising temperature and falling viscosity, got {thick:g} m^2/s at {cold:g} K "
            f"before {thin:g} m^2/s at {hot:g} K"
        )
