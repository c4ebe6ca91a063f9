"""Case files on disk: TOML, one built upon another with `base`, and what is wrong with them in one line."""

import json
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any, NamedTuple

from studies.units import split

Table = dict[str, Any]
Steps = tuple[str | int, ...]  # the way to a value through tables and lists, in names of fields
LONGEST = 60  # characters of a value in a message
LONGEST_PATH = 1000  # characters of a base; no system takes names that are much longer


class StudyError(ValueError):
    """What was asked for cannot be done; the message is one line, with what is allowed instead."""


class CaseError(StudyError):
    """A case file that cannot be used; the message names the file, the key, the value and what is allowed."""


class Source(NamedTuple):
    """One file as it was written."""

    file: Traversable
    table: Table


@dataclass(frozen=True, kw_only=True)
class CaseFile:
    """A case as read, not yet checked.

    Parameters
    ----------
    sources : sequence of Source
        The file itself, its base, the base of that, and so on.
    table : dict
        All of them merged.
    """

    sources: Sequence[Source]
    table: Table

    def error(self, steps: Steps, text: str, *, with_value: bool = False) -> CaseError:
        """What is wrong at `steps`, in the file in which that key stands and as it is spelled there."""
        keys, value = _spelled(self.table, steps)
        source = next(
            (source for source in self.sources if _spelled(source.table, steps)[1] is not None), self.sources[0]
        )
        where = "".join(_step(key) for key in keys).removeprefix(".")
        if with_value or keys[-1:] != steps[-1:]:
            where += f" = {show(value)}"
        return CaseError(f"{source.file}: {where} {text}" if where else f"{source.file}: {text}")


def show(value: Any) -> str:
    """A value as it stands in the file, on one short line; of tables and lists only that."""
    match value:
        case dict():
            return "a table"
        case list():
            return "a list"
        case bool() | str():
            text = json.dumps(value, ensure_ascii=False)
        case _:
            text = str(value)
    return text if len(text) <= LONGEST else f"{text[:LONGEST]}..."


def _step(key: str | int) -> str:
    if isinstance(key, int):
        return f"[{key}]"
    bare = key.isascii() and key.replace("-", "_").isidentifier()
    return f".{key}" if bare else f".{json.dumps(key, ensure_ascii=False)}"


def _spelled(table: Any, steps: Steps) -> tuple[Steps, Any]:
    """The same way in keys of the file, with their unit suffixes, and the value there (None: missing)."""
    keys: list[str | int] = []
    for step in steps:
        key = step
        if isinstance(table, dict):
            key = step if step in table else next((key for key in table if split(key).name == step), step)
            table = table.get(key)
        else:
            table = table[step] if isinstance(table, list) and isinstance(step, int) else None
        keys.append(key)
    return tuple(keys), table


def built_in_files() -> dict[str, Traversable]:
    """The cases that come with the package, by name."""
    folder = resources.files("studies") / "data"
    found = {file.name.removesuffix(".toml"): file for file in folder.iterdir() if file.name.endswith(".toml")}
    return dict(sorted(found.items()))


def names_of_cases() -> str:
    """Names of the built-in cases, for messages."""
    return ", ".join(built_in_files())


def locate(name: str | Path, folder: Path) -> Traversable:
    """A built-in case by its name, else a file, relative to `folder`."""
    built_in = built_in_files().get(name) if isinstance(name, str) else None
    return built_in or (folder / name).resolve()


def read(file: Traversable) -> CaseFile:
    """Read a file and everything it is based on.

    The tables of a file are merged into those of its `base`, key by key. A table that names another
    `type` than its base replaces it whole.

    Raises
    ------
    CaseError
        For a file that is missing or not TOML, and for bases that go in a circle.
    """
    sources: list[Source] = []
    following: Traversable | None = file
    while following is not None:
        if any(following == source.file for source in sources):
            circle = " -> ".join(str(link) for link in [*(source.file for source in sources), following])
            raise CaseError(f"{file}: base goes in a circle: {circle}")
        sources.append(Source(following, _parse(following, sources)))
        following = _base(sources[-1])
    merged: Table = {}
    for source in reversed(sources):
        merged = _merge(merged, {key: value for key, value in source.table.items() if key != "base"})
    return CaseFile(sources=sources, table=merged)


def _parse(file: Traversable, readers: Sequence[Source]) -> Table:
    asked = f"{readers[-1].file}: base = {show(readers[-1].table['base'])}: " if readers else ""
    try:
        return tomllib.loads(file.read_bytes().decode("utf-8-sig"))
    except OSError as error:
        reason = f"cannot be read: {error.strerror}; the built-in cases are {names_of_cases()}"
        raise CaseError(f"{asked}{file}: {reason}") from None
    except UnicodeDecodeError as error:
        raise CaseError(f"{asked}{file}: not valid TOML: not UTF-8 text at byte {error.start}") from None
    except ValueError as error:  # TOMLDecodeError, and what Python says to a number of thousands of digits
        raise CaseError(f"{asked}{file}: not valid TOML: {error}") from None
    except RecursionError:
        raise CaseError(f"{asked}{file}: not valid TOML: nested too deeply") from None


def _base(source: Source) -> Traversable | None:
    base = source.table.get("base")
    if base is None:
        return None
    if not isinstance(base, str):
        raise CaseError(f"{source.file}: base = {show(base)} must be the name of a built-in case or a relative path")
    if not base.isprintable() or len(base) > LONGEST_PATH:
        raise CaseError(f"{source.file}: base = {show(base)}: no such file; the built-in cases are {names_of_cases()}")
    return locate(base, source.file.parent if isinstance(source.file, Path) else Path())


def _merge(base: Mapping[str, Any], own: Mapping[str, Any]) -> Table:
    if "type" in own and own["type"] != base.get("type", own["type"]):
        return dict(own)
    # a number may be given anew in another unit
    replaced = {split(key).name for key, value in own.items() if not isinstance(value, dict)}
    merged = {key: value for key, value in base.items() if isinstance(value, dict) or split(key).name not in replaced}
    for key, value in own.items():
        present = merged.get(key)
        merged[key] = _merge(present, value) if isinstance(value, dict) and isinstance(present, dict) else value
    return merged
