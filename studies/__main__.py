"""The command line: python -m studies."""

import logging
from pathlib import Path

import click

from actuator import SimulationError
from studies.benchmark import benchmark as run_benchmark
from studies.cases import built_in, load_case
from studies.files import CaseError
from studies.gear_paper import gear_paper as run_gear_paper
from studies.judge import judge
from studies.report import write_files, write_report

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
@click.option("--verbose", is_flag=True, help="Say how the simulation runs.")
@click.pass_context
def main(context: click.Context, name: str, out: Path, listing: bool, verbose: bool) -> None:
    """Simulate a geared actuator, say whether it hunts, linearize it, and write a report.

    Without a command: run a built-in case, or the case in the file PATH.toml.
    """
    logging.basicConfig(level=logging.INFO if verbose else logging.WARNING, format="%(message)s")
    if listing:
        width = max(map(len, built_in()))
        for each in built_in():
            click.echo(f"{each:{width}}  {load_case(each).title}")
    elif context.invoked_subcommand is None:
        _run(name, out)
    else:
        context.obj = out


@main.command(hidden=True)
@click.argument("path", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(file_okay=False, path_type=Path), default=None)
@click.pass_context
def run(context: click.Context, path: Path, out: Path | None) -> None:
    """Run the case in a TOML file."""
    _run(path, out or context.obj)


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


def _run(case: str | Path, out: Path) -> None:
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
            judgment = judge(loaded, advance)
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
    report = next(path for path in written if path.suffix == ".html")
    click.echo(f"written: {report} and {len(written) - 1} more files")


if __name__ == "__main__":
    main(prog_name="python -m studies")
