"""The mechanics of a transmission as a hybrid automaton: margins, accelerations and the reset of its contacts."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import casadi as ca

from actuator.system.decision import decision_function
from actuator.system.hybrid import INACTIVE, MARGIN_BAND, Event, EventKind, Mode, ModeKind, Place
from actuator.system.hybrid import Contact as ContactRecord
from gear.couplings.law import TWIST_NOMINAL, Twist
from gear.elasticity.law import DEFLECTION_NOMINAL, has_gap
from gear.kinematics import Kinematics, Row
from gear.motion import MeshMotion
from gear.quantities import Matrix, Scalar
from gear.stiction.decision import BACKWARD, FORWARD, RestProblem
from gear.stiction.friction import friction, motion_without_slip, smallest_sharing
from gear.stiction.mechanisms import mechanisms, structural_rank
from gear.transmission import Contact, Transmission

REST_SPEED = 10 * MARGIN_BAND  # part of a contact's usual slip speed that counts as standing still
SHARED = {"cse": True}


class ContactModes(NamedTuple):
    """The mode variables of a transmission."""

    motion: ca.SX  # (K, 1): 0 stuck, +-1 sliding
    flank: dict[str, ca.SX]  # per mesh, coupling and end stop, by path: +1, -1, 0 in the gap


class ContactForces(NamedTuple):
    """All that the contacts of a transmission do at one state; vectors are (K, 1) in the order of the contacts."""

    motions: dict[str, MeshMotion]  # per mesh
    normal: dict[str, Matrix]  # signed normal force per mesh [N]
    twists: dict[str, Twist]  # per coupling and end stop, by path
    passed: dict[str, Matrix]  # torque passed per coupling and end stop [N m], by path
    slip: Matrix  # slip speed
    static: Matrix  # friction limit at rest
    sliding: Matrix  # friction while sliding at the present speed
    friction: Matrix  # friction scalars of the present modes, some of those that hold where they are not unique
    shown: Matrix  # the smallest of those
    smooth: dict[str, Matrix]  # torque per shaft of teeth, couplings, stops and viscous drag [N m]
    by_memory: dict[str, tuple[Matrix, list[Matrix]]]  # per law that does not stick, by path: friction scalar, rates
    acceleration: dict[str, Matrix]  # per shaft [rad/s^2]


class ContactMechanics:
    """The contacts of one transmission, with inertias and torques of what is attached to it.

    Parameters
    ----------
    gear : Transmission
        Symbolic (its numbers are parameters).
    numbers : Transmission
        The same in numbers, which decide what is redundant.
    kinematics : Kinematics
        Which shafts move independently.
    inertia : mapping of str to SX
        Total inertia per shaft; it may depend on the angles.
    memory : mapping of str to list of SX
        Internal state of each friction law that does not stick, by path. Such a contact has no modes: its friction is a
        torque as that of a spring is.
    """

    def __init__(
        self,
        gear: Transmission,
        numbers: Transmission,
        kinematics: Kinematics,
        inertia: Mapping[str, Scalar],
        memory: Mapping[str, list[ca.SX]],
    ) -> None:
        self.gear, self.redundant, self.kinematics = gear, numbers.redundant(), kinematics
        self.masses, self.inertia = inertia, kinematics.solver(inertia)
        self.contacts: list[Contact] = gear.contacts()
        self.creeping, self.memory = gear.contacts(sticking=False), memory
        # rows over the independent shafts: slip speed, and torque against the shafts per unit of friction
        self.slip = [kinematics.gather(contact.slip) for contact in self.contacts]
        self.torque = [kinematics.gather(opposed(contact)) for contact in self.contacts]
        in_numbers = numbers.kinematics()
        rows = [in_numbers.gather(opposed(contact)) for contact in numbers.contacts()]
        self.rank = structural_rank(rows, in_numbers.independent)
        found = mechanisms(self.torque, rows, in_numbers.independent)
        self.alone = {k for slips in found if len(slips) == 1 for k in slips}  # contacts that can let go by themselves
        self.groups = [slips for slips in found if len(slips) > 1]  # contacts that let go together
        # without a gap the flank only matters to friction, where the size of the normal force has a kink
        laws = {name: mesh.law() for name, mesh in gear.meshes.items() if not mesh.rigid}
        self.laws = {
            f"meshes.{name}": law
            for name, law in laws.items()
            if has_gap(law) or gear.meshes[name].friction is not None
        }
        still = Twist(0.0, 0.0)
        self.plays = {path: part for path, part in gear.springs().items() if part.penetration(still, 1.0) is not None}
        self.mesh_at = {f"meshes.{name}": name for name in laws}
        self.gapped = [path for path, law in self.laws.items() if has_gap(law)] + [*self.plays]
        self.flanks = [*self.laws, *self.plays]

    def mode_variables(self) -> list[Mode]:
        """A motion per contact, a flank per mesh, coupling with a gap and end stop."""
        motions = [(f"gear.{contact.name}", contact.place, ModeKind.MOTION) for contact in self.contacts]
        flanks = [(f"gear.{path}", self._place(path), ModeKind.FLANK) for path in self.flanks]
        return [Mode(f"{at}.{kind}", kind, at, Place(place)) for at, place, kind in motions + flanks]

    def _place(self, path: str) -> Place:
        """What has a flank: a mesh, a coupling or an end stop."""
        if path in self.laws:
            return Place.MESH
        return Place.STOP if path in {f"stops.{name}" for name in self.gear.stops} else Place.COUPLING

    def records(self, directions: Mapping[str, int]) -> list[ContactRecord]:
        """The contacts as analyses know them; `directions` in which they slide when the output moves forward."""
        return [
            ContactRecord(
                at := f"gear.{contact.name}",
                Place(contact.place),
                f"{at}.{ModeKind.MOTION}",
                f"{at}.{ModeKind.FLANK}" if contact.name in self.flanks else None,
                directions[at],
            )
            for contact in self.contacts
        ]

    @staticmethod
    def state(forces: ContactForces) -> list[Matrix]:
        """Slip speed, friction, and friction limit at rest and while sliding, of all contacts."""
        return [forces.slip, forces.shown, forces.static, forces.sliding]

    def modes(self, m: ca.SX) -> ContactModes:
        """The mode variables from the vector m; rounding is taken off here, once."""
        whole = [ca.sign(m[k]) * ((ca.fabs(m[k]) > 0.5) + (ca.fabs(m[k]) > 1.5)) for k in range(m.shape[0])]  # noqa: PLR2004
        count = len(self.contacts)
        return ContactModes(ca.vertcat(*whole[:count]), self._all_flanks(whole[count:]))

    def _all_flanks(self, flanks: Sequence[ca.SX]) -> dict[str, ca.SX]:
        """Flanks by path; +1 where a mesh or coupling has only one."""
        paths = [*(f"meshes.{name}" for name in self.gear.meshes), *self.gear.springs()]
        return dict.fromkeys(paths, ca.SX(1)) | dict(zip(self.flanks, flanks, strict=True))

    def slip_speeds(self, speed: Mapping[str, Scalar]) -> Matrix:
        """Slip speed of each contact."""
        return ca.vertcat(*(sum(c * speed[shaft] for shaft, c in contact.slip.items()) for contact in self.contacts))

    def forces(self, angle: Mapping, speed: Mapping, torque: Mapping, modes: ContactModes) -> ContactForces:
        """Friction and accelerations in the given modes, with `torque` per shaft from outside."""
        direction = ca.sign(modes.motion)
        slip = self.slip_speeds(speed)
        motions = self.gear.motions(angle, speed)
        normal = self.gear.normal_forces(motions, modes.flank)
        twists = self.gear.twists(angle, speed)
        passed = self.gear.passed_torques(twists, modes.flank)
        smooth = self.gear.torques(speed, normal, passed)
        creep = {contact.name: sum(c * speed[shaft] for shaft, c in contact.slip.items()) for contact in self.creeping}
        by_memory = self.gear.friction_by_memory(self.memory, motions, normal, creep)
        rubbing = self.creep_torques(by_memory)
        outside = {shaft: torque.get(shaft, 0) + rubbing.get(shaft, 0) for shaft in smooth}
        free = self.inertia.accelerations({shaft: value + outside[shaft] for shaft, value in smooth.items()})
        demand = ca.vertcat(*(sum(c * free[shaft] for shaft, c in contact.slip.items()) for contact in self.contacts))
        static, sliding = self.limits(motions, normal, direction * slip, direction, modes)
        held = ca.eq(direction, 0) * self._engaged(modes)
        scalar = friction(self.compliance(), demand, held, direction * sliding, self.redundant)
        answer = self.inertia.accelerations(self.friction_torques(scalar))
        acceleration = self.without_slip({shaft: free[shaft] + answer[shaft] for shaft in self.gear.shafts}, held)
        shown = scalar
        if self.groups:
            torque = _matrix(self.torque, self.kinematics.independent)
            spare = len(self.contacts) - self.rank
            shown = smallest_sharing(torque, scalar, held, static, spare)
        return ContactForces(
            motions=motions,
            normal=normal,
            twists=twists,
            passed=passed,
            slip=slip,
            static=static,
            sliding=sliding,
            friction=scalar,
            shown=shown,
            smooth=smooth,
            by_memory=by_memory,
            acceleration=acceleration,
        )

    def without_slip(self, motion: Mapping[str, Scalar], held: Matrix) -> dict[str, Scalar]:
        """The motion of the shafts with what is left of slip in the held contacts taken out, by construction."""
        shafts = self.kinematics.independent
        taken = motion_without_slip(self.slip, held, shafts) @ ca.vertcat(*(ca.SX(motion[shaft]) for shaft in shafts))
        return self.kinematics.expand(dict(zip(shafts, ca.vertsplit(taken), strict=True)))

    def compliance(self) -> Matrix:
        """G of the joint decision: slip acceleration of contact i per unit of friction against it in contact k."""
        count = len(self.contacts)
        matrix = ca.SX(count, count)
        for k, column in enumerate(self.contacts):
            answer = self.inertia.accelerations(column.torque)
            for i, row in enumerate(self.contacts):
                taken = ca.SX(sum(c * answer[shaft] for shaft, c in row.slip.items()))
                if not taken.is_zero():
                    matrix[i, k] = -taken
        return matrix

    def rigid_forces(self, forces: ContactForces, torque: Mapping) -> dict[str, Scalar]:
        """Normal force [N] of each rigid mesh: what keeps its constraint, with the modes' friction acting.

        With R the constraints and J the inertias of the shafts, R J^-1 R^T lambda = R J^-1 torque.
        """
        rigid = [name for name, mesh in self.gear.meshes.items() if mesh.rigid]
        rows = [self.gear.meshes[name].deflection_per_shaft() for name in rigid] + [{s: 1.0} for s in self.gear.fixed]
        if not rigid:
            return {}
        stuck, rubbing = self.friction_torques(forces.friction), self.creep_torques(forces.by_memory)
        acting = {s: forces.smooth[s] + stuck[s] + rubbing.get(s, 0) for s in self.gear.shafts}
        free = {s: (acting[s] + torque.get(s, 0)) / self.masses[s] for s in self.gear.shafts}
        compliance, demand = ca.SX(len(rows), len(rows)), ca.SX(len(rows), 1)
        for i, row in enumerate(rows):
            demand[i] = sum(c * free[s] for s, c in row.items())
            for k, other in enumerate(rows):
                compliance[i, k] = sum(c * other[s] / self.masses[s] for s, c in row.items() if s in other)
        kept = friction(compliance, demand, ca.SX.ones(len(rows)), ca.SX.zeros(len(rows)), redundant=True)
        return {name: kept[k] / ca.cos(self.gear.meshes[name].pair.working_angle) for k, name in enumerate(rigid)}

    def creep_torques(self, by_memory: Mapping[str, tuple[Matrix, list[Matrix]]]) -> dict[str, Scalar]:
        """Torque [N m] on shafts from the friction laws that do not stick."""
        torque: dict[str, Scalar] = {}
        for contact in self.creeping:
            for shaft, arm in contact.torque.items():
                torque[shaft] = torque.get(shaft, 0) + arm * by_memory[contact.name][0]
        return torque

    def friction_torques(self, scalar: Matrix) -> dict[str, Scalar]:
        """Torque on each shaft from the friction scalars."""
        return {
            shaft: sum((c.torque[shaft] * scalar[k] for k, c in enumerate(self.contacts) if shaft in c.torque), 0.0)
            for shaft in self.gear.shafts
        }

    def limits(
        self, motions: Mapping, normal: Mapping, speed: Matrix, direction: Matrix, modes: ContactModes
    ) -> tuple[Matrix, Matrix]:
        """Friction limits at rest and while sliding at `speed` >= 0 in `direction`; zero in a gap."""
        names = [contact.name for contact in self.contacts]
        slip = {name: ca.fmax(speed[k], 0) for k, name in enumerate(names)}
        pairs = self.gear.friction_limits(motions, normal, slip, {name: direction[k] for k, name in enumerate(names)})
        engaged = self._engaged(modes)
        static, sliding = (ca.vertcat(*(pairs[contact.name][j] for contact in self.contacts)) for j in (0, 1))
        return engaged * static, engaged * sliding

    def _engaged(self, modes: ContactModes) -> Matrix:
        """1 per contact, 0 for a mesh in its gap."""
        return ca.vertcat(
            *(ca.fabs(modes.flank[contact.name]) if contact.name in modes.flank else 1 for contact in self.contacts)
        )

    # -- margins --------------------------------------------------------------------------------------

    def events(self) -> list[Event]:
        """Two per contact and group of contacts, two per mesh, coupling or stop with a gap, one per mesh without."""
        found = []
        for slips in [(k,) for k in range(len(self.contacts))] + [tuple(group) for group in self.groups]:
            names = tuple(f"gear.{self.contacts[k].name}" for k in slips)
            at, place = " + ".join(names), Place(self.contacts[slips[0]].place)
            found += [
                Event(f"{at} {end}", EventKind.FRICTION, at, place, side, names)
                for end, side in (("upper", 1), ("lower", -1))
            ]
        for path in self.flanks:
            at, place = f"gear.{path}", self._place(path)
            if path in self.gapped:
                found += [
                    Event(f"{at} flank {end}", EventKind.GAP, at, place, side) for end, side in (("+", 1), ("-", -1))
                ]
            else:
                found.append(Event(f"{at} flank", EventKind.FORCE, at, place))
        return found

    def _beyond(self, path: str, motions: Mapping, twists: Mapping, side: int) -> Scalar:
        """How far teeth or coupling are beyond their gap on a side, over a usual size."""
        if path in self.plays:
            return self.plays[path].penetration(twists[path], side) / TWIST_NOMINAL
        return self.laws[path].penetration(motions[self.mesh_at[path]], side) / DEFLECTION_NOMINAL

    def margins(self, forces: ContactForces, modes: ContactModes) -> Matrix:
        """Margins in the order of `events`.

        stuck:    (static - s) and (static + s), over a usual friction force
        sliding:  direction * slip speed, over a usual speed
        group:    sum of static |c| of what is stuck of it -+ sum of s c, over the usual (see `mechanisms`)
        flank:    flank * F_n without a gap, else the penetration or the distance to the flank
        """
        rows = []
        engaged = self._engaged(modes)
        stuck = ca.logic_and(ca.eq(modes.motion, 0), engaged)
        for k, contact in enumerate(self.contacts):
            slides = ca.logic_and(ca.eq(ca.fabs(modes.motion[k]), 1), engaged[k])
            speed = ca.if_else(slides, modes.motion[k] * forces.slip[k] / contact.speed_nominal, INACTIVE)
            room = [(forces.static[k] - end * forces.friction[k]) / contact.force_nominal for end in (1, -1)]
            alone = k in self.alone
            rows += [
                ca.if_else(stuck[k], room[0] if alone else INACTIVE, speed),
                ca.if_else(stuck[k], room[1], INACTIVE) if alone else ca.SX(INACTIVE),
            ]
        for slips in self.groups:
            limit = sum(ca.fabs(c) * ca.if_else(stuck[k], forces.static[k], 0) for k, c in slips.items())
            load = sum(c * ca.if_else(stuck[k], forces.friction[k], 0) for k, c in slips.items())
            usual = sum(ca.fabs(c) * self.contacts[k].force_nominal for k, c in slips.items())
            some = sum(stuck[k] for k in slips) > 0
            rows += [ca.if_else(some, (limit - end * load) / usual, INACTIVE) for end in (1, -1)]
        for path in self.flanks:
            flank = modes.flank[path]
            if path not in self.gapped:
                name = self.mesh_at[path]
                usual = self.laws[path].force_scale() * self.gear.meshes[name].count
                rows.append(flank * forces.normal[name] / usual)
                continue
            for side in (1, -1):
                beyond = self._beyond(path, forces.motions, forces.twists, side)
                rows.append(ca.if_else(ca.eq(flank, side), beyond, ca.if_else(ca.eq(flank, 0), -beyond, INACTIVE)))
        return ca.vertcat(*rows) + MARGIN_BAND

    # -- reset ----------------------------------------------------------------------------------------

    def flanks_after(self, fired: Matrix, angle: Mapping, speed: Mapping, before: Mapping[str, Scalar]) -> list[ca.SX]:
        """Flank of each mesh, coupling and stop after an event; from where it is if the event was elsewhere."""
        motions, twists = self.gear.motions(angle, speed), self.gear.twists(angle, speed)
        row, found = 2 * (len(self.contacts) + len(self.groups)), []
        for path in self.flanks:
            flank = before[path]
            if path not in self.gapped:
                force = self.laws[path].force(motions[self.mesh_at[path]], flank)
                kept = ca.if_else(ca.fabs(force) > 0, ca.sign(force), 1)
                turned = ca.if_else(ca.eq(flank, 0), kept, -flank)
                found.append(ca.if_else(fired[row], turned, kept))
                row += 1
                continue
            deep = [self._beyond(path, motions, twists, side) > 0 for side in (1, -1)]
            sides = ca.if_else(deep[0], 1, ca.if_else(deep[1], -1, 0))
            # the flank that fired: engaged if it was in the gap, in the gap if it was engaged
            plus = ca.if_else(ca.eq(flank, 0), 1, 0)
            minus = ca.if_else(ca.eq(flank, 0), -1, 0)
            found.append(ca.if_else(fired[row], plus, ca.if_else(fired[row + 1], minus, sides)))
            row += 2
        return found

    def problem(
        self, fired: Matrix, angle: Mapping, speed: Mapping, torque: Mapping, before: Matrix, flank: Mapping
    ) -> RestProblem:
        """What is to be decided jointly after an event: which contacts are at rest, and what they must bear."""
        slip, shafts, count = self.slip_speeds(speed), self.kinematics.independent, len(self.contacts)
        direction, still = ca.sign(slip), ca.SX.zeros(count)
        modes = ContactModes(direction, dict(flank))
        forces = self.forces(angle, speed, torque, modes)
        onset = [
            self.limits(forces.motions, forces.normal, still, still + end, modes)[1] for end in (FORWARD, BACKWARD)
        ]

        rest, released = [], []
        for k, contact in enumerate(self.contacts):
            hit = ca.logic_or(fired[2 * k], fired[2 * k + 1])
            together = [2 * (count + g) + side for g, slips in enumerate(self.groups) if k in slips for side in (0, 1)]
            was_stuck = ca.eq(before[k], 0)
            slow = ca.fabs(slip[k]) <= REST_SPEED * contact.speed_nominal
            rest.append(ca.logic_or(slow, hit))
            released.append(ca.logic_and(was_stuck, sum((fired[row] for row in together), hit)))
        resting = ca.vertcat(*rest) * self._engaged(modes)
        rubbing = self.friction_torques(ca.if_else(resting, 0, direction * forces.sliding))
        creep = self.creep_torques(forces.by_memory)
        outside = {shaft: torque.get(shaft, 0) + creep.get(shaft, 0) for shaft in self.gear.shafts}
        load = self.kinematics.gather({s: forces.smooth[s] + rubbing[s] + outside[s] for s in self.gear.shafts})
        return RestProblem(
            inertia=ca.vertcat(*(ca.horzcat(*(ca.SX(entry) for entry in row)) for row in self.inertia.rows)),
            load=ca.vertcat(*(load[shaft] for shaft in shafts)),
            slip=_matrix(self.slip, shafts),
            torque=_matrix(self.torque, shafts),
            static=forces.static,
            forward=onset[0],
            backward=onset[1],
            rest=resting,
            released=ca.vertcat(*released),
        )

    def pose_function(
        self,
        name: str,
        arguments: list[ca.SX],
        fired: Matrix,
        angle: Mapping,
        speed: Mapping,
        torque: Mapping,
        m: ca.SX,
    ) -> ca.Function:
        """(fired, *arguments) -> problem to be decided as a vector, modes after but for that, speeds after.

        Contacts at rest get their slip speed set to exactly zero by an impulse along their own friction; their motion
        is what is decided.
        """
        before = self.modes(m)
        flank = self.flanks_after(fired, angle, speed, before.flank)
        problem = self.problem(fired, angle, speed, torque, before.motion, self._all_flanks(flank))
        slip, count = self.slip_speeds(speed), len(self.contacts)
        impulse = friction(self.compliance(), slip, problem.rest, ca.SX.zeros(count), self.redundant)
        step = self.inertia.accelerations(self.friction_torques(impulse))
        after = self.without_slip({shaft: speed[shaft] + step[shaft] for shaft in self.gear.shafts}, problem.rest)
        speeds = ca.vertcat(*(after[shaft] for shaft in self.kinematics.independent))
        posed = ca.vertcat(*(ca.vec(ca.SX(part).T) for part in problem))
        modes = ca.vertcat(ca.if_else(problem.rest, 0, ca.sign(slip)), *flank)
        return ca.Function(name, [fired, *arguments], [posed, modes, speeds], SHARED)

    def reset_function(self, name: str, pose: ca.Function) -> ca.Function:
        """From `pose`: (fired, *arguments) -> what is after, modes after, fault; all modes decided together."""
        count = len(self.contacts)
        inputs = [ca.MX.sym(f"input{i}", pose.size1_in(i)) for i in range(pose.n_in())]
        posed, modes, after = pose(*inputs)
        if not count:
            return ca.Function(name, inputs, [after, modes, 0])
        decided = decision_function(len(self.kinematics.independent), count)(posed)
        # what is not at rest has no motion decided, and what is has none before
        motion = ca.vertcat(modes[:count, :] + decided[:count, :], modes[count:, :])
        return ca.Function(name, inputs, [after, motion, decided[count]])


def opposed(contact: Contact) -> dict[str, Scalar]:
    """Torque against each shaft per unit of friction in a contact."""
    return {shaft: -arm for shaft, arm in contact.torque.items()}


def _matrix(rows: Sequence[Row], shafts: Sequence[str]) -> Matrix:
    return ca.vertcat(*(ca.horzcat(*(ca.SX(row.get(shaft, 0.0)) for shaft in shafts)) for row in rows))
