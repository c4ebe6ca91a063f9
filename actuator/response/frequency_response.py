"""Nonlinear frequency response: sines of several amplitudes, each settled before it is measured."""

import hashlib
import itertools
import math
from collections.abc import Callable, Mapping, MutableMapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import control
import numpy as np
import xarray

from actuator.actuator import Actuator
from actuator.engine.model import model
from actuator.response.sine import SinePoint, SineResponse, SineStream
from actuator.simulation.many import run_many
from actuator.system.hybrid import HybridSystem
from gear.lubrication.lubricant import at_temperature
from gear.quantities.roles import NodeTemperature, OilTemperature

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from actuator.response.spectra import Spectrum

DIMENSIONS = ("set", "load", "amplitude", "frequency")
SAME = 1e-6  # relative difference of two numbers on an axis that are one


@dataclass(frozen=True, kw_only=True)
class FrequencyResponse:
    """The amplitude family of an actuator.

    Attributes
    ----------
    data : xarray.Dataset
        Over set, load [N m], amplitude, frequency [Hz] and output: `response` (complex, the fundamental of the output
        over the sine), `harmonics` (complex, of the output), `distortion` (the harmonics that are kept over the
        fundamental, of what moves; nan where only that is kept), `mean`, `peak_to_peak`; without output: `settled`,
        `moves`, `slides`, `stuck`, `periods`, `note`.
    given : str
        The input of the sine.
    """

    data: xarray.Dataset = field(repr=False)
    given: str

    def select(self, variable: str = "response", **where: Any) -> xarray.DataArray:
        """A variable at one place of the dimensions that are named; of sets, loads and outputs else the first.

        Raises
        ------
        KeyError
            For a place that there is not.
        """
        array = self.data[variable]
        for name, value in where.items():
            array = array.isel({name: _place(array[name], value)})
        rest = [name for name in array.dims if name in ("set", "load", "output") and name not in where]
        return array.isel(dict.fromkeys(rest, 0))

    def frd(self, amplitude: float, **where: Any) -> control.FrequencyResponseData:
        """The response at one amplitude as python-control has it, over rad/s; `where` names set, load and output."""
        response = self.select(amplitude=amplitude, **where)
        output = str(where.get("output", self.data.output.values[0]))
        return control.FrequencyResponseData(
            response.values,
            2 * np.pi * self.data.frequency.values,
            inputs=[self.given.replace(".", "_")],
            outputs=[output.replace(".", "_")],
        )

    @property
    def notes(self) -> list[str]:
        """What is not as it should be, with its point, in words."""
        note = self.data.note
        found = []
        for index in np.argwhere(note.values != ""):
            place = note[dict(zip(DIMENSIONS, index.tolist(), strict=True))]
            where = ", ".join(f"{name} {place[name].item()}" for name in DIMENSIONS if place[name].item() != "")
            found.append(f"{where}: {place.item()}")
        return found

    def plot(
        self,
        linear: Mapping[str, control.StateSpace] | None = None,
        overlay: Sequence["Spectrum"] = (),
        **where: Any,
    ) -> "Figure":
        """Bode plot of every amplitude, what does not settle open, in front of the envelope of linear models.

        `overlay` holds measured spectra, `where` places on the dimensions set, load and output.
        """
        from actuator.plots.response import plot_responses

        return plot_responses(self, linear, overlay, **where)

    def plot_harmonics(self, **where: Any) -> "Figure":
        """Harmonics over the fundamental, a line per amplitude; `where` as for `plot`."""
        from actuator.plots.response import plot_harmonics

        return plot_harmonics(self, **where)


