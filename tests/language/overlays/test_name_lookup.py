"""Project: where a name is looked up, the head of a file, and what a variant extends."""

from __future__ import annotations

from pathlib import Path

import pytest

from language.loading.load import automaton_of, load_automaton
from language.loading.scenario_reader import read_scenario
from language.loading.system_reader import read_system
from language.overlays.expand_document import (
    Project,
    apply_variant,
    display_path,
    expand_document,
    lineage,
    read_document,
)
from language.text.diagnostic import Problems, Source, Span
from language.text.document import Document
from modewright.api.spec_check import check
from tests.language.spec_builders import (
    SHIPPED,
    document,
    problem_lines,
    project_of,
    raised_problems,
)

PLAIN = """language: 1
automaton: {name}
parameters: {{p: {{value: 2 m}}}}
states: {{x: {{unit: m, initial: p}}}}
flow: {{x: der(x) = 0}}
modes: {{only: {{}}}}
"""
VARIANT = "language: 1\nvariant: {name}\nextends: {base}\n{body}\n"


def plain(name: str) -> str:
    return PLAIN.format(name=name)


def variant(name: str, base: str, body: str = "") -> str:
    return VARIANT.format(name=name, base=base, body=body)


def extended(project: Project, name: str) -> Document:
    return expand_document(read_document(project.path_of(name)), project)


def test_a_file_is_found_by_the_name_of_what_it_holds(tmp_path: Path) -> None:
    project = project_of(tmp_path, file=plain("ball"))
    assert project.path_of("ball") == tmp_path / "spec" / "file.yaml"


def test_only_the_first_head_of_a_file_names_it(tmp_path: Path) -> None:
    scenario = "language: 1\nscenario: {name}\nof: ball\n"
    wrong = "language: 1\nstudy: many\nscenario: {name}\nof: ball\n"
    project = project_of(
        tmp_path,
        z_scenario=scenario.format(name="kick"),
        a_study=wrong.format(name="kick"),
        b_study=wrong.format(name="tip_out").replace("many", "more"),
        c_study=wrong.format(name="nowhere_else").replace("many", "other"),
    )
    assert project.path_of("kick").name == "z_scenario.yaml"
    assert project.path_of("tip_out") == SHIPPED.path_of("tip_out")
    assert project.path_of("many").name == "a_study.yaml"
    assert project.path_of("nowhere_else").name == "c_study.yaml"
    (line,) = problem_lines(lambda: extended(project, "many"))
    assert line.endswith("one file holds one thing: `study` is given too")


def test_a_file_is_found_in_any_folder_below_spec(tmp_path: Path) -> None:
    project = project_of(tmp_path)
    (tmp_path / "spec" / "a" / "b").mkdir(parents=True)
    (tmp_path / "spec" / "a" / "b" / "c.yaml").write_text(plain("ball"))
    assert project.path_of("ball").name == "c.yaml"


@pytest.mark.parametrize(
    "head", ["automaton: 'ball'", 'automaton: "ball"', "automaton:   ball # it"]
)
def test_a_name_is_found_however_it_is_written(tmp_path: Path, head: str) -> None:
    project = project_of(tmp_path, file=plain("ball").replace("automaton: ball", head))
    assert project.path_of("ball").name == "file.yaml"
    assert read_document(project.path_of("ball")).name == "ball"


def test_a_path_is_a_path(tmp_path: Path) -> None:
    project = project_of(tmp_path, file=plain("ball"))
    path = str(tmp_path / "spec" / "file.yaml")
    assert str(project.path_of(path)) == path
    assert load_automaton(path, project).name == "ball"


def test_a_path_inside_a_file_is_looked_up_beside_it(tmp_path: Path) -> None:
    project = project_of(tmp_path, base=plain("ball"), over=variant("v", "base.yaml"))
    assert extended(project, "v").name == "v"
    span = Span(Source(str(tmp_path / "spec" / "over.yaml")), 1, 1)
    assert project.path_of("base.yaml", span) == tmp_path / "spec" / "base.yaml"


def test_shipped_specs_are_found_from_anywhere(tmp_path: Path) -> None:
    project = Project(tmp_path)
    for name in ("driveline", "estimator", "tip_out", "leaf", "leaf_can", "ev_driveline"):
        assert project.path_of(name).is_file()
    assert load_automaton("estimator", project).name == "estimator"


def test_the_own_spec_goes_before_the_shipped_one(tmp_path: Path) -> None:
    project = project_of(tmp_path, mine=plain("driveline"))
    assert project.path_of("driveline") == tmp_path / "spec" / "mine.yaml"
    assert list(load_automaton("driveline", project).states) == ["x"]


def test_a_shipped_automaton_takes_the_own_model(tmp_path: Path) -> None:
    source = SHIPPED.path_of("driveline").read_text("utf-8")
    project = project_of(tmp_path, mine=source.replace("value: 8.1,", "value: 9.25,"))
    assert float(load_automaton("estimator", project).parameters["R"].value or 0) == 9.25


