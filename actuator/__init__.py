"""One actuator: its parts, their composition, and every question that can be asked of it."""

from actuator.actuator import Actuator as Actuator
from actuator.continuation.bifurcations import Branch as Branch
from actuator.continuation.bisection import Bisection as Bisection
from actuator.continuation.bisection import bisect_by_simulation as bisect_by_simulation
from actuator.continuation.boundary import Boundary as Boundary
from actuator.continuation.boundary import Interval as Interval
from actuator.continuation.boundary import hunting_boundary as hunting_boundary
from actuator.continuation.continuation import continue_orbit as continue_orbit
from actuator.describing.check import DescribingCheck as DescribingCheck
from actuator.describing.check import check_describing_function as check_describing_function
from actuator.describing.describing import PredictedCycle as PredictedCycle
from actuator.describing.describing import StageResponse as StageResponse
from actuator.describing.describing import predict_cycles as predict_cycles
from actuator.describing.describing import stage_response as stage_response
from actuator.diagnosis.causes import find_causes as find_causes
from actuator.diagnosis.countermeasures import find_remedies as find_remedies
from actuator.diagnosis.cycle_energy import energy_per_cycle as energy_per_cycle
from actuator.linear.bode import envelope as envelope
from actuator.linear.loop import loop_transfer as loop_transfer
from actuator.linear.margins.crossings import Margins as Margins
from actuator.linear.margins.crossings import margins as margins
from actuator.linear.margins.disk import DiskMargin as DiskMargin
from actuator.linear.margins.disk import disk_margin as disk_margin
from actuator.linear.margins.lifted import LiftedMargins as LiftedMargins
from actuator.linear.margins.lifted import lifted_margins as lifted_margins
from actuator.linear.margins.sensitivity import complementary_sensitivity as complementary_sensitivity
from actuator.linear.margins.sensitivity import load_response as load_response
from actuator.linear.margins.sensitivity import sensitivity as sensitivity
from actuator.linear.model import linearize as linearize
from actuator.linear.modes import ModeModel as ModeModel
from actuator.linear.modes import ModeModels as ModeModels
from actuator.linear.modes import linearize_modes as linearize_modes
from actuator.linear.operating_point import NoEquilibrium as NoEquilibrium
from actuator.linear.operating_point import OperatingPoint as OperatingPoint
from actuator.linear.poles import Poles as Poles
from actuator.linear.poles import poles as poles
from actuator.linear.reduce_order import reduce_order as reduce_order
from actuator.linear.sampled import harmonic_response as harmonic_response
from actuator.linear.sampled import without_quantization as without_quantization
from actuator.linear.trim import trim as trim
from actuator.orbits.find import find_orbit as find_orbit
from actuator.orbits.flow import NoOrbit as NoOrbit
from actuator.orbits.orbit import Orbit as Orbit
from actuator.orbits.sampled import PeriodicOrbit as PeriodicOrbit
from actuator.orbits.sampled import SampledOrbit as SampledOrbit
from actuator.parts.bridge import Bridge as Bridge
from actuator.parts.current_source import CurrentSource as CurrentSource
from actuator.parts.dc_link import BrakingChopper as BrakingChopper
from actuator.parts.dc_link import DCLink as DCLink
from actuator.parts.dc_motor import DCMotor as DCMotor
from actuator.parts.derating import OverheatDerating as OverheatDerating
from actuator.parts.derating import UndervoltageDerating as UndervoltageDerating
from actuator.parts.inverter import Inverter as Inverter
from actuator.parts.linear_load import LinearLoad as LinearLoad
from actuator.parts.load import Gravity as Gravity
from actuator.parts.load import Load as Load
from actuator.parts.mechanisms import Lever as Lever
from actuator.parts.mechanisms import Rack as Rack
from actuator.parts.mechanisms import Screw as Screw
from actuator.parts.motor import Motor as Motor
from actuator.parts.noise import WhiteNoise as WhiteNoise
from actuator.parts.pmsm import PMSM as PMSM
from actuator.parts.rotor import Cogging as Cogging
from actuator.parts.rotor import Rotor as Rotor
from actuator.parts.rotor import RotorDrag as RotorDrag
from actuator.parts.saturation import Saturation as Saturation
from actuator.parts.sensors import AngleSensor as AngleSensor
from actuator.parts.sensors import CurrentSensor as CurrentSensor
from actuator.parts.sensors import Sensors as Sensors
from actuator.parts.temperature import MotorTemperature as MotorTemperature
from actuator.parts.temperature import TemperatureDependence as TemperatureDependence
from actuator.parts.thermal import ThermalNetwork as ThermalNetwork
from actuator.parts.thermal import ThermalNode as ThermalNode
from actuator.parts.thermal import ThermalPath as ThermalPath
from actuator.parts.torque_source import TorqueSource as TorqueSource
from actuator.parts.torque_speed import TorqueSpeedCurve as TorqueSpeedCurve
from actuator.parts.torque_speed import torque_speed_curve as torque_speed_curve
from actuator.response.bench.bench import Bench as Bench
from actuator.response.bench.free_play import BackDriving as BackDriving
from actuator.response.bench.free_play import FreePlay as FreePlay
from actuator.response.bench.free_play import back_driving as back_driving
from actuator.response.bench.free_play import free_play as free_play
from actuator.response.bench.long import hold_test as hold_test
from actuator.response.bench.long import rate_test as rate_test
from actuator.response.bench.long import soak_test as soak_test
from actuator.response.bench.slow import staircase_test as staircase_test
from actuator.response.bench.slow import triangle_test as triangle_test
from actuator.response.bench.steps import step_test as step_test
from actuator.response.frequency_response import FrequencyResponse as FrequencyResponse
from actuator.response.frequency_response import frequency_response as frequency_response
from actuator.response.frequency_response import temperature_sets as temperature_sets
from actuator.response.sine import SinePoint as SinePoint
from actuator.response.sine import SineResponse as SineResponse
from actuator.response.sine import SineStream as SineStream
from actuator.response.spectra import Record as Record
from actuator.response.spectra import Spectrum as Spectrum
from actuator.response.spectra import chirp_response as chirp_response
from actuator.response.spectra import multisine_response as multisine_response
from actuator.response.spectra import read_record as read_record
from actuator.response.stiffness import DynamicStiffness as DynamicStiffness
from actuator.response.stiffness import block_motor as block_motor
from actuator.response.stiffness import dynamic_stiffness as dynamic_stiffness
from actuator.response.stiffness import remove_drive as remove_drive
from actuator.simulation.failures import Chattering as Chattering
from actuator.simulation.failures import InconsistentModes as InconsistentModes
from actuator.simulation.failures import SimulationError as SimulationError
from actuator.simulation.run import ModeChange as ModeChange
from actuator.simulation.run import Run as Run
from actuator.simulation.signals import Chirp as Chirp
from actuator.simulation.signals import Constant as Constant
from actuator.simulation.signals import Gust as Gust
from actuator.simulation.signals import Ramp as Ramp
from actuator.simulation.signals import Sine as Sine
from actuator.simulation.signals import Staircase as Staircase
from actuator.simulation.signals import Step as Step
from actuator.simulation.signals import Sum as Sum
from actuator.simulation.signals import Table as Table
from actuator.simulation.simulate import simulate as simulate
from actuator.stiction.breakaway import BreakawayPrediction as BreakawayPrediction
from actuator.stiction.breakaway import NotAtRest as NotAtRest
from actuator.stiction.breakaway import predict_breakaway as predict_breakaway
from actuator.stiction.equilibrium_set import EquilibriumSet as EquilibriumSet
from actuator.stiction.equilibrium_set import find_equilibrium_set as find_equilibrium_set
from actuator.stiction.margins import HuntingMargin as HuntingMargin
from actuator.stiction.margins import hunting_margin as hunting_margin
from actuator.stiction.margins import hunting_margins as hunting_margins
from actuator.system.hybrid import HybridSystem as HybridSystem
from actuator.verdict.log import classify_log as classify_log
from actuator.verdict.verdict import Hunting as Hunting
from actuator.verdict.verdict import Verdict as Verdict
from actuator.verdict.verdict import classify as classify
from actuator.verdict.verdict import decide as decide
from gear.quantities import renamed as _renamed

FORMER: dict[str, str] = {  # until 0.3
    "DescribedHunting": "DescribingCheck",
    "Rest": "BreakawayPrediction",
    "RestSet": "EquilibriumSet",
    "Stretch": "Interval",
    "described_hunting": "check_describing_function",
    "follow": "continue_orbit",
    "gear_stage": "stage_response",
    "locked": "block_motor",
    "unpowered": "remove_drive",
    "mode_models": "linearize_modes",
    "predicted_cycles": "predict_cycles",
    "reduced": "reduce_order",
    "rest": "predict_breakaway",
    "rest_set": "find_equilibrium_set",
    "OverheatFoldBack": "OverheatDerating",
    "UndervoltageFoldBack": "UndervoltageDerating",
    "without_counts": "without_quantization",
}
__getattr__ = _renamed(__name__, FORMER)
__version__ = "0.2.0"
