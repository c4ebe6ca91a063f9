"""Many points of one kind of work: side by side, with progress, each result kept as soon as it is there.

    run_many(work, points)              results of all points, in processes of this machine or any other executor
    submit_many(work, points, pool)     the same as futures, for a caller that does other things meanwhile
    processes(count)                    the executor of this machine, whose processes end with the one that started them

The contract, which all studies share:

* `work` is a callable of one point. `points` maps a key to each point; the key names the point and all that its result
  depends on (model, numbers, settings), so that a result under the same key may be used again.
* `done` maps keys to results. What is in it is not computed again; what is computed is put in at once, by one thread at
  a time, before anybody is told of it. Any mutable mapping will do: a dictionary, a file, or a view that converts.
* `work`, points and results go through pickle where there is more than one process. Work travels once per process and
  is kept there with all that it builds; an actuator travels by its numbers, and is built once per process (`Actuator`).
* What raises ends the whole: what was finished until then is in `done`.
"""

import contextlib
import multiprocessing
import os
import pickle  # what a process of ours was given by this one
import signal
import threading
from collections.abc import Callable, Iterator, Mapping, MutableMapping
from concurrent.futures import Executor, Future, ProcessPoolExecutor, as_completed
from functools import lru_cache, partial
from typing import Any, TypeVar

Point = TypeVar("Point")
Result = TypeVar("Result")
WORKS = 4  # kinds of work that a process keeps with what they have built


def run_many(  # noqa: PLR0913 - what is run, and how
    work: Callable[[Point], Result],
    points: Mapping[str, Point],
    *,
    done: MutableMapping[str, Result] | None = None,
    workers: int | None = None,
    executor: Executor | None = None,
    first_here: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> dict[str, Result]:
    """Results of all points by their keys, in the order of `points`.

    Parameters
    ----------
    work, points, done
        The contract is above; without `done` nothing is taken from before.
    workers : int or None
        Processes; None for all cores, 1 for this one.
    executor : Executor or None
        Computes instead of processes of this machine: Dask's, say.
    first_here : bool
        Compute the first missing point in this process before there are others: it compiles the model for all.
    progress : callable or None
        Called with the numbers of finished and of all points, after each that is computed.
    """
    done = {} if done is None else done
    missing = {key: point for key, point in points.items() if key not in done}
    finished = len(points) - len(missing)

    def note() -> None:
        nonlocal finished
        finished += 1
        if progress is not None:
            progress(finished, len(points))

    workers = min(workers or os.cpu_count() or 1, max(len(missing), 1))
    alone = workers == 1 and executor is None
    for key in list(missing) if alone else list(missing)[: int(first_here)]:
        done[key] = work(missing.pop(key))
        note()
    if missing:
        pool = contextlib.nullcontext(executor) if executor else processes(min(workers, len(missing)))
        with pool as running:
            futures = submit_many(work, missing, running, done=done).values()
            try:
                for future in as_completed(futures):
                    future.result()
                    note()
            except BaseException:
                for future in futures:
                    future.cancel()
                raise
    return {key: done[key] for key in points}


def submit_many(
    work: Callable[[Point], Result],
    points: Mapping[str, Point],
    executor: Executor,
    *,
    done: MutableMapping[str, Result] | None = None,
) -> dict[str, Future[Result]]:
    """Futures of all points by their keys: those in `done` are finished, the others begin in the executor.

    A result is put into `done` even where nobody asks its future; the future raises where that fails, too. To cancel
    it cancels its work, as far as that has not begun.
    """
    done, lock = {} if done is None else done, threading.Lock()
    packed = pickle.dumps(work)
    found: dict[str, Future[Result]] = {}
    for key, point in points.items():
        found[key] = Future()
        if key in done:
            found[key].set_result(done[key])
        else:
            begun = executor.submit(_call, packed, point)
            found[key].add_done_callback(partial(_pass_cancel, begun))
            begun.add_done_callback(partial(_keep, key, done, lock, found[key]))
    return found


def _pass_cancel(begun: Future, promise: Future) -> None:
    if promise.cancelled():
        begun.cancel()


def _keep(key: str, done: MutableMapping[str, Any], lock: threading.Lock, promise: Future, begun: Future) -> None:
    """Keep what was computed, then tell it, or what was raised."""
    try:
        result, error = begun.result(), None
        with lock:
            done[key] = result
    except BaseException as raised:  # of any kind: who asks the promise hears of it
        result, error = None, raised
    if not promise.set_running_or_notify_cancel():
        return
    if error is None:
        promise.set_result(result)
    else:
        promise.set_exception(error)


def _call(packed: bytes, point: Any) -> Any:
    return _unpacked(packed)(point)


@lru_cache(maxsize=WORKS)
def _unpacked(packed: bytes) -> Callable[[Any], Any]:
    return pickle.loads(packed)  # packed by `submit_many`


@contextlib.contextmanager
def processes(count: int) -> Iterator[ProcessPoolExecutor]:
    """An executor of at most so many fresh interpreters, as a copy of this one would hold its threads' locks.

    Left by an exception, Ctrl-C among them, it ends its processes in the middle of what they do.
    """
    before = multiprocessing.active_children()
    pool = _Pool(count, multiprocessing.get_context("spawn"), _prepare)
    try:
        yield pool
    except BaseException:
        for child in multiprocessing.active_children():
            if child not in before:
                child.terminate()
        raise
    finally:
        pool.shutdown(cancel_futures=True)


class _Pool(ProcessPoolExecutor):
    """Its processes do not hear of Ctrl-C, from their first moment on: the one that started them ends them."""

    def submit(self, function: Callable[..., Any], /, *arguments: Any, **options: Any) -> Future:
        """Starts a process where none is idle; what is blocked here stays blocked in it."""
        if not hasattr(signal, "pthread_sigmask"):
            return super().submit(function, *arguments, **options)
        mask = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
        try:
            return super().submit(function, *arguments, **options)
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, mask)


def _prepare() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    assert parent is not None

    def wait() -> None:
        """Leave no process behind that waits for one that was killed."""
        parent.join()
        os._exit(1)

    threading.Thread(target=wait, daemon=True).start()
