"""What a mesh tells its laws: where it is, how it moves, how it is loaded."""

from typing import NamedTuple

from gear.quantities import Scalar
from gear.teeth.pair import Pair


class MeshMotion(NamedTuple):
    """Position and motion of a mesh, for the laws of its elasticity."""

    deflection: Scalar  # x_A - x_B [m]
    rate: Scalar  # its time derivative [m/s]
    position: Scalar  # x_mesh = (x_A + x_B)/2, the feed through the pitch point [m]
    speed: Scalar  # its time derivative [m/s]
    turn_a: Scalar  # angle of wheel A relative to the carrier [rad]
    turn_b: Scalar  # angle of wheel B relative to the carrier [rad]
    speed_a: Scalar  # its time derivative [rad/s]
    speed_b: Scalar  # its time derivative [rad/s]
    pair: Pair | None = None  # the teeth, of a mesh


class Sliding(NamedTuple):
    """State of a mesh, for the laws of its friction; a law that sticks is asked for a direction that the mode knows."""

    speed: Scalar  # mesh speed [m/s], >= 0; with its sign for laws that do not stick
    force: Scalar  # normal force [N], >= 0
    a_drives: Scalar  # 1 where wheel A drives, 0 where wheel B does
    position: Scalar  # x_mesh [m]
    pair: Pair  # the teeth
