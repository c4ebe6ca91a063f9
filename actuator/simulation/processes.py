"""Processes that work side by side and end with the one that started them, however that ends."""

import contextlib
import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from typing import Any


@contextlib.contextmanager
def processes(count: int, equip: Callable[..., None] | None = None, *arguments: Any) -> Iterator[ProcessPoolExecutor]:
    """An executor of fresh interpreters, as a copy of this one would hold its threads' locks.

    Left by an exception, Ctrl-C among them, it ends its processes in the middle of what they do.

    Parameters
    ----------
    count : int
        Of processes, at most.
    equip : callable or None
        Called with `arguments` in each process before anything else.
    """
    before = multiprocessing.active_children()
    pool = _Pool(count, multiprocessing.get_context("spawn"), _prepare, (equip, arguments))
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


def _prepare(equip: Callable[..., None] | None, arguments: tuple) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    assert parent is not None

    def wait() -> None:
        """Leave no process behind that waits for one that was killed."""
        parent.join()
        os._exit(1)

    threading.Thread(target=wait, daemon=True).start()
    if equip is not None:
        equip(*arguments)
