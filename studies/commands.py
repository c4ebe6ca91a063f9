"""What the commands share: options, progress, what was kept, and refusals in one line."""

import contextlib
import os
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import click

from studies.cache import Kept, kept_in

RESUMES = "What was interrupted goes on where it stopped when the same command is given again."
FOLDER = click.Path(file_okay=False, path_type=Path)
JOBS = click.option(
    "--jobs", type=click.IntRange(1), default=os.cpu_count(), show_default="all cores", help="Processes."
)


def out_option(default: str) -> Callable:
    """--out, in the folder of the whole unless it is given."""
    return click.option(
        "--out", type=FOLDER, default=None, help="Folder for the results.", show_default=f"out/{default}"
    )


class Refused(click.ClickException):
    """What was asked for cannot be done; its one line is all that is shown."""

    exit_code = 2


@contextlib.contextmanager
def refusing(folder: Path, *errors: type[Exception]) -> Iterator[None]:
    """Turn errors into refusals; `folder` is where is written."""
    try:
        yield
    except OSError as error:
        at = Path(error.filename or folder)
        if not at.is_relative_to(folder) and not folder.is_relative_to(at):
            raise  # not for want of a place to write
        raise Refused(f"cannot write to {folder}: {error.strerror}; choose another folder with --out") from None
    except errors as error:
        raise Refused(str(error)) from None


def begun(folder: Path) -> Kept:
    """What is finished in a folder; where there is something, it is said."""
    kept = kept_in(folder)
    if kept:
        click.echo(f"{kept.path} holds {len(kept)} results; those of this study are not computed again")
    return kept


@contextlib.contextmanager
def shares(label: str) -> Iterator[Callable[[float], None]]:
    """A progress bar that is moved by the share that is done."""
    with click.progressbar(length=1000, label=label, show_eta=False) as bar:
        yield lambda share: bar.update(max(int(1000 * share) - bar.pos, 0))


def announce(text: Sequence[str], written: Sequence[Path], first: str) -> None:
    """Say what was found, and what was written, the file `first` by its name."""
    for sentence in text:
        click.echo(sentence)
    named = next(path for path in written if path.name == first)
    click.echo(f"written: {named} and {len(written) - 1} more files")


class LateBar:
    """Progress bar, created at the first progress so that errors before it are printed alone."""

    def __init__(self, label: str) -> None:
        self.label, self.bar = label, None

    def move(self, done: float, length: int) -> None:
        """Move to what is done; never back."""
        if self.bar is None:
            self.bar = click.progressbar(length=length, label=self.label, show_eta=False)
            self.bar.__enter__()
        self.bar.update(max(int(done) - self.bar.pos, 0))

    def finish(self) -> None:
        """Fill it and end its line."""
        if self.bar is not None:
            self.bar.update((self.bar.length or 0) - self.bar.pos)
            self.bar.__exit__(None, None, None)
