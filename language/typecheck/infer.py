"""Type inference: the type and dimension of every expression, and their problems (rule 20)."""

from __future__ import annotations

import dataclasses

from language.expressions.syntax_tree import (
    Arithmetic,
    BoolLiteral,
    Conditional,
    ErrorNode,
    FunctionCall,
    Logic,
    Name,
    Negation,
    Not,
    NumberLiteral,
    Power,
    Relation,
    SyntaxTree,
    integer_literal,
    is_bare_zero,
)
from language.expressions.units import (
    NO_UNIT,
    Dimension,
    angle_hint,
    are_compatible,
    common_dimension,
    dimension_power,
    dimension_product,
    matching_units_hint,
)
from language.text.diagnostic import Problems, Span, suggest_name
from language.typecheck.function_calls import infer_function_call
from language.typecheck.name_environment import NameEnvironment
from language.typecheck.types import (
    MAX_INT,
    BoolType,
    EnumType,
    ExprType,
    IntType,
    as_real_type,
    comparison_hint,
    condition_hint,
    describe_type,
    int_operand_types,
    int_type_of,
)

MAX_HINTS = 200
"""Number of problems after which no similar name is suggested, because that search is slow."""


class TypeChecker:
    """Bottom-up inference of types and dimensions that reports each mistake once and continues."""

    def __init__(self, environment: NameEnvironment, problems: Problems) -> None:
        """Create a checker for an environment that reports into `problems`."""
        self.environment = environment
        self.problems = problems

    def inside_memory_function(self, *functions: str) -> TypeChecker:
        """Return a checker for the argument of a function with memory, with the same problems.

        Of the functions with memory that are allowed here only `functions` are allowed there.
        """
        memory = self.environment.memory_functions & {*functions}
        return TypeChecker(
            dataclasses.replace(self.environment, memory_functions=memory), self.problems
        )

    def check_quantity(self, tree: SyntaxTree, expected: Dimension, what: str) -> None:
        """Report an expression that is not a quantity of the dimension `expected`.

        `what` names the target in the message. A whole number counts as a pure number, and a 0
        without a unit has any dimension. An expression whose type is None is not reported again.
        The kinds are "type" for a truth value or an enumeration, and "dimension".
        """
        kind = as_real_type(self.infer_type(tree))
        if isinstance(kind, str | EnumType):
            label = f"`{what}` is a quantity, this is {describe_type(kind)}"
            self.report("type", tree.span, label)
        elif (
            isinstance(kind, Dimension)
            and not is_bare_zero(tree)
            and not are_compatible(kind, expected)
        ):
            label = f"this is in `{kind.display_name}`, `{what}` is in `{expected.display_name}`"
            hint = angle_hint(kind, expected)
            if isinstance(tree, NumberLiteral | Negation):
                hint = hint or matching_units_hint(expected)
            self.report("dimension", tree.span, label, hint)

    def check_assignment(self, tree: SyntaxTree, expected: ExprType, what: str) -> None:
        """Report an expression that cannot be assigned to a target of a type.

        `what` names the target in the message. A whole-number target accepts whole numbers,
        literals and `floor(...)`; ranges are not compared. A truth value or an enumeration needs
        exactly its type, a quantity the check of `check_quantity`. An expression whose type is None
        is not reported again.
        """
        if isinstance(expected, Dimension):
            self.check_quantity(tree, expected, what)
        elif expected == "truth":
            self._check_same_type(tree, "truth", what)
        elif isinstance(expected, EnumType):
            self._check_same_type(tree, expected, what)
        elif integer_literal(tree) is None:
            kind = self.infer_type(tree)
            is_floor = isinstance(tree, FunctionCall) and tree.function == "floor"
            if kind is not None and not isinstance(kind, IntType) and not is_floor:
                hint = "`floor(...)` makes a whole number of a real"
                label = f"`{what}` is a whole number, this is {describe_type(kind)}"
                self.report("type", tree.span, label, hint if isinstance(kind, Dimension) else "")

    def _check_same_type(self, tree: SyntaxTree, expected: ExprType, what: str) -> None:
        """Report an expression whose type is not exactly `expected`."""
        kind = self.infer_type(tree)
        if kind is not None and kind != expected:
            label = f"`{what}` is {describe_type(expected)}, this is {describe_type(kind)}"
            hint = condition_hint(tree) if expected == "truth" else ""
            self.report("type", tree.span, label, hint)

    def check_condition(self, tree: SyntaxTree, what: str) -> None:
        """Report an expression that is not a truth value; `what` names the place in the message.

        An expression whose type is None is not reported again.
        """
        kind = self.infer_type(tree)
        if kind is not None and kind != "truth":
            hint = condition_hint(tree)
            label = f"`{what}` is a condition, this is {describe_type(kind)}"
            self.report("type", tree.span, label, hint)

    def infer_type(self, tree: SyntaxTree) -> ExprType | None:
        """Return the type of an expression, and report the problems inside it.

        It is a Dimension, "truth", an IntType with the possible range, or an EnumType. Relations,
        `and`, `or` and `not` are truth values also after a problem; whole-number arithmetic that
        may leave 32 bits is reported and has the full range. None means a name without a type, or
        another problem.
        """
        match tree:
            case Name():
                return self._infer_name(tree)
            case NumberLiteral(_, unit, _):
                return unit.dimension
            case Arithmetic():
                return self._infer_arithmetic(tree)
            case FunctionCall():
                return infer_function_call(self, tree)
            case BoolLiteral():
                return "truth"
            case Negation(operand, _):
                kind = self.infer_type(operand)
                if isinstance(kind, IntType):
                    return IntType(-kind.high, -kind.low)
                return self.require_real(kind, operand)
            case Not(operand, _):
                self.check_condition(operand, "not")
                return "truth"
            case Logic(operator, left, right, _):
                self.check_condition(left, operator)
                self.check_condition(right, operator)
                return "truth"
            case Relation():
                return self._infer_relation(tree)
            case Power(base, exponent, _):
                kind = self.infer_real(base)
                return None if kind is None else dimension_power(kind, exponent)
            case Conditional():
                return self._infer_conditional(tree)
            case ErrorNode():
                return None

    def report(self, kind: str, span: Span, label: str, help: str = "") -> None:
        """Report a problem as an error in `problems`."""
        self.problems.error(kind, span, label, help)

    def infer_real(self, tree: SyntaxTree) -> Dimension | None:
        """Return the dimension of an expression; report a truth value or an enumeration.

        A whole number is a pure number. The result is None after a report, and if the type of the
        expression is None.
        """
        return self.require_real(self.infer_type(tree), tree)

    def require_real(self, kind: ExprType | None, tree: SyntaxTree) -> Dimension | None:
        """Return the dimension of a type used as a real; report a truth value or an enumeration.

        A whole number is a pure number. The result is None after a report, and for None, the type
        of an erroneous expression. `tree` gives the place.
        """
        kind = as_real_type(kind)
        if isinstance(kind, Dimension):
            return kind
        if kind is not None:
            self.report("type", tree.span, f"this is {describe_type(kind)}, a quantity is needed")
        return None

    def _infer_name(self, tree: Name) -> ExprType | None:
        """Return the type of a name; report an unknown name, an event or a table."""
        if tree.path in self.environment.tables:
            hint = f"read it with `lookup({tree.path}, ...)`"
            self.report("table", tree.span, f"`{tree.path}` is a table, not a value", hint)
            return None
        if tree.path in self.environment.types:
            return self.environment.types[tree.path]
        few = len(self.problems.reported) < MAX_HINTS
        hint = suggest_name(tree.path, self.environment.types) if few else ""
        owner = self.environment.equation_owners.get(tree.path, self.environment.mode)
        if owner != self.environment.mode:
            hint = f"mode `{owner}` has an equation of it, mode `{self.environment.mode}` has none"
        if tree.path in self.environment.events:
            hint = f"it is an event: write `event: {tree.path}` on a transition"
        self.report(
            "name", tree.span, f"`{tree.path}` is not known {self.environment.location}", hint
        )
        return None

    def _infer_arithmetic(self, tree: Arithmetic) -> Dimension | IntType | None:
        """Return the type of an arithmetic operation: a range (whole numbers) or a dimension."""
        first, second = self.infer_type(tree.left), self.infer_type(tree.right)
        wholes = int_operand_types(tree.left, first, tree.right, second)
        if wholes and tree.operator != "/":
            return self._check_int32(int_type_of(tree.operator, *wholes), tree)
        left, right = self.require_real(first, tree.left), self.require_real(second, tree.right)
        if left is None or right is None:
            return None
        if tree.operator in "*/":
            return dimension_product(left, right, 1 if tree.operator == "*" else -1)
        for part in (tree.left, tree.right):
            if isinstance(part, NumberLiteral) and part.unit.offset:
                label = "a temperature in degC is not added or subtracted"
                self.report("dimension", part.span, label, "write a difference in K")
        self._check_angle_units(tree)
        return self.unify_dimensions(tree.left, left, tree.right, right, tree.span, tree.operator)

    def _check_angle_units(self, tree: Arithmetic) -> None:
        """Report a sum of parameters declared in two units of angle.

        Nothing is converted (rule 20).
        """
        known = self.environment.angle_units
        first, second = (
            known.get(part.path) if isinstance(part, Name) else None
            for part in (tree.left, tree.right)
        )
        if first and second and first.factor != second.factor:
            label = f"`{tree.operator}` joins `{first.text}` and `{second.text}`"
            self.report("dimension", tree.span, label, "declare both in one unit of angle")

    def _check_int32(self, kind: IntType, tree: Arithmetic) -> IntType:
        """Return the type of whole-number arithmetic; report a range that does not fit 32 bits."""
        if kind.fits_int32:
            return kind
        label = f"this may lie from {kind.low} to {kind.high}: past {MAX_INT}"
        hint = "give the whole numbers in it a narrower `range`"
        self.report("overflow", tree.span, label, hint)
        return IntType()

    def unify_dimensions(
        self,
        a: SyntaxTree,
        left: Dimension,
        b: SyntaxTree,
        right: Dimension,
        span: Span,
        operator: str,
    ) -> Dimension | None:
        """Return the common dimension of the operands `a` and `b`; report dimensions that differ.

        `left` and `right` are the dimensions of the operands. A 0 without a unit takes the
        dimension of the other operand. `operator` is named in the message at `span`. None is
        returned after a problem.
        """
        if is_bare_zero(a):
            return right
        if is_bare_zero(b):
            return left
        if are_compatible(left, right):
            return common_dimension(left, right)
        label = f"`{operator}` joins `{left.display_name}` and `{right.display_name}`"
        hint = angle_hint(left, right)
        for tree, other in ((a, right), (b, left)):
            if isinstance(tree, NumberLiteral) and tree.unit is NO_UNIT:
                hint = hint or matching_units_hint(other)
        self.report("dimension", span, label, hint)
        return None

    def _infer_relation(self, tree: Relation) -> BoolType:
        """Return the type of a relation, a truth value; report operands that cannot be compared.

        `==` and `!=` need whole numbers, truth values or enumerations; reals need an order
        relation.
        """
        first, second = self.infer_type(tree.left), self.infer_type(tree.right)
        equality = tree.operator in ("==", "!=")
        if int_operand_types(tree.left, first, tree.right, second):
            return "truth"
        named = [kind for kind in (first, second) if isinstance(kind, str | EnumType)]
        if equality and (first is None or second is None):
            return "truth"
        if equality and len(named) == 2:
            if first != second:
                kinds = " and ".join(describe_type(kind) for kind in named)
                label = f"`{tree.operator}` compares {kinds}"
                self.report("type", tree.span, label)
            return "truth"
        if equality and "truth" in (first, second):
            condition = tree.left if first == "truth" else tree.right
            label = "this is true or false, a quantity is needed"
            self.report("type", condition.span, label, comparison_hint(tree, condition))
            return "truth"
        left, right = self.require_real(first, tree.left), self.require_real(second, tree.right)
        if left is None or right is None:
            return "truth"
        if equality:
            label = f"`{tree.operator}` is not for real numbers"
            self.report("type", tree.span, label, "use `<=` or `>=`")
        else:
            self.unify_dimensions(tree.left, left, tree.right, right, tree.span, tree.operator)
        return "truth"

    def _infer_conditional(self, tree: Conditional) -> ExprType | None:
        """Return the common type of both alternatives; report types that differ and return None."""
        self.check_condition(tree.condition, "if")
        first, second = self.infer_type(tree.then), self.infer_type(tree.other)
        if first is None or second is None:
            return None
        wholes = int_operand_types(tree.then, first, tree.other, second)
        if wholes:
            return wholes[0].hull(wholes[1])
        left, right = as_real_type(first), as_real_type(second)
        if isinstance(left, Dimension) and isinstance(right, Dimension):
            return self.unify_dimensions(tree.then, left, tree.other, right, tree.span, "if")
        if left != right:
            label = f"one alternative is {describe_type(first)}, the other {describe_type(second)}"
            if "truth" in (left, right) and Dimension in (type(left), type(right)):
                label = "one alternative is a condition, the other a quantity"
            self.report("type", tree.span, label)
            return None
        return left
