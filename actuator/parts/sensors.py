"""Sensors of angle and current, read once a tick; what they keep between ticks is handed in and out.

A sensor's memory is a list in the order of `memory()`: first the state of its noise, then the readings under
way, the oldest first. In one tick, `read` says what the controller gets and `advance` what to keep, both of the
memory and the true value at the tick.
"""

import math
from dataclasses import dataclass, field, fields, replace
from typing import Annotated, Any

import casadi as ca
from annotated_types import Ge, Gt, Unit

from actuator.parts.noise import WhiteNoise
from controllers.memory import Memory
from gear.quantities import Angle, Scalar, check, check_count
from gear.quantities.roles import NoiseLevel, Resolution, SensorOf

ANGLE, CURRENT = 1e-4, 1.0  # usual sizes, for the error control


def quantize(value: Scalar, resolution: Scalar | None) -> Scalar:
    """The nearest multiple of a resolution; unchanged for None."""
    return value if resolution is None else resolution * ca.floor(value / resolution + 0.5)


@dataclass(frozen=True, kw_only=True)
class AngleSensor:
    """Encoder or resolver on a shaft.

        measured = quantize(angle + offset + eccentricity sin(angle + eccentricity_phase) + noise), `delay` ticks late

    Parameters
    ----------
    resolution : float or None
        Angle of one count [rad]; None for a continuous sensor.
    offset : float
        [rad].
    eccentricity : float
        Amplitude of the error that comes once a turn [rad].
    eccentricity_phase : float
        [rad].
    delay : int
        Ticks from the measurement to the reading.
    noise : float or None
        Size of the white noise before the quantization [rad]: the standard deviation of a normal one, the bound of
        a uniform one; None for none.
    white_noise : WhiteNoise
        Its distribution and seed.
    """

    resolution: Annotated[float, Unit("rad"), Gt(0), Resolution()] | None = None
    offset: Angle = 0.0
    eccentricity: Annotated[float, Unit("rad"), Ge(0)] = 0.0
    eccentricity_phase: Angle = 0.0
    delay: int = 0
    noise: Annotated[float, Unit("rad"), Ge(0), NoiseLevel()] | None = None
    white_noise: WhiteNoise = field(default_factory=WhiteNoise)

    def __post_init__(self) -> None:
        check(self)
        check_count(self, "delay", least=0)

    @classmethod
    def of_counts(cls, counts_per_turn: int, **more: Any) -> "AngleSensor":
        """By the counts a turn (four times the lines of an incremental encoder); `more` are the other fields."""
        if isinstance(counts_per_turn, bool) or not isinstance(counts_per_turn, int) or counts_per_turn < 1:
            raise ValueError(f"AngleSensor: counts_per_turn must be a whole number >= 1, got {counts_per_turn!r}")
        return cls(resolution=2 * math.pi / counts_per_turn, **more)

    def memory(self, angle: float = 0.0) -> tuple[Memory, ...]:
        """What it keeps between ticks, initially as after standing still at an angle [rad], without noise."""
        reading = quantize(self._seen(angle), self.resolution)
        late = tuple(Memory(f"reading_{k}", "rad", ANGLE, reading) for k in range(self.delay))
        return (*_of_noise(self), *late)

    def read(self, memory: list[Scalar], angle: Scalar) -> Scalar:
        """Measured angle [rad] at this tick, from the true one."""
        late = memory[_count(self) :]
        return late[0] if self.delay else self._sample(memory, angle)

    def advance(self, memory: list[Scalar], angle: Scalar) -> list[Scalar]:
        """Memory for the next tick."""
        late = memory[_count(self) :]
        return [*_next_noise(self, memory), *([*late[1:], self._sample(memory, angle)] if self.delay else [])]

    def _seen(self, angle: Scalar) -> Scalar:
        return angle + self.offset + self.eccentricity * ca.sin(angle + self.eccentricity_phase)

    def _sample(self, memory: list[Scalar], angle: Scalar) -> Scalar:
        return quantize(self._seen(angle) + _noise(self, memory), self.resolution)


@dataclass(frozen=True, kw_only=True)
class CurrentSensor:
    """Sensor of one current, of a phase or of an axis.

        measured = quantize((1 + gain_error) current + offset + noise)

    Parameters
    ----------
    gain_error : float
        Relative [-].
    offset : float
        [A].
    resolution : float or None
        Of the converter [A]; None for a continuous one.
    noise : float or None
        Size of the white noise before the quantization [A], as for AngleSensor; None for none.
    white_noise : WhiteNoise
        Its distribution and seed.
    """

    gain_error: Annotated[float, Unit("-"), Gt(-1)] = 0.0
    offset: Annotated[float, Unit("A")] = 0.0
    resolution: Annotated[float, Unit("A"), Gt(0), Resolution()] | None = None
    noise: Annotated[float, Unit("A"), Ge(0), NoiseLevel()] | None = None
    white_noise: WhiteNoise = field(default_factory=WhiteNoise)

    def __post_init__(self) -> None:
        check(self)

    def memory(self) -> tuple[Memory, ...]:
        """What it keeps between ticks."""
        return _of_noise(self)

    def read(self, memory: list[Scalar], current: Scalar) -> Scalar:
        """Measured current [A] at this tick, from the true one."""
        return quantize((1 + self.gain_error) * current + self.offset + _noise(self, memory), self.resolution)

    def advance(self, memory: list[Scalar], current: Scalar) -> list[Scalar]:
        """Memory for the next tick."""
        return _next_noise(self, memory)


@dataclass(frozen=True, kw_only=True)
class Sensors:
    """What a drive measures with; a sensor left out is ideal.

    Parameters
    ----------
    motor, load : AngleSensor or None
        On the motor and on the output shaft.
    current : CurrentSensor or None
        One on each axis of the motor.
    """

    motor: Annotated[AngleSensor | None, SensorOf("motor")] = None
    load: Annotated[AngleSensor | None, SensorOf("load")] = None
    current: Annotated[CurrentSensor | None, SensorOf("current")] = None

    def present(self) -> dict[str, AngleSensor | CurrentSensor]:
        """Those that there are, by name."""
        return {each.name: sensor for each in fields(self) if (sensor := getattr(self, each.name)) is not None}

    def with_each(self, **changes: Any) -> "Sensors":
        """The same sensors, with these fields changed in each that there is."""
        return replace(self, **{name: replace(sensor, **changes) for name, sensor in self.present().items()})


def _count(sensor: AngleSensor | CurrentSensor) -> int:
    return 0 if sensor.noise is None else 1


def _of_noise(sensor: AngleSensor | CurrentSensor) -> tuple[Memory, ...]:
    return () if sensor.noise is None else (sensor.white_noise.memory(),)


def _noise(sensor: AngleSensor | CurrentSensor, memory: list[Scalar]) -> Scalar:
    return 0.0 if sensor.noise is None else sensor.noise * sensor.white_noise.value(memory[0])


def _next_noise(sensor: AngleSensor | CurrentSensor, memory: list[Scalar]) -> list[Scalar]:
    return [] if sensor.noise is None else [sensor.white_noise.advance(memory[0])]
