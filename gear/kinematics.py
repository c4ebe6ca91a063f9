"""Which shafts move independently: rigid meshes and fixed shafts take degrees of freedom away."""

from collections.abc import Mapping

import casadi as ca

from gear.quantities import Matrix, Scalar

PIVOT = 1e-9  # part of the largest coefficient below which a constraint says nothing new

Lower = dict[tuple[int, int], ca.SX]
Row = dict[str, Scalar]  # a linear combination of shaft motions


class Kinematics:
    """The motion of every shaft from that of the independent ones, and the inertia behind them.

        motion of shaft s = sum over independent q of turns[s][q] * motion of q
        M_qr = sum over shafts of inertia_s turns[s][q] turns[s][r]

    Parameters
    ----------
    shafts : list of str
        In order.
    constraints : list of dict of str to Scalar
        Each a combination of shaft motions that is always zero (a rigid mesh, a fixed shaft).
    values : list of dict of str to float
        The same constraints in numbers; they decide which shaft is expressed by the others.
    keep : list of str
        Shafts that stay independent where there is a choice.
    """

    def __init__(self, shafts: list[str], constraints: list[Row], values: list[Row], keep: list[str]) -> None:
        found: dict[str, tuple[Row, Row]] = {}
        for constraint in zip(constraints, values, strict=True):
            size = max(abs(float(value)) for value in constraint[1].values())
            rows = [_insert(row, {s: pair[k] for s, pair in found.items()}) for k, row in enumerate(constraint)]
            choice = [s for s in shafts if abs(float(rows[1].get(s, 0.0))) > PIVOT * size]
            if not choice:
                continue  # the others already say so
            dependent = next((s for s in reversed(choice) if s not in keep), choice[-1])
            solved = [{s: -value / row[dependent] for s, value in row.items() if s != dependent} for row in rows]
            found = {
                s: (_insert(x, {dependent: solved[0]}), _insert(y, {dependent: solved[1]}))
                for s, (x, y) in found.items()
            }
            found[dependent] = (solved[0], solved[1])
        self.shafts = shafts
        self.independent = [s for s in shafts if s not in found]
        self.turns: dict[str, Row] = {s: found[s][0] if s in found else {s: 1.0} for s in shafts}

    def expand(self, motion: Mapping[str, Scalar]) -> dict[str, Scalar]:
        """Motion of every shaft from that of the independent ones."""
        return {s: sum((turn * motion[q] for q, turn in row.items()), 0.0) for s, row in self.turns.items()}

    def gather(self, torque: Mapping[str, Scalar]) -> Row:
        """Generalized torque on each independent shaft, of torques on shafts; of a row of coefficients, likewise."""
        found: Row = {}
        for shaft, value in torque.items():
            for q, turn in self.turns[shaft].items():
                found[q] = found.get(q, 0.0) + turn * value
        return found

    def solver(self, inertia: Mapping[str, Scalar]) -> "Inertia":
        """The inertia behind the independent shafts, factorized once."""
        rows = [
            [
                sum((inertia[s] * row[q] * row[r] for s, row in self.turns.items() if q in row and r in row), 0.0)
                for r in self.independent
            ]
            for q in self.independent
        ]
        return Inertia(self, rows)


class Inertia:
    """Accelerations from torques: M^-1 of the independent shafts, seen from all."""

    def __init__(self, kinematics: Kinematics, rows: list[list[Matrix]]) -> None:
        self.kinematics, self.rows = kinematics, rows
        self.factors = factorize(rows)

    def accelerations(self, torque: Mapping[str, Scalar]) -> dict[str, Scalar]:
        """Acceleration of every shaft [rad/s^2] from the torques on the shafts [N m]; impulses give speed steps."""
        known = self.kinematics.gather(torque)
        solved = substitute(*self.factors, [known.get(q, 0.0) for q in self.kinematics.independent])
        return self.kinematics.expand(dict(zip(self.kinematics.independent, solved, strict=True)))


def _insert(row: Row, known: Mapping[str, Row]) -> Row:
    """A combination with the known shafts replaced by what they are combinations of."""
    result: Row = {}
    for shaft, value in row.items():
        for other, turn in known[shaft].items() if shaft in known else [(shaft, 1.0)]:
            result[other] = result[other] + value * turn if other in result else value * turn
    return result


# -- elimination on small matrices of expressions: zeros that are known stay zeros ---------------------------


def factorize(rows: list[list[Matrix]]) -> tuple[Lower, list[list[Matrix]]]:
    """LU factors without pivoting, for matrices whose principal minors are positive."""
    rows, lower = [list(row) for row in rows], {}
    for pivot in range(len(rows)):
        for i in range(pivot + 1, len(rows)):
            if not ca.SX(rows[i][pivot]).is_zero():
                lower[i, pivot] = rows[i][pivot] / rows[pivot][pivot]
                for j in range(pivot + 1, len(rows)):
                    rows[i][j] = rows[i][j] - lower[i, pivot] * rows[pivot][j]
    return lower, rows


def substitute(lower: Lower, upper: list[list[Matrix]], right: list[Matrix]) -> list[Matrix]:
    """Solution of the factorized system for one right side."""
    solution = list(right)
    for i in range(len(solution)):
        for j in range(i):
            if (i, j) in lower:
                solution[i] = solution[i] - lower[i, j] * solution[j]
    for i in reversed(range(len(solution))):
        for j in range(i + 1, len(solution)):
            solution[i] = solution[i] - upper[i][j] * solution[j]
        solution[i] = solution[i] / upper[i][i]
    return solution
