"""Results on disk as they come: a mapping whose items are lines of a file, so that an interrupted study can be resumed.

Every study writes what it has finished to one file of its folder, `finished.jsonl`. Its first line says which program
wrote it: the results of another program are not used, and go with the first result of this one. A half-written last
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
from typing import Any, Generic, TypeVar

import numpy as np
from cattrs.preconf.json import JsonConverter, make_converter

FILE = "finished.jsonl"
PACKAGES = ("gear", "controllers", "actuator", "studies")
TEXTS = (".py", ".json")  # what results depend on; case files do so by their numbers, which are part of the keys
LIBRARIES = ("casadi", "control", "matplotlib", "numpy", "scipy")

T = TypeVar("T")


# -- fingerprints -------------------------------------------------------------------------------------------


def fingerprint(*parts: Any) -> str:
    """A hash of actuators, numbers and texts: the same for the same, in every process."""
    text = json.dumps(parts, sort_keys=True, default=repr)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


@cache
def program_fingerprint() -> str:
    """A hash of all that computes and shows a study, as it was when it was first asked for."""
    folders = [Path(str(resources.files(package))) for package in PACKAGES]
    return fingerprint(hash_source(folders), {name: metadata.version(name) for name in LIBRARIES})


def hash_source(folders: Iterable[Path]) -> str:
    """A hash of the program text in folders and all folders below them."""
    found = hashlib.sha256()
    for folder in folders:
        for path in sorted(path for path in folder.rglob("*") if path.suffix in TEXTS):
            found.update(f"{path.relative_to(folder).as_posix()}\n".encode() + path.read_bytes())
    return found.hexdigest()


def _row(line: bytes) -> tuple[str, dict[str, Any]] | None:
    """Key and result of a line of the file; None where it is damaged, and its result has to be computed again."""
    try:
        row = json.loads(line)
        key, result = row["key"], row["result"]
    except (ValueError, KeyError, TypeError):
        return None
    return (key, result) if isinstance(key, str) and isinstance(result, dict) else None


# -- the file -----------------------------------------------------------------------------------------------


class Cache(MutableMapping[str, dict[str, Any]]):
    """Results by key, each written to the file when it is set.

    Parameters
    ----------
    path : Path
        Of the file, which need not exist.
    program : str or None
        Fingerprint of the program that computes them; None for this one.
    """

    def __init__(self, path: Path, program: str | None = None) -> None:
        self.path = path
        self.reused: set[str] = set()  # keys that were in the file and have been read
        self.damaged = 0  # lines of the file that hold no result, after a loss of power or an edit
        self._items: dict[str, dict[str, Any]] = {}
        self._head = json.dumps({"program": program or program_fingerprint()}).encode() + b"\n"
        self._lock = threading.Lock()
        text = path.read_bytes() if path.exists() else b""
        self._begun = text.startswith(self._head)
        if self._begun:
            whole = text[: text.rfind(b"\n") + 1]
            if len(whole) < len(text):
                os.truncate(path, len(whole))
            rows = [_row(line) for line in whole[len(self._head) :].splitlines()]
            self._items = dict(row for row in rows if row is not None)
            self.damaged = rows.count(None)
        self._loaded = frozenset(self._items)

    def __getitem__(self, key: str) -> dict[str, Any]:
        item = self._items[key]
        if key in self._loaded:
            self.reused.add(key)
        return item

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
        raise TypeError(f"{self.path}: results cannot be deleted one by one; delete the file")

    def __contains__(self, key: object) -> bool:
        return key in self._items

    def __iter__(self) -> Iterator[str]:
        return iter(self._items)

    def __len__(self) -> int:
        return len(self._items)


def open_cache(folder: Path) -> Cache:
    """The results of the studies in a folder; it is made, and written to, before hours go into it.

    Raises
    ------
    OSError
        Where it cannot be.
    """
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryFile(dir=folder):
        pass
    return Cache(folder / FILE)


# -- steps of a study ---------------------------------------------------------------------------------------


def _converter() -> JsonConverter:
    """Dataclasses and named tuples to JSON and back, every number as it was; arrays of one dimension among them."""
    made = make_converter()
    made.register_unstructure_hook(np.ndarray, lambda array: [str(array.dtype), array.tobytes().hex()])
    made.register_structure_hook(np.ndarray, lambda row, _: np.frombuffer(bytes.fromhex(row[1]), row[0]).copy())
    made.register_unstructure_hook(complex, lambda number: [number.real, number.imag])
    made.register_structure_hook(complex, lambda pair, _: complex(*pair))
    return made


CONVERTER = _converter()


class StepError(Exception):
    """A step that has no result; the message says why."""


class Steps:
    """Steps of one study, each computed once: taken from the cache, or computed and put there.

    Parameters
    ----------
    cache : mutable mapping of str to dict
        Finished steps, of this study and of others; None to cache nothing.
    of : str
        A fingerprint of all that the steps depend on besides the program.
    """

    def __init__(self, cache: MutableMapping[str, dict[str, Any]] | None = None, of: str = "") -> None:
        self._cache: MutableMapping[str, dict[str, Any]] = {} if cache is None else cache
        self._of = of

    def compute(self, name: str, kind: type[T], work: Callable[[], T], *, failures: tuple = ()) -> T:
        """The result of that name and type, computed only where it is not in the cache.

        Raises
        ------
        StepError
            Where the work raised one of `failures`, now or then: they are cached, too.
        """
        if name not in self:
            try:
                self.put(name, work())
            except failures as error:
                self._cache[self._key(name)] = {"missing": str(error)}
        return self.read(name, kind)

    def read(self, name: str, kind: type[T]) -> T:
        """The result of that name, which is in the cache; errors as of `compute`."""
        row = self._cache[self._key(name)]
        if "missing" in row:
            raise StepError(row["missing"])
        return CONVERTER.structure(row["part"], kind)

    def put(self, name: str, result: Any) -> None:
        """Put a result into the cache."""
        self._cache[self._key(name)] = {"part": CONVERTER.unstructure(result)}

    def results(self, kind: type[T]) -> "StepResults[T]":
        """Those of one type by name, as `run_many` takes finished points."""
        return StepResults(self, kind)

    def __contains__(self, name: object) -> bool:
        return self._key(str(name)) in self._cache

    def _key(self, name: str) -> str:
        return f"{name}, {self._of}"


class StepResults(MutableMapping[str, T], Generic[T]):
    """Results of one type by the names of their steps."""

    def __init__(self, steps: Steps, kind: type[T]) -> None:
        self._steps, self._kind, self._put = steps, kind, set[str]()

    def __getitem__(self, name: str) -> T:
        return self._steps.read(name, self._kind)

    def __setitem__(self, name: str, result: T) -> None:
        self._steps.put(name, result)
        self._put.add(name)

    def __contains__(self, name: object) -> bool:
        return name in self._steps

    def __delitem__(self, name: str) -> None:
        raise TypeError("steps are not deleted")

    def __iter__(self) -> Iterator[str]:
        return iter(self._put)

    def __len__(self) -> int:
        return len(self._put)
