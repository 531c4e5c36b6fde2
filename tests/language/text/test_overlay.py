"""Overlay: a partial tree laid over another one - docs/language.md, "Variants"."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given, strategies as st

from language.loading.load import automaton_of
from language.model.automaton import Automaton
from language.overlays.expand_document import read_document
from language.text.diagnostic import Problem, Problems, Source
from language.text.document import MappingNode, ScalarNode, SequenceNode, YamlNode
from language.text.overlay import apply_overlay, without_keys
from language.text.yaml_parser import parse_yaml
from tests.language.spec_builders import automaton, problem_lines, project_of, raised_problems, tree

Plain = str | list[str] | dict[str, "Plain"]


def read(text: str, name: str = "base") -> MappingNode:
    return parse_yaml(Source(name, tuple(text.splitlines())), text)


def plain(node: YamlNode) -> Plain:
    """Return a tree without its places."""
    match node:
        case ScalarNode(text, _, _):
            return text
        case SequenceNode(nodes, _):
            return [str(plain(item)) for item in nodes]
        case MappingNode():
            return {entry.key: plain(entry.node) for entry in node}


def laid(base: str, over: str, *, template: bool = False) -> tuple[Plain, list[Problem]]:
    problems = Problems()
    result = apply_overlay(read(base), read(over, "over"), problems, is_template=template)
    return plain(result), problems.reported


@pytest.mark.parametrize(
    ("base", "over", "result"),
    [
        ("{a: 1, b: 2}", "{b: 3}", {"a": "1", "b": "3"}),
        ("{a: 1}", "{b: 2}", {"a": "1", "b": "2"}),
        ("{a: {b: {c: 1, d: 2}}}", "{a: {b: {d: 3}}}", {"a": {"b": {"c": "1", "d": "3"}}}),
        ("{a: {b: {c: 1}}}", "{a: {b: {e: 3}}}", {"a": {"b": {"c": "1", "e": "3"}}}),
        ("{a: [p, q]}", "{a: [r]}", {"a": ["r"]}),
        ("{a: {b: 1}}", "{a: 2}", {"a": "2"}),
        ("{a: 2}", "{a: {b: 1}}", {"a": {"b": "1"}}),
        ("{a: 1, b: 2}", "{a: {remove: true}}", {"b": "2"}),
        ("{a: {b: 1, c: 2}}", "{a: {b: {remove: true}}}", {"a": {"c": "2"}}),
        ("{a: {b: 1}}", "{a: {}}", {"a": {"b": "1"}}),
    ],
)
def test_names_merge_and_values_replace(base: str, over: str, result: Plain) -> None:
    assert laid(base, over) == (result, [])


def test_what_is_there_keeps_its_place_in_the_order_and_new_names_come_last() -> None:
    result, _ = laid("{a: 1, b: 2, c: 3}", "{d: 4, b: 5}")
    assert isinstance(result, dict)
    assert list(result) == ["a", "b", "c", "d"]


def test_a_value_keeps_the_place_that_it_came_from() -> None:
    base, over = read("{a: 1, b: {c: 2}}"), read("{b: {c: 3}}", "over")
    result = apply_overlay(base, over, Problems())
    kept, table = result.get("a"), result.get("b")
    assert isinstance(table, MappingNode)
    changed = table.get("c")
    assert kept is not None and changed is not None
    assert [kept.span.source.name, changed.span.source.name] == ["base", "over"]


def test_what_is_absent_cannot_be_removed_and_the_nearest_is_named() -> None:
    result, problems = laid("{theta_d: 1}", "{theta_D: {remove: true}}")
    assert result == {"theta_d": "1"}
    (problem,) = problems
    assert problem.label == "`theta_D` cannot be removed: it is not there"
    assert (problem.severity, problem.help) == ("error", "did you mean `theta_d`?")


@pytest.mark.parametrize("over", ["{a: {remove: false}}", "{a: {remove: true, b: 1}}"])
def test_remove_true_alone_removes(over: str) -> None:
    result, _ = laid("{a: {b: 2}}", over)
    assert isinstance(result, dict)
    assert "a" in result


def test_an_override_by_an_equal_value_is_a_warning_that_names_the_first() -> None:
    result, problems = laid("{a: {b: 0.7 ms}}", "{a: {b: 0.7 ms}}")
    assert result == {"a": {"b": "0.7 ms"}}
    (problem,) = problems
    assert (problem.severity, problem.help) == ("warning", "it is given at base:1:6")


def test_an_override_by_an_equal_list_is_a_warning() -> None:
    assert laid("{a: [1, 2]}", "{a: [1, 2]}")[1]


def test_an_override_by_another_list_is_no_warning() -> None:
    assert laid("{a: [1, 2]}", "{a: [2, 1]}") == ({"a": ["2", "1"]}, [])


@pytest.mark.parametrize("over", ["{b: {c: {remove: true}}}", "{b: {c: {d: {remove: true}}}}"])
def test_inside_what_is_new_nothing_can_be_removed(over: str) -> None:
    _, problems = laid("{a: {c: {d: 1}}}", over)
    assert [problem.label[4:] for problem in problems] == ["cannot be removed: it is not there"]


def test_over_a_template_an_equal_value_is_no_warning() -> None:
    assert laid("{a: 1}", "{a: 1}", template=True)[1] == []


keys = st.sampled_from("abc")
words = st.sampled_from(["1", "2", "3"])
branches = st.recursive(words, lambda parts: st.dictionaries(keys, parts, max_size=3), max_leaves=8)
mappings = st.dictionaries(keys, branches, max_size=3)


def shown(value: object) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {shown(part)}" for key, part in value.items()) + "}"
    return str(value)


def merged(base: Plain, over: Plain) -> Plain:
    if isinstance(base, dict) and isinstance(over, dict):
        both = {key: merged(base[key], over[key]) for key in base if key in over}
        return {**base, **over, **both}
    return over


@given(mappings, mappings)
def test_any_two_mappings_merge_by_name(base: Plain, over: Plain) -> None:
    assert laid(shown(base), shown(over))[0] == merged(base, over)


@given(mappings, mappings, mappings)
def test_layers_may_be_laid_in_any_grouping(a: Plain, b: Plain, c: Plain) -> None:
    first, second, third = (read(shown(part)) for part in (a, b, c))
    left = apply_overlay(apply_overlay(first, second, Problems()), third, Problems())
    assert plain(left) == merged(merged(a, b), c)


@given(mappings)
def test_what_was_added_can_be_removed(added: dict[str, Plain]) -> None:
    base = read("{kept: 1}")
    more = apply_overlay(base, read(shown(added)), Problems())
    removal = "{" + ", ".join(f"{key}: {{remove: true}}" for key in added) + "}"
    problems = Problems()
    assert plain(apply_overlay(more, read(removal), problems)) == {"kept": "1"}
    assert problems.reported == []


def test_without_leaves_the_others() -> None:
    assert plain(without_keys(read("{a: 1, b: 2}"), "a", "c")) == {"b": "2"}


# Templates: laid under a mode, after all variants.

LAMP = """language: 1
automaton: lamp
period: 1 ms
numbers: float64
inputs: {push: {type: bool, default: false}}
states: {x: {unit: m, initial: 0 m}}
initial: off
templates:
  common:
    equations: {bright: 1 m}
    update: {x: x + bright}
    transitions: {other: {to: off, when: push, priority: 3}}
