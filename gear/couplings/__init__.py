"""Couplings between shafts or to the housing, and end stops."""

from gear.couplings.coupling import Coupling as Coupling
from gear.couplings.end_stop import EndStop as EndStop
from gear.couplings.law import TWIST_NOMINAL as TWIST_NOMINAL
from gear.couplings.law import ShaftCoupling as ShaftCoupling
from gear.couplings.law import ShaftSpring as ShaftSpring
from gear.couplings.law import ShaftStop as ShaftStop
from gear.couplings.law import Twist as Twist
