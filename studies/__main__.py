"""The command line: python -m studies."""

import logging
import math
import os
import time
from pathlib import Path

import click

from actuator import SimulationError
from studies.benchmark import benchmark as run_benchmark
from studies.cases import built_in, load_case
from studies.cross_check import cross_check as run_cross_check
from studies.cross_check_record import WrongRecord
from studies.files import CaseError
from studies.frequency_commands import frequency_response
from studies.gear_paper import gear_paper as run_gear_paper
from studies.hunting import DATA, WrongPlan, hunting_map, plan_of
from studies.judge import judge
from studies.report import write_files, write_report
from studies.tuning_commands import COMMANDS

DEFAULT_CASE = "aileron"


class WrongCase(click.ClickException):
    """A case that cannot be run; its one line is all that is shown."""

    exit_code = 2


class CaseGroup(click.Group):
    """Commands by name; anything else is taken for the path of a case file."""

    def resolve_command(self, ctx: click.Context, args: list[str]) -> tuple:
        """The named command, or `run` with the path."""
        if args and args[0] not in self.commands and (args[0].endswith(".toml") or Path(args[0]).exists()):
            return "run", self.commands["run"], args
        return super().resolve_command(ctx, args)


@click.group(cls=CaseGroup, invoke_without_command=True, subcommand_metavar="[PATH.toml | COMMAND]")
@click.option("--case", "name", default=DEFAULT_CASE, show_default=True, help="Built-in case to run.")
@click.option("--out", type=click.Path(file_okay=False, path_type=Path), default=Path("out"), show_default=True)
@click.option("--list", "listing", is_flag=True, help="List the built-in cases.")
@click.option("--thorough", is_flag=True, help="Explain the hunting of a case even where its runs take long.")
@click.option("--verbose", is_flag=True, help="Say how the simulation runs.")
@click.pass_context
def main(  # noqa: PLR0913, PLR0917 - one per option
    context: click.Context, name: str, out: Path, listing: bool, thorough: bool, verbose: bool
) -> None:
    """Simulate a geared actuator, say whether it hunts, linearize it, and write a report.

    Without a command: run a built-in case, or the case in the file PATH.toml.
    """
    logging.basicConfig(level=logging.INFO if verbose else logging.WARNING, format="%(message)s")
    if listing:
        width = max(map(len, built_in()))
        for each in built_in():
            click.echo(f"{each:{width}}  {load_case(each).title}")
    elif context.invoked_subcommand is None:
        _run(name, out, thorough)
    else:
        context.obj = out


@main.command(hidden=True)
@click.argument("path", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(file_okay=False, path_type=Path), default=None)
@click.option("--thorough", is_flag=True)
@click.pass_context
def run(context: click.Context, path: Path, out: Path | None, thorough: bool) -> None:
    """Run the case in a TOML file."""
    _run(path, out or context.obj, thorough)


@main.command()
@click.option("--runs", default=5, show_default=True, type=click.IntRange(1), help="Times each case is run.")
def benchmark(runs: int) -> None:
    """Time figure 9 of the gear paper and the built-in cases, compiled and interpreted."""
    run_benchmark(runs, click.echo)


@main.command("gear-paper")
@click.option("--out", type=click.Path(file_okay=False, path_type=Path), default=None, help="Folder for the results.")
@click.pass_context
def gear_paper(context: click.Context, out: Path | None) -> None:
    """Reproduce the gear paper's figures 7, 9, 12 and 13 and its cold gearbox."""
    with click.progressbar(length=100, label="The gear paper", show_eta=False) as bar:
        found = run_gear_paper(lambda share: bar.update(int(100 * share) - bar.pos))
    write_files(found.pictures, found.result, found.text, out or context.obj)
    for sentence in found.text:
        click.echo(sentence)


AXIS = (str, float, float, click.IntRange(1))


@main.command(epilog="A name with * is a factor on every parameter of that pattern, patterns may be added with +: "
              "'*.breakaway+*.static'; =PATTERN sets them all to one value.")  # fmt: skip
