"""What an actuator is put together in: states, their rates and ticks, inputs and outputs, declared by name."""

import casadi as ca

from actuator.system.hybrid import Quantity
from gear.quantities import Scalar
from gear.quantities.roles import Role


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