def test_two_definitions_are_refused_with_both_files(tmp_path: Path) -> None:
    project = project_of(tmp_path, a=plain("ball"), b=plain("ball"))
    (problem,) = raised_problems(lambda: project.path_of("ball"))
    assert problem.label == "`ball` is defined twice"
    assert "a.yaml" in problem.help and "b.yaml" in problem.help


def test_two_kinds_share_their_names(tmp_path: Path) -> None:
    system = "language: 1\nsystem: ball\ninstances: {one: {of: ball}}\n"
    project = project_of(tmp_path, a=plain("ball"), b=system)
    assert problem_lines(lambda: project.path_of("ball")) == ["1:1 `ball` is defined twice"]


def test_an_unknown_name_is_refused_with_the_nearest() -> None:
    (problem,) = raised_problems(lambda: SHIPPED.path_of("drivelin"))
    assert problem.label == "there is no spec named `drivelin`"
    assert problem.help == "did you mean `driveline`?"


def test_an_unknown_name_is_told_where_it_is_written(tmp_path: Path) -> None:
    project = project_of(tmp_path, v=variant("v", "balll"), a=plain("ball"))
    (problem,) = raised_problems(lambda: extended(project, "v"))
    assert (problem.span.line, problem.span.column, problem.span.width) == (3, 10, 5)
    assert problem.help == "did you mean `ball`?"


def test_a_path_that_is_no_file_is_refused(tmp_path: Path) -> None:
    lines = problem_lines(lambda: load_automaton(str(tmp_path / "none.yaml"), SHIPPED))
    assert lines == ["1:1 the file cannot be read: No such file or directory"]


def test_a_file_of_a_project_that_is_no_yaml_hides_no_other(tmp_path: Path) -> None:
    project = project_of(tmp_path, a=plain("ball"))
    (tmp_path / "spec" / "b.yaml").write_bytes(b"\xff\xfe\x00")
    assert project.path_of("ball").name == "a.yaml"


@pytest.mark.parametrize(
    ("text", "lines"),
    [
        ("automaton: a\n", ["1:1 `language: 1` is missing"]),
        ("language: 2\nautomaton: a\n", ["1:11 this version of the language is not known: use 1"]),
        ("language: 1.0\nmap: a\n", ["1:11 this version of the language is not known: use 1"]),
        ("language: 1\n", ["1:1 the file does not say what it holds"]),
        (
            "language: 1\nautomaton: a\nsystem: b\n",
            ["3:1 one file holds one thing: `automaton` is given too"],
        ),
        (
            "language: 1\nscenario: a\nsystem: b\n",
            ["3:1 one file holds one thing: `scenario` is given too"],
        ),
        ("language: 1\nautomaton: {a: 1}\n", ["2:1 `automaton` is followed by a name"]),
        ("{}", ["1:1 `language: 1` is missing", "1:1 the file does not say what it holds"]),
    ],
)
def test_a_file_starts_with_its_version_its_kind_and_its_name(text: str, lines: list[str]) -> None:
    assert problem_lines(lambda: document(text)) == lines


def test_a_document_of_another_kind_is_no_automaton() -> None:
    lines = problem_lines(lambda: load_automaton("ev_driveline", SHIPPED))
    assert [line.partition(" ")[2] for line in lines] == [
        "`ev_driveline` is a system, not an automaton"
    ]


def test_a_variant_names_its_base(tmp_path: Path) -> None:
    project = project_of(tmp_path, v="language: 1\nvariant: v\n")
    assert problem_lines(lambda: extended(project, "v")) == [
        "2:10 a variant names its base in `extends`"
    ]


def test_a_variant_becomes_what_its_base_is(tmp_path: Path) -> None:
    project = project_of(tmp_path, a=plain("ball"), v=variant("v", "ball"), w=variant("w", "v"))
    made = extended(project, "w")
    assert (made.kind, made.name) == ("automaton", "w")
    assert "extends" not in made.root.entries
    assert lineage(read_document(project.path_of("w")), project) == ["w", "v", "ball"]


@pytest.mark.parametrize(
    ("bases", "chain"),
    [
        ({"v": "v"}, "`v` extends itself: `v` -> `v`"),
        ({"v": "w", "w": "v"}, "`v` extends itself: `v` -> `w` -> `v`"),
        ({"v": "w", "w": "z", "z": "w"}, "`w` extends itself: `w` -> `z` -> `w`"),
    ],
)
def test_a_circle_of_variants_is_refused_with_the_chain(
    tmp_path: Path, bases: dict[str, str], chain: str
) -> None:
    project = project_of(tmp_path, **{name: variant(name, base) for name, base in bases.items()})
    for make in (extended, lambda p, name: lineage(read_document(p.path_of(name)), p)):
        assert problem_lines(lambda make=make: make(project, "v")) == [f"3:10 {chain}"]  # type: ignore[misc]


def test_twenty_one_layers_are_too_many(tmp_path: Path) -> None:
    chain = {f"v{k}": variant(f"v{k}", f"v{k + 1}") for k in range(20)}
    project = project_of(tmp_path, **chain, v20=plain("v20"))
    assert extended(project, "v1").kind == "automaton"
    assert problem_lines(lambda: extended(project, "v0")) == [
        "3:10 a chain of `extends` has more than 20 documents"
    ]


