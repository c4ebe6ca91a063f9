"""Cascade of position, speed and current control."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Literal

from controllers.compensation import Dither, FrictionCompensation, Knocker
from controllers.feedforward import FeedForward
from controllers.filters import LeadLag, LowPass, Notch, SecondOrderLowPass
from controllers.observer import DisturbanceObserver, FilteredDerivative, PositionObserver
from controllers.pid import PI, P
from controllers.reference import RateAndAccelerationLimit, RateLimit
from controllers.scheduling import ScheduledGain
from controllers.units import Speed
from gear.quantities import check, check_choice
from gear.quantities.roles import InLoop

Filter = LowPass | SecondOrderLowPass | Notch | LeadLag
CurrentDemand = Literal["quadrature", "least current"]


@dataclass(frozen=True, kw_only=True)
class Remedies:
    """What is added to the torque demand against stiction; each None is switched off.

    Parameters
    ----------
    compensation : FrictionCompensation or None
        Of dry friction, with a boost to break away.
    dither : Dither or None
        A small fast oscillation.
    knocker : Knocker or None
        Pulses in the direction of the position error. It needs a sampled controller.
    """

    compensation: FrictionCompensation | None = None
    dither: Dither | None = None
    knocker: Knocker | None = None


@dataclass(frozen=True, kw_only=True)
class Cascade:
    """Position -> speed -> current, the structure of nearly every servo drive.

        motor speed reference = ratio * position law (reference - measured position), limited
        motor torque demand   = speed PI on motor speed, with what is added to it, filtered, limited
        voltage demand        = current PI on each axis of the motor, plus decoupling

    Parameters
    ----------
    position : P, PI or None
        Gain [1/s] on the position error at the load; None for a speed drive, whose reference is the motor's speed.
    speed : PI
        Torque at the motor [N m] from the speed error of the motor [rad/s].
    current : PI or None
        Voltage [V] from current error [A], the same on each axis of the motor; None for a motor that gets its
        current or torque at once.
    speed_limit : float
        Of the motor speed reference [rad/s].
    feedback : "load" or "motor"
        Where the position is measured; at the motor it is divided by the gear ratio.
    decoupling : bool
        Whether the back-emf and the coupling of the axes are added to the voltage demand.
    reference : RateLimit, RateAndAccelerationLimit or None
        Limits of the position reference, at the load.
    feed_forward : FeedForward or None
        From the limited reference, which it needs.
    speed_from : FilteredDerivative, PositionObserver or None
        The motor's speed from its measured angle; None for a tachometer.
    torque_filters : mapping of str to filter
        In a row on the torque demand.
    disturbance_observer : DisturbanceObserver or None
        Its estimate is taken from the torque demand.
    remedies : Remedies
        Against stiction, on the torque demand.
    current_demand : "quadrature" or "least current"
        Torque by quadrature current alone, or with the direct current that needs least in all and keeps the voltage
        limit (maximum torque per ampere and field weakening), for a PMSM.
    schedule : ScheduledGain or None
        Factor on the gains of the speed law over "temperature" [K] (of the oil or else the housing) or "load" (the
        torque demand of the last sample [N m]).

    Raises
    ------
    ValueError
        Where parts do not go together.
    """

    position: Annotated[P | PI | None, InLoop("position")]
    speed: Annotated[PI, InLoop("speed")]
    current: Annotated[PI | None, InLoop("current", "electrical")]
    speed_limit: Speed
    feedback: Literal["load", "motor"] = "load"
    decoupling: bool = True
    reference: RateLimit | RateAndAccelerationLimit | None = None
    feed_forward: FeedForward | None = None
    speed_from: FilteredDerivative | PositionObserver | None = None
    torque_filters: Mapping[str, Filter] = field(default_factory=dict)
    disturbance_observer: DisturbanceObserver | None = None
    remedies: Remedies = field(default_factory=Remedies)
    current_demand: CurrentDemand = "quadrature"
    schedule: ScheduledGain | None = None

    def __post_init__(self) -> None:
        check(self)
        check_choice(self, "feedback", ("load", "motor"))
        check_choice(self, "current_demand", ("quadrature", "least current"))
        if self.position is None:
            self._require_no_position()
        if self.feed_forward is not None and self.reference is None:
            raise ValueError(
                "Cascade.feed_forward needs the speed of the reference: limit it, with reference = RateLimit or "
                "RateAndAccelerationLimit"
            )
        if self.schedule is not None and self.schedule.over not in ("temperature", "load"):
            raise ValueError(f'Cascade.schedule is over "temperature" or "load", got {self.schedule.over!r}')

    def _require_no_position(self) -> None:
        """Raise where a part needs the position loop that a speed drive lacks."""
        needing = {"reference": self.reference, "feed_forward": self.feed_forward, "knocker": self.remedies.knocker}
        for name, part in needing.items():
            if part is not None:
                raise ValueError(
                    f"Cascade without a position loop (position = None) has no position error: leave {name} out, "
                    "or give it a position law"
                )

    @classmethod
    def for_bandwidths(  # noqa: PLR0913 - a design has this many numbers
        cls,
        *,
        position: float,
        speed: float,
        current: float,
        inertia: float,
        resistance: float,
        inductance: float,
        speed_limit: float,
        integral: float | None = None,
        feedback: Literal["load", "motor"] = "load",
    ) -> "Cascade":
        """From loop bandwidths [rad/s], the inertia seen by the motor [kg m^2] and its winding.

        `integral` is the rate of the speed integrator [rad/s], a fifth of the speed bandwidth if not given.
        """
        return cls(
            position=P.for_bandwidth(position),
            speed=PI.for_inertia(
                inertia=inertia, bandwidth=speed, integral_bandwidth=speed / 5 if integral is None else integral
            ),
            current=PI.for_winding(resistance=resistance, inductance=inductance, bandwidth=current),
            speed_limit=speed_limit,
            feedback=feedback,
        )
