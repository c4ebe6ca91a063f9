"""Exact models of sampled control with their derivatives by named parameters, for tuning.

From tick to tick everything is linear, so one period of the slowest clock is a product of maps, and its derivative by
a gain is that of a product:

    x(k+) = Tx x(k) + Tu u(k),     x(k+1) = Phi x(k+) + Gamma u(k)

A signal that is renewed N times in that period is cut N times in it. Its loop then is an N x N matrix L(z), unstable
for a common factor f on all values where det(1 + f L) encircles zero, so that its eigenvalues take the place of the one
loop transfer. In the order of their size they are that transfer at the frequencies that alias to the same z,

    w,  2 pi/T - w (conjugated),  2 pi/T + w,  4 pi/T - w (conjugated), ...

and unfolded in this way they are one curve up to half the rate at which the signal is renewed.

References
----------
S. Bittanti, P. Colaneri, "Periodic Systems: Filtering and Control" (2009), chapter 6 (lifting); A. G. J. MacFarlane,
I. Postlethwaite, "The generalized Nyquist stability criterion and multivariable root loci", Int. J. Control 25 (1977).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from actuator.linear.derivatives.continuous import Response, Value
from controllers.loop import PREFIX

ROUNDING = 1e-6  # by which a pole may lie outside the unit circle: free bodies have two at one


@dataclass(frozen=True, kw_only=True, eq=False)
class SampledGainModel:
    """The linear model of a contact mode over one period of all clocks, and how it changes with the gains.

    Inputs and outputs are those of every tick; outputs are taken just after it. States are over their nominal sizes.

    Attributes
    ----------
    gains, given, seen : tuple of str
        Parameters, inputs and outputs (or states) by name.
    base : float
        Between two ticks [s].
    renewed : dict of str to int
        Ticks between two values of each signal that has an injection among the inputs.
    a, b, c, d : ndarray, (n, n), (n, ticks, inputs), (ticks, outputs, n), (ticks, outputs, ticks, inputs)
        The model.
    slopes : tuple of ndarray
        Derivatives of the four, the gains in the first axis.
    """

    gains: tuple[str, ...]
    given: tuple[str, ...]
    seen: tuple[str, ...]
    base: float
    renewed: dict[str, int]
    a: np.ndarray = field(repr=False)
    b: np.ndarray = field(repr=False)
    c: np.ndarray = field(repr=False)
    d: np.ndarray = field(repr=False)
    slopes: tuple[np.ndarray, ...] = field(repr=False)

    @property
    def period(self) -> float:
        """After which all clocks are due again [s]."""
        return len(self.c) * self.base

    @cached_property
    def stable(self) -> bool:
        """Whether no pole lies outside the unit circle, but for rounding."""
        return bool((abs(np.linalg.eigvals(self.a)) <= 1 + ROUNDING).all())

    def highest(self, at: str | None = None) -> float:
        """Half the rate at which a signal is renewed [rad/s]; of all signals together without a name."""
        return math.pi / self.period * (1 if at is None else len(self.c) // self.renewed[at])

    def spacing(self, step: float) -> float:
        """The whole number of ticks [s] next to a step."""
        return max(1, round(step / self.base)) * self.base

    # -- sines --------------------------------------------------------------------------------------------

    def responses(self, given: str, seen: str, frequencies: np.ndarray) -> np.ndarray:
        """Response of one output to samples of a sine that are held over a period, at frequencies [rad/s]."""
        b, c, d, _ = self._constant(given, seen)
        return self._states(b[:, None], frequencies)[0][..., 0] @ c + d

    def response(self, given: str, seen: str, frequencies: np.ndarray | Sequence[float]) -> Response:
        """The same with its derivatives."""
        frequencies = np.asarray(frequencies, float)
        b, c, d, (db, dc, dd) = self._constant(given, seen)
        right, z = self._states(b[:, None], frequencies)
        left = np.linalg.solve(np.swapaxes(z * np.eye(len(self.a)) - self.a, 1, 2), c[None, :, None] + 0j)[..., 0]
        right = right[..., 0]
        slopes = right @ dc.T + ((left @ self.slopes[0]) * right).sum(axis=2).T + left @ db.T + dd
        return Response(right @ c + d, slopes, -1j * self.period * z[:, 0, 0] * (left * right).sum(axis=1))

    def loops(self, at: str, frequencies: np.ndarray) -> np.ndarray:
        """Loop transfer with the loop opened at a named signal, L = -T/(1 + T), at true frequencies [rad/s]."""
        folded, fold = self._folded(frequencies)
        b, c, d, _ = self._cut(at)
        through = np.linalg.inv(np.eye(len(d)) + c @ self._states(b, folded)[0] + d)
        found = np.linalg.eigvals(through - np.eye(len(d)))
        found = np.take_along_axis(found, np.argsort(-abs(found), axis=1), axis=1)[np.arange(len(fold)), fold]
        return np.where(fold % 2, found.conj(), found)

    def loop(self, at: str, frequencies: np.ndarray | Sequence[float]) -> Response:
        """The same with its derivatives."""
        frequencies = np.asarray(frequencies, float)
        folded, fold = self._folded(frequencies)
        b, c, d, (db, dc, dd) = self._cut(at)
        da, one = self.slopes[0], np.eye(len(d))
        right, z = self._states(b, folded)
        left = np.swapaxes(np.linalg.solve(np.swapaxes(z * np.eye(len(self.a)) - self.a, 1, 2), c.T + 0j), 1, 2)
        through = np.linalg.inv(one + c @ right + d)
        by_gains = dc[None] @ right[:, None] + left[:, None] @ (da[None] @ right[:, None] + db[None]) + dd[None]
        by_frequency = -1j * self.period * z * (left @ right)
        every = np.concatenate([by_gains, by_frequency[:, None]], axis=1)  # of the closed loop T
        values, vectors = np.linalg.eig(through - one)
        turned = -np.linalg.inv(vectors)[:, None] @ (through[:, None] @ every @ through[:, None]) @ vectors[:, None]
        which = np.argsort(-abs(values), axis=1)[np.arange(len(fold)), fold]
        rows, odd = np.arange(len(fold)), fold % 2 == 1
        value, slopes = values[rows, which], turned[rows, :, which, which]
        value, slopes = np.where(odd, value.conj(), value), np.where(odd[:, None], slopes.conj(), slopes)
        return Response(value, slopes[:, :-1], np.where(odd, -slopes[:, -1], slopes[:, -1]))

    def _folded(self, frequencies: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Frequencies below half the common rate that alias to these, and how often these are folded."""
        half = self.highest()
        fold = np.floor(frequencies / half).astype(int)
        return np.where(fold % 2, (fold + 1) * half - frequencies, frequencies - fold * half), fold

    def _states(self, b: np.ndarray, frequencies: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(z - A)^-1 B, (f, n, inputs), and z."""
        z = np.exp(1j * self.period * frequencies)[:, None, None]
        return np.linalg.solve(z * np.eye(len(self.a)) - self.a, b + 0j), z

    def _constant(self, given: str, seen: str) -> tuple[np.ndarray, np.ndarray, np.ndarray, tuple[np.ndarray, ...]]:
        """b, c, d of an input that is constant over a period and an output after its first tick; their derivatives."""
        k, i = self.given.index(given), self.seen.index(seen)
        _, db, dc, dd = self.slopes
        slopes = db[..., k].sum(axis=2), dc[:, 0, i], dd[:, 0, i, :, k].sum(axis=1)
        return self.b[..., k].sum(axis=1), self.c[0, i], self.d[0, i, :, k].sum(), slopes

    def _cut(self, at: str) -> tuple[np.ndarray, np.ndarray, np.ndarray, tuple[np.ndarray, ...]]:
        """B, C, D from all values of what is injected in a period to those of the signal; their derivatives."""
        if at in self._cuts:
            return self._cuts[at]
        k, i, every = self.given.index(PREFIX + at), self.seen.index(at), self.renewed[at]
        parts = len(self.c) // every
        b, c, d = (np.moveaxis(self.b, 2, 0)[k], self.c[::every, i], np.moveaxis(self.d, 3, 0)[k, ::every, i])
        _, db, dc, dd = self.slopes
        slopes = db[..., k], dc[:, ::every, i], np.moveaxis(dd, 4, 0)[k][:, ::every, i]

        def held(values: np.ndarray) -> np.ndarray:
            return values.reshape(*values.shape[:-1], parts, every).sum(axis=-1)

        self._cuts[at] = held(b), c, held(d), (held(slopes[0]), slopes[1], held(slopes[2]))
        return self._cuts[at]

    @cached_property
    def _cuts(self) -> dict[str, Any]:
        return {}

    # -- steps --------------------------------------------------------------------------------------------

    def steps(self, given: str, seen: str, step: float, count: int) -> np.ndarray:
        """Step response at 0, step, 2 step, ..., a whole number of ticks each (`spacing`)."""
        k, i, ticks = self.given.index(given), self.seen.index(seen), len(self.c)
        periods, tick = np.divmod(np.arange(count) * round(step / self.base), ticks)
        driven, states, power = self.b[..., k].sum(axis=1), np.zeros((1, len(self.a))), self.a
        while len(states) <= periods[-1]:  # from rest x(n + m) = A^m x(n) + x(m)
            states, power = np.vstack([states, states @ power.T + self.a @ states[-1] + driven]), power @ power
        return (self.c[tick, i] * states[periods]).sum(axis=1) + self.d[tick, i, :, k].sum(axis=1)

    def step_at(self, given: str, seen: str, time: float) -> Value:
        """Step response just after the tick at a time [s] with its derivatives."""
        k, i, n = self.given.index(given), self.seen.index(seen), len(self.a)
        periods, tick = divmod(round(time / self.base), len(self.c))
        da, db, dc, dd = self.slopes
        once = np.eye(n + 1)
        once[:n, :n], once[:n, n] = self.a, self.b[..., k].sum(axis=1)
        state = np.linalg.matrix_power(once, periods)[:n, n]
        slopes = np.empty(len(self.gains))
        for g in range(len(self.gains)):
            direction = np.zeros_like(once)
            direction[:n, :n], direction[:n, n] = da[g], db[g, ..., k].sum(axis=1)
            both = np.block([[once, direction], [np.zeros_like(once), once]])  # its powers hold those of the derivative
            changed = np.linalg.matrix_power(both, periods)[:n, 2 * n + 1]
            slopes[g] = dc[g, tick, i] @ state + self.c[tick, i] @ changed + dd[g, tick, i, :, k].sum()
        return Value(np.asarray(self.c[tick, i] @ state + self.d[tick, i, :, k].sum()), slopes)
