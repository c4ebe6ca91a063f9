"""The gear paper's results from the gear model: figures 7, 9, 12, 13 and the cold gearbox.

F. L. J. van der Linden, "Modeling of geared positioning systems: an object oriented gear contact model with
validation". Its figures 7 (elasticity laws), 9 (stick-slip under preload), 12 and 13 (deformation, stiffness
and friction torque on the test rig, four quadrants), and its sentence on gears at -55 degC as a worked
example. Numbers printed in the paper are compared; for curves that it only draws the report says so.
"""

from collections.abc import Callable, MutableMapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import brentq

from actuator import Run, simulate
from actuator.plots.runs import plot_run
from gear import (
    Backlash,
    Bearing,
    Din3990,
    ExternalPair,
    GivenViscosity,
    Linear,
    Mesh,
    ProgressiveISO,
    ProgressiveNiemann,
    Shaft,
    TabulatedEfficiency,
    Transmission,
    elasticity_curves,
)
from gear.balance import balance
from gear.breakout import breakout
from gear.efficiency import efficiency
from gear.elasticity.law import AT_REST
from gear.friction.tabulated_efficiency import EfficiencyPoint
from gear.motion import Sliding
from studies.cache import Steps
from studies.checks.paper import figure_9, figure_9_inputs, figure_9_start
from studies.checks.pictures import RigCurve, plot_deformation, plot_elasticities, plot_friction
from studies.findings import Findings, png

PAIR = ExternalPair(teeth_a=20, teeth_b=60, module=1e-3)
FACE_WIDTH = 0.01  # m; the paper gives none
EFFECTIVE = 0.28  # of the face width, fitted in the paper
RIG = {  # the paper's Tables 3 and 4 and text
    "stiffness per width": 20e9,  # N/m per m: 20 N/um per mm
    "gap": 15e-6,  # m
    "roughness": 0.8e-6,  # m
    "viscosity": 320e-6 * 860,  # Pa s: 320 mm^2/s times the density
    "static": 0.2,
    "bearing": 0.05,  # N m, seals and bearings together
    "speed": 10.0,  # rad/s on wheel A
    "train stiffness": 2e7,  # N/m at the contact; the paper subtracts one and does not print it
}
CONTACT = RIG["stiffness per width"] * EFFECTIVE * FACE_WIDTH  # N/m
ROUGH = 5e-6  # m; where the ISO law becomes linear, for the picture
DEFLECTIONS = np.linspace(-20e-6, 20e-6, 401)
LOADS = np.concatenate([np.linspace(-12.0, -0.2, 60), np.linspace(0.2, 12.0, 60)])  # N m on wheel B
FLANKS = (slice(0, 60), slice(60, None))  # of LOADS


@dataclass(frozen=True, kw_only=True)
class Figures:
    """Pictures (PNG) by file name, numbers, and sentences on the comparison."""

    pictures: dict[str, bytes]
    result: dict[str, Any]
    text: list[str]


def run_gear_paper(progress: Callable[[float], None], cache: MutableMapping | None = None) -> Findings:
    """All figures; `progress` is called with the share that is done."""
    steps, found = Steps(cache), []
    parts = (figure_7, figure_9_with_din, figures_12_and_13, cold_gearbox)
    for k, part in enumerate(parts):
        found.append(steps.compute(part.__name__.replace("_", " "), Figures, part))
        progress((k + 1) / len(parts))
    return Findings(
        pictures={name: figure for each in found for name, figure in each.pictures.items()},
        result={name: value for each in found for name, value in each.result.items()},
        text=[sentence for each in found for sentence in each.text],
    )


def figure_7() -> Figures:
    """Force and stiffness over deflection for every elasticity law, with and without backlash."""
    springs = {
        "linear": Linear(stiffness=CONTACT, damping=0.0),
        "ISO 6336-1": ProgressiveISO(stiffness=CONTACT, roughness=ROUGH, damping=0.0),
        "Niemann & Winter": niemann(),
    }
    gaps = {f"{name}, backlash": Backlash(gap=RIG["gap"], law=spring) for name, spring in springs.items()}
    data = elasticity_curves({**springs, **gaps}, DEFLECTIONS)
    result = {str(law): float(data["force"].sel(law=law)[-1]) for law in data.law.values}
    text = ["Figure 7: the laws are plotted over the same axes; the paper prints no numbers for its curves."]
    return Figures(
        pictures={"figure_7": png(plot_elasticities(data, list(springs)))},
        result={"figure_7_force_at_20_um_N": result},
        text=text,
    )


