"""Parts of a study that are made once: taken from what an earlier run has kept, or made and kept."""

from collections.abc import Callable, Iterable, Iterator, MutableMapping
from concurrent.futures import Executor, Future
from functools import partial
from typing import Any, TypeVar

import numpy as np
from cattrs.preconf.json import JsonConverter, make_converter

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

    def __contains__(self, name: str) -> bool:
        return self._key(name) in self._kept

    def _key(self, name: str) -> str:
        return f"{name}, {self._of}"


class KeepingExecutor(Executor):
    """Gives another executor the work that is not kept, and keeps what comes of it as soon as it is there.

    Parameters
    ----------
    executor : Executor
        What works.
    stages : Stages
        Where it is kept, as "`name` 1", "`name` 2", ...
    name : str
        What each piece of work gives.
    kind : type
        The type of that.
    """

    def __init__(self, executor: Executor, stages: Stages, name: str, kind: type) -> None:
        self._executor, self._stages, self._name, self._kind = executor, stages, name, kind

    def map(self, fn: Callable[..., Any], *iterables: Iterable, **options: Any) -> Iterator[Any]:
        """As of an Executor; what is not kept begins at once."""
        begun: list[tuple[str, Future | None]] = []
        for k, arguments in enumerate(zip(*iterables, strict=True)):
            name = f"{self._name} {k + 1}"
            begun.append((name, None if name in self._stages else self._executor.submit(fn, *arguments)))
            if (future := begun[-1][1]) is not None:
                future.add_done_callback(partial(self._keep, name))
        return (self._result(name, future) for name, future in begun)

    def _keep(self, name: str, future: Future) -> None:
        if not future.cancelled() and future.exception() is None:
            self._stages.keep(name, future.result())

    def _result(self, name: str, future: Future | None) -> Any:
        if future is not None:
            return future.result()
        self._stages.taken.append(name)
        return self._stages.read(name, self._kind)
