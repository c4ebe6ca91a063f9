"""The integral of a PI or PID: anti-windup, and remedies against stiction.

Anti-windup by what was realized: a law proposes an output, something (its own limit, a current limit, the
voltage of the inverter) realizes part of it, and the integral is driven by the difference, so every limiter
outside is handled without a special case:

    back-calculation    state' = integral * error + back_calculation * (realized - proposed)
    clamping            state' = integral * error, 0 while limited and the error pushes further
    conditional         state' = integral * error, 0 while limited

The last two switch: in continuous time the integral may slide along the limit, and the integration with it
takes short steps. They are at home in sampled controllers.
"""

from dataclasses import dataclass
from typing import Any, Literal

from controllers.memory import Memory
from controllers.shapes import dead_zone
from controllers.units import ErrorBand, Rate
from gear.quantities import Scalar, check, check_choice

AntiWindup = Literal["back-calculation", "clamping", "conditional"]
ANTI_WINDUP: tuple[AntiWindup, ...] = ("back-calculation", "clamping", "conditional")
ROUNDING = 1e-9  # relative: an output that goes through a gear ratio and back is not limited by that


@dataclass(frozen=True, kw_only=True)
class IntegralRemedies:
    """Remedies against stick-slip hunting, in the integral of a PI or PID; each None or False is switched off.

        state' = integral * dead_zone(error) - leakage * state + anti-windup
        state  = 0 at the sample where the error has changed its sign

    Parameters
    ----------
    dead_band : float or None
        Of the error that is integrated, zero inside and shifted outside [error].
    leakage : float or None
        Rate at which the integral decays [1/s].
    reset_on_reversal : bool
        Whether the integral starts again where the error changes its sign. It needs a sampled controller,
        which remembers the last error that was not zero.

    References
    ----------
    B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, "A survey of models, analysis tools and compensation
    methods for the control of machines with friction", Automatica 30 (1994) 1083-1138, section 5.
    """

    dead_band: ErrorBand | None = None
    leakage: Rate | None = None
    reset_on_reversal: bool = False

    def __post_init__(self) -> None:
        check(self)
        if not isinstance(self.reset_on_reversal, bool):
            raise ValueError(
                f"IntegralRemedies.reset_on_reversal must be True or False, got {self.reset_on_reversal!r}"
            )

    def integrated(self, error: Scalar) -> Scalar:
        """The part of the error that is integrated."""
        return error if self.dead_band is None else dead_zone(error, self.dead_band)

    def leak(self, state: Scalar) -> Scalar:
        """Rate at which the integral state is lost [output/s]."""
        return 0.0 if self.leakage is None else self.leakage * state


def last_error(remembered: Scalar, error: Scalar) -> Scalar:
    """The last error that was not zero: a quantized one stands at zero on its way to the other sign."""
    return error + (error == 0) * remembered


def reversed_since(remembered: Scalar, error: Scalar) -> Scalar:
    """1 where the error has the other sign than the one remembered, else 0."""
    return (remembered * error < 0) * 1.0


# -- the integral of a law, which is a PI or a PID: their methods -----------------------------------------


def check_anti_windup(law: Any) -> None:
    """Raise ValueError where the method is none, or has a rate that it does not use."""
    check_choice(law, "anti_windup", ANTI_WINDUP)
    if law.back_calculation is not None and law.anti_windup != "back-calculation":
        raise ValueError(
            f"{type(law).__name__}.back_calculation {law.back_calculation:.6g} 1/s has no meaning with "
            f'anti_windup "{law.anti_windup}"; leave one of them out'
        )


def memory_of(law: Any, unit: str = "output", nominal: float = 1.0) -> tuple[Memory, ...]:
    """The integral state, and the last error where the integral is reset on reversal."""
    integral = Memory("integral", unit, nominal)
    reset = law.remedies is not None and law.remedies.reset_on_reversal
    return (integral, Memory("last_error", "error", 1.0)) if reset else (integral,)


def _rate(law: Any, state: Scalar, error: Scalar, proposed: Scalar, realized: Scalar) -> Scalar:
    leak = 0.0
    if law.remedies is not None:
        error, leak = law.remedies.integrated(error), law.remedies.leak(state)
    if law.anti_windup == "back-calculation":
        rate = law.integral / law.proportional if law.back_calculation is None else law.back_calculation
        return law.integral * error + rate * (realized - proposed) - leak
    lost = proposed - realized
    stopped = lost**2 > (ROUNDING * proposed) ** 2
    if law.anti_windup == "clamping":
        stopped = stopped * (lost * error > 0)
    return law.integral * error * (1 - stopped) - leak


def rate_of(law: Any, state: Scalar, error: Scalar, proposed: Scalar, realized: Scalar) -> Scalar:
    """Time derivative of the integral state, continuous form.

    Raises
    ------
    ValueError
        Where the integral is reset on reversal, which needs a sampled controller.
    """
    if law.remedies is not None and law.remedies.reset_on_reversal:
        raise ValueError(
            f"{type(law).__name__}: reset_on_reversal needs a sampled controller: give it a sampling, "
            "or leave reset_on_reversal out"
        )
    return _rate(law, state, error, proposed, realized)


def advance_integral(  # noqa: PLR0913 - the law, what it saw, and its period
    law: Any,
    state: Scalar,
    error: Scalar,
    proposed: Scalar,
    realized: Scalar,
    period: Scalar,
    remembered: Scalar | None = None,
) -> Scalar:
    """Integral state after a sample, by Euler's forward rule as in drives.

    `remembered` is the last error that was not zero, needed where the integral is reset on reversal.
    """
    after = state + period * _rate(law, state, error, proposed, realized)
    if law.remedies is None or not law.remedies.reset_on_reversal:
        return after
    if remembered is None:
        raise ValueError(f"{type(law).__name__}.advance needs the last error remembered, as it has reset_on_reversal")
    return after * (1 - reversed_since(remembered, error))
