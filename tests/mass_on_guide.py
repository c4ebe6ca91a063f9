"""A mass on a guide that sticks under a PID with a dead band: its cycle in closed form, by matrix exponentials alone.

Between events the motion is linear in each part of the dead band, with error e, speed v and integral z:

    e' = -v,    v' = kp e + z - (kd + viscous) v - coulomb,    z' = ki dead_zone(e)

Stuck, the torque kp e + z grows linearly until it exceeds breakaway. A half of the symmetric cycle takes the error at
one release to minus the error at the next.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import expm
from scipy.optimize import brentq

from actuator import Actuator, TorqueSource
from controllers import PID, IntegralRemedies
from gear import Bearing, Shaft, Transmission


class Cycle(NamedTuple):
    """The symmetric cycle."""

    period: float  # s
    amplitude: float  # rad
    stick_fraction: float
    multiplier: float


@dataclass(frozen=True, kw_only=True)
class MassOnGuide:
    """Unit mass; gains, friction and dead band."""

    kp: float = 3.0
    ki: float = 4.0
    kd: float = 6.0
    coulomb: float = 1.0
    breakaway: float = 1.5
    viscous: float = 0.0
    dead: float = 0.0

    def actuator(self):
        """The same as an Actuator."""
        guide = Bearing(shaft="mass", coulomb=self.coulomb, breakaway=self.breakaway, viscous=self.viscous)
        gear = Transmission(shafts={"mass": Shaft(inertia=1.0)}, bearings={"guide": guide}, input="mass", output="mass")
        remedies = IntegralRemedies(dead_band=self.dead) if self.dead else None
        pid = PID(proportional=self.kp, integral=self.ki, derivative=self.kd, remedies=remedies)
        return Actuator(name="mass on a guide", motor=TorqueSource(), gear=gear, controller=pid)

    def matrix(self, side):
        """Of the state (e, v, z, 1) while the error is on a `side` of the dead band: +1, 0 inside, -1."""
        rate = [self.ki * abs(side), 0, 0, -side * self.ki * self.dead]
        return np.array(
            [[0, -1, 0, 0], [self.kp, -self.kd - self.viscous, 1, -self.coulomb], rate, [0, 0, 0, 0]], float
        )

    def slide(self, error):
        """Duration of a slide that starts from rest `error` behind the reference, error and integral at its end."""
        state, total, step = np.array([error, 0.0, self.breakaway - self.kp * error, 1.0]), 0.0, 0.02
        for side, leaves in ((1, self.dead), (0, -self.dead), (-1, -np.inf)):
            if self.dead == 0 and side == 0:
                continue
            if side * state[0] < side * leaves and side == 1:
                continue
            matrix = self.matrix(side)
            small = expm(step * matrix)
            local, at, first = 0.0, state, total == 0
            while True:
                after = small @ at
                stops, passes = after[1] <= 0 and not (first and local == 0), after[0] <= leaves
                if stops or passes:
                    break
                if local > 500:
                    raise ValueError("the slide does not end")
                at, local = after, local + step

            def value(time, row, level, at=at, matrix=matrix):
                return (expm(time * matrix) @ at)[row] - level

            low = 1e-9 if first and local == 0 else 0.0
            times = []
            if stops:
                times.append((brentq(value, low, step, args=(1, 0.0), xtol=1e-15, rtol=1e-15), True))
            if passes and value(low, 0, leaves) > 0:
                times.append((brentq(value, low, step, args=(0, leaves), xtol=1e-15, rtol=1e-15), False))
            last, stopped = min(times)
            state, total = expm(last * matrix) @ at, total + local + last
            if stopped:
                return total, state[0], state[2]
        raise AssertionError("the slide does not end")

    def after_half(self, error):
        """Error at the next release, of the other sign, taken positive; the error does not change while stuck."""
        return -self.slide(error)[1]

    def cycle(self, low=0.005, high=1.0):
        """The cycle with an amplitude between the bounds; ValueError where the half map does not cross there."""
        error = brentq(lambda e: self.after_half(e) - e, low, high, xtol=1e-15, rtol=1e-14)
        duration, left, integral = self.slide(error)
        stick = (self.kp * left + integral + self.breakaway) / (self.ki * (error - self.dead))
        step = 1e-4 * error
        stencil = [self.after_half(error + k * step) for k in (-2, -1, 1, 2)]
        slope = (stencil[0] - 8 * stencil[1] + 8 * stencil[2] - stencil[3]) / (12 * step)
        return Cycle(2 * (duration + stick), error, stick / (duration + stick), slope**2)