def frequency_response(  # noqa: PLR0913 - an experiment has this many choices, all but three with defaults
    plant: Actuator | HybridSystem,
    *,
    amplitudes: Sequence[float],
    frequencies: Sequence[float] | np.ndarray,
    given: str = "reference",
    seen: Sequence[str] = ("load_angle",),
    inputs: Mapping[str, float] | None = None,
    loads: Sequence[float] = (0.0,),
    sets: Mapping[str, Mapping[str, float]] | None = None,
    harmonics: int = 7,
    agreement: float = 5e-4,
    tolerance: float = 1e-6,
    compiled: bool | None = None,
    workers: int | None = None,
    done: MutableMapping[str, dict[str, Any]] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> FrequencyResponse:
    """Response to sines of every amplitude and frequency, with every bias load and set of parameters.

    Each sine runs until two measurements in a row agree: one period each, or as many as last one time constant. A
    response may also repeat after two or three of them (subharmonics). What does not settle is measured all the same,
    and says so in `note`.

    Parameters
    ----------
    plant : Actuator or HybridSystem
        What is measured; one compiled model serves all points.
    amplitudes : sequence of float
        In the unit of the input.
    frequencies : sequence of float
        [Hz].
    given : str
        The input of the sine.
    seen : sequence of str
        Outputs.
    inputs : mapping of str to float
        The other inputs, constant; on the input of the sine, its mean.
    loads : sequence of float
        Bias loads on the input `load_torque` [N m], on top of what `inputs` has there.
    sets : mapping of str to mapping of str to float
        Sets of parameters by name, such as `temperature_sets` makes; None for the defaults.
    harmonics : int
        How many are kept, with the fundamental.
    agreement : float
        Relative difference of two measurements in a row that is none.
    tolerance : float
        Local error of each state over its nominal size.
    compiled : bool or None
        As for `simulate`.
    workers, done, progress
        As for `run_many`: processes, finished points by key, and what is told how many are finished.

    Returns
    -------
    FrequencyResponse

    Raises
    ------
    ValueError
        For an amplitude or frequency that is not positive, or without any.
    KeyError
        Unknown input, output or parameter.
    """
    for name, values in (("amplitudes", amplitudes), ("frequencies", frequencies)):
        if not len(values) or not all(value > 0 for value in values):
            raise ValueError(f"frequency_response: {name} must be > 0, and at least one, got {list(values)}")
    sets = {"": {}} if sets is None else sets
    stream = SineStream(
        plant=plant,
        given=given,
        seen=tuple(seen),
        harmonics=harmonics,
        agreement=agreement,
        tolerance=tolerance,
        compiled=compiled,
    )
    for changes in sets.values():
        stream.system.parameter_values(changes)
    model(stream.system)  # compiled once, before there are processes
    base = dict(inputs or {})
    points: dict[tuple, SinePoint] = {}
    # the slowest first, so that no core is left with them
    for frequency, amplitude, load, name in itertools.product(sorted(frequencies), amplitudes, loads, sets):
        biased = base | ({"load_torque": base.get("load_torque", 0.0) + load} if load else {})
        points[name, load, amplitude, frequency] = SinePoint(
            amplitude=float(amplitude), frequency=float(frequency), inputs=biased, parameters=dict(sets[name])
        )
    keys = {place: point_key(stream, point) for place, point in points.items()}
    results = run_many(
        _Measurement(stream),
        {keys[place]: point for place, point in points.items()},
        done=done,
        workers=workers,
        progress=progress,
    )
    found = {place: SineResponse(**results[key]) for place, key in keys.items()}
    coordinates = (list(sets), list(loads), list(amplitudes), list(frequencies))
    return FrequencyResponse(data=_dataset(stream, found, coordinates), given=given)


def _place(axis: xarray.DataArray, value: Any) -> int:
    """Where a value stands on an axis."""
    known = axis.values.tolist()
    for k, one in enumerate(known):
        if one == value or (not isinstance(value, str) and math.isclose(one, value, rel_tol=SAME)):
            return k
    raise KeyError(f"no {axis.name} {value!r}; there are {', '.join(map(repr, known))}")


class _Measurement:
    """The work of `run_many`."""

    def __init__(self, stream: SineStream) -> None:
        self.stream = stream

    def __call__(self, point: SinePoint) -> dict[str, Any]:
        return self.stream.measure(point).as_dict()


def point_key(stream: SineStream, point: SinePoint) -> str:
    """A name for a point and all that its result depends on: the model, its numbers, the sine, the analysis."""
    system = stream.system
    p, u = system.parameter_values(point.parameters), system.input_vector(point.inputs)
    names = [quantity.name for quantity in (*system.states, *system.inputs, *system.outputs)]
    settings = (stream.given, tuple(stream.seen), stream.harmonics, stream.agreement, stream.tolerance)
    parts = (names, [parameter.name for parameter in system.parameters], p.tolist(), u.tolist(), settings)
    digest = hashlib.sha256(repr((parts, stream.model)).encode()).hexdigest()[:16]
    return f"{point.amplitude:.12g} at {point.frequency:.12g} Hz, {digest}"


def _dataset(
    stream: SineStream, found: Mapping[tuple, SineResponse], coordinates: tuple[list, list, list, list]
) -> xarray.Dataset:
    """All responses on their axes."""
    shape = tuple(len(values) for values in coordinates)
    outputs, harmonics = len(stream.seen), stream.harmonics
    places = [found[place] for place in itertools.product(*coordinates)]
    amplitudes = np.array([place.amplitudes for place in places]).reshape(*shape, outputs, harmonics + 1)
    units = {quantity.name: quantity.unit for quantity in (*stream.system.inputs, *stream.system.outputs)}
    sizes = np.array(coordinates[2], float)[:, None, None]
    full = (*DIMENSIONS, "output")
    seen_unit = units[stream.seen[0]]

    def table(name: str) -> np.ndarray:
        return np.array([getattr(place, name) for place in places]).reshape(shape)

    heights = abs(amplitudes[..., 1:])
    told = table("moves") & (harmonics > 1)
    with np.errstate(divide="ignore", invalid="ignore"):
        distortion = np.linalg.norm(heights[..., 1:], axis=-1) / heights[..., 0]
    return xarray.Dataset(
        {
            "response": (full, amplitudes[..., 1] / sizes, {"units": f"({seen_unit})/({units[stream.given]})"}),
            "mean": (full, np.real(amplitudes[..., 0]), {"units": seen_unit}),
            "harmonics": ((*full, "harmonic"), amplitudes[..., 1:], {"units": seen_unit}),
            "distortion": (full, np.where(told[..., None], distortion, np.nan), {"units": "-"}),
            "peak_to_peak": (
                full,
                np.array([place.peak_to_peak for place in places]).reshape(*shape, outputs),
                {"units": seen_unit},
            ),
            **{name: (DIMENSIONS, table(name)) for name in ("settled", "moves", "slides", "periods", "note")},
            "stuck": (DIMENSIONS, table("stuck"), {"units": "-"}),
        },
        coords={
            "set": coordinates[0],
            "load": ("load", coordinates[1], {"units": "N m"}),
            "amplitude": ("amplitude", coordinates[2], {"units": units[stream.given]}),
            "frequency": ("frequency", coordinates[3], {"units": "Hz"}),
            "output": list(stream.seen),
            "unit": ("output", [units[name] for name in stream.seen]),
            "harmonic": np.arange(1, harmonics + 1),
        },
        attrs={"system": stream.system.name, "given": stream.given},
    )


def temperature_sets(actuator: Actuator, temperatures: Sequence[float]) -> dict[str, dict[str, float]]:
    """Sets of parameters with every oil of the gear and every thermal node at each temperature [K], named in degC.

    Raises
    ------
    ValueError
        Where nothing depends on the temperature, or it is out of the range of an oil.
    """
    system = actuator.system()
    before = {parameter.name: parameter.default for parameter in system.parameters}
    oils = system.parameters_having(OilTemperature)
    nodes = [parameter.name for parameter in system.parameters_having(NodeTemperature)]
    found = {}
    for temperature in temperatures:
        changes = dict.fromkeys(nodes, float(temperature))
        if oils or not nodes:  # without either, this says so
            soaked = replace(actuator, gear=at_temperature(actuator.gear, temperature)).system().parameters
            changes |= {p.name: p.default for p in soaked if p.default != before[p.name]}
        found[f"{temperature - 273.15:g} degC"] = changes
    return found