def niemann() -> ProgressiveNiemann:
    """The paper's progressive teeth, constant in stiffness above 100 N per mm of effective width."""
    return ProgressiveNiemann(stiffness=CONTACT, nominal_force=1e5 * EFFECTIVE * FACE_WIDTH, damping=0.0)


def din() -> Din3990:
    """The paper's friction: DIN 3990-4 with its oil, roughness and effective width."""
    return Din3990(
        static=RIG["static"],
        lubricant=GivenViscosity(viscosity=RIG["viscosity"]),
        roughness=RIG["roughness"],
        face_width=FACE_WIDTH,
        effective_width=EFFECTIVE,
    )


def figure_9_with_din() -> Figures:
    """Stick-slip of the preloaded gear with the paper's friction law, both lever arms."""
    pictures, result = {}, {}
    for arms in ("printed", "geometric"):
        plain = figure_9(arms)
        mesh = replace(plain.gear.meshes["mesh"], friction=din())
        plant = replace(plain, gear=replace(plain.gear, meshes={"mesh": mesh}), name=f"figure 9, DIN 3990-4, {arms}")
        run = simulate(plant, 10.0, inputs=figure_9_inputs(), start=figure_9_start(plant))
        pictures[f"figure_9_{arms}"] = png(plot_run(run, ["motor_angle", "load_angle", "gear.meshes.mesh.slip_speed"]))
        result[arms] = _stick_slip(run)
    plain = simulate(figure_9("printed"), 10.0, inputs=figure_9_inputs(), start=figure_9_start(figure_9("printed")))
    pictures["figure_9_coulomb"] = png(plot_run(plain, ["motor_angle", "load_angle"]))
    result["coulomb, printed"] = _stick_slip(plain)
    text = [
        "Figure 9: the paper prints no times or angles, and neither the load spring nor the face width that its "
        f"friction law needs; 1000 N m/rad and {1e3 * FACE_WIDTH:g} mm are assumed. With Coulomb friction and the "
        f"printed lever arms the gear slips {result['coulomb, printed']['slips']} times and is stuck for "
        f"{result['coulomb, printed']['stuck_share']:.0%} of the time, qualitatively as in the figure.",
        "With DIN 3990-4 capped by the static coefficient at all speeds (without the cap friction would rise at "
        f"breakaway) it breaks away {result['printed']['slips']} and {result['geometric']['slips']} times with printed "
        f"and geometric lever arms and is stuck for {result['printed']['stuck_share']:.0%} and "
        f"{result['geometric']['stuck_share']:.0%} of the time: while the slip is slow, friction does not drop with "
        "speed, so nothing stops the motion again.",
        f"Computing time for these 10 s: 0.19 s in the paper, {result['coulomb, printed']['wall_s']:.3f} s "
        f"({'compiled' if plain.statistics.compiled else 'interpreted'}) here.",
    ]
    return Figures(pictures=pictures, result={"figure_9": result}, text=text)


def _stick_slip(run: Run) -> dict[str, Any]:
    slips = [change.time for change in run.changes if change.before == "stuck"]
    return {
        "mode_changes": len(run.changes),
        "slips": len(slips),
        "first_slip_s": slips[0] if slips else None,
        "load_angle_at_end_rad": float(run["load_angle"][-1]),
        "stuck_share": float(np.mean(run.modes["gear.meshes.mesh"] == "stuck")),
        "wall_s": run.statistics.wall_s,
        "compiled": run.statistics.compiled,
    }


def rig() -> Transmission:
    """The test rig's gear with lumped bearing and seal friction on wheel A."""
    teeth = Backlash(gap=RIG["gap"], law=niemann())
    mesh = Mesh(a="wheel_a", b="wheel_b", pair=PAIR, elasticity=teeth, friction=din())
    return Transmission(
        shafts={"wheel_a": Shaft(inertia=5e-4), "wheel_b": Shaft(inertia=1e-3)},
        meshes={"mesh": mesh},
        bearings={"seals": Bearing(shaft="wheel_a", coulomb=RIG["bearing"], breakaway=RIG["bearing"])},
        input="wheel_a",
        output="wheel_b",
    )


