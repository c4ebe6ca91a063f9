"""Findings of a study and how they are written: pictures, numbers, sentences, tables, a page. All files or none."""

import base64
import io
import json
import math
import os
import platform
import shutil
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

from jinja2 import Environment, PackageLoader, StrictUndefined

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LIBRARIES = ("geared-actuator", "casadi", "control", "numpy", "scipy", "matplotlib")
DPI = 130
RESULT, TEXT, PAGE, WRITING = "result.json", "findings.txt", "report.html", ".writing-"


@dataclass(frozen=True, kw_only=True)
class Findings:
    """Findings of a study.

    Parameters
    ----------
    pictures : mapping of str to Figure or bytes
        By name; bytes are a PNG file.
    result : dict
        All numbers, for result.json.
    text : list of str
        Sentences, the most important first.
    files : mapping of str to str or callable
        Further files by name: the text, or a callable that writes to a path.
    page : callable or None
        Renders report.html from the pictures, by name, in base64.
    passed : bool
        Whether all checks of the study passed; otherwise its command exits with 1.
    """

    pictures: "Mapping[str, Figure | bytes]"
    result: dict[str, Any]
    text: list[str]
    files: Mapping[str, str | Callable[[Path], None]] = field(default_factory=dict)
    page: Callable[[Mapping[str, str]], str] | None = None
    passed: bool = True

    def save(self, folder: Path) -> list[Path]:
        """Write all files into `folder`, in place of those of an earlier result; returns their paths.

        On a failure none is written and the earlier files are restored. A kill in between leaves no result.json, which
        is written last.
        """
        folder.mkdir(parents=True, exist_ok=True)
        for left in folder.glob(f"{WRITING}*"):  # by a run that was killed
            shutil.rmtree(left, ignore_errors=True)
        earlier = _written_before(folder)
        with tempfile.TemporaryDirectory(dir=folder, prefix=WRITING) as hidden:
            work, aside = Path(hidden) / "new", Path(hidden) / "old"
            work.mkdir()
            aside.mkdir()
            self._write(work)
            names = sorted([RESULT, *(path.name for path in work.iterdir())])
            result = json.dumps({**replace_nonfinite(self.result), "files": names}, indent=2, allow_nan=False)
            (work / RESULT).write_text(result + "\n")
            _exchange(folder, work, aside, sorted(earlier | set(names), key=lambda name: (name == RESULT, name)))
        return [folder / name for name in names]

    def _write(self, folder: Path) -> None:
        """Everything but the numbers."""
        images = {
            name: picture if isinstance(picture, bytes) else png(picture) for name, picture in self.pictures.items()
        }
        files: dict[str, str | Callable[[Path], None]] = {TEXT: "\n\n".join(self.text) + "\n", **self.files}
        if self.page is not None:
            files[PAGE] = self.page({name: base64.b64encode(image).decode() for name, image in images.items()})
        for name, image in images.items():
            (folder / f"{name}.png").write_bytes(image)
        for name, content in files.items():
            if isinstance(content, str):
                (folder / name).write_text(content, encoding="utf-8", newline="")
            else:
                content(folder / name)


def _exchange(folder: Path, new: Path, aside: Path, names: list[str]) -> None:
    """Move files into a folder and those they replace aside; the last name is removed first and written last.

    A directory in the way stays, and is a failure.
    """
    moved: list[tuple[Path, Path]] = []

    def move(source: Path, target: Path) -> None:
        os.replace(source, target)
        moved.append((source, target))

    try:
        for name in reversed(names):
            if (folder / name).is_file():
                move(folder / name, aside / name)
        for name in names:
            if (new / name).exists():
                move(new / name, folder / name)
    except BaseException:
        for source, target in reversed(moved):
            os.replace(target, source)
        raise


def _written_before(folder: Path) -> set[str]:
    """Names of the files that the result in a folder lists."""
    try:
        names = json.loads((folder / RESULT).read_text(encoding="utf-8"))["files"]
        return {name for name in names if Path(name).name == name}
    except (OSError, ValueError, KeyError, TypeError):  # no result, or none of these studies
        return set()


def png(figure: "Figure") -> bytes:
    """A figure as a picture."""
    image = io.BytesIO()
    figure.savefig(image, dpi=DPI, format="png")
    return image.getvalue()


def render(template: str, filters: Mapping[str, Callable[..., str]] | None = None, **values: Any) -> str:
    """Render a template; every value that it uses must be given, and `made` is the time."""
    environment = Environment(loader=PackageLoader("studies"), autoescape=True, undefined=StrictUndefined)
    environment.filters |= dict(filters or {})
    return environment.get_template(template).render(made=datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"), **values)


def versions(*more: str) -> dict[str, str]:
    """Versions of Python and of the libraries that a result depends on."""
    return {"python": platform.python_version()} | {name: _version(name) for name in (*LIBRARIES, *more)}


def _version(library: str) -> str:
    try:
        return metadata.version(library)
    except metadata.PackageNotFoundError:  # run from a checkout that is not installed
        return "not installed"


def replace_nonfinite(value: Any) -> Any:
    """The same for JSON, with None in place of numbers that are not finite."""
    if isinstance(value, dict):
        return {key: replace_nonfinite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [replace_nonfinite(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
