"""The command `frequency-response`."""

import math
from dataclasses import dataclass, replace
from pathlib import Path

import click
import numpy as np

from actuator import Spectrum, read_record
from studies.cases import Case
from studies.files import StudyError
from studies.findings import Findings
from studies.frequency.mask import load_mask
from studies.frequency.plan import Plan, choose_corners, load_positioner, load_second, locate_case
from studies.frequency.report import study_findings
from studies.frequency.study import measure_case
from studies.study import Work, study

DEFAULT_AMPLITUDES = "0.1,0.3,1,3,10"
DEFAULT_FREQUENCIES = (0.2, 20.0, 17)
FILE = click.Path(dir_okay=False, path_type=Path)


@dataclass(frozen=True, kw_only=True)
class ResponseStudy:
    """The frequency response of one case, or of two side by side.

    Parameters
    ----------
    plan : Plan
        What is measured.
    cases : tuple of Case
        With a position controller.
    records : tuple of Spectrum
        Measured responses to overlay.
    """

    plan: Plan
    cases: tuple[Case, ...]
    records: tuple[Spectrum, ...] = ()
    title: str = "Frequency response"

    def run(self, work: Work) -> Findings:
        """Measure the cases and write the report."""
        counts, finished, found = [self.plan.points(case.actuator) for case in self.cases], 0, []
        for case, count in zip(self.cases, counts, strict=True):
            part = work.part(finished / sum(counts), (finished + count) / sum(counts))
            found.append(measure_case(case, self.plan, replace(work, progress=lambda share, part=part: part(share, 1))))
            finished += count
        return study_findings(self.plan, found, self.records)


@study(
    "frequency-response",
    epilog="The default points take one to two minutes on two cores, twice that with --against, and many times that "
    "with a sampled controller. In a corner NAME may be anything that `hunting` takes, such as "
    '--corner "worn: gear.meshes.*.gap=1.5"; --corner "as it is" omits the temperatures.',
)
@click.argument("case", default="aileron", metavar="[CASE | PATH.toml]")
@click.option("--against", default=None, metavar="CASE|PATH.toml|result.json",
              help="Second actuator, or the first with the gains of a tuning's result.json.")  # fmt: skip
@click.option("--measured", "records", multiple=True, type=FILE,
              help="Measured response to overlay (CSV: time, reference, response); repeatable.")  # fmt: skip
@click.option("--mask", "mask_path", default=None, type=FILE,
              help="Limits of gain and phase; start from studies/data/masks/position.toml.")  # fmt: skip
@click.option("--stroke", default=50.0, show_default=True, type=click.FloatRange(0, min_open=True),
              help="Travel of the load from end to end [deg].")  # fmt: skip
@click.option("--amplitudes", default=DEFAULT_AMPLITUDES, show_default=True,
              help="Peak values of the reference sines [% of the stroke]; those of the mask are added.")  # fmt: skip
@click.option("--frequencies", default=DEFAULT_FREQUENCIES, show_default=True, type=(float, float, click.IntRange(1)),
              metavar="FROM TO COUNT", help="Frequencies [Hz], logarithmically spaced.")  # fmt: skip
@click.option("--corner", "corners", multiple=True, metavar="[LABEL:] NAME=VALUE,...",
              help="Set of parameters for which all sines are repeated; repeatable.  [default: the temperatures of the "
              "built-in specification of the case, else -55, 20 and 70 degC of its oils]")  # fmt: skip
@click.option("--bias", "biases", multiple=True, type=float, metavar="TORQUE",
              help="Additional bias load, applied in every corner [N m]; repeatable.")  # fmt: skip
@click.option("--torque", default=None, type=click.FloatRange(0, min_open=True),
              help="Largest torque on the load [N m].  [default: the motor's, at the load]")  # fmt: skip
def frequency_response(  # noqa: PLR0913, PLR0917 - one per option
    case: str,
    against: str | None,
    records: tuple[Path, ...],
    mask_path: Path | None,
    stroke: float,
    amplitudes: str,
    frequencies: tuple[float, float, int],
    corners: tuple[str, ...],
    biases: tuple[float, ...],
    torque: float | None,
) -> ResponseStudy:
    """Linear and nonlinear frequency response of a case, margins, stiffness and bench tests, checked against a mask.

    CASE is a built-in case.
    """
    plan = Plan(
        mask=load_mask(mask_path),
        stroke=math.radians(stroke),
        amplitudes=tuple(each / 100 for each in _read_numbers(amplitudes)),
        frequencies=_make_grid(*frequencies),
        torque=torque,
        corners=choose_corners(locate_case(case), corners),
        biases=biases,
    )
    first = load_positioner(locate_case(case))
    cases = (first, load_second(against, first)) if against else (first,)
    for each in cases:
        plan.corners.sets_of(each.actuator)  # refuses what an actuator does not have
    return ResponseStudy(plan=plan, cases=cases, records=tuple(_read_spectrum(path, plan) for path in records))


def _read_numbers(text: str) -> list[float]:
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        raise StudyError(f"--amplitudes takes numbers separated by commas, in % of the stroke, got {text!r}") from None


def _make_grid(first: float, last: float, count: int) -> tuple[float, ...]:
    if not (0 < first < math.inf and first <= last < math.inf):
        raise StudyError(f"--frequencies takes FROM TO COUNT with 0 < FROM <= TO, got {first:g} {last:g} {count}")
    return tuple(float(value) for value in np.geomspace(first, last, count))


def _read_spectrum(path: Path, plan: Plan) -> Spectrum:
    try:
        return read_record(path).spectrum(min(plan.frequencies), max(plan.frequencies))
    except OSError as error:
        raise StudyError(f"{path}: cannot be read: {error.strerror}") from None
    except ValueError as error:
        raise StudyError(str(error)) from None
