"""Shafts and what brakes them beside the meshes: bearings with stiction, brakes, drag."""

from gear.shafts.bearing import Bearing as Bearing
from gear.shafts.brake import Brake as Brake
from gear.shafts.brake import add_brake as add_brake
from gear.shafts.drag import Drag as Drag
from gear.shafts.law import Shaft as Shaft
from gear.shafts.law import ShaftBearing as ShaftBearing
from gear.shafts.law import ShaftDrag as ShaftDrag
from gear.shafts.lugre_bearing import LuGreBearing as LuGreBearing
