"""Effects and variants in which a value has a wrong shape: problems, never a defect."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from language.text.document import MappingNode, ScalarNode, YamlNode
from language.text.node_edit import format_inline
from modewright.api.spec_check import check_spec
from tests.language.spec_builders import document

EFFECT = """\
language: 1
effect: drag_of_here
about: a resistance
at: {balance: {of: rate, unit: N, has: [far]}, element: {kind: elastic, unit: N}}
reads: [m]
parameters: {p_e: {value: 1 N, range: [0, 2], about: a force}}
states: {s_e: {unit: 1, initial: 0}}
equations: {q_e: p_e * 2, $x: base + 1}
flow: {s_e: der(s_e) = 1 / 1 s}
terms: {$x: {t1: -q_e}}
discrete: {d_e: {unit: 1, initial: 0}}
elements: {el: {kind: elastic}}
regions:
  r_e: {initial: a, modes: {a: {equations: {w_e: 1}, transitions: {b: {when: q_e > 1 N}}}, b: {}}}
redirect: {$u: q_e, except: [a]}
move: {a: b}
signature: a curve
confused_with: [viscous_friction]
separated_by: [two speeds]
references: [a book]
"""
VARIANT = """\
language: 1
variant: other
extends: base
effects: {coulomb_friction@v: {values: {F: 1 N}, as: z, rename: {a: b}}}
calibrations: [one]
parameters: {m: 1300 kg}
remove: [parameters.J]
"""
BASE = """\
language: 1
automaton: base
method: rk4
step: 1 ms
numbers: float64
parameters: {m: {value: 1 kg}, J: {value: 1}}
states: {v: {unit: m/s, initial: 0}}
flow: {v: m * der(v) = -1 N}
outputs: [v]
"""
SHAPES = ("1", "[]", "[1, {a: 1}]", "{}", "~", "''", "{a: 1}", "{a: {b: 1}}", "x y", "[[1]]")


def variants(node: YamlNode) -> Iterator[str]:
    """Yield the texts of a node in which one value has another shape, at any depth."""
    if isinstance(node, MappingNode):
        for entry in node:
            for text in (*SHAPES, *variants(entry.node)):
                parts = [
                    f"{one.key}: {text if one is entry else format_inline(one.node)}"
                    for one in node
                ]
                yield f"{{{', '.join(parts)}}}"
    elif not isinstance(node, ScalarNode):
        yield "[1]"


@pytest.mark.parametrize("text", [EFFECT, VARIANT], ids=["effect", "variant"])
def test_a_value_of_another_shape_is_no_defect(text: str, tmp_path: Path) -> None:
    (tmp_path / "base.yaml").write_text(BASE)
    spec = tmp_path / "here.yaml"
    for entry in document(text).root:
        rest = "".join(
            f"{one.key}: {format_inline(one.node)}\n"
            for one in document(text).root
            if one is not entry and one.key != entry.key
        )
        for shape in (*SHAPES, *variants(entry.node)):
            spec.write_text(f"{rest}{entry.key}: {shape}\n")
            assert isinstance(check_spec(str(spec), tmp_path).problems, tuple)


def test_equations_of_an_effect_that_are_no_mapping_are_refused_at_their_place(
    tmp_path: Path,
) -> None:
    spec = tmp_path / "e2.yaml"
    spec.write_text("language: 1\neffect: e2\nat: {balance: {unit: N}}\nequations: 1\n")
    found = check_spec(str(spec), tmp_path).problems
    assert [(p.span.line, p.label) for p in found] == [(4, "`equations` is a mapping")]
