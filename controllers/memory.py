"""What a control law remembers, and the contract of laws that remember something."""

from typing import Any, Protocol

from gear.quantities import Memory, Scalar

__all__ = ["LawWithMemory", "Memory"]


class LawWithMemory(Protocol):
    """A law whose output depends on the past. The law is frozen: its memory is passed in, and a new one returned.

    `memory` arguments are lists of scalars in the order of the declaration, `inputs` are scalars. Everything
    is written once for floats and CasADi expressions. The same law works in two forms, and who uses it
    decides which:

        continuous    y = output(memory, *inputs),             memory' = rates(memory, *inputs)
        sampled       y = output(memory, *inputs, period=h),   memory  = advance(memory, *inputs, period=h)

    At a tick the output is taken first, then the memory is advanced, exactly once, with the inputs of that
    same tick. Both forms have the same memory with the same meaning at rest, so a law can be started from the
    equilibrium of either. A law whose signal may be anything takes its unit and usual size in `memory`.
    """

    def memory(self) -> tuple[Memory, ...]:
        """Declare what is remembered."""
        ...

    def output(self, memory: list[Scalar], *inputs: Any, **period: Any) -> Scalar:
        """The law's value; `period` [s] for the sampled form, None for the continuous one."""
        ...

    def rates(self, memory: list[Scalar], *inputs: Any, **none: Any) -> list[Scalar]:
        """Time derivative of the memory, continuous form; ValueError where a law is at home in samples only."""
        ...

    def advance(self, memory: list[Scalar], *inputs: Any, **period: Any) -> list[Scalar]:
        """The memory after one sample of `period` [s]."""
        ...
