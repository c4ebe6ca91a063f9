"""The mechanics between motor and load: laws, meshes, bearings, transmissions."""

from gear.couplings.coupling import Coupling as Coupling
from gear.couplings.end_stop import EndStop as EndStop
from gear.elasticity.backlash import Backlash as Backlash
from gear.elasticity.backlash import BacklashAsPrinted as BacklashAsPrinted
from gear.elasticity.curves import elasticity_curves as elasticity_curves
from gear.elasticity.law import ElasticityLaw as ElasticityLaw
from gear.elasticity.linear import Linear as Linear
from gear.elasticity.periodic import PeriodicStiffness as PeriodicStiffness
from gear.elasticity.progressive import ProgressiveISO as ProgressiveISO
from gear.elasticity.progressive import ProgressiveNiemann as ProgressiveNiemann
from gear.elasticity.tooth_faults import ToothFault as ToothFault
from gear.elasticity.tooth_faults import ToothFaults as ToothFaults
from gear.elasticity.transmission_error import ErrorHarmonic as ErrorHarmonic
from gear.elasticity.transmission_error import TransmissionError as TransmissionError
from gear.friction.at_viscosity import AtViscosity as AtViscosity
from gear.friction.coulomb import Coulomb as Coulomb
from gear.friction.din3990 import Din3990 as Din3990
from gear.friction.law import FrictionLaw as FrictionLaw
from gear.friction.lugre import LuGre as LuGre
from gear.friction.over_speed import FrictionPoint as FrictionPoint
from gear.friction.over_speed import FrictionTable as FrictionTable
from gear.friction.over_speed import Stribeck as Stribeck
from gear.friction.periodic import PeriodicFriction as PeriodicFriction
from gear.friction.tabulated_efficiency import EfficiencyPoint as EfficiencyPoint
from gear.friction.tabulated_efficiency import TabulatedEfficiency as TabulatedEfficiency
from gear.harmonics import Harmonic as Harmonic
from gear.lubrication.drag import Palmgren as Palmgren
from gear.lubrication.drag import Thickening as Thickening
from gear.lubrication.lubricant import GivenViscosity as GivenViscosity
from gear.lubrication.lubricant import KnownOil as KnownOil
from gear.lubrication.lubricant import OilAt as OilAt
from gear.lubrication.lubricant import at_temperature as at_temperature
from gear.lubrication.oil import Oil as Oil
from gear.lubrication.viscosity import Vogel as Vogel
from gear.lubrication.viscosity import Walther as Walther
from gear.mesh import BearingForce as BearingForce
from gear.mesh import Mesh as Mesh
from gear.quantities import renamed as _renamed
from gear.shafts.bearing import Bearing as Bearing
from gear.shafts.brake import Brake as Brake
from gear.shafts.brake import add_brake as add_brake
from gear.shafts.law import Shaft as Shaft
from gear.shafts.lugre_bearing import LuGreBearing as LuGreBearing
from gear.teeth.engagement import Engagement as Engagement
from gear.teeth.geometry import ExternalPair as ExternalPair
from gear.teeth.geometry import GivenPair as GivenPair
from gear.teeth.internal import InternalPair as InternalPair
from gear.teeth.screw import ScrewPair as ScrewPair
from gear.transmission import Transmission as Transmission

FORMER = {"jam": "add_brake", "FrictionLaws": "FrictionLaw", "ElasticityLaws": "ElasticityLaw"}  # until 0.3
__getattr__ = _renamed(__name__, FORMER)