modes:
  on_: {like: common, equations: {bright: 2 m}, number: 4}
  off: {like: common, transitions: {other: {to: on_}}}
  dark: {like: common, transitions: {other: {remove: true}}}
"""
NAMED = LAMP.replace("on_", "bright_one").replace("off", "dim")


def test_a_mode_is_laid_over_its_template() -> None:
    made = automaton(NAMED)
    bright, dim, dark = made.modes.values()
    assert [mode.equations["bright"].tree for mode in (bright, dim)] == [
        tree("2 m"),
        tree("1 m"),
    ]
    assert dim.update["x"].tree == tree("x + bright")
    assert [(t.target, t.priority) for t in dim.transitions] == [("bright_one", 3)]
    assert [(t.source, t.target) for t in bright.transitions] == [("bright_one", "dim")]
    assert dark.transitions == ()


def test_an_unknown_template_is_told_with_the_nearest() -> None:
    problems = raised_problems(lambda: automaton(NAMED.replace("like: common", "like: comon", 1)))
    assert ("there is no template `comon`", "did you mean `common`?") in [
        (problem.label, problem.help) for problem in problems
    ]


# Variants.

VARIANT = "language: 1\nvariant: {name}\nextends: {base}\n{body}\n"


def variant(folder: Path, body: str, **more: str) -> Automaton:
    """Return the automaton of a variant `v` of NAMED; `more` are further variants."""
    texts = {
        "lamp": NAMED,
        "v": VARIANT.format(name="v", base="lamp", body=body),
        **more,
    }
    project = project_of(folder, **texts)
    last = list(texts)[-1]
    return automaton_of(read_document(project.path_of(last)), project)


def test_a_variant_has_a_name_of_its_own(tmp_path: Path) -> None:
    assert variant(tmp_path, "period: 2 ms").name == "v"


def test_a_template_is_applied_after_the_variants(tmp_path: Path) -> None:
    made = variant(tmp_path, "templates: {common: {update: {x: x + 5 m}}}")
    for mode in made.modes.values():
        assert mode.update["x"].tree == tree("x + 5 m")


def test_a_variant_of_a_variant_has_the_changes_of_both(tmp_path: Path) -> None:
    second = VARIANT.format(name="w", base="v", body="inputs: {push: {default: true}}")
    made = variant(tmp_path, "period: 2 ms\nmodes: {dark: {remove: true}}", w=second)
    assert made.name == "w"
    assert (made.period or 0) * 1000 == 2
    assert list(made.modes) == ["bright_one", "dim"]
    assert made.inputs["push"].default == 1


def test_the_last_layer_wins(tmp_path: Path) -> None:
    second = VARIANT.format(name="w", base="v", body="period: 3 ms")
    assert (variant(tmp_path, "period: 2 ms", w=second).period or 0) * 1000 == 3


def test_a_removal_of_what_the_base_has_not_is_refused(tmp_path: Path) -> None:
    lines = problem_lines(lambda: variant(tmp_path, "modes: {bright: {remove: true}}"))
    assert lines == ["4:9 `bright` cannot be removed: it is not there"]


def test_a_new_key_where_no_such_key_is_known_is_refused(tmp_path: Path) -> None:
    lines = problem_lines(lambda: variant(tmp_path, "modes: {dim: {updates: {x: 0 m}}}"))
    assert lines == ["4:15 `updates` is not a key of `modes.dim`"]


def test_all_problems_of_a_variant_are_told_in_one_run(tmp_path: Path) -> None:
    body = "modes: {bright: {remove: true}}\nstates: {z: {remove: true}}"
    assert len(problem_lines(lambda: variant(tmp_path, body))) == 2
