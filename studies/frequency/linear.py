"""The linear models of an actuator for a report: per contact mode loops, margins, poles and closed-loop responses."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import control

from actuator import (
    Actuator,
    LiftedMargins,
    Margins,
    ModeModels,
    Poles,
    lifted_margins,
    linearize_modes,
    margins,
    poles,
)
from actuator.linear.margins.sensitivity import Peak, Sensitivities, peak_of, sensitivities
from gear.quantities.roles import LoopSignal
from studies.frequency.plan import Place

OUTPUT = "load_angle"
LOAD = "load_torque"


@dataclass(frozen=True, kw_only=True)
class LinearPart:
    """The linear models in every reachable mode.

    Attributes
    ----------
    models : ModeModels
        At the operating point.
    closed, compliance : mapping of str to StateSpace
        Load angle over reference and over load torque, all loops closed, by mode.
    loops : mapping of str to mapping of str to StateSpace
        By the signal at which the loop is opened, then by mode.
    margins : mapping of str to mapping of str to Margins or LiftedMargins
        Of these loops.
    sensitivities : mapping of str to mapping of str to Sensitivities or None
        Likewise; None where the loop gain is zero.
    compliance_peaks : mapping of str to Peak
        Largest compliance by mode [rad/(N m)].
    poles : mapping of str to Poles
        By mode.
    missing : mapping of str to str
        Loops that cannot be opened, and why.
    """

    models: ModeModels
    closed: Mapping[str, control.StateSpace] = field(repr=False)
    compliance: Mapping[str, control.StateSpace] = field(repr=False)
    loops: Mapping[str, Mapping[str, control.StateSpace]] = field(repr=False)
    margins: Mapping[str, Mapping[str, Margins | LiftedMargins]]
    sensitivities: Mapping[str, Mapping[str, Sensitivities | None]] = field(repr=False)
    compliance_peaks: Mapping[str, Peak]
    poles: Mapping[str, Poles]
    missing: Mapping[str, str]


def linearize_case(actuator: Actuator, inputs: Mapping[str, float]) -> LinearPart:
    """Linearize in every mode at an operating point.

    Raises
    ------
    NoEquilibrium
        Where no mode can be reached.
    """
    models = linearize_modes(actuator, inputs=inputs)
    loops: dict[str, Mapping[str, control.StateSpace]] = {}
    missing: dict[str, str] = {}
    for quantity in models.models[0].point.system.inputs:
        if role := quantity.role(LoopSignal):
            try:
                loops[role.signal] = models.loops(role.signal)
            except ValueError as error:  # a signal that is not held between the ticks of its clock
                missing[role.signal] = str(error)
    compliance = models.responses(LOAD, OUTPUT)
    return LinearPart(
        models=models,
        closed=models.responses("reference", OUTPUT),
        compliance=compliance,
        loops=loops,
        margins={at: {mode: _margins(loop) for mode, loop in opened.items()} for at, opened in loops.items()},
        sensitivities={
            at: {mode: sensitivities(loop) for mode, loop in opened.items()} for at, opened in loops.items()
        },
        compliance_peaks={mode: peak_of(model) for mode, model in compliance.items()},
        poles={model.name: poles(model.point, drifting=model.drifting) for model in models},
        missing=missing,
    )


def _margins(loop: control.StateSpace) -> Margins | LiftedMargins:
    return margins(loop) if loop.ninputs == 1 else lifted_margins(loop)


def closed_loop_at(
    actuator: Actuator, inputs: Mapping[str, float], sets: Mapping[str, Mapping[str, float]], place: Place
) -> dict[str, control.StateSpace]:
    """Load angle over reference by mode, all loops closed, in a corner with a bias load.

    Raises
    ------
    NoEquilibrium
        Where no mode can be reached.
    """
    biased = {**inputs, LOAD: inputs.get(LOAD, 0.0) + place.bias}
    return linearize_modes(actuator, inputs=biased, parameters=sets[place.corner]).responses("reference", OUTPUT)
