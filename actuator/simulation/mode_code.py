"""The modes as whole numbers in one number, and the log of the last events: what rides along in the integration."""

from typing import Any, NamedTuple

import casadi as ca
import numpy as np

MODE_BASE = 5  # mode variables are -2..2
MODES_PER_CODE = 20  # 5^20 < 2^53
LOG_SLOTS = 4  # events of one output interval that are kept


class ModeCode:
    """Mode variables as digits of one number (of several, where there are more than MODES_PER_CODE)."""

    def __init__(self, count: int) -> None:
        self.sizes = [min(MODES_PER_CODE, count - k) for k in range(0, count, MODES_PER_CODE)]

    @property
    def size(self) -> int:
        """How many numbers."""
        return len(self.sizes)

    def pack(self, modes: Any) -> Any:
        """Codes from modes."""
        groups = ca.vertsplit(modes, [0, *np.cumsum(self.sizes)]) if self.sizes else []
        weights = [ca.DM([float(MODE_BASE**i) for i in range(size)]) for size in self.sizes]
        return ca.vertcat(*(ca.dot(group + 2, weight) for group, weight in zip(groups, weights, strict=True)))

    def packed(self, modes: np.ndarray) -> np.ndarray:
        """Codes from modes, as numbers."""
        return ca.DM(self.pack(ca.DM(modes))).full().ravel()

    def unpack(self, codes: ca.SX) -> ca.SX:
        """Modes from codes that may have picked up rounding."""
        digits = []
        for k, size in enumerate(self.sizes):
            rest = ca.floor(codes[k] + 0.5)
            for _ in range(size):
                shorter = ca.floor((rest + 0.5) / MODE_BASE)
                digits.append(rest - MODE_BASE * shorter - 2)
                rest = shorter
        return ca.vertcat(*digits)

    def words(self, codes: np.ndarray) -> tuple[int, ...]:
        """Modes from codes, as integers."""
        digits = []
        for code, size in zip(codes, self.sizes, strict=True):
            rest = round(code)
            for _ in range(size):
                rest, digit = divmod(rest, MODE_BASE)
                digits.append(digit - 2)
        return tuple(digits)

    def unpack_function(self) -> ca.Function:
        """(codes) -> modes."""
        codes = ca.SX.sym("codes", self.size)
        return ca.Function("unpack", [codes], [ca.reshape(self.unpack(codes), sum(self.sizes), 1)])


class EventLog(NamedTuple):
    """Behind the `moving` states: codes of the modes, number of events, times of the last LOG_SLOTS, older codes."""

    moving: int
    codes: int

    @property
    def size(self) -> int:
        """Of the log, without the present codes, which are the newest."""
        return 1 + LOG_SLOTS + (LOG_SLOTS - 1) * self.codes

    def split(self, y: ca.MX) -> list[ca.MX]:
        """States, codes, count, times and older codes; of one or many columns."""
        sizes = [0, self.moving, self.codes, 1, LOG_SLOTS, (LOG_SLOTS - 1) * self.codes]
        return ca.vertsplit(y, [int(row) for row in np.cumsum(sizes)])

    def told(self, y: ca.MX) -> ca.MX:
        """Count, times, codes: present and older."""
        _, codes, count, times, older = self.split(y)
        return ca.vertcat(count, times, codes, older)

    def after(self, y: ca.MX, states: ca.MX, codes: ca.MX, time: ca.MX) -> ca.MX:
        """With one more event."""
        _, before, count, times, older = self.split(y)
        kept = ca.vertcat(before, older)[: older.shape[0]]
        return ca.vertcat(states, codes, count + 1, time, times[: LOG_SLOTS - 1], kept)
