"""What gear pairs with teeth have in common, whether the other wheel is outside or a ring."""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

from gear.quantities import Factor, HelixAngle, Length, Number, PressureAngle, Scalar, check
from gear.teeth.checks import require_possible, require_teeth
from gear.teeth.involute import Gearing, Path, Rack, Teeth, gearing


@dataclass(frozen=True, kw_only=True)
class ToothedPair:
    """A pair from its teeth; `ExternalPair` and `InternalPair` say which one, and what the fields mean there."""

    teeth_a: int
    teeth_b: int
    module: Length
    pressure_angle: PressureAngle = math.radians(20.0)
    helix_angle: HelixAngle = 0.0
    shift_a: Number = 0.0
    shift_b: Number = 0.0
    addendum_a: Factor = 1.0
    addendum_b: Factor = 1.0
    tip_radius_a: Length | None = None
    tip_radius_b: Length | None = None

    sticks_by_mesh_speed: ClassVar[bool] = True
    side_b: ClassVar[int] = 1  # -1 where B is a ring, whose teeth and radii count negative

    def __post_init__(self) -> None:
        check(self)
        require_teeth(self)
        self._require_sides()
        require_possible(type(self).__name__, *self._parts())

    def _require_sides(self) -> None:
        """Hold the numbers of teeth against each other."""

    def _parts(self) -> tuple[Rack, Teeth, Teeth]:
        rack = Rack(self.module, self.pressure_angle, self.helix_angle)
        a = Teeth(self.teeth_a, self.shift_a, self.addendum_a, self.tip_radius_a)
        tip = None if self.tip_radius_b is None else self.side_b * self.tip_radius_b
        return rack, a, Teeth(self.side_b * self.teeth_b, self.shift_b, self.addendum_b, tip)

    @cached_property
    def gearing(self) -> Gearing:
        """Everything that follows from the teeth, those of a ring negative: radii, angles, center distance, ratios."""
        return gearing(*self._parts())

    @property
    def radius_a(self) -> Scalar:
        """Working pitch radius [m] of wheel A."""
        return self.gearing.radius_a

    @property
    def radius_b(self) -> Scalar:
        """Working pitch radius [m] of wheel B; of a ring negative."""
        return self.gearing.radius_b

    @property
    def working_angle(self) -> Scalar:
        """Working transverse pressure angle [rad]."""
        return self.gearing.angle

    @property
    def base_helix_angle(self) -> Scalar:
        """Helix angle at the base cylinders, beta_b [rad]."""
        return self.gearing.base_helix_angle

    @property
    def tooth_pitch(self) -> Scalar:
        """Feed from tooth to tooth on the working pitch circles [m]."""
        return self.gearing.pitch

    @property
    def friction_factor(self) -> Scalar:
        """Averaged friction force on the bearings per unit of friction scalar, d_F [-]."""
        return self.path().friction_factor

    @property
    def friction_arm_a(self) -> Scalar:
        """Averaged lever arm of the friction on wheel A, -d_tauA [m]."""
        return self.path().friction_arm_a

    @property
    def friction_arm_b(self) -> Scalar:
        """Averaged lever arm of the friction on wheel B, d_tauB [m]; on a ring with the signed length."""
        return self.path().friction_arm_b

    def path(self) -> Path:
        """Path of contact from the tip circle of B, ring or wheel, to the tip circle of A."""
        return self.gearing.path()

    def contact_ratio(self) -> Scalar:
        """Average number of tooth pairs in contact in one plane [-]."""
        return self.gearing.contact_ratio()

    def size(self) -> str:
        """Its numbers of teeth."""
        return f"{self.teeth_a} : {self.teeth_b}"
