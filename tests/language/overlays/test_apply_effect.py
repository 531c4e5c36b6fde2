"""Laying: what an effect does to the tree of an automaton, in its order."""

from __future__ import annotations

from pathlib import Path

import pytest

from language.loading.load import load_automaton, program_of
from language.overlays.expand_document import Project, expand_document, read_document
from language.readers.element_reader import outputs_as_mapping
from language.text.document import ScalarNode
from language.text.node_edit import find_node
from tests.language.spec_builders import problem_lines, project_of

CART = """language: 1
automaton: cart
parameters:
  {m: {value: 2 kg}, k: {value: 8 N/m}, c: {value: 3 N*s^2/m^2}, q: {derived: k / m, unit: 1/s^2}}
inputs: {F: {unit: N}}
states: {x: {unit: m, initial: 0 m}, v: {unit: m/s, initial: F / m * 1 s}}
equations: {F_s: k * x, part: c * v * v, load: part + part_2, part_2: 2 N, both: part_2}
flow:
  x: der(x) = v
  v: m * der(v) = F - load - (F_s + F) + F * v / v
modes:
  only: {transitions: {again: {to: only, when: F > 3 N and x > 1 m, reset: {x: -abs(F / k)}}}}
elements: {body: {kind: inertia, speed: v, inertia: m, far: [load]}}
outputs: [x, v, F_s]
"""
LAG = """language: 1
effect: lag
at: {input: {}}
parameters: {tau: {value: 1 s}, twice: {derived: 2 * tau, unit: s}}
states: {u_a: {unit: $unit, initial: $u}}
flow: {u_a: twice * der(u_a) = $u - u_a}
redirect: {everywhere: {$u: u_a}}
"""
SPLIT = """language: 1
effect: split
at: {element: {kind: inertia}}
parameters: {m_1: {value: 1 kg}}
states: {w: {unit: $unit, initial: $speed}}
flow: {w: ($inertia - m_1) * der(w) = m_1 * w * 0 / 1 s}
move: {$far: w}
redirect: {flow.$speed: {$inertia: m_1}, equations.$far: {$speed: w}}
"""
MORE = """language: 1
effect: more
at: {element: {kind: inertia, has: [far]}}
equations: {$far: 2 * base}
"""


def cart(folder: Path, effects: str, **more: str) -> Project:
    variant = f"language: 1\nvariant: laid\nextends: cart\neffects: {effects}\n"
    return project_of(folder, cart=CART, laid=variant, lag=LAG, split=SPLIT, more=MORE, **more)


def text(project: Project, path: str, name: str = "laid") -> str:
    tree = expand_document(read_document(project.path_of(name)), project).root
    node = find_node(tree, path.split("."))
    assert isinstance(node, ScalarNode), path
    return node.text


def test_reads_are_redirected_everywhere_but_in_start_values_and_own_lines(tmp_path: Path) -> None:
    project = cart(tmp_path, "{lag@F: {}}")
    assert text(project, "flow.v") == ("m * der(v) = u_a_F - load - (F_s + u_a_F) + u_a_F * v / v")
    assert text(project, "modes.only.transitions.again.when") == "u_a_F > 3 N and x > 1 m"
    assert text(project, "modes.only.transitions.again.reset.x") == "-abs(u_a_F / k)"
    assert text(project, "states.v.initial") == "F / m * 1 s"
    assert text(project, "flow.u_a_F") == "twice_F * der(u_a_F) = F - u_a_F"
    assert text(project, "parameters.twice_F.derived") == "2 * tau_F"
    program_of(load_automaton("laid", project))


def test_a_later_layer_sees_the_earlier_one_as_its_base(tmp_path: Path) -> None:
    project = cart(tmp_path, "{lag@F: {}}")
    second = "language: 1\nvariant: twice\nextends: laid\neffects: {lag@F: {as: b}}\n"
    project_of(tmp_path, twice=second)
    # Both read the input itself: what reads the delivered force reads that of the first.
    assert text(project, "flow.u_a_F", "twice") == "twice_F * der(u_a_F) = u_a_b - u_a_F"
    assert text(project, "flow.u_a_b", "twice") == "twice_b * der(u_a_b) = F - u_a_b"
    program_of(load_automaton("twice", Project(tmp_path)))


