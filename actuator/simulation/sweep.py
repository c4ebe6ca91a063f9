"""Many points of one kind: in parallel, with progress, and without repeating those that are done."""

import os
from collections.abc import Callable, Mapping, MutableMapping
from concurrent.futures import as_completed
from typing import Any

from actuator.simulation.processes import processes

_work: Callable[[Any], dict[str, Any]] | None = None


def sweep(
    work: Callable[[Any], dict[str, Any]],
    points: Mapping[str, Any],
    *,
    done: MutableMapping[str, dict[str, Any]] | None = None,
    workers: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> dict[str, dict[str, Any]]:
    """Results of all points by their keys.

    Parameters
    ----------
    work : callable
        From a point to a dictionary of numbers and words; both go through pickle.
    points : mapping of str to any
        By keys that name them and all that their results depend on.
    done : mutable mapping of str to dict or None
        Finished points; each new one is put in as soon as it is there, so that whoever keeps them can go on later.
    workers : int or None
        Processes; None for all cores, 1 for this one.
    progress : callable or None
        Called with the number of finished points, and of all.

    Returns
    -------
    dict of str to dict
        In the order of `points`.
    """
    done = {} if done is None else done
    missing = {key: point for key, point in points.items() if key not in done}
    finished = len(points) - len(missing)
    workers = min(workers or os.cpu_count() or 1, max(len(missing), 1))

    def note(key: str, result: dict[str, Any]) -> None:
        nonlocal finished
        done[key] = result
        finished += 1
        if progress is not None:
            progress(finished, len(points))

    if workers == 1:
        for key, point in missing.items():
            note(key, work(point))
    else:
        with processes(workers, _equip, work) as pool:
            futures = {pool.submit(_call, point): key for key, point in missing.items()}
            for future in as_completed(futures):
                note(futures[future], future.result())
    return {key: done[key] for key in points}


def _equip(work: Callable[[Any], dict[str, Any]]) -> None:
    """Give a worker what it is to do, once."""
    global _work  # noqa: PLW0603 - a process has one task
    _work = work


def _call(point: Any) -> dict[str, Any]:
    assert _work is not None
    return _work(point)
