"""Finished points of a map on disk: one line each, written as they come, so that a kill costs no more than one.

A half-written last line is what a kill leaves; it is dropped, and its point computed again.
"""

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

Index = tuple[int, int, int]  # corner, row, column


class PointStore:
    """The points of one map in one file; `fingerprint` says of which.

    Parameters
    ----------
    folder : Path
        Where the file stands.
    fingerprint : str
        A map with another one has another file.
    """

    def __init__(self, folder: Path, fingerprint: str) -> None:
        self.path = folder / f"points-{fingerprint}.jsonl"

    def finished(self) -> dict[Index, dict[str, Any]]:
        """Points by index; a last line that is not whole is cut off."""
        if not self.path.exists():
            return {}
        text = self.path.read_bytes()
        whole = text[: text.rfind(b"\n") + 1]
        if len(whole) < len(text):
            with self.path.open("r+b") as file:
                file.truncate(len(whole))
        rows = [json.loads(line) for line in whole.splitlines()]
        return {tuple(row["index"]): row["point"] for row in rows}

    def add(self, index: Index, point: Mapping[str, Any]) -> None:
        """Write a point, to the disk and not only to its cache."""
        self.path.parent.mkdir(parents=True, exist_ok=True)
        with self.path.open("a", encoding="utf-8") as file:
            file.write(json.dumps({"index": index, "point": point}) + "\n")
            file.flush()
            os.fsync(file.fileno())
