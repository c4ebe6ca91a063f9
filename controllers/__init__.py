"""Control laws and their design rules: pure, no plant inside."""

from controllers.cascade import Cascade as Cascade
from controllers.cascade import Remedies as Remedies
from controllers.compensation import Dither as Dither
from controllers.compensation import FrictionCompensation as FrictionCompensation
from controllers.compensation import Knocker as Knocker
from controllers.controller import Controller as Controller
from controllers.current_reference import CurrentReference as CurrentReference
from controllers.feedforward import FeedForward as FeedForward
from controllers.filters import LeadLag as LeadLag
from controllers.filters import LowPass as LowPass
from controllers.filters import Notch as Notch
from controllers.filters import SecondOrderLowPass as SecondOrderLowPass
from controllers.integral import IntegralRemedies as IntegralRemedies
from controllers.memory import LawWithMemory as LawWithMemory
from controllers.memory import Memory as Memory
from controllers.observer import DisturbanceObserver as DisturbanceObserver
from controllers.observer import FilteredDerivative as FilteredDerivative
from controllers.observer import PositionObserver as PositionObserver
from controllers.pid import PI as PI
from controllers.pid import PID as PID
from controllers.pid import P as P
from controllers.reference import Motion as Motion
from controllers.reference import RateAndAccelerationLimit as RateAndAccelerationLimit
from controllers.reference import RateLimit as RateLimit
from controllers.sampling import LoopPeriod as LoopPeriod
from controllers.sampling import Sampling as Sampling
from controllers.scheduling import ScheduledGain as ScheduledGain
from controllers.shapes import dead_zone as dead_zone
from controllers.shapes import direction as direction
from controllers.shapes import saturate as saturate
from controllers.state_feedback import StateFeedback as StateFeedback
from gear.quantities import renamed as _renamed

FORMER: dict[str, str] = {"limited": "saturate"}  # until 0.3
__getattr__ = _renamed(__name__, FORMER)
