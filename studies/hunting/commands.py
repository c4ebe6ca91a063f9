"""The command `hunting`."""

import contextlib
import time
from pathlib import Path

import click

from studies.cache import Kept, kept_in
from studies.cases import built_in
from studies.commands import JOBS, RESUMES, announce, out_option, refusing
from studies.files import CaseError
from studies.findings import Findings
from studies.hunting.map import Plan
from studies.hunting.study import DATA, WrongPlan, hunting_map, plan_of

AXIS = (str, float, float, click.IntRange(1))


@click.command(
    epilog="A name with * is a factor on every parameter of that pattern, patterns may be added with +: "
    f"'*.breakaway+*.static'; =PATTERN sets them all to one value. All else is in SI units. {RESUMES}"
)
@click.argument("case", default="aileron", metavar="[CASE | PATH.toml]")
@click.option("--x", type=AXIS, default=None, metavar="NAME FROM TO COUNT", help="Default: the integral gain.")
@click.option("--y", type=AXIS, default=None, metavar="NAME FROM TO COUNT", help="Default: all breakaway friction.")
@click.option("--corner", "corners", multiple=True, metavar="NAME=VALUE,...", help="A set of parameters; repeatable.")
@click.option("--duration", type=click.FloatRange(0, min_open=True), default=None,
              help="Of each run [s].  [default: that of the case]")  # fmt: skip
@click.option("--exact", is_flag=True, help="Follow the exact boundary along the axis that is one parameter.")
@JOBS
@out_option("hunting")
@click.pass_context
def hunting(  # noqa: PLR0913, PLR0917 - one per option
    context: click.Context,
    case: str,
    x: tuple | None,
    y: tuple | None,
    corners: tuple[str, ...],
    duration: float | None,
    exact: bool,
    jobs: int,
    out: Path | None,
) -> None:
    """Map where a case hunts, over two parameters and any number of corners.

    A point hunts if it does so in the scenario of the case, or after one more step of a fiftieth of the way.
    """
    folder = out or context.obj / "hunting"
    with refusing(folder, CaseError, WrongPlan):
        plan = plan_of(case if case in built_in() else Path(case), x=x, y=y, corners=corners, duration=duration)
        kept = kept_in(folder)
        before, began = len(kept), time.perf_counter()
        found = _mapped(plan, kept, exact, jobs)
        new, seconds = len(kept) - before, time.perf_counter() - began
        written = found.save(folder)
    cost = f"{new} results are new, found in {seconds:.3g} s; all others were in {kept.path}"
    announce([*found.text, cost], written, DATA)


def _mapped(plan: Plan, kept: Kept, exact: bool, jobs: int) -> Findings:
    """The map, with a bar for its points and one for the ends of exact families."""
    with contextlib.ExitStack() as bars:
        points = bars.enter_context(click.progressbar(length=len(plan.indices()), label="Points"))
        ends = []

        def advance(done: int, count: int) -> None:
            if not ends:
                points.render_finish()
                ends.append(bars.enter_context(click.progressbar(length=count, label="Exact boundary")))
            ends[0].update(done)

        return hunting_map(plan, kept, jobs=jobs, exact=exact, progress=points.update, progress_of_ends=advance)