def test_summands_move_and_what_only_an_equation_reads_is_redirected(tmp_path: Path) -> None:
    project = cart(tmp_path, "{split@body: {}}")
    assert text(project, "flow.v") == "m_1_body * der(v) = F - (F_s + F) + F * v / v"
    assert text(project, "flow.w_body") == (
        "(m - m_1_body) * der(w_body) = m_1_body * w_body * 0 / 1 s - load"
    )
    assert text(project, "equations.part") == "c * w_body * w_body"
    program_of(load_automaton("laid", project))


def test_base_is_what_an_equation_was(tmp_path: Path) -> None:
    project = cart(tmp_path, "{more@body: {}, split@body: {}}")
    assert text(project, "equations.load") == "2 * (part + part_2)"
    project = cart(tmp_path, "{more@body: {}}")
    assert text(project, "flow.v").startswith("m * der(v) = F - load")


def test_effects_may_be_laid_by_the_automaton_itself(tmp_path: Path) -> None:
    project = cart(tmp_path, "{}")
    project_of(tmp_path, cart=CART + "effects: {lag@F: {rename: {u_a: F_a}}}\n")
    assert "F_a" in load_automaton("cart", Project(tmp_path)).states
    assert "F_a" in load_automaton("laid", project).states


def test_a_redirection_that_finds_nothing_is_refused(tmp_path: Path) -> None:
    project = cart(tmp_path, "{lag@F: {}}", unread="")
    project_of(tmp_path, cart=CART.replace("inputs: {", "inputs: {G: {unit: N}, "))
    project_of(tmp_path, laid="language: 1\nvariant: laid\nextends: cart\neffects: {lag@G: {}}\n")
    assert problem_lines(
        lambda: expand_document(read_document(project.path_of("laid")), project)
    ) == ["4:15 `lag` cannot be applied here: nothing reads `G`"]


def lag_with(folder: Path, redirect: str, base: str = CART) -> Project:
    """Return a project whose effect `lag` at F has other redirections."""
    project = cart(folder, "{lag@F: {}}")
    lag = LAG.replace("redirect: {everywhere: {$u: u_a}}", f"redirect: {redirect}")
    return project_of(project.root, lag=lag, cart=base)


MODES = """modes:
  only:
    terms: {v: {push: F}}
    equations: {pull: F + F}
    transitions: {again: {to: only, when: F > 3 N and x > 1 m, reset: {x: -abs(F / k)}}}
"""
WITH_TERMS = CART.partition("modes:")[0] + MODES + "elements" + CART.partition("elements")[2]


def test_exceptions_apply_to_every_redirection(tmp_path: Path) -> None:
    base = CART.replace("der(x) = v", "der(x) = v + F / k / 1 s")
    redirect = "{flow: {$u: u_a}, modes: {$u: u_a}, except: [flow.v, when]}"
    project = lag_with(tmp_path, redirect, base)
    assert text(project, "flow.x") == "der(x) = v + u_a_F / k / 1 s"
    assert text(project, "flow.v") == "m * der(v) = F - load - (F_s + F) + F * v / v"
    assert text(project, "modes.only.transitions.again.when") == "F > 3 N and x > 1 m"
    assert text(project, "modes.only.transitions.again.reset.x") == "-abs(u_a_F / k)"


@pytest.mark.parametrize(
    ("excepted", "force"), [("outputs", "F"), ("outputs.F", "F"), ("flow", "u_a_F")]
)
def test_outputs_may_be_excepted(tmp_path: Path, excepted: str, force: str) -> None:
    base = CART.replace("outputs: [x, v, F_s]", "outputs: [x, F]")
    project = lag_with(tmp_path, f"{{everywhere: {{$u: u_a}}, except: [{excepted}]}}", base)
    tree = expand_document(read_document(project.path_of("laid")), project).root
    outputs = {entry.key: entry.node for entry in outputs_as_mapping(tree.entries["outputs"].node)}
    assert isinstance(shown := outputs["F"], ScalarNode)
    assert shown.text == force


