"""Lie derivatives: the rates of expressions along the flow of a mode, with inputs held constant.

At a corner of `abs`, `min`, `max`, `clip` or `if`, the derivative is that of the active branch.
Delays and tables have no derivative here. Rules: Griewank and Walther, Evaluating Derivatives (2nd
ed. 2008), table 2.3.
"""

from __future__ import annotations

from language.expressions.syntax_tree import names
from language.ir.ops import (
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
from language.lowering.expressions import lower_rate
from language.smt.symbolic_environment import GuardSnapshot

ZERO = real(0.0)
"""Derivative of a constant."""


class UnknownRateError(Exception):
    """Error of an expression whose derivative along the flow is unknown."""


class LieDerivative:
    """Derivatives along the flow of the mode of a snapshot.

    Assignments that they need are appended to the symbolic path of the snapshot. Each operation of
    a differentiated expression is assigned to a name of its own, and so is each rate. The rules
    repeat operands, so the derivative of nested operations has 2^depth parts without the names.
    """

    def __init__(self, snapshot: GuardSnapshot) -> None:
        """Compute the rates of all states and append them to the path of the snapshot.

        Raises UnknownRateError if the mode has no balance for a state.
        """
        self.snapshot = snapshot
        self.assignments = snapshot.path.assignments
        self.rates: dict[str, Expr] = {}
        self.operations: dict[Expr, Ref] = {}
        self.values: dict[str, Expr] = {}
        mode = snapshot.mode
        for state in snapshot.automaton.states:
            if state not in mode.flow:
                raise UnknownRateError(state)
            balance = mode.flow[state]
            for side in (balance.left, balance.right):
                for read in names(side):
                    if read.path != state:
                        snapshot.lower_expression(read)
            known = snapshot.bindings[state]
            assert isinstance(known, Ref)
            target = f"rate.{state}{snapshot.suffix}"
            snapshot.define_memory(balance.right)
            self.assignments.append((target, lower_rate(balance, snapshot.bindings)))
            self.rates[known.name] = Ref(target)

    def differentiate(self, expr: Expr) -> Expr:
        """Return the derivative of an expression with respect to time: 0 or a name.

        Inputs, parameters and discrete variables are constant. At a corner of `abs`, `min`, `max`,
        `clip` or a selection it is that of the active branch; `sign` and `floor` have 0. The
        operations of the expression and their rates are appended to the path. Raises
        UnknownRateError for memory, conditions and functions without a rule (such as lookups),
        unless their arguments are constant.
        """
        return self._rate_of_operation(self._assign_operations(expr))

    def _assign_operations(self, expr: Expr) -> Expr:
        """Return the name of an expression; its operations are assigned first, inner ones before.

        Equal operations share a name. Literals, names and elements of arrays are returned as they
        are.
        """
        match expr:
            case Unary(operator, operand):
                operation: Expr = Unary(operator, self._assign_operations(operand))
            case Binary(operator, left, right):
                operation = Binary(
                    operator, self._assign_operations(left), self._assign_operations(right)
                )
            case Compare(relation, left, right):
                operation = Compare(
                    relation, self._assign_operations(left), self._assign_operations(right)
                )
            case Select(condition, then, other):
                parts = [self._assign_operations(part) for part in (condition, then, other)]
                operation = Select(*parts)
            case Call(function, arguments):
                operation = Call(function, tuple(map(self._assign_operations, arguments)))
            case _:
                return expr
        if operation not in self.operations:
            name = Ref(f"operation {len(self.operations)}{self.snapshot.suffix}")
            self.operations[operation] = name
            self.values[name.name] = operation
            self.assignments.append((name.name, operation))
        return self.operations[operation]

    def _rate_of_operation(self, expr: Expr) -> Expr:
        """Return the rate of an operation from the rates of its operands, which are names."""
        match expr:
            case Value():
                return ZERO
            case Ref(name):
                return self._rate_of_name(name)
            case Unary("-", operand):
                return _negate(self._rate_of_operation(operand))
            case Binary("+", left, right):
                return _add_rates(self._rate_of_operation(left), self._rate_of_operation(right))
            case Binary("-", left, right):
                return _add_rates(
                    self._rate_of_operation(left), _negate(self._rate_of_operation(right))
                )
            case Binary("*", left, right):
                return _add_rates(
                    _multiply_rate(self._rate_of_operation(left), right),
                    _multiply_rate(left, self._rate_of_operation(right)),
                )
            case Binary("/", left, right):
                first, second = self._rate_of_operation(left), self._rate_of_operation(right)
                if second == ZERO:
                    return first if first == ZERO else divide(first, right)
                return divide(subtract(first, multiply(expr, second)), right)
            case Select(condition, then, other):
                return _select_rate(
                    condition, self._rate_of_operation(then), self._rate_of_operation(other)
                )
            case Call(function, arguments):
                return self._rate_of_call(function, arguments, expr)
        raise UnknownRateError

    def _rate_of_name(self, name: str) -> Expr:
        """Return the rate of a name; zero for an input, parameter or discrete variable.

        The rate of an assigned name is stored by a further assignment. Raises UnknownRateError for
        the state of a function with memory.
        """
        if name in self.rates:
            return self.rates[name]
        assigned = self.values.get(name) or next(
            (
                self._assign_operations(value)
                for target, value in self.assignments
                if target == name
            ),
            None,
        )
        if assigned is None:
            if name.startswith("memory."):
                raise UnknownRateError(name)
            return ZERO  # an input, a parameter or a discrete variable
        change = self._rate_of_operation(assigned)
        if not isinstance(change, Value | Ref):
            change = self._assign_operations(change)
        self.rates[name] = change
        return change

    def _rate_of_call(self, function: str, arguments: tuple[Expr, ...], expr: Expr) -> Expr:
        """Return the derivative of a call by the chain rule; zero if all arguments are constant.

        `expr` is the call itself, whose value some rules reuse. Raises UnknownRateError for
        functions without a rule.
        """
        changes = [self._rate_of_operation(argument) for argument in arguments]
        if all(change == ZERO for change in changes):
            return ZERO
        first, change = arguments[0], changes[0]
        match function:
            case "abs":
                return _select_rate(Compare(">=", first, ZERO), change, _negate(change))
            case "min" | "max":
                is_second = Compare("<" if function == "min" else ">", arguments[1], first)
                return _select_rate(is_second, changes[1], change)
            case "clip":
                inside = _select_rate(Compare("<", first, arguments[2]), change, changes[2])
                return _select_rate(Compare(">", first, arguments[1]), inside, changes[1])
            case "sign" | "floor":
                return ZERO
            case "sqrt":
                return divide(change, multiply(real(2.0), expr))
            case "log":
                return divide(change, first)
            case "pow":
                base = _multiply_rate(
                    multiply(arguments[1], _reduce_power(first, arguments[1])), change
                )
                return _add_rates(
                    base, _multiply_rate(multiply(expr, Call("log", (first,))), changes[1])
                )
            case "sin":
                return _multiply_rate(Call("cos", (first,)), change)
            case "cos":
                return _negate(_multiply_rate(Call("sin", (first,)), change))
            case "exp":
                return _multiply_rate(expr, change)
            case "tanh":
                return _multiply_rate(subtract(real(1.0), multiply(expr, expr)), change)
        raise UnknownRateError(function)


def _reduce_power(base: Expr, degree: Expr) -> Expr:
    """Return `pow(base, degree - 1)`."""
    return Call("pow", (base, subtract(degree, real(1.0))))


def _negate(expr: Expr) -> Expr:
    """Return `-expr`; zero remains zero."""
    return expr if expr == ZERO else Unary("-", expr)


def _add_rates(left: Expr, right: Expr) -> Expr:
    """Return the sum of two rates without zero terms."""
    if left == ZERO:
        return right
    return left if right == ZERO else add(left, right)


def _multiply_rate(left: Expr, right: Expr) -> Expr:
    """Return the product of two factors; zero if one of them is zero."""
    return ZERO if ZERO in (left, right) else multiply(left, right)


def _select_rate(condition: Expr, then: Expr, other: Expr) -> Expr:
    """Return the conditional expression, or the branch if both branches are equal."""
    return then if then == other else Select(condition, then, other)
