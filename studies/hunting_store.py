"""Finished points of a map on disk, by their place in it."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from studies.kept import Kept

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
        self._kept = Kept(self.path)

    def finished(self) -> dict[Index, dict[str, Any]]:
        """Points by index, as the file has them now."""
        self._kept = Kept(self.path)
        return {tuple(json.loads(key)): point for key, point in self._kept.items()}

    def add(self, index: Index, point: Mapping[str, Any]) -> None:
        """Write a point, to the disk and not only to its cache."""
        self._kept[json.dumps(index)] = dict(point)
