"""Random trains with contacts at rest, several of which lock the same shafts, and limit analysis by programming."""

import numpy as np
import scipy.linalg
from scipy.optimize import linprog

from gear.stiction.decision import RestProblem

SOLVER = {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10}


def draw_train(rng, light=1.0, stick_by="conjugate speed"):
    """Inertia, slip rows and torque rows of one to five shafts in a chain, some meshes on a carrier, many bearings."""
    count = int(rng.integers(1, 6))
    inertia = np.exp(rng.uniform(np.log(1e-5), np.log(1e-1), count))
    inertia[rng.random(count) < 0.4] *= light
    slips, torques = [], []
    for k in range(count - 1):
        radius = rng.uniform(0.005, 0.03), rng.uniform(0.01, 0.1)
        arm = radius[0] * rng.uniform(0.05, 0.2), radius[1] * rng.uniform(0.03, 0.2)
        carrier = int(rng.integers(count)) if rng.random() < 0.3 else k
        rows = np.zeros((2, count))
        for row, a, b in ((rows[0], radius[0] / 2, radius[1] / 2), (rows[1], *arm)):
            row[k] += a
            row[k + 1] -= b
            if carrier not in (k, k + 1):
                row[carrier] -= a - b
        slips.append(rows[1] if stick_by == "conjugate speed" else rows[0])
        torques.append(rows[1])
    for k in range(count):
        for _ in range(rng.integers(0, 3)):
            slips.append(np.eye(count)[k])
            torques.append(np.eye(count)[k])
    order = rng.permutation(len(slips))[:12]
    slip, torque = (np.reshape(rows, (-1, count))[order] for rows in (slips, torques))
    possible = len(order) and (np.einsum("ij,j,ij->i", slip, 1 / inertia, torque) > 0).all()
    return (np.diag(inertia), slip, torque) if possible else draw_train(rng, light, stick_by)


def draw_problem(rng, *, light=1.0, one_friction=False, stick_by="conjugate speed"):
    """A RestProblem about such a train, its load turning either way: within all limits, near them or beyond."""
    inertia, slip, torque = draw_train(rng, light, stick_by)
    count = len(slip)
    static = np.exp(rng.uniform(-2, 1, count)) / np.linalg.norm(torque, axis=1)
    static[rng.random(count) < 0.05] *= 1e-6
    part = np.ones((2, count)) if one_friction else rng.uniform(0.2, 1, (2, count))
    load = torque.T @ (static * rng.uniform(-1, 1, count)) * np.exp(rng.uniform(-0.7, 0.7))
    if rng.random() < 0.3:
        load += rng.normal(size=len(load)) * abs(torque.T @ static).mean() * rng.choice([0.1, 1.0])
    still = np.zeros(count)
    return RestProblem(inertia, load, slip, torque, static, static * part[0], static * part[1], still + 1, still)


def motions_without_slip(slip):
    """A basis of them, sparse, so that light shafts stay apart from heavy ones."""
    _, sizes, turned = np.linalg.svd(slip / np.linalg.norm(slip, axis=1, keepdims=True))
    basis = turned[(sizes > 1e-9).sum() :].T
    if basis.shape[1]:
        chosen = scipy.linalg.qr(basis.T, pivoting=True)[2][: basis.shape[1]]
        basis = basis @ np.linalg.inv(basis[chosen])
        basis[abs(basis) < 1e-13] = 0
    return basis


def needed_part(problem):
    """The smallest part of all static limits with which nothing slips: T's + M a = f ; inf where none does."""
    moves = problem.inertia @ motions_without_slip(problem.slip)
    moves = moves / np.maximum(abs(moves).max(axis=0, initial=0), 1e-300)
    balance = np.column_stack([problem.torque.T * problem.static, moves, np.zeros(len(problem.load))])
    size = np.maximum(abs(balance).max(axis=1), 1e-300)
    count, others = len(problem.static), moves.shape[1]
    box = [np.column_stack([sign * np.eye(count), np.zeros((count, others)), -np.ones(count)]) for sign in (1, -1)]
    answer = linprog(
        np.append(np.zeros(count + others), 1),
        A_ub=np.vstack(box),
        b_ub=np.zeros(2 * count),
        A_eq=balance / size[:, None],
        b_eq=problem.load / size,
        bounds=[(None, None)] * (count + others) + [(0, None)],
        method="highs",
        options=SOLVER,
    )
    assert answer.status in (0, 2), answer.message
    return answer.x[-1] if answer.status == 0 else np.inf


def worst_violation(problem, motion, friction):
    """Of the rules: friction of what holds over its limit, slip of it, friction and direction of what slips."""
    held, forward, backward = motion == 0, motion == 1, motion == -1
    slip = problem.slip @ np.linalg.solve(problem.inertia, problem.load - problem.torque.T @ friction)
    usual = abs(problem.slip) @ np.linalg.solve(
        problem.inertia, abs(problem.load) + abs(problem.torque.T) @ problem.static
    )
    return max(
        (abs(friction) / problem.static - 1)[held].max(initial=0),
        (abs(slip) / usual)[held].max(initial=0),
        (abs(friction - problem.forward) / problem.static)[forward].max(initial=0),
        (abs(friction + problem.backward) / problem.static)[backward].max(initial=0),
        (-(slip * motion) / usual)[~held].max(initial=0),
    )
