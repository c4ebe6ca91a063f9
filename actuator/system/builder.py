"""What an actuator is put together in: states, their rates and ticks, inputs and outputs, declared by name.

The laws of a control loop run in a `Loop`: in continuous time, or once at every tick that is due. They are
written down once for both.
"""

from collections.abc import Callable, Sequence
from typing import Any

import casadi as ca

from actuator.system.hybrid import Quantity
from controllers.integral import last_error
from controllers.pid import PI, PID
from gear.quantities import Scalar
from gear.quantities.roles import ControllerMemory, LoopSignal, Role

CONTROLLER = "controller"  # owner of what its laws keep in mind
PREFIX = "inject."  # inputs that are added to a signal inside a loop


class SystemBuilder:
    """States, inputs and outputs as they are declared, with the expressions that belong to them."""

    def __init__(self) -> None:
        self._states: dict[str, tuple[Quantity, ca.SX]] = {}
        self._inputs: dict[str, tuple[Quantity, ca.SX]] = {}
        self._outputs: dict[str, tuple[Quantity, ca.SX]] = {}
        self._rates: dict[str, ca.SX] = {}
        self._ticks: dict[str, ca.SX] = {}
        self._forward: dict[str, ca.SX] = {}  # held states asked for before they are declared
        self._begins: dict[str, ca.SX] = {}  # where states begin that follow others, or a parameter

    def state(  # noqa: PLR0913 - all that a state has
        self,
        name: str,
        unit: str,
        nominal: float = 1.0,
        *,
        initial: Scalar = 0.0,
        held: bool = False,
        symbol: ca.SX | None = None,
        roles: tuple[Role, ...] = (),
        owner: str = "",
    ) -> ca.SX:
        """Declare a state: continuous, or held between ticks; `symbol` where it has one already.

        It begins at a number, or at an expression of parameters, angles and states declared before it.
        """
        symbol = self._forward.get(name, ca.SX.sym(name)) if symbol is None else symbol
        if isinstance(initial, ca.SX):
            known = ca.vertcat(ca.SX(0, 1), *(self._states[other][1] for other in self._begins))
            self._begins[name] = ca.substitute(initial, known, ca.vertcat(ca.SX(0, 1), *self._begins.values()))
            initial = 0.0
        self._states[name] = (Quantity(name, unit, nominal, initial, held, roles, owner), symbol)
        return symbol

    def held(self, name: str) -> ca.SX:
        """A held state by its name: declared, or to be declared by a loop later."""
        if name not in self._forward:
            self._forward[name] = ca.SX.sym(name)
        return self._states[name][1] if name in self._states else self._forward[name]

    def rate(self, name: str, value: Scalar) -> None:
        """The time derivative of a continuous state."""
        self._rates[name] = ca.SX(value)

    def tick(self, name: str, value: Scalar) -> None:
        """What a held state is after a tick."""
        self._ticks[name] = ca.SX(value)

    def input(self, name: str, unit: str, *roles: Role) -> ca.SX:
        """Declare an input."""
        symbol = ca.SX.sym(name)
        self._inputs[name] = (Quantity(name, unit, roles=roles), symbol)
        return symbol

    def output(self, name: str, unit: str, value: Scalar, *roles: Role) -> None:
        """Declare an output."""
        self._outputs[name] = (Quantity(name, unit, roles=roles), ca.SX(value))

    @property
    def states(self) -> tuple[Quantity, ...]:
        """In the order of declaration, the held ones behind the others."""
        return tuple(sorted((quantity for quantity, _ in self._states.values()), key=lambda quantity: quantity.held))

    @property
    def inputs(self) -> tuple[Quantity, ...]:
        """In the order of declaration."""
        return tuple(quantity for quantity, _ in self._inputs.values())

    @property
    def outputs(self) -> tuple[Quantity, ...]:
        """In the order of declaration."""
        return tuple(quantity for quantity, _ in self._outputs.values())

    def x(self) -> ca.SX:
        """Symbols of the states."""
        return ca.vertcat(*(self._states[quantity.name][1] for quantity in self.states))

    def u(self) -> ca.SX:
        """Symbols of the inputs."""
        return ca.vertcat(*(symbol for _, symbol in self._inputs.values()))

    def flow(self) -> ca.SX:
        """Time derivatives of the states; what is held does not move."""
        return ca.vertcat(*(0 if state.held else self._rates[state.name] for state in self.states))

    def begin(self, p: ca.SX) -> ca.Function | None:
        """(x, p) -> x with the states where they begin that follow others, inputs at zero; None where none does."""
        if not self._begins:
            return None
        begun = [self._begins.get(state.name, self._states[state.name][1]) for state in self.states]
        return ca.Function("begin", [self.x(), p], [ca.substitute(ca.vertcat(*begun), self.u(), 0 * self.u())])

    def after_tick(self) -> ca.SX:
        """The states after a tick; what is continuous stays as it is."""
        return ca.vertcat(*(self._ticks.get(state.name, self._states[state.name][1]) for state in self.states))

    def y(self) -> ca.SX:
        """Expressions of the outputs."""
        return ca.vertcat(*(value for _, value in self._outputs.values()))


class Loop:
    """Where the laws of one control loop run.

    Parameters
    ----------
    builder : SystemBuilder
        Of the actuator.
    due : SX or None
        1 at a tick of this loop; None in continuous time.
    period : SX or None
        Between two ticks of this loop [s]; None in continuous time.
    delay : int
        Ticks from a sample to the moment at which its result is applied.
    """

    def __init__(self, builder: SystemBuilder, due: ca.SX | None = None, period: Scalar = None, delay: int = 0) -> None:
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

    def integrate(
        self, law: PI | PID, memory: Sequence[ca.SX], error: Scalar, proposed: Scalar, realized: Scalar
    ) -> None:
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
