"""The command `frequency-response`."""

import math
import os
from pathlib import Path

import click
import numpy as np

from actuator import Spectrum, read_record
from studies.cases import built_in
from studies.files import CaseError
from studies.frequency_mask import load_mask
from studies.frequency_report import StudyFiles, study_files
from studies.frequency_response import Plan, WrongRequest, kept_in, load_positioner, study
from studies.report import write_files

DEFAULT_AMPLITUDES = "0.1,0.3,1,3,10"
DEFAULT_FREQUENCIES = (0.2, 20.0, 17)
FILE = click.Path(dir_okay=False, path_type=Path)


class Refused(click.ClickException):
    """What was asked for cannot be done; its one line is all that is shown."""

    exit_code = 2


@click.command(
    epilog="The default points take one to two minutes on two cores, twice that with --against; "
    "of sampled control many times that."
)
@click.argument("case", default="aileron", metavar="[CASE | PATH.toml]")
@click.option(
    "--against", default=None, metavar="CASE|PATH.toml", help="A second actuator or tuning, beside the first."
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
@click.option("--torque", default=None, type=click.FloatRange(0, min_open=True),
              help="Largest torque on the load [N m].  [default: the motor's, at the load]")  # fmt: skip
@click.option("--jobs", type=click.IntRange(1), default=os.cpu_count(), show_default="all cores", help="Processes.")
@click.option("--out", type=click.Path(file_okay=False, path_type=Path), default=None, help="Folder for the results.")
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
    torque: float | None,
    jobs: int,
    out: Path | None,
) -> None:
    """Report the frequency response of a case: linear and not, margins, stiffness, bench tests, and a mask.

    CASE is a built-in case. What was interrupted goes on where it stopped when the same command is given again.
    """
    folder = out or context.obj / "frequency-response"
    try:
        plan = Plan(
            mask=load_mask(mask_path),
            stroke=math.radians(stroke),
            amplitudes=tuple(each / 100 for each in _numbers(amplitudes)),
            frequencies=_grid(*frequencies),
            torque=torque,
        )
        cases = [load_positioner(name if name in built_in() else Path(name)) for name in (case, against) if name]
        if len({each.name for each in cases}) < len(cases):
            raise WrongRequest(f"both cases are called {cases[0].name}; a case is not laid beside itself")
        measured = [_spectrum(path, plan) for path in records]
        kept = kept_in(folder)
        with click.progressbar(length=plan.points * len(cases), label="Points") as bar:
            studies = [study(each, plan, kept, jobs=jobs, progress=bar.update) for each in cases]
        found: StudyFiles = study_files(plan, studies, measured)
        written = write_files(found.pictures, found.result, found.text, folder, found.files)
    except (CaseError, WrongRequest) as error:
        raise Refused(str(error)) from None
    except OSError as error:
        raise Refused(f"cannot write to {folder}: {error.strerror}; choose another folder with --out") from None
    for sentence in found.text:
        click.echo(sentence)
    click.echo(f"written: {folder / 'report.html'} and {len(written) - 1} more files")


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
