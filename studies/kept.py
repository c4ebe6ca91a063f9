"""Results kept on disk as they come: a mapping whose items are lines of a file, so that a study can go on later.

Every study keeps what it has finished in one file of its folder, `finished.jsonl`. Its first line says which program
wrote it: what another one found is not used again, and goes with the first result of this one. A half-written last
line is what a kill leaves; it is dropped, and its point computed again.
"""

import hashlib
import json
import os
import tempfile
import threading
from collections.abc import Iterable, Iterator, MutableMapping
from functools import cache
from importlib import metadata, resources
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from actuator import Actuator

FILE = "finished.jsonl"
PACKAGES = ("gear", "controllers", "actuator", "studies")
TEXTS = (".py", ".json")  # what results depend on; case files do so by their numbers, which are part of the keys
LIBRARIES = ("casadi", "control", "matplotlib", "numpy", "scipy")


class Kept(MutableMapping[str, dict[str, Any]]):
    """Results by key, each written to the file when it is set.

    Parameters
    ----------
    path : Path
        Of the file, which need not exist.
    by : str or None
        The program that found them; None for this one.
    """

    def __init__(self, path: Path, by: str | None = None) -> None:
        self.path = path
        self._items: dict[str, dict[str, Any]] = {}
        self._head = json.dumps({"program": by or program()}).encode() + b"\n"
        self._lock = threading.Lock()
        text = path.read_bytes() if path.exists() else b""
        self._begun = text.startswith(self._head)
        if self._begun:
            whole = text[: text.rfind(b"\n") + 1]
            if len(whole) < len(text):
                os.truncate(path, len(whole))
            rows = map(json.loads, whole[len(self._head) :].splitlines())
            self._items = {row["key"]: row["result"] for row in rows}

    def __getitem__(self, key: str) -> dict[str, Any]:
        return self._items[key]

    def __setitem__(self, key: str, result: dict[str, Any]) -> None:
        row = json.dumps({"key": key, "result": result}).encode() + b"\n"
        with self._lock:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            with self.path.open("ab" if self._begun else "wb") as file:
                file.write(row if self._begun else self._head + row)
                file.flush()
                os.fsync(file.fileno())
            self._begun = True
            self._items[key] = result

    def __delitem__(self, key: str) -> None:
        raise TypeError(f"{self.path}: what is kept is not taken back; remove the file")

    def __iter__(self) -> Iterator[str]:
        return iter(self._items)

    def __len__(self) -> int:
        return len(self._items)


def kept_in(folder: Path) -> Kept:
    """What is finished of the studies in a folder; it is made, and written to, before hours go into it.

    Raises
    ------
    OSError
        Where it cannot be.
    """
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryFile(dir=folder):
        pass
    return Kept(folder / FILE)


@cache
def program() -> str:
    """A fingerprint of all that computes and shows a study, as it was when it was first asked for."""
    folders = [Path(str(resources.files(package))) for package in PACKAGES]
    return fingerprint([source(folders), {name: metadata.version(name) for name in LIBRARIES}])


def source(folders: Iterable[Path]) -> str:
    """A hash of the program text in folders and all folders below them."""
    found = hashlib.sha256()
    for folder in folders:
        for path in sorted(path for path in folder.rglob("*") if path.suffix in TEXTS):
            found.update(f"{path.relative_to(folder).as_posix()}\n".encode() + path.read_bytes())
    return found.hexdigest()


def fingerprint(what: Any) -> str:
    """Of numbers and words: the same for the same, in every process."""
    text = json.dumps(what, sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def actuator_of(actuator: "Actuator", *others: Any) -> str:
    """Of an actuator, by all its parts, choices and numbers, and of what else a result depends on."""
    return fingerprint([repr(actuator), *map(repr, others)])
