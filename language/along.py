"""Along: how expressions change along the flow of a mode (Lie derivatives), inputs held.

At a corner of `abs`, `min`, `max`, `clip` or `if` it is the branch taken there. What delays or
looks up has none. Rules: Griewank and Walther, Evaluating Derivatives (2nd ed. 2008), table 2.3.
"""

from __future__ import annotations

from language.lower import rate
from language.moment import Moment
from language.operation import (
    Binary,
    Call,
    Compare,
    Expr,
    Ref,
    Select,
    Unary,
    Value,
    add,
    divide,
    multiply,
    real,
    subtract,
)
from language.syntax import names

ZERO = real(0.0)


class NoRate(Exception):
    """An expression whose change along the flow is not known."""


class Along:
    """The flow of a moment's mode; what is needed of it becomes steps of the story."""

    def __init__(self, moment: Moment) -> None:
        """Make the rates of all states known. Raises NoRate where a region gives one."""
        self.moment = moment
        self.steps = moment.story.steps
        self.rates: dict[str, Expr] = {}
        mode = moment.mode
        for state in moment.automaton.states:
            if state not in mode.flow:
                raise NoRate(state)
            balance = mode.flow[state]
            for side in (balance.left, balance.right):
                for read in names(side):
                    if read.path != state:
                        moment.expression(read)
            known = moment.known[state]
            assert isinstance(known, Ref)
            target = f"rate.{state}{moment.tag}"
            moment.remember(balance.right)
            self.steps.append((target, rate(balance, moment.known)))
            self.rates[known.name] = Ref(target)

    def of(self, expr: Expr) -> Expr:
        """Return the derivative of an expression with respect to time. Raises NoRate."""
        match expr:
            case Value():
                return ZERO
            case Ref(name):
                return self._named(name)
            case Unary("-", operand):
                return _negative(self.of(operand))
            case Binary("+", left, right):
                return _sum(self.of(left), self.of(right))
            case Binary("-", left, right):
                return _sum(self.of(left), _negative(self.of(right)))
            case Binary("*", left, right):
                return _sum(_times(self.of(left), right), _times(left, self.of(right)))
            case Binary("/", left, right):
                first, second = self.of(left), self.of(right)
                if second == ZERO:
                    return first if first == ZERO else divide(first, right)
                return divide(subtract(first, multiply(expr, second)), right)
            case Select(condition, then, other):
                return _either(condition, self.of(then), self.of(other))
            case Call(function, arguments):
                return self._call(function, arguments, expr)
        raise NoRate

    def _named(self, name: str) -> Expr:
        if name in self.rates:
            return self.rates[name]
        found = next((value for target, value in self.steps if target == name), None)
        if found is None:
            if name.startswith("memory."):
                raise NoRate(name)
            return ZERO  # an input, a parameter or a discrete variable
        change = self.of(found)
        if change != ZERO:
            target = f"rate of {name}"
            self.steps.append((target, change))
            change = Ref(target)
        self.rates[name] = change
        return change

    def _call(self, function: str, arguments: tuple[Expr, ...], whole: Expr) -> Expr:
        changes = [self.of(argument) for argument in arguments]
        if all(change == ZERO for change in changes):
            return ZERO
        first, change = arguments[0], changes[0]
        match function:
            case "abs":
                return _either(Compare(">=", first, ZERO), change, _negative(change))
            case "min" | "max":
                is_second = Compare("<" if function == "min" else ">", arguments[1], first)
                return _either(is_second, changes[1], change)
            case "clip":
                inside = _either(Compare("<", first, arguments[2]), change, changes[2])
                return _either(Compare(">", first, arguments[1]), inside, changes[1])
            case "sign" | "floor":
                return ZERO
            case "sqrt":
                return divide(change, multiply(real(2.0), whole))
            case "log":
                return divide(change, first)
            case "pow":
                base = _times(multiply(arguments[1], _lower(first, arguments[1])), change)
                return _sum(base, _times(multiply(whole, Call("log", (first,))), changes[1]))
            case "sin":
                return _times(Call("cos", (first,)), change)
            case "cos":
                return _negative(_times(Call("sin", (first,)), change))
            case "exp":
                return _times(whole, change)
            case "tanh":
                return _times(subtract(real(1.0), multiply(whole, whole)), change)
        raise NoRate(function)


def _lower(base: Expr, degree: Expr) -> Expr:
    return Call("pow", (base, subtract(degree, real(1.0))))


def _negative(expr: Expr) -> Expr:
    return expr if expr == ZERO else Unary("-", expr)


def _sum(left: Expr, right: Expr) -> Expr:
    if left == ZERO:
        return right
    return left if right == ZERO else add(left, right)


def _times(left: Expr, right: Expr) -> Expr:
    return ZERO if ZERO in (left, right) else multiply(left, right)


def _either(condition: Expr, then: Expr, other: Expr) -> Expr:
    return then if then == other else Select(condition, then, other)
