"""Elasticity of the teeth: what a mesh asks of it, and the laws that answer."""

from gear.elasticity.backlash import Backlash, BacklashAsPrinted, Teeth
from gear.elasticity.law import DEFLECTION_NOMINAL, ElasticityLaw, Gapless, ToothSpring, as_law, has_gap
from gear.elasticity.linear import Linear
from gear.elasticity.periodic import PeriodicStiffness
from gear.elasticity.progressive import ProgressiveISO, ProgressiveNiemann
from gear.elasticity.tooth_faults import ToothFaults
from gear.elasticity.transmission_error import TransmissionError

__all__ = [
    "DEFLECTION_NOMINAL",
    "Backlash",
    "BacklashAsPrinted",
    "ElasticityLaw",
    "ElasticityLaws",
    "Gapless",
    "Linear",
    "PeriodicStiffness",
    "ProgressiveISO",
    "ProgressiveNiemann",
    "ToothFaults",
    "ToothSpring",
    "TransmissionError",
    "as_law",
    "has_gap",
]

# every law by its type, for files: its members are told apart by their names
ElasticityLaws = Teeth | Backlash | BacklashAsPrinted | PeriodicStiffness | ToothFaults | TransmissionError
