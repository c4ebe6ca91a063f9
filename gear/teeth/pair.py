"""What a mesh asks of its pair of wheels. A new kind of pair is a new file in this folder."""

from typing import ClassVar, Protocol

from gear.quantities import Scalar


class Pair(Protocol):
    """What a mesh asks of a gear pair, however the numbers were obtained.

    Working pitch radii [m] (a ring gear B has a negative one), working pressure angle and base helix angle [rad],
    and the averaged constants of the friction: the lever arms `friction_arm_a`, `friction_arm_b` [m] on the wheels
    and the `friction_factor` [-] on the bearings.

    Its parts do not name it as their base, as a field of a dataclass cannot take the place of a property.
    """

    sticks_by_mesh_speed: ClassVar[bool]  # whether friction may oppose the mesh speed; a thread slides along its slope

    @property
    def radius_a(self) -> Scalar:
        """Working pitch radius [m] of wheel A."""

    @property
    def radius_b(self) -> Scalar:
        """Working pitch radius [m] of wheel B, negative for a ring."""

    @property
    def working_angle(self) -> Scalar:
        """Working transverse pressure angle [rad]."""

    @property
    def base_helix_angle(self) -> Scalar:
        """Helix angle at the base cylinders, beta_b [rad]."""

    @property
    def tooth_pitch(self) -> Scalar | None:
        """Feed from tooth to tooth on the working pitch circles [m]; None where the teeth are not known."""

    @property
    def friction_factor(self) -> Scalar:
        """d_F [-]."""

    @property
    def friction_arm_a(self) -> Scalar:
        """-d_tauA [m]."""

    @property
    def friction_arm_b(self) -> Scalar:
        """d_tauB [m]."""

    def size(self) -> str:
        """Its size in words, for tables: numbers of teeth, or what it has instead."""
        ...
