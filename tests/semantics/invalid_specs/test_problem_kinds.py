"""The scan that finds every kind of problem in the source sees literals and helpers."""

from __future__ import annotations

from tests.semantics.invalid_specs.problem_kinds import kinds, reported_kinds

SOURCE = """
class Check:
    def run(self, problems, span, late):
        problems.error("direct", span, "label")
        problems.warning("soft" if late else "softer", span, "label")
        self.tell("told", span)
        refuse(span, "refused")
        print("error", "no kind")
        logger.warning("not kept: %s", span)

    def tell(self, kind, span):
        self.problems.error(kind, span, "label")

def refuse(span, kind):
    raise SpecError([Problem(kind, span, "label")])
"""


def test_literals_choices_and_helpers_are_seen() -> None:
    found = {kind for kind, _ in reported_kinds(SOURCE)}
    assert found == {"direct", "soft", "softer", "told", "refused"}


def test_kinds_of_every_floor_are_found() -> None:
    assert {"loop", "type", "refire", "row", "unreached"} <= set(kinds())
