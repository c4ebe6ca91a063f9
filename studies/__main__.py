"""The command line: python -m studies."""

import logging
from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

from actuator import __version__
from studies.cases import built_in, load_case
from studies.judge.commands import THOROUGH, Judge
from studies.study import FOLDER, RESUMES, load_commands, run_study

DEFAULT_CASE = "aileron"


class Interrupted(click.ClickException):
    """Ctrl-C; the message is all that is shown."""

    exit_code = 130

    def show(self, file: Any = None) -> None:
        """One line, behind that of a progress bar."""
        click.echo(f"\n{self.message}", file=file, err=True)


class CaseGroup(click.Group):
    """Commands by name; anything else is taken for the path of a case file."""

    def resolve_command(self, ctx: click.Context, args: list[str]) -> tuple:
        """The named command, or `run` with the path."""
        if args and args[0] not in self.commands and (args[0].endswith(".toml") or Path(args[0]).exists()):
            return "run", self.commands["run"], args
        return super().resolve_command(ctx, args)

    def invoke(self, ctx: click.Context) -> Any:
        """Whatever was asked for; interrupted, it says so in a line."""
        try:
            return super().invoke(ctx)
        except (KeyboardInterrupt, click.Abort):
            command = self.commands.get(ctx.invoked_subcommand or "run")
            resumes = command is not None and RESUMES in (command.epilog or "")
            raise Interrupted(f"interrupted{'; repeat the command to resume' if resumes else ''}") from None


@click.group(cls=CaseGroup, invoke_without_command=True, subcommand_metavar="[PATH.toml | COMMAND]", epilog=RESUMES)
@click.version_option(__version__, prog_name="geared-actuator")
@click.option("--case", default=DEFAULT_CASE, show_default=True, help="Built-in case to run.")
@click.option("--out", type=FOLDER, default=Path("out"), show_default=True,
              help="Folder for the results; those of a COMMAND go to OUT/COMMAND.")  # fmt: skip
@click.option("--list", "listing", is_flag=True, help="List the built-in cases.")
@click.option("--thorough", is_flag=True, help=THOROUGH)
@click.option("--verbose", is_flag=True, help="Log how the simulation runs.")
@click.pass_context
def main(  # noqa: PLR0913, PLR0917 - one per option
    context: click.Context, case: str, out: Path, listing: bool, thorough: bool, verbose: bool
) -> None:
    """Simulate a geared actuator, judge whether it hunts, linearize it, and write a report.

    Without a command: run a built-in case, or the case in the file PATH.toml.
    """
    logging.basicConfig(level=logging.INFO if verbose else logging.WARNING, format="%(message)s")
    context.obj = out
    if context.invoked_subcommand is None:
        if listing:
            width = max(map(len, built_in()))
            for name in built_in():
                click.echo(f"{name:{width}}  {load_case(name).title}")
        else:
            run_study(lambda: Judge(case=load_case(case), thorough=thorough), out)
        return
    command = main.commands[context.invoked_subcommand]
    taken = [parameter.name for parameter in command.params]
    for name, option in (("case", "--case"), ("listing", "--list"), ("thorough", "--thorough")):
        given = context.get_parameter_source(name) is ParameterSource.COMMANDLINE
        if given and (name != "thorough" or name not in taken):
            raise click.UsageError(f"{option} does not apply to {context.invoked_subcommand!r}; leave it out")


COMMANDS = load_commands()
for _command in COMMANDS.values():
    main.add_command(_command)


if __name__ == "__main__":
    main(prog_name="python -m studies")