def figures_12_and_13() -> Figures:
    """Deformation, stiffness and friction torque over load, at +-10 rad/s on wheel A."""
    gear = rig()
    law, ratio = gear.meshes["mesh"].law(), gear.ratio()
    result: dict[str, Any] = {"no_load_friction_Nm": {}, "friction_at_12_Nm": {}}
    curves: dict[str, list[RigCurve]] = {}
    for sign in (1, -1):
        points = [balance(gear, output_torque=t, output_speed=sign * RIG["speed"] / ratio) for t in LOADS]
        normal = np.array([point.normal["mesh"] for point in points])
        friction = np.array([point.input_torque + point.output_torque / ratio for point in points])
        deflection = np.array([_deflection(law, force) for force in normal])
        train = deflection + normal / RIG["train stiffness"]
        label = f"{sign * RIG['speed']:+g} rad/s"
        curves[label] = [RigCurve(normal[side], friction[side], deflection[side], train[side]) for side in FLANKS]
        result["friction_at_12_Nm"][label] = {f"{LOADS[k]:+g} N m on B": float(friction[k]) for k in (0, -1)}
        result["no_load_friction_Nm"][label] = float(friction[np.abs(LOADS).argmin()])
    text = [
        "Figures 12 and 13: the paper prints the errors of its simulation against its measurement (at most 10 um and "
        "0.09 N m, on average 3.4 um and 0.023 N m) but no values of the curves, so only the no-load friction can be "
        "compared: "
        f"{abs(next(iter(result['no_load_friction_Nm'].values()))):.3f} N m here near zero load, 0.05 N m in "
        "the paper (its text also says 0.5 N m, a misprint).",
        "The face width and the train stiffness are not printed; 10 mm and 20 N/um are assumed.",
    ]
    pictures = {"figure_12": png(plot_deformation(curves)), "figure_13": png(plot_friction(curves))}
    return Figures(pictures=pictures, result={"figures_12_13": result}, text=text)


def _deflection(law: Any, force: float) -> float:
    """Deflection [m] at which an elasticity law gives a force [N]."""
    flank = 1.0 if force >= 0 else -1.0
    start = RIG["gap"] / 2
    x = brentq(
        lambda d: float(law.force(AT_REST._replace(deflection=flank * d), flank)) - force,
        start,
        start + 1e-3,
        xtol=1e-15,
    )
    return flank * float(x)  # pyright: ignore[reportArgumentType]


def cold_gearbox() -> Figures:
    """The aerospace sentence: 85 % efficiency and breakout at half the stall load, at -55 degC."""
    stall, speed = 60.0, 1.0  # N m and rad/s at wheel B
    law = TabulatedEfficiency(points=(EfficiencyPoint(speed=0.0, a_drives=0.85, b_drives=0.85),), breakout=1.0)
    mesh = Mesh(a="wheel_a", b="wheel_b", pair=PAIR, elasticity=Linear(stiffness=CONTACT, damping=1e3), friction=law)
    bare = Transmission(
        shafts={"wheel_a": Shaft(inertia=5e-4), "wheel_b": Shaft(inertia=1e-3)},
        meshes={"mesh": mesh},
        input="wheel_a",
        output="wheel_b",
    )
    # the seals hold the torque that half the stall load, back-driving the gear, gives on wheel A
    seals = abs(balance(bare, output_torque=stall / 2, output_speed=speed, friction="static").input_torque)
    cold = replace(bare, bearings={"seals": Bearing(shaft="wheel_a", coulomb=0.0, breakaway=seals)})
    start = breakout(cold, torque=1e-6)
    result = {
        "efficiency_forward": efficiency(bare, torque=stall, speed=speed),
        "efficiency_backward": efficiency(bare, torque=stall, speed=speed, driving="output"),
        "coefficient_of_friction": float(
            law.breakaway(Sliding(speed=0.0, force=0.0, a_drives=1.0, position=0.0, pair=PAIR))
        ),
        "breakout_torque_at_output_Nm": start.output_torque,
        "breakout_over_stall": start.output_torque / stall,
    }
    text = [
        f"Gears at -55 degC: an efficiency of 85 % in this one mesh requires a coefficient of friction of "
        f"{result['coefficient_of_friction']:.2f}, which stands for a whole cold gearbox with seals and bearings. With "
        f"seals that break away at {seals:.3g} N m on wheel A the gear can be back-driven from "
        f"{100 * result['breakout_over_stall']:.0f} % of the stall load."
    ]
    return Figures(pictures={}, result={"cold_gearbox": result}, text=text)
