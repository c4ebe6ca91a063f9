"""The mechanics between motor and load: laws, meshes, bearings, transmissions."""

from gear.elasticity import Backlash as Backlash
from gear.elasticity import Linear as Linear
from gear.friction import Coulomb as Coulomb
from gear.geometry import ExternalPair as ExternalPair
from gear.geometry import GivenPair as GivenPair
from gear.mesh import BearingForce as BearingForce
from gear.mesh import Mesh as Mesh
from gear.shafts import Bearing as Bearing
from gear.shafts import Coupling as Coupling
from gear.shafts import Shaft as Shaft
from gear.transmission import Transmission as Transmission
