"""What can be seen of an actuator: the outputs that belong to its mechanics."""

from collections.abc import Mapping
from typing import NamedTuple

import casadi as ca

from actuator.system.builder import SystemBuilder
from actuator.system.contacts import ContactForces, ContactMechanics, ContactModes
from actuator.system.hybrid import Place
from controllers.controller import PlantMotion
from gear.quantities import Matrix, Scalar
from gear.quantities.roles import FrictionHeat
from gear.transmission import Contact


class Mechanics(NamedTuple):
    """The mechanics of a transmission in its present modes."""

    contacts: ContactMechanics
    forces: ContactForces
    modes: ContactModes
    angle: Mapping[str, Scalar]
    speed: Mapping[str, Scalar]
    torque: Mapping[str, Scalar]  # from outside, per shaft

    def friction_losses(self) -> dict[str, ca.SX]:
        """Power that each contact takes [W]; of a friction law with an internal state, what that stores with it."""
        return {
            contact.name: -friction * sum(arm * self.speed[s] for s, arm in contact.torque.items())
            for contact, _, friction in self.rubbing()
        }

    def rubbing(self) -> list[tuple[Contact, Matrix, Matrix]]:
        """Every contact with its slip speed and friction, those that can stick first."""
        forces, contacts = self.forces, self.contacts
        found = [(contact, forces.slip[k], forces.shown[k]) for k, contact in enumerate(contacts.contacts)]
        for contact in contacts.creeping:
            slip = ca.SX(sum(c * self.speed[shaft] for shaft, c in contact.slip.items()))
            found.append((contact, slip, ca.SX(forces.by_memory[contact.name][0])))
        return found

    def energy(self) -> ca.SX:
        """Kinetic, and stored in teeth, couplings and stops [J]."""
        kinetic = sum(inertia * self.speed[shaft] ** 2 / 2 for shaft, inertia in self.contacts.masses.items())
        gear, forces = self.contacts.gear, self.forces
        return kinetic + gear.elastic_energy(forces.motions, self.angle, self.modes.flank)

    def losses(self) -> dict[str, ca.SX]:
        """Heat [W] of the contacts, and of all that damps without sticking."""
        gear, forces = self.contacts.gear, self.forces
        taken = -sum(forces.smooth[shaft] * self.speed[shaft] for shaft in gear.shafts)
        # what the springs take is not lost: the rate of their energy, along the present speeds
        stored = gear.elastic_energy(forces.motions, self.angle, self.modes.flank)
        angles = ca.vertcat(*(ca.SX(self.angle[shaft]) for shaft in self.contacts.kinematics.independent))
        speeds = ca.vertcat(*(ca.SX(self.speed[shaft]) for shaft in self.contacts.kinematics.independent))
        return {
            "friction": sum(self.friction_losses().values(), ca.SX(0)),
            "damping": taken - ca.jtimes(ca.SX(stored), angles, speeds),
        }


def observe(builder: SystemBuilder, seen: Mechanics, motion: PlantMotion) -> None:
    """Motion of motor and load, slip, friction and loss of every contact, loads of every mesh, energy."""
    contacts, forces = seen.contacts, seen.forces
    gear = contacts.gear
    for side in ("motor", "load"):
        builder.output(f"{side}_angle", "rad", getattr(motion, f"{side}_angle"))
        builder.output(f"{side}_speed", "rad/s", getattr(motion, f"{side}_speed"))
    builder.output("motor_angle_at_load", "rad", motion.motor_angle / motion.ratio)
    friction: dict[str, ca.SX] = {}
    lost = seen.friction_losses()
    for contact, slip, scalar in seen.rubbing():
        unit = ("m/s", "N") if contact.place == Place.MESH else ("rad/s", "N m")
        builder.output(f"gear.{contact.name}.slip_speed", unit[0], slip)
        builder.output(f"gear.{contact.name}.friction", unit[1], scalar)
        builder.output(f"gear.{contact.name}.friction_loss", "W", lost[contact.name], FrictionHeat(contact.name))
        friction[contact.name] = scalar
    rigid = contacts.rigid_forces(forces, seen.torque)
    for name, normal in {**forces.normal, **rigid}.items():
        mesh, path = gear.meshes[name], f"gear.meshes.{name}"
        builder.output(f"{path}.normal_force", "N", normal)
        if name in forces.motions:
            builder.output(f"{path}.deflection", "m", forces.motions[name].deflection)
        bearing = mesh.bearing_force(normal, friction.get(f"meshes.{name}", 0.0), ca.if_else(normal < 0, -1, 1))
        builder.output(f"{path}.bearing_force_x", "N", bearing.x)
        builder.output(f"{path}.bearing_force_y", "N", bearing.y)
    for path, passed in forces.passed.items():
        builder.output(f"gear.{path}.torque", "N m", passed)
        builder.output(f"gear.{path}.twist", "rad", forces.twists[path].angle)
    builder.output("mechanical_energy", "J", seen.energy())
