"""The type checker as functions of expressions see it: types of arguments, names, problems."""

from __future__ import annotations

from typing import Protocol

from language.expressions.syntax_tree import SyntaxTree
from language.expressions.units import Dimension
from language.text.diagnostic import Problems, Span
from language.typecheck.environment import NameEnvironment
from language.typecheck.types import ExprType


class TypingContext(Protocol):
    """Infers and checks types of arguments in an environment; `infer.TypeChecker` is one."""

    environment: NameEnvironment
    problems: Problems

    def inside_memory_function(self, *functions: str) -> TypingContext:
        """Return the context for an argument of a function with memory, which may use `functions`."""

    def infer_type(self, tree: SyntaxTree) -> ExprType | None:
        """Return the type of an expression, None where a problem was reported inside it."""

    def require_real(self, kind: ExprType | None, tree: SyntaxTree) -> Dimension | None:
        """Return the dimension of a real quantity; reports an expression of another type."""

    def check_quantity(self, tree: SyntaxTree, expected: Dimension, what: str) -> None:
        """Check that an expression is a quantity of the expected dimension."""

    def check_condition(self, tree: SyntaxTree, what: str) -> None:
        """Check that an expression is a condition."""

    def unify_dimensions(
        self,
        a: SyntaxTree,
        left: Dimension,
        b: SyntaxTree,
        right: Dimension,
        span: Span,
        what: str,
    ) -> Dimension | None:
        """Return the common dimension of two operands; reports operands that do not fit."""

    def report(self, kind: str, span: Span, label: str, help: str = "") -> None:
        """Report a problem."""