@pytest.mark.parametrize(
    "part", ["terms.v", "terms", "equations.pull", "reset", "transitions.again"]
)
def test_a_part_inside_a_mode_has_all_expressions_below_it(tmp_path: Path, part: str) -> None:
    project = lag_with(tmp_path, f"{{{part}: {{$u: u_a}}}}", WITH_TERMS)
    new = {
        "terms.v.push": "u_a_F",
        "equations.pull": "u_a_F + u_a_F",
        "transitions.again.when": "u_a_F > 3 N and x > 1 m",
        "transitions.again.reset.x": "-abs(u_a_F / k)",
    }
    for path, redirected in new.items():
        is_inside = path.startswith(part) or f".{part}." in path
        expected = redirected if is_inside else redirected.replace("u_a_F", "F")
        assert text(project, f"modes.only.{path}") == expected


def test_a_part_that_is_nowhere_is_refused(tmp_path: Path) -> None:
    project = lag_with(tmp_path, "{terms.x: {$u: u_a}}", WITH_TERMS)
    (line,) = problem_lines(
        lambda: expand_document(read_document(project.path_of("laid")), project)
    )
    assert line.endswith("`lag` cannot be applied here: there is no `terms.x`")


def test_an_element_without_what_an_effect_needs_is_told_the_key(tmp_path: Path) -> None:
    project = cart(tmp_path, "{split@body: {}}")
    project_of(tmp_path, cart=CART.replace("inertia: m,", ""))
    assert problem_lines(
        lambda: expand_document(read_document(project.path_of("laid")), project)
    ) == ["4:17 `split` cannot be applied here: element `body` has no `inertia`"]


def test_of_an_inertia_without_a_far_side_nothing_moves(tmp_path: Path) -> None:
    project = cart(tmp_path, "{split@body: {}}")
    project_of(tmp_path, cart=CART.replace(", far: [load]", ""))
    assert text(project, "flow.v") == "m_1_body * der(v) = F - load - (F_s + F) + F * v / v"


def test_an_expression_is_no_name_to_redirect(tmp_path: Path) -> None:
    project = cart(tmp_path, "{split@body: {}}")
    project_of(tmp_path, cart=CART.replace("inertia: m,", "inertia: m + m,"))
    (line,) = problem_lines(
        lambda: expand_document(read_document(project.path_of("laid")), project)
    )
    assert line.endswith("`m + m` would be redirected, and only a name can be")


def test_a_mistake_in_an_effect_names_the_effect_and_where_it_is_laid(tmp_path: Path) -> None:
    wrong = LAG.replace("effect: lag", "effect: wrong").replace("$u - u_a", "$u - tau")
    project = cart(tmp_path, "{wrong@F: {}}", wrong=wrong)
    with pytest.raises(Exception, match="joins") as caught:
        load_automaton("laid", project)
    span = caught.value.problems[0].span  # type: ignore[attr-defined]
    assert span.source.layer == "effect wrong@F"
    assert str(span.source.applied_at).endswith("laid.yaml:4:11")


@pytest.mark.parametrize("mode", ["drive_contact", "no_contact"])
def test_a_sampled_automaton_runs_a_model_with_effects(tmp_path: Path, mode: str) -> None:
    rider = f"""language: 1
automaton: rider
period: 1 ms
numbers: float64
model: driveline_load
inputs: {{T_em: {{unit: N*m}}, T_br: {{unit: N*m}}, slope: {{unit: rad}}}}
states:
  theta_d: {{initial: 0.07 rad, range: [-1, 1]}}
  theta_b: {{initial: alpha, range: [-0.2, 0.2]}}
  w_em: {{initial: 300 rad/s, range: [-400, 2400]}}
  w_w: {{initial: 37 rad/s, range: [-50, 300]}}
  T_l: {{initial: 5 N*m, range: [-2000, 2000]}}
modes: {{run: {{runs: {{of: driveline_load.{mode}, method: rk4}}}}}}
outputs: [w_w, T_l]
"""
    project_of(tmp_path, rider=rider)
    automaton = load_automaton("rider", Project(tmp_path))
    assert automaton.model is not None and "T_l" in automaton.model.states
    program = program_of(automaton)
    assert any("T_l" in variable.name for variable in program.variables)
