"""One shape for every study: a plan whose `run` gives findings, and a command that makes the plan of its options.

    @dataclass(frozen=True, kw_only=True)
    class Drift:
        case: Case
        title: str = "Drift"

        def run(self, work: Work) -> Findings: ...

    @study("drift")
    @click.argument("case")
    def drift(case: str) -> Drift:
        \"\"\"How far a case drifts while it is held.\"\"\"
        return Drift(case=load_case(case))

in `studies/drift/commands.py`, or in a module of another package that an entry point of the group
`geared_actuator.parts` names; the command line finds both. All else is done here: the options --jobs and --out,
requests refused in one line, the progress bar, resuming an interrupted run, writing.
"""

import contextlib
import os
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from types import TracebackType
from typing import Any, Protocol

import click

from actuator.linear.operating_point import NoEquilibrium
from actuator.simulation.failures import SimulationError
from gear.quantities.registry import slots
from studies.cache import Cache, open_cache
from studies.files import StudyError
from studies.findings import PAGE, Findings

RESUMES = "Repeat the command to resume an interrupted run."
FOLDER = click.Path(file_okay=False, path_type=Path)
COMMANDS: dict[str, click.Command] = {}


@dataclass(frozen=True, kw_only=True)
class Work:
    """What a study runs with.

    Parameters
    ----------
    cache : Cache
        Results that are finished; each new one goes there as soon as it is computed.
    jobs : int
        Processes.
    progress : callable
        Called with the share that is done, 0 to 1.
    """

    cache: Cache
    jobs: int = 1
    progress: Callable[[float], None] = lambda share: None

    def part(self, begin: float, end: float) -> Callable[[float, float], None]:
        """Progress of a part of the work, from its counts of finished and all points."""
        return lambda done, count: self.progress(begin + (end - begin) * (done / count if count else 1.0))


class Study(Protocol):
    """The plan of a study."""

    @property
    def title(self) -> str:
        """A few words for the progress bar."""
        ...

    def run(self, work: Work) -> Findings:
        """Compute it, or finish what was begun.

        Raises
        ------
        StudyError
            Where it cannot be done; its one line is shown.
        """
        ...


def study(
    name: str, *, first: str = PAGE, parallel: bool = True, folder: str | None = None, **settings: Any
) -> Callable[[Callable[..., Study]], click.Command]:
    """Make a command of a function that turns options into the plan of a study.

    Parameters
    ----------
    name : str
        Of the command.
    first : str
        Name of the file that is announced.
    parallel : bool
        Whether it takes --jobs.
    folder : str or None
        Its folder in that of all results; None for its name.
    **settings
        Of the click.Command: epilog, hidden.
    """
    place = name if folder is None else folder

    def register(plan: Callable[..., Study]) -> click.Command:
        own = list(reversed(getattr(plan, "__click_params__", [])))
        jobs = click.Option(
            ["--jobs"], type=click.IntRange(1), default=os.cpu_count(), show_default="all cores", help="Processes."
        )
        out = click.Option(
            ["--out"], type=FOLDER, show_default=str(Path("out") / place), help="Folder for the results."
        )
        text = " ".join(filter(None, (settings.pop("epilog", ""), RESUMES)))
        command = click.Command(
            name,
            callback=click.pass_context(partial(_run, plan, first, place)),
            params=[*own, *([jobs] if parallel else []), out],
            help=plan.__doc__,
            epilog=text,
            **settings,
        )
        return add_command(command)

    return register


def add_command(command: click.Command) -> click.Command:
    """Show a command in the command line; a study is added by `study`."""
    assert command.name is not None
    command.short_help = " ".join((command.help or "").partition("\n\n")[0].split())  # not cut off in the list
    COMMANDS[command.name] = command
    return command


def load_commands() -> dict[str, click.Command]:
    """All commands by name: of the folders of this package, and of other packages."""
    here = import_module(__name__.partition(".")[0])
    for module in iter_modules(here.__path__):
        if module.ispkg:
            import_module(f"{here.__name__}.{module.name}.commands")
    slots()  # loads the modules of other packages
    return COMMANDS


def _run(
    plan: Callable[..., Study],
    first: str,
    place: str,
    context: click.Context,
    /,
    out: Path | None,
    jobs: int = 1,
    **options: Any,
) -> None:
    if not run_study(partial(plan, **options), out or context.obj / place, jobs=jobs, first=first).passed:
        context.exit(1)


def run_study(plan: Callable[[], Study], folder: Path, *, jobs: int = 1, first: str = PAGE) -> Findings:
    """Run a study, write its findings into a folder, and say what was found."""
    with refuse(folder):
        chosen = plan()
        cache = open_cache(folder)
        if cache:
            damaged = f"; {cache.damaged} damaged lines are computed again" if cache.damaged else ""
            click.echo(f"Resuming: {len(cache)} results found in {cache.path}{damaged}")
        before, began = len(cache), time.perf_counter()
        with ProgressBar(chosen.title) as bar:
            found = chosen.run(Work(cache=cache, jobs=jobs, progress=bar.move))
        seconds = time.perf_counter() - began
        written = found.save(folder)
    for sentence in found.text:
        click.echo(sentence)
    if cache:
        click.echo(
            f"{len(cache) - before} results computed in {seconds:.3g} s, {len(cache.reused)} reused from {cache.path}"
        )
    named = next((path for path in written if path.name == first), written[0])
    click.echo(f"written: {named} and {len(written) - 1} more files")
    return found


class RefusedRequest(click.ClickException):
    """Invalid request; shown to the user as one line."""

    exit_code = 2


@contextlib.contextmanager
def refuse(folder: Path) -> Iterator[None]:
    """Turn errors of a request into refusals; `folder` is where the results go."""
    try:
        yield
    except OSError as error:
        at, wanted = Path(error.filename or folder).absolute(), folder.absolute()
        if not at.is_relative_to(wanted) and not wanted.is_relative_to(at):
            raise  # not for want of a place to write
        raise RefusedRequest(f"cannot write to {folder}: {error.strerror}; choose another folder with --out") from None
    except (StudyError, SimulationError, NoEquilibrium) as error:
        raise RefusedRequest(str(error)) from None


class ProgressBar:
    """A bar of the share that is done, created at the first progress so that errors before it are printed alone."""

    def __init__(self, label: str) -> None:
        self.label, self.bar = label, None

    def __enter__(self) -> "ProgressBar":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        if self.bar is not None:
            if kind is None:
                self.move(1.0)
            self.bar.__exit__(None, None, None)

    def move(self, share: float) -> None:
        """Move to the share that is done; never back."""
        if self.bar is None:
            self.bar = click.progressbar(length=1000, label=self.label, show_eta=False)
            self.bar.__enter__()
        self.bar.update(max(int(1000 * share) - self.bar.pos, 0))
