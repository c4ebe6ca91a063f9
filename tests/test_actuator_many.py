"""Many points of one kind of work: in this process, in others, in any executor; what is done is kept and not repeated.

Oracles: squares; which process did it and how often it built what it needs, by its own account; the operating system.
"""

import multiprocessing
import os
import pickle
import threading
import time
from concurrent.futures import CancelledError, ThreadPoolExecutor

import pytest
from mass_on_guide import MassOnGuide

from actuator import Actuator
from actuator.simulation.many import processes, run_many, submit_many


def square(value):
    return {"square": value**2}


@pytest.mark.parametrize("first_here", [False, True])
def test_many_points_over_processes_keep_their_order_and_progress(first_here):
    seen, points = [], {str(k): k for k in range(8)}
    found = run_many(square, points, workers=2, first_here=first_here, progress=lambda k, n: seen.append((k, n)))
    assert list(found) == [str(k) for k in range(8)]
    assert [result["square"] for result in found.values()] == [k**2 for k in range(8)]
    assert seen == [(k, 8) for k in range(1, 9)]


def test_what_is_done_is_not_computed_again():
    seen = []
    found = run_many(
        square, {"2": 2, "3": 3}, done={"2": {"square": 0}}, workers=1, progress=lambda k, n: seen.append((k, n))
    )
    assert found == {"2": {"square": 0}, "3": {"square": 9}}
    assert seen == [(2, 2)]


def fails(value):
    raise RuntimeError(f"no {value}")


@pytest.mark.parametrize("workers", [1, 2])
def test_what_fails_leaves_what_is_done(workers):
    done = {"0": {"square": 0}}
    with pytest.raises(RuntimeError, match="no 1"):
        run_many(fails, {"0": 0, "1": 1}, done=done, workers=workers)
    assert done == {"0": {"square": 0}}


class Counting:
    """Says who it is and how often it was called, which a copy per point could not."""

    def __init__(self):
        self.calls = 0

    def __call__(self, _):
        self.calls += 1
        return os.getpid(), self.calls


def test_the_first_point_may_be_computed_here_and_work_stays_in_its_process():
    found = list(run_many(Counting(), dict.fromkeys("abcd"), workers=1, first_here=True).values())
    assert found == [(os.getpid(), k) for k in (1, 2, 3, 4)]
    with processes(1) as pool:
        here, *there = run_many(Counting(), dict.fromkeys("abcd"), executor=pool, first_here=True).values()
    assert here == (os.getpid(), 1)
    assert [calls for _, calls in there] == [2, 3, 4]  # from what was sent, with one call behind it
    assert len({pid for pid, _ in there}) == 1 and there[0][0] != os.getpid()


# -- futures ------------------------------------------------------------------------------------------------


def careful(item):
    if item == 3:
        raise ValueError("three")
    return item / 2


def test_results_are_kept_even_where_nobody_asks_for_them():
    done = {"1": "kept"}
    with ThreadPoolExecutor(1) as pool:
        futures = submit_many(careful, {str(k): k for k in (1, 2, 3, 4)}, pool, done=done)
    assert done == {"1": "kept", "2": 1.0, "4": 2.0}
    assert [futures[key].result() for key in "124"] == ["kept", 1.0, 2.0]
    with pytest.raises(ValueError, match="three"):
        futures["3"].result()


class Full(dict):
    """A mapping that cannot be written to."""

    def __setitem__(self, key, value):
        raise OSError("no space left")


def test_a_result_that_cannot_be_kept_is_an_error_of_its_future():
    with ThreadPoolExecutor(1) as pool:
        future = submit_many(careful, {"1": 1}, pool, done=Full())["1"]
        with pytest.raises(OSError, match="no space"):
            future.result()
    with ThreadPoolExecutor(1) as pool, pytest.raises(OSError, match="no space"):
        run_many(careful, {"1": 1}, executor=pool, done=Full())


begin = threading.Event()


def waits(item):
    begin.wait()
    return item


def test_what_is_cancelled_does_not_begin_and_what_has_begun_is_kept():
    begin.clear()
    done = {}
    with ThreadPoolExecutor(1) as pool:
        first, second = submit_many(waits, {"1": 1, "2": 2}, pool, done=done).values()
        while not pool._work_queue.qsize() == 1:
            time.sleep(1e-3)
        second.cancel()
        first.cancel()
        begin.set()
    assert done == {"1": 1}
    for future in (first, second):
        with pytest.raises(CancelledError):
            future.result()


# -- what travels -------------------------------------------------------------------------------------------


def test_an_actuator_travels_without_its_model_and_is_one_where_it_arrives():
    actuator = MassOnGuide().actuator()
    before = pickle.dumps(actuator)
    actuator.system()
    assert pickle.dumps(actuator) == before
    first, again = pickle.loads(before), pickle.loads(pickle.dumps(actuator))
    assert first is again and isinstance(first, Actuator)
    assert first is not actuator and repr(first) == repr(actuator)
    assert first.system() is again.system()


# -- processes ----------------------------------------------------------------------------------------------


def test_processes_end_in_the_middle_of_their_work_where_the_pool_is_left_by_an_exception():
    with pytest.raises(KeyboardInterrupt), processes(1) as pool:
        pid = pool.submit(os.getpid).result()
        assert pid in [child.pid for child in multiprocessing.active_children()]
        pool.submit(time.sleep, 3600)
        raise KeyboardInterrupt
    assert pid not in [child.pid for child in multiprocessing.active_children()]
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)
