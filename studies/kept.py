"""Results kept on disk as they come: a mapping whose items are lines of a file, so that a study can go on later.

A half-written last line is what a kill leaves; it is dropped, and its point computed again.
"""

import hashlib
import json
import os
from collections.abc import Iterator, Mapping, MutableMapping
from pathlib import Path
from typing import Any


class Kept(MutableMapping[str, dict[str, Any]]):
    """Results by key, each written to the file when it is set.

    Parameters
    ----------
    path : Path
        Of the file, which need not exist.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._items: dict[str, dict[str, Any]] = {}
        if path.exists():
            text = path.read_bytes()
            whole = text[: text.rfind(b"\n") + 1]
            if len(whole) < len(text):
                with path.open("r+b") as file:
                    file.truncate(len(whole))
            self._items = {row["key"]: row["result"] for row in map(json.loads, whole.splitlines())}

    def __getitem__(self, key: str) -> dict[str, Any]:
        return self._items[key]

    def __setitem__(self, key: str, result: dict[str, Any]) -> None:
        self.path.parent.mkdir(parents=True, exist_ok=True)
        with self.path.open("a", encoding="utf-8") as file:
            file.write(json.dumps({"key": key, "result": result}) + "\n")
            file.flush()
            os.fsync(file.fileno())
        self._items[key] = result

    def __delitem__(self, key: str) -> None:
        raise TypeError(f"{self.path}: what is kept is not taken back; remove the file")

    def __iter__(self) -> Iterator[str]:
        return iter(self._items)

    def __len__(self) -> int:
        return len(self._items)


def fingerprint(what: Any) -> str:
    """Of numbers and words: the same for the same, in every process."""
    text = json.dumps(what, sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def model_of(parameters: Mapping[str, float], words: str = "") -> str:
    """Of a model, by all its numbers."""
    return fingerprint([words, dict(parameters)])
