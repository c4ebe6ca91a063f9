"""Where a law has a corner inside one mode: limits that are met, damping that is cut off, tables with straight pieces.

An integrator that steps over a corner gives the state well and its derivatives badly. So the corners are read off the
expressions themselves: fmax(a, b), fmin(a, b) and a condition a < b have one where a - b is zero, fabs(a) and sign(a)
where a is. With each of them held on one side, by a number of its own, the expressions are smooth.
"""

from typing import NamedTuple

import casadi as ca

ORDERS = {ca.OP_FMAX, ca.OP_FMIN, ca.OP_LT, ca.OP_LE}
SIZES = {ca.OP_FABS, ca.OP_SIGN}


class Smooth(NamedTuple):
    """Expressions of (x, m, u, p) with their corners held."""

    arguments: list[ca.SX]  # x, m, u, p
    sides: ca.SX  # (K, 1): +1 or -1, the side of each corner
    results: list[ca.SX]  # smooth while the sides are held
    corners: ca.SX  # (K, 1): zero at the corner, with the sign of the side; with the other corners held
    true_corners: ca.SX  # (K, 1): with nothing held


def hold_corners(function: ca.Function) -> Smooth:
    """The results of an SX function of (x, m, u, p) with every corner in x held on one side."""
    arguments = [ca.SX.sym(name, function.size1_in(k)) for k, name in enumerate("xmup")]
    _, true = _walk(function, arguments, None)
    sides = ca.SX.sym("sides", len(true))
    results, held = _walk(function, arguments, sides)
    return Smooth(arguments, sides, results, *(ca.vertcat(ca.SX(0, 1), *kinks) for kinks in (held, true)))


def _walk(function: ca.Function, arguments: list[ca.SX], sides: ca.SX | None) -> tuple[list[ca.SX], list[ca.SX]]:
    """Results of the function and its corners, operation by operation; `sides` None for nothing held."""
    entries = [ca.vertsplit(argument) for argument in arguments]
    results = [ca.SX(function.sparsity_out(k)) for k in range(function.n_out())]
    work: dict[int, ca.SX] = {}
    corners: list[ca.SX] = []
    for k in range(function.n_instructions()):
        operation, read, written = (
            function.instruction_id(k),
            function.instruction_input(k),
            function.instruction_output(k),
        )
        if operation == ca.OP_INPUT:
            work[written[0]] = entries[read[0]][read[1]]
        elif operation == ca.OP_CONST:
            work[written[0]] = ca.SX(function.instruction_constant(k))
        elif operation == ca.OP_OUTPUT:
            results[written[0]].nz[written[1]] = work[read[0]]
        else:
            values = [work[index] for index in read]
            corner = values[0] - values[1] if operation in ORDERS else values[0] if operation in SIZES else None
            if corner is not None and ca.depends_on(corner, arguments[0]):
                corners.append(corner)
                if sides is not None:
                    work[written[0]] = _held(operation, values, sides[len(corners) - 1] > 0)
                    continue
            work[written[0]] = (ca.SX.unary if len(values) == 1 else ca.SX.binary)(operation, *values)
    return results, corners


def _held(operation: int, values: list[ca.SX], above: ca.SX) -> ca.SX:
    """The operation on one side of its corner."""
    if operation == ca.OP_FMAX:
        return ca.if_else(above, values[0], values[1])
    if operation == ca.OP_FMIN:
        return ca.if_else(above, values[1], values[0])
    if operation == ca.OP_FABS:
        return ca.if_else(above, values[0], -values[0])
    return 2 * above - 1 if operation == ca.OP_SIGN else 1 - above
