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
from collections.abc import Callable, Iterable, Iterator, MutableMapping
from functools import cache
from importlib import metadata, resources
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from cattrs.preconf.json import JsonConverter, make_converter

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


T = TypeVar("T")


def _converter() -> JsonConverter:
    """Dataclasses and named tuples to JSON and back, every number as it was; arrays of one dimension among them."""
    made = make_converter()
    made.register_unstructure_hook(np.ndarray, lambda array: [str(array.dtype), array.tobytes().hex()])
    made.register_structure_hook(np.ndarray, lambda row, _: np.frombuffer(bytes.fromhex(row[1]), row[0]).copy())
    made.register_unstructure_hook(complex, lambda number: [number.real, number.imag])
    made.register_structure_hook(complex, lambda pair, _: complex(*pair))
    return made


CONVERTER = _converter()


class Missing(Exception):
    """A part that cannot be made; the message says why."""


class Stages:
    """The parts of one study.

    Parameters
    ----------
    kept : mutable mapping of str to dict
        What is finished, of this study and of others; None to keep nothing.
    of : str
        A fingerprint of all that the parts depend on besides the program.
    """

    def __init__(self, kept: MutableMapping[str, dict[str, Any]] | None = None, of: str = "") -> None:
        self._kept: MutableMapping[str, dict[str, Any]] = {} if kept is None else kept
        self._of = of
        self.taken: list[str] = []  # names of parts that were there

    def get(self, name: str, kind: type[T], make: Callable[[], T], *, failures: tuple = ()) -> T:
        """The part of that name and type, made only where it is not kept.

        Raises
        ------
        Missing
            Where making it raised one of `failures`, now or then: they are kept, too.
        """
        key = self._key(name)
        if key in self._kept:
            self.taken.append(name)
        else:
            try:
                self.keep(name, make())
            except failures as error:
                self._kept[key] = {"missing": str(error)}
        return self.read(name, kind)

    def read(self, name: str, kind: type[T]) -> T:
        """The part of that name, which is kept; errors as of `get`."""
        row = self._kept[self._key(name)]
        if "missing" in row:
            raise Missing(row["missing"])
        return CONVERTER.structure(row["part"], kind)

    def keep(self, name: str, part: Any) -> None:
        """Keep a part under a name."""
        self._kept[self._key(name)] = {"part": CONVERTER.unstructure(part)}

    def of(self, kind: type[T]) -> MutableMapping[str, T]:
        """Parts of a type by name, as the `done` of `run_many`."""
        return _Parts(self, kind)

    def __contains__(self, name: object) -> bool:
        return self._key(name) in self._kept

    def _key(self, name: object) -> str:
        return f"{name}, {self._of}"


class _Parts(MutableMapping[str, T]):
    """Parts of one type, as whoever makes many of them reads and writes them."""

    def __init__(self, stages: Stages, kind: type[T]) -> None:
        self._stages, self._kind, self._made = stages, kind, set()

    def __contains__(self, name: object) -> bool:
        return name in self._stages

    def __getitem__(self, name: str) -> T:
        if name not in self._made:
            self._stages.taken.append(name)
        return self._stages.read(name, self._kind)

    def __setitem__(self, name: str, part: T) -> None:
        self._made.add(name)
        self._stages.keep(name, part)

    def __delitem__(self, name: str) -> None:
        raise TypeError(f"{name}: what is kept is not taken back")

    def __iter__(self) -> Iterator[str]:
        raise TypeError("what is kept is asked for by name")

    def __len__(self) -> int:
        raise TypeError("what is kept is asked for by name")
