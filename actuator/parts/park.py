"""Phases and rotor axes: the amplitude-invariant Park transform."""

import math

import casadi as ca

from gear.quantities import Scalar

THIRD = 2 * math.pi / 3


def to_phases(axes: list[Scalar], angle: Scalar) -> list[Scalar]:
    """The three phases from [d, q]; `angle` [rad electrical] is that of the d axis against phase a.

    phase k = d cos(angle - 2 pi k/3) - q sin(angle - 2 pi k/3)
    """
    direct, quadrature = axes
    return [direct * ca.cos(angle - k * THIRD) - quadrature * ca.sin(angle - k * THIRD) for k in range(3)]


def to_axes(phases: list[Scalar], angle: Scalar) -> list[Scalar]:
    """[d, q] from the three phases; what they have in common drops out."""
    turned = [(phase, angle - k * THIRD) for k, phase in enumerate(phases)]
    direct = 2 / 3 * sum(phase * ca.cos(at) for phase, at in turned)
    return [direct, -2 / 3 * sum(phase * ca.sin(at) for phase, at in turned)]


def rotate(axes: list[Scalar], angle: Scalar) -> list[Scalar]:
    """A vector of two axes turned ahead by an angle [rad electrical]: from rotor axes to those of the phases."""
    direct, quadrature = axes
    cosine, sine = ca.cos(angle), ca.sin(angle)
    return [cosine * direct - sine * quadrature, sine * direct + cosine * quadrature]
