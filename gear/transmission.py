"""A transmission: shafts joined by meshes and couplings, carried by bearings, ended by stops."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import casadi as ca
import numpy as np

from gear.couplings.law import ShaftCoupling, ShaftSpring, ShaftStop, Twist
from gear.friction.law import FrictionLaw
from gear.kinematics import Kinematics
from gear.mesh import MESH_SPEED_NOMINAL, Mesh
from gear.motion import MeshMotion, Sliding
from gear.quantities import Scalar
from gear.shafts.law import Shaft, ShaftBearing, ShaftDrag

BEARING_SPEED_NOMINAL = 1.0  # rad/s
RANK = 1e-9  # motion of the output below which it stands still
BEARING_TORQUE_FLOOR = 1e-3  # N m; keeps the scale of a frictionless bearing finite


class Contact(NamedTuple):
    """A place where friction acts, as the joint decision sees it if it sticks."""

    name: str  # path of the mesh or bearing in the transmission
    place: str  # "mesh" or "bearing"
    slip: dict[str, float]  # slip speed per shaft speed
    torque: dict[str, float]  # torque on each shaft per friction scalar
    speed_nominal: float  # a usual slip speed
    force_nominal: float  # a usual friction limit


@dataclass(frozen=True, kw_only=True)
class Transmission:
    """Shafts, the meshes and couplings between them, and their bearings.

    With stiff bearings the planar mechanics of any gear set is this graph: a mesh has three terminals
    (two wheels and the carrier of their line of centers), everything else has one or two.

    Parameters
    ----------
    shafts : mapping of str to Shaft
        By name; the order is the order of the states.
    meshes, bearings, couplings, drags, stops : mappings of str to Mesh, ShaftBearing, ShaftCoupling, ...
        By name; they refer to shafts by name.
    input, output : str
        Names of the shafts on which the motor and the load act.
    fixed : tuple of str
        Names of shafts that are fixed to the housing, such as a ring gear.

    Raises
    ------
    ValueError
        Where a name is unknown (with the valid ones), a shaft is connected to nothing, or a mesh cannot
        stick by mesh speed because its stuck inertia would not be positive.
    """

    shafts: Mapping[str, Shaft]
    meshes: Mapping[str, Mesh] = field(default_factory=dict)
    bearings: Mapping[str, ShaftBearing] = field(default_factory=dict)
    couplings: Mapping[str, ShaftCoupling] = field(default_factory=dict)
    drags: Mapping[str, ShaftDrag] = field(default_factory=dict)
    stops: Mapping[str, ShaftStop] = field(default_factory=dict)
    input: str
    output: str
    fixed: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for what, name in [("input", self.input), ("output", self.output), *self._references()]:
            if name not in self.shafts:
                raise ValueError(f"Transmission.{what} names shaft {name!r}; the shafts are {', '.join(self.shafts)}")
        for name in self.fixed:
            if name not in self.shafts:
                raise ValueError(f"Transmission.fixed names shaft {name!r}; the shafts are {', '.join(self.shafts)}")
            if name in (self.input, self.output):
                raise ValueError(f"Transmission.fixed names shaft {name!r}, which is the input or output")
        for name, bearing in self.bearings.items():
            rigid = [key for key, mesh in self.meshes.items() if mesh.rigid and bearing.shaft in (mesh.a, mesh.b)]
            if bearing.carries_load and rigid:
                raise ValueError(
                    f"Transmission: bearing {name!r} takes its load from mesh {rigid[0]!r}, which is rigid; give "
                    "the mesh an elasticity, or load_arm = 0"
                )
        self._require_connected()
        kinematics = self.kinematics()
        for name, mesh in self.meshes.items():
            self._require_positive_stuck_inertia(name, mesh, kinematics)

    def _references(self) -> list[tuple[str, str]]:
        found = []
        for kind in ("meshes", "couplings", "bearings", "drags", "stops"):
            for name, part in getattr(self, kind).items():
                found += [(f"{kind}.{name}.{field}", shaft) for field, shaft in part.terminals().items()]
        return found

    def _require_connected(self) -> None:
        """Raise where a shaft has no way to the input through meshes and couplings."""
        reached, joined = {self.input}, [set(mesh.deflection_per_shaft()) for mesh in self.meshes.values()]
        joined += [set(coupling.twist_per_shaft()) for coupling in self.couplings.values()]
        for _ in self.shafts:
            reached |= set().union(*(group for group in joined if group & reached))
        alone = [name for name in self.shafts if name not in reached]
        if alone:
            raise ValueError(
                f"Transmission: shaft {alone[0]!r} is not joined to the input {self.input!r}; every shaft needs a mesh "
                "or a coupling that leads there"
            )

    def _require_positive_stuck_inertia(self, name: str, mesh: Mesh, kinematics: Kinematics) -> None:
        if mesh.friction is None or not mesh.friction.sticks or mesh.stick_by == "conjugate speed":
            return
        inertia = kinematics.solver({shaft: part.inertia for shaft, part in self.shafts.items()})
        answer = inertia.accelerations(mesh.torque_per_friction())
        mobility = -sum(float(slip * answer[shaft]) for shaft, slip in mesh.slip_per_shaft().items())
        if mobility <= 0:
            raise ValueError(
                f'Transmission: mesh {name!r} cannot stick by "mesh speed": its friction would speed up the slip it '
                f"opposes ({-mobility:.4g} m/s^2 per N with the inertias given); use stick_by='conjugate speed'"
            )

    def kinematics(self, symbolic: "Transmission | None" = None) -> Kinematics:
        """Which shafts move independently; with the expressions of `symbolic`, the same set with other numbers."""
        source = self if symbolic is None else symbolic
        constraints = [[{name: 1.0} for name in self.fixed] for _ in range(2)]
        for k, gear in enumerate((source, self)):
            constraints[k] += [mesh.deflection_per_shaft() for mesh in gear.meshes.values() if mesh.rigid]
        return Kinematics(list(self.shafts), *constraints, keep=[self.output, self.input])

    def contacts(self, *, sticking: bool = True) -> list[Contact]:
        """Every place that can stick, along the shafts, so that neighbors in the list are neighbors in the train.

        Or those whose friction law has an internal state and never sticks.
        """
        found = []
        for shaft in self.shafts:
            found += [
                Contact(
                    f"bearings.{name}",
                    "bearing",
                    {shaft: 1.0},
                    {shaft: -1.0},
                    BEARING_SPEED_NOMINAL,
                    ca.fmax(bearing.holding(0.0), BEARING_TORQUE_FLOOR),
                )
                for name, bearing in self.bearings.items()
                if bearing.shaft == shaft and bearing.sticks is sticking
            ]
            found += [
                Contact(
                    f"meshes.{name}",
                    "mesh",
                    mesh.slip_per_shaft(),
                    mesh.torque_per_friction(),
                    MESH_SPEED_NOMINAL,
                    mesh.count * mesh.law().force_scale(),
                )
                for name, mesh in self.meshes.items()
                if mesh.a == shaft and mesh.friction is not None and mesh.friction.sticks is sticking
            ]
        return found

    def redundant(self) -> bool:
        """Whether several contacts can lock the same shafts, so that their friction is not unique."""
        contacts, kinematics = self.contacts(), self.kinematics()
        if not contacts:
            return False
        turns = np.array(
            [[float(row.get(q, 0.0)) for q in kinematics.independent] for row in kinematics.turns.values()]
        )
        rows = self._matrix([contact.slip for contact in contacts]) @ turns
        return int(np.linalg.matrix_rank(rows)) < len(rows)

    def ratio(self) -> float:
        """Turns of the input shaft per turn of the output shaft, all teeth and couplings rigid.

        Raises
        ------
        ValueError
            Where input and output are not joined by a single-valued ratio.
        """
        return self.speed_ratios()[self.input]

    def speed_ratios(self) -> dict[str, float]:
        """Turns of every shaft per turn of the output shaft, all teeth and couplings rigid; errors as `ratio`."""
        rigid = [mesh.deflection_per_shaft() for mesh in self.meshes.values()] + [{name: 1.0} for name in self.fixed]
        stiff = [coupling for coupling in self.couplings.values() if coupling.rigid]
        rigid += [coupling.twist_per_shaft() for coupling in stiff if len(coupling.terminals()) > 1]
        kinematics = Kinematics(list(self.shafts), rigid, rigid, keep=[self.output])
        if len(kinematics.independent) > 1:  # a mounting stands still; a return spring does not lock
            ends = ([self.input], [self.output])
            mountings = [(coupling, list(coupling.terminals().values())) for coupling in stiff]
            rigid += [c.twist_per_shaft() for c, on in mountings if len(on) == 1 and on not in ends]
            kinematics = Kinematics(list(self.shafts), rigid, rigid, keep=[self.output])
        free = kinematics.independent
        turns = {name: float(row.get(free[0], 0.0)) for name, row in kinematics.turns.items()} if free else {}
        if len(free) != 1 or abs(turns[self.output]) < RANK * max(abs(turn) for turn in turns.values()):
            raise ValueError(
                f"Transmission: {self.input!r} (input) and {self.output!r} (output) are not joined by one speed ratio: "
                f"with rigid teeth {len(free)} speeds are free; "
                + ("fix a shaft, or join what is loose" if free else "the constraints lock the train")
            )
        return {name: turn / turns[self.output] + 0.0 for name, turn in turns.items()}

    def output_range(self) -> tuple[float, float]:
        """Angles [rad] of the output between which no end stop is touched, all teeth and couplings rigid."""
        turns = self.speed_ratios() if self.stops else {}
        twists = [(stop, sum(c * turns[s] for s, c in stop.twist_per_shaft().items())) for stop in self.stops.values()]
        ends = [sorted(end / twist for end in stop.free_range()) for stop, twist in twists if twist != 0]
        return max((low for low, _ in ends), default=-math.inf), min((high for _, high in ends), default=math.inf)

    def _matrix(self, rows: list[dict[str, Scalar]]) -> np.ndarray:
        """Coefficients per shaft as a matrix, each row scaled to one."""
        table = np.array([[float(row.get(name, 0.0)) for name in self.shafts] for row in rows])
        return table / np.linalg.norm(table, axis=1, keepdims=True) if rows else np.zeros((0, len(self.shafts)))

    def motions(self, angle: Mapping[str, Scalar], speed: Mapping[str, Scalar]) -> dict[str, MeshMotion]:
        """Position and motion of each mesh from the angles [rad] and speeds [rad/s] of the shafts."""
        return {name: mesh.motion(angle, speed) for name, mesh in self.meshes.items() if not mesh.rigid}

    def normal_forces(self, motions: Mapping[str, MeshMotion], flank: Mapping[str, Scalar]) -> dict[str, Scalar]:
        """Signed normal force [N] of each elastic mesh on its present flank, the sum of its `count` equal ones."""
        return {
            name: self.meshes[name].count * self.meshes[name].law().force(motion, flank[f"meshes.{name}"])
            for name, motion in motions.items()
        }

    def springs(self) -> dict[str, ShaftSpring]:
        """Couplings and end stops, by path."""
        couplings: dict[str, ShaftSpring] = {f"couplings.{name}": part for name, part in self.couplings.items()}
        return couplings | {f"stops.{name}": stop for name, stop in self.stops.items()}

    def twists(self, angle: Mapping[str, Scalar], speed: Mapping[str, Scalar]) -> dict[str, Twist]:
        """Twist of each coupling and end stop, by path."""
        rows = {path: spring.twist_per_shaft() for path, spring in self.springs().items()}
        return {
            path: Twist(*(sum(c * motion[shaft] for shaft, c in row.items()) for motion in (angle, speed)))
            for path, row in rows.items()
        }

    def passed_torques(self, twists: Mapping[str, Twist], flank: Mapping[str, Scalar]) -> dict[str, Scalar]:
        """Torque [N m] that each coupling passes on from a to b, and each end stop to the housing, by path."""
        return {path: spring.torque(twists[path], flank[path]) for path, spring in self.springs().items()}

    def torques(
        self, speed: Mapping[str, Scalar], normal: Mapping[str, Scalar], passed: Mapping[str, Scalar]
    ) -> dict[str, Scalar]:
        """Torque on each shaft [N m] from teeth, couplings, end stops and viscous drag, without what can stick."""
        torque = dict.fromkeys(self.shafts, 0.0)
        for name, force in normal.items():
            for shaft, arm in self.meshes[name].torque_per_normal().items():
                torque[shaft] += arm * force
        for path, spring in self.springs().items():
            for shaft, c in spring.twist_per_shaft().items():
                torque[shaft] -= c * passed[path]
        for bearing in self.bearings.values():
            torque[bearing.shaft] += bearing.viscous_torque(speed[bearing.shaft])
        for drag in self.drags.values():
            torque[drag.shaft] += drag.torque(speed[drag.shaft])
        return torque

    def friction_limits(
        self,
        motions: Mapping[str, MeshMotion],
        normal: Mapping[str, Scalar],
        slip: Mapping[str, Scalar],
        direction: Mapping[str, Scalar],
    ) -> dict[str, tuple[Scalar, Scalar]]:
        """Friction limits of each contact, both >= 0: at rest, and while sliding at `slip` >= 0 in `direction` +-1."""
        limits = {}
        for name, bearing in self.bearings.items():
            if bearing.sticks:
                path, load = f"bearings.{name}", self.bearing_load(bearing, normal)
                limits[path] = (bearing.holding(load), bearing.sliding(load, slip[path]))
        for name, mesh in self.meshes.items():
            if mesh.friction is not None and mesh.friction.sticks:
                path, force = f"meshes.{name}", ca.fabs(normal[name])
                sliding = _sliding(mesh, motions[name], normal[name], slip[path], direction[path])
                limits[path] = (mesh.friction.breakaway(sliding) * force, mesh.friction.coefficient(sliding) * force)
        return limits

    def laws_with_memory(self) -> dict[str, ShaftBearing | FrictionLaw]:
        """Each friction law that does not stick, by path."""
        laws: dict[str, ShaftBearing | FrictionLaw] = {f"bearings.{name}": part for name, part in self.bearings.items()}
        laws |= {f"meshes.{name}": mesh.friction for name, mesh in self.meshes.items() if mesh.friction is not None}
        return {path: law for path, law in laws.items() if not law.sticks}

    def friction_by_memory(
        self,
        memory: Mapping[str, Sequence[Scalar]],
        motions: Mapping[str, MeshMotion],
        normal: Mapping[str, Scalar],
        slip: Mapping[str, Scalar],
    ) -> dict[str, tuple[Scalar, list[Scalar]]]:
        """Friction scalar and rates of the internal state of each law that does not stick, at a signed slip speed."""
        found = {}
        for name, bearing in self.bearings.items():
            if not bearing.sticks:
                path, load = f"bearings.{name}", self.bearing_load(bearing, normal)
                state = (memory[path], load, slip[path])
                found[path] = (bearing.friction(*state), bearing.rates(*state))
        for name, mesh in self.meshes.items():
            if mesh.friction is not None and not mesh.friction.sticks:
                path, law = f"meshes.{name}", mesh.friction
                sliding = _sliding(mesh, motions[name], normal[name], slip[path], slip[path])
                friction = law.friction(memory[path], sliding) * ca.fabs(normal[name])
                found[path] = (friction, law.rates(memory[path], sliding))
        return found

    def bearing_load(self, bearing: ShaftBearing, normal: Mapping[str, Scalar]) -> Scalar:
        """Sum of the sizes of the normal forces [N] on the wheels of the bearing's shaft."""
        return sum(
            (ca.fabs(f) for name, f in normal.items() if bearing.shaft in (self.meshes[name].a, self.meshes[name].b)),
            0.0,
        )

    def elastic_energy(self, motions: Mapping[str, MeshMotion], angle: Mapping, flank: Mapping[str, Scalar]) -> Scalar:
        """Energy [J] stored in teeth, couplings and end stops.

        The deflection is measured on the pitch circle and the force acts along the line of action, so a
        mesh stores cos(alpha) times the integral of its force law.
        """
        stored = 0.0
        for name, motion in motions.items():
            mesh = self.meshes[name]
            stored += ca.cos(mesh.pair.working_angle) * mesh.count * mesh.law().stored(motion, flank[f"meshes.{name}"])
        for path, twist in self.twists(angle, dict.fromkeys(self.shafts, 0.0)).items():
            stored += self.springs()[path].stored(twist, flank[path])
        return stored


def _sliding(mesh: Mesh, motion: MeshMotion, normal: Scalar, slip: Scalar, direction: Scalar) -> Sliding:
    """What a mesh tells its friction law at a slip speed, with the signed normal force [N] of all its equal ones."""
    return Sliding(
        speed=slip * mesh.speed_per_slip(),
        force=ca.fabs(normal) / mesh.count,
        a_drives=ca.if_else(direction * normal >= 0, 1, 0),
        position=motion.position,
        pair=mesh.pair,
    )