@pytest.mark.parametrize("base", ["v.yaml", "./v.yaml"])
def test_a_circle_of_variants_by_paths_is_refused(tmp_path: Path, base: str) -> None:
    project = project_of(tmp_path, v=variant("v", base))
    assert problem_lines(lambda: extended(project, "v")) == ["3:10 `v` extends itself: `v` -> `v`"]


def test_an_automaton_that_is_its_own_model_is_refused(tmp_path: Path) -> None:
    clocked = "period: 1 ms\nnumbers: float64\nmodel: ball\n"
    text = plain("ball").replace("flow: {x: der(x) = 0}\n", clocked)
    project = project_of(tmp_path, a=text)
    assert problem_lines(lambda: load_automaton("ball", project))


def test_a_warning_of_a_variant_is_told(tmp_path: Path) -> None:
    same = variant("v", "ball", "parameters: {p: {value: 2 m}}")
    project_of(tmp_path, a=plain("ball"), v=same)
    assert [problem.severity for problem in check("v", tmp_path)] == ["warning"]


SYSTEM = """language: 1
system: shelf
inputs: {push: {unit: m}}
instances: {one: {of: cart, values: {p: 3 m}}}
connections: {one.u: push}
outputs: {x: one.x}
"""
CART = PLAIN.replace("modes:", "inputs: {{u: {{unit: m}}}}\nmodes:") + "outputs: [x]\n"
RUN = """language: 1
scenario: run
of: shelf
horizon: 2 s
initial: {one.x: 1 m}
inputs: {push: {start: 1 m, steps: {1 s: 2 m}}}
"""


def test_a_system_is_extended(tmp_path: Path) -> None:
    body = "instances: {one: {values: {p: 4 m}}, two: {of: cart}}\nconnections: {two.u: one.x}"
    project = project_of(
        tmp_path,
        a=CART.format(name="cart"),
        s=SYSTEM,
        v=variant("v", "shelf", body.replace("one.x}", "push}")),
    )
    made = read_system(read_document(project.path_of("v")), project)
    assert list(made.instances) == ["one", "two"]
    assert [i.automaton.parameters["p"].value for i in made.instances.values()] == [4, 2]
    assert check("v", tmp_path) == []


def test_a_warning_of_a_variant_of_a_system_is_told(tmp_path: Path) -> None:
    same = variant("v", "shelf", "instances: {one: {values: {p: 3 m}}}")
    project_of(tmp_path, a=CART.format(name="cart"), s=SYSTEM, v=same)
    assert [problem.severity for problem in check("v", tmp_path)] == ["warning"]


def test_a_value_for_an_unknown_parameter_is_told_with_the_nearest(tmp_path: Path) -> None:
    wrong = variant("v", "shelf", "instances: {one: {values: {pp: 3 m}}}")
    project_of(tmp_path, a=CART.format(name="cart"), s=SYSTEM, v=wrong)
    (problem,) = check("v", tmp_path)
    assert (problem.label, problem.span.line) == ("there is no parameter `pp`", 4)


def test_a_scenario_is_extended(tmp_path: Path) -> None:
    body = "horizon: 3 s\ninputs: {push: {steps: {1 s: 5 m, 2 s: 6 m}}}"
    project = project_of(
        tmp_path, a=CART.format(name="cart"), s=SYSTEM, r=RUN, v=variant("v", "run", body)
    )
    system = read_system(read_document(project.path_of("shelf")), project)
    made = read_scenario(read_document(project.path_of("v")), project, system)
    assert (made.name, float(made.horizon or 0)) == ("v", 3.0)
    steps = [(float(time), float(value)) for time, value in made.inputs["push"].steps]
    assert steps == [(0.0, 1.0), (1.0, 5.0), (2.0, 6.0)]
    assert check("v", tmp_path) == []
    same = variant("w", "run", "inputs: {push: {start: 1 m}}")
    project_of(tmp_path, w=same)
    assert [problem.severity for problem in check("w", tmp_path)] == ["warning"]


def test_a_variant_is_laid_over_what_it_extends_or_a_relative_of_it(tmp_path: Path) -> None:
    change = variant("hot", "ball", "parameters: {p: {value: 3 m}}")
    project = project_of(
        tmp_path, a=plain("ball"), b=plain("cube"), h=change, v=variant("v", "ball")
    )
    hot = read_document(project.path_of("hot"))
    base = read_document(project.path_of("v"))
    made = apply_variant(base, hot, project, Problems())
    assert automaton_of(made, project).parameters["p"].value == 3
    other = read_document(project.path_of("cube"))
    (problem,) = raised_problems(lambda: apply_variant(other, hot, project, Problems()))
    assert problem.label == "variant `hot` extends `ball`, not `cube`"


def test_a_path_is_shown_as_short_as_it_can_be(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert display_path(tmp_path / "spec" / "a.yaml") == str(Path("spec") / "a.yaml")
    outside = tmp_path.parent / "a.yaml"
    assert display_path(outside) == str(outside)
