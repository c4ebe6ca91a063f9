"""The command `frequency-response`."""

import math
from pathlib import Path

import click
import numpy as np

from actuator import Spectrum, read_record
from studies.cases import Case
from studies.commands import JOBS, RESUMES, announce, begun, out_option, refusing
from studies.files import CaseError
from studies.findings import PAGE
from studies.frequency.corners import WrongRequest, corners_of
from studies.frequency.mask import load_mask
from studies.frequency.plan import Plan, load_positioner, second, source_of
from studies.frequency.report import study_findings
from studies.frequency.study import study

DEFAULT_AMPLITUDES = "0.1,0.3,1,3,10"
DEFAULT_FREQUENCIES = (0.2, 20.0, 17)
FILE = click.Path(dir_okay=False, path_type=Path)


@click.command(
    epilog="The default points take one to two minutes on two cores, twice that with --against; "
    "of sampled control many times that. In a corner a name with * is a factor on every parameter of that pattern, as "
    'for `hunting`: --corner "worn: gear.meshes.*.gap=1.5"; --corner "as it is" leaves out the temperatures. ' + RESUMES
)
@click.argument("case", default="aileron", metavar="[CASE | PATH.toml]")
@click.option(
    "--against",
    default=None,
    metavar="CASE|PATH.toml|result.json",
    help="Beside the first: a second actuator, or the first with the gains in the result.json of a tuning.",
)
@click.option("--measured", "records", multiple=True, type=FILE,
              help="CSV with columns time, reference, response, laid over it; repeatable.")  # fmt: skip
@click.option(
    "--mask", "mask_path", default=None, type=FILE, help="Limits; start from studies/data/masks/position.toml."
)
@click.option("--stroke", default=50.0, show_default=True, type=click.FloatRange(0, min_open=True),
              help="From end to end [deg].")  # fmt: skip
@click.option("--amplitudes", default=DEFAULT_AMPLITUDES, show_default=True,
              help="Peak values of the sines [% of the stroke]; those of the mask are added.")  # fmt: skip
@click.option("--frequencies", default=DEFAULT_FREQUENCIES, show_default=True, type=(float, float, click.IntRange(1)),
              metavar="FROM TO COUNT", help="[Hz], evenly over the logarithm.")  # fmt: skip
@click.option("--corner", "corners", multiple=True, metavar="[LABEL:] NAME=VALUE,...",
              help="A set of parameters with which all sines run too; repeatable.  [default: the temperatures of the "
              "built-in specification of the case, else -55, 20 and 70 degC of its oils]")  # fmt: skip
@click.option("--bias", "biases", multiple=True, type=float, metavar="TORQUE",
              help="A bias load with which they run too, in every corner [N m]; repeatable.")  # fmt: skip
@click.option("--torque", default=None, type=click.FloatRange(0, min_open=True),
              help="Largest torque on the load [N m].  [default: the motor's, at the load]")  # fmt: skip
@JOBS
@out_option("frequency-response")
@click.pass_context
def frequency_response(  # noqa: PLR0913, PLR0917 - one per option
    context: click.Context,
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
    jobs: int,
    out: Path | None,
) -> None:
    """Report the frequency response of a case: linear and not, margins, stiffness, bench tests, and a mask.

    CASE is a built-in case.
    """
    folder = out or context.obj / "frequency-response"
    with refusing(folder, CaseError, WrongRequest):
        plan = Plan(
            mask=load_mask(mask_path),
            stroke=math.radians(stroke),
            amplitudes=tuple(each / 100 for each in _numbers(amplitudes)),
            frequencies=_grid(*frequencies),
            torque=torque,
            corners=corners_of(source_of(case), corners),
            biases=biases,
        )
        cases: list[Case] = [load_positioner(source_of(case))]
        if against:
            cases.append(second(against, cases[0]))
        measured = [_spectrum(path, plan) for path in records]
        points = sum(plan.points(each.actuator) for each in cases)
        kept = begun(folder)
        with click.progressbar(length=points, label="Points") as bar:
            studies = [study(each, plan, kept, jobs=jobs, progress=bar.update) for each in cases]
        found = study_findings(plan, studies, measured)
        written = found.save(folder)
    announce(found.text, written, PAGE)


def _numbers(text: str) -> list[float]:
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        raise WrongRequest(f"--amplitudes are numbers with commas, in % of the stroke, got {text!r}") from None


def _grid(first: float, last: float, count: int) -> tuple[float, ...]:
    if not (0 < first < math.inf and first <= last < math.inf):
        raise WrongRequest(f"--frequencies are FROM TO COUNT with 0 < FROM <= TO, got {first:g} {last:g} {count}")
    return tuple(float(value) for value in np.geomspace(first, last, count))


def _spectrum(path: Path, plan: Plan) -> Spectrum:
    try:
        return read_record(path).spectrum(min(plan.frequencies), max(plan.frequencies))
    except OSError as error:
        raise WrongRequest(f"{path}: cannot be read: {error.strerror}") from None
    except ValueError as error:
        raise WrongRequest(str(error)) from None