@click.argument("case", default=DEFAULT_CASE)
@click.option("--x", type=AXIS, default=None, metavar="NAME FROM TO COUNT", help="Default: the integral gain.")
@click.option("--y", type=AXIS, default=None, metavar="NAME FROM TO COUNT", help="Default: all breakaway friction.")
@click.option("--corner", "corners", multiple=True, metavar="NAME=VALUE,...", help="A set of parameters; repeatable.")
@click.option("--duration", type=click.FloatRange(0, min_open=True), default=None, help="Of each run [s].")
@click.option("--exact", is_flag=True, help="Follow the exact boundary along the axis that is one parameter.")
@click.option("--jobs", type=click.IntRange(1), default=os.cpu_count(), show_default="all cores", help="Processes.")
@click.option("--out", type=click.Path(file_okay=False, path_type=Path), default=None, help="Folder for the results.")
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

    A point hunts if it does so in the scenario of the case, or after one more step of a fiftieth of the way. CASE is a
    built-in case or a path. A map that was interrupted goes on where it stopped when the same command is given again.
    """
    folder, began, computed = out or context.obj / "hunting", time.perf_counter(), [0]
    try:
        plan = plan_of(case if case in built_in() else Path(case), x=x, y=y, corners=corners, duration=duration)
        with click.progressbar(length=len(plan.indices()), label="Points") as bar:
            ends = None

            def advance(done: int, count: int) -> None:
                nonlocal ends
                if ends is None:
                    ends = click.progressbar(length=count, label="Exact boundary")
                    ends.render_progress()
                ends.update(done)

            def count(done: int) -> None:
                bar.update(done)
                computed.append(done)

            found = hunting_map(plan, folder, jobs=jobs, exact=exact, progress=count, progress_of_ends=advance)
            if ends is not None:
                ends.render_finish()
        written = write_files(found.pictures, found.result, found.text, folder, found.files)
    except (CaseError, WrongPlan) as error:
        raise WrongCase(str(error)) from None
    except OSError as error:
        raise WrongCase(f"cannot write to {folder}: {error.strerror}; choose another folder with --out") from None
    for sentence in found.text:
        click.echo(sentence)
    new, seconds = sum(computed[2:]), time.perf_counter() - began
    click.echo(f"{new} new points in {seconds:.3g} s, {new / seconds:.2g} points per second")
    click.echo(f"written: {folder / DATA} and {len(written) - 1} more files")


@main.command("cross-check")
@click.option(
    "--reference",
    "folder",
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    default=None,
    help="Folder with the whole published results, dymola_result.csv and reference.npz, for those stored here in part.",
)
@click.option("--out", type=click.Path(file_okay=False, path_type=Path), default=None, help="Folder for the results.")
@click.pass_context
def cross_check(context: click.Context, folder: Path | None, out: Path | None) -> None:
    """Compare with others' numbers: Dymola's actuator and motulator's drive."""
    with click.progressbar(length=100, label="Others' numbers", show_eta=False) as bar:
        try:
            found = run_cross_check(lambda share: bar.update(int(100 * share) - bar.pos), folder)
        except WrongRecord as error:
            raise WrongCase(str(error)) from None
    write_files(found.pictures, found.result, found.text, out or context.obj)
    for paragraph in found.text:
        click.echo(paragraph)
    if not all(row["holds"] for row in found.result["deviations"]):
        context.exit(1)


main.add_command(frequency_response, "frequency-response")
for _name, _command in COMMANDS.items():
    main.add_command(_command, _name)


def _run(case: str | Path, out: Path, thorough: bool) -> None:
    try:
        loaded = load_case(case)
    except CaseError as error:
        raise WrongCase(str(error)) from None
    with click.progressbar(length=1000, label=loaded.title, show_eta=False) as bar:
        done = 0

        def advance(share: float) -> None:
            nonlocal done
            bar.update(int(1000 * share) - done)
            done = int(1000 * share)

        try:
            judgment = judge(loaded, advance, thorough=thorough)
        except SimulationError as error:
            raise WrongCase(f"{loaded.name}: {error}") from None
    try:
        written = write_report(judgment, out)
    except OSError as error:
        raise WrongCase(f"cannot write to {out}: {error.strerror}; choose another folder with --out") from None
    hunting = judgment.hunting
    click.echo(f"verdict: {hunting.verdict} ({hunting.reason})")
    if hunting.cycles:
        click.echo(
            f"period {hunting.period_s:.4g} s, amplitude {hunting.amplitude_rad * 1e3:.4g} mrad at the load, "
            f"stuck for {hunting.stick_fraction:.0%} of the time"
        )
    for kind, margin in judgment.insight.margins.items():
        end = "no factor up to 64 makes it hunt" if margin.factor else "no factor down to 1/64 ends the hunting"
        known = f"{margin.db:+.1f} dB (factor {margin.factor:.3g})"
        click.echo(f"{kind} margin: {known if math.isfinite(margin.db) else end}")
    for what, why in judgment.insight.missing.items():
        click.echo(f"{'margins, causes and remedies' if what == 'all' else what}: {why}")
    if judgment.insight.causes:
        click.echo(judgment.insight.causes.sentence())
    if judgment.insight.remedies:
        best = judgment.insight.remedies.ranked[0]
        click.echo(f"best remedy: {' '.join((best.name, best.setting)).strip()} ({best.does})")
    report = next(path for path in written if path.suffix == ".html")
    click.echo(f"written: {report} and {len(written) - 1} more files")


if __name__ == "__main__":
    main(prog_name="python -m studies")
