"""Where the laws of a control loop run: in continuous time, or once at every tick that is due.

They are written down once for both.
"""

from collections.abc import Callable, Sequence
from typing import Any

import casadi as ca

from controllers.integral import last_error
from gear.quantities import Scalar
from gear.quantities.roles import ControllerMemory, LoopSignal, Role

CONTROLLER = "controller"  # owner of what its laws keep in mind
PREFIX = "inject."  # inputs that are added to a signal inside a loop


class Loop:
    """Where the laws of one control loop run.

    Parameters
    ----------
    builder : SystemBuilder
        Where the actuator declares its states, inputs and outputs.
    due : SX or None
        1 at a tick of this loop; None in continuous time.
    period : SX or None
        Between two ticks of this loop [s]; None in continuous time.
    delay : int
        Ticks from a sample to the moment at which its result is applied.
    """

    def __init__(self, builder: Any, due: ca.SX | None = None, period: Scalar = None, delay: int = 0) -> None:
        self.builder, self.due, self.period, self.delay = builder, due, period, delay

    @property
    def sampled(self) -> bool:
        """Whether the loop runs at ticks."""
        return self.due is not None

    def state(  # noqa: PLR0913, PLR0917 - all that a state has
        self,
        name: str,
        unit: str,
        nominal: float = 1.0,
        initial: Scalar = 0.0,
        roles: tuple[Role, ...] = (ControllerMemory(),),
        owner: str = CONTROLLER,
    ) -> ca.SX:
        """What a law, or a sensor that is read in this loop, keeps in mind."""
        held = self.sampled
        return self.builder.state(name, unit, nominal, initial=initial, held=held, roles=roles, owner=owner)

    def after(self, state: ca.SX, rate: Callable[[], Scalar], after: Callable[[], Scalar]) -> None:
        """How a state goes on: by its rate in continuous time, or to what it is after a tick that is due."""
        if self.due is None:
            self.builder.rate(state.name(), rate())
        else:
            self.builder.tick(state.name(), ca.if_else(self.due, after(), state))

    def integrate(self, law: Any, memory: Sequence[ca.SX], error: Scalar, proposed: Scalar, realized: Scalar) -> None:
        """The integral of a law, driven by its error and by what was realized of its output."""
        state, *last = memory
        self.after(
            state,
            lambda: law.rate_of_integral(state, error, proposed, realized),
            lambda: law.advance(state, error, proposed, realized, self.period, *last),
        )
        for kept in last:
            self.after(kept, lambda: 0.0, lambda kept=kept: last_error(kept, error))

    def signal(self, name: str, unit: str, computed: Scalar) -> ca.SX:
        """A named signal of the loop, for the laws that use it: held between ticks, with what is injected there."""
        now, standing = self.hold(f"controller.{name}", unit, computed, LoopSignal(name))
        self.builder.output(name, unit, standing, LoopSignal(name))
        return now + self.builder.input(PREFIX + name, unit, LoopSignal(name))

    def apply(self, name: str, unit: str, computed: Scalar) -> ca.SX:
        """A named signal that acts on the plant: held and delayed, with what is injected there."""
        standing = self.hold_delayed(f"controller.{name}", unit, computed, LoopSignal(name))
        self.builder.output(name, unit, standing, LoopSignal(name))
        return standing + self.builder.input(PREFIX + name, unit, LoopSignal(name))

    def hold_delayed(self, name: str, unit: str, computed: Scalar, *roles: Role) -> ca.SX:
        """A result as the plant sees it between ticks, `delay` ticks after its sample."""
        due = ca.SX(1) if self.due is None else self.due
        for k in range(self.delay):
            pending = f"{name}.pending_{k + 1}"
            before = self.builder.state(pending, unit, held=True, roles=(ControllerMemory(),), owner=CONTROLLER)
            self.builder.tick(pending, ca.if_else(due, computed, before))
            computed = before
        return self.hold(name, unit, computed, *roles)[1]

    def hold(self, name: str, unit: str, computed: Scalar, *roles: Role) -> tuple[ca.SX, ca.SX]:
        """A result at a tick, for the laws that run then, and as it stands between ticks."""
        if self.due is None:
            return ca.SX(computed), ca.SX(computed)
        roles = (ControllerMemory(), *roles)
        standing = self.builder.state(name, unit, held=True, roles=roles, owner=CONTROLLER)
        now = ca.if_else(self.due, computed, standing)
        self.builder.tick(name, now)
        return now, standing

    def memory(self, path: str, law: Any, *kind: Any, first: Scalar = 0.0) -> list[ca.SX]:
        """Declare what a law with memory keeps in mind; `kind` is what its declaration asks for.

        The first of it begins at `first`: a position that is followed, where it is.
        """
        places = [kept if k else kept._replace(initial=first) for k, kept in enumerate(law.memory(*kind))]
        return [self.state(f"{path}.{kept.name}", *kept[1:]) for kept in places]

    def output(self, law: Any, memory: Sequence[ca.SX], *inputs: Scalar) -> Scalar:
        """The value of a law with memory, in the form of this loop."""
        return law.output(memory, *inputs, period=self.period)

    def remember(self, law: Any, memory: Sequence[ca.SX], *inputs: Scalar) -> None:
        """How the memory of a law goes on."""
        following = law.rates(memory, *inputs) if self.due is None else law.advance(memory, *inputs, period=self.period)
        for kept, value in zip(memory, following, strict=True):
            self.after(kept, lambda value=value: value, lambda value=value: value)
