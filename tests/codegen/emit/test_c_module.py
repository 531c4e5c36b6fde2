"""Source: the text of the generated C - golden, cited, reproducible, free of date and place."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import modewright as mw
from codegen.emit.c_math import emit_math_files
from codegen.emit.c_module import emit_c_files
from codegen.emit.c_names import CNames
from codegen.toolchain.templates import product_version
from language.expressions.name_rules import reserved_words
from language.ir.ops import Assign
from language.ir.printer import digest
from language.ir.program import Program
from language.ir.traversal import walk_ops
from language.loading.load import program_of
from modewright.api.simulation import load, program

GOLDEN = Path(__file__).parent / "golden"
HEATER = GOLDEN / "heater.yaml"
AUTOMATA = ("estimator", "estimator_simple", "hko", "leaf", str(HEATER))
WIDEST = 120
"""Longest line of generated C, its comment included."""
KEYWORDS = """
auto break case char const continue default do double else enum extern float for goto if inline
int long register restrict return short signed sizeof static struct switch typedef union unsigned
void volatile while bool true false asm
""".split()  # noqa: SIM905
MACROS = ("INFINITY", "NAN", "HUGE_VAL", "DBL_MAX", "DBL_EPSILON", "FLT_RADIX", "INT8_MAX")
"""What <math.h>, <float.h> and <stdint.h> replace wherever it stands."""
SMALL = """\
language: 1
automaton: {automaton}
period: 1 ms
numbers: float64
parameters: {{{parameter}: {{value: 2}}}}
inputs: {{{input}: {{unit: "1"}}}}
states: {{{state}: {{unit: "1", initial: {input}}}}}
equations: {{{equation}: {input} * {parameter} + sqrt(abs(sin({state} * 1 rad)))}}
initial: {mode}
modes:
  {mode}:
    update: {{{state}: {equation}}}
    transitions: {{{transition}: {{to: other, when: {input} > 0}}}}
  other: {{}}
outputs: [{equation}, {state}, mode]
"""
PLACES = ("automaton", "parameter", "input", "state", "equation", "mode", "transition")


def files_of(name: str) -> dict[str, str]:
    return emit_c_files(program(name))


def unversioned(text: str) -> str:
    return text.replace(f"modewright {product_version()};", "modewright VERSION;")


@pytest.mark.parametrize("name", ["heater.h", "heater.c"])
def test_c_of_a_small_automaton_is_as_kept(name: str, update: bool) -> None:
    """`pytest --update` writes it anew."""
    text = unversioned(files_of(str(HEATER))[name])
    if update:
        (GOLDEN / name).write_text(text)
    assert text == (GOLDEN / name).read_text()


def cited_lines(text: str) -> dict[int, str]:
    """Return what the comment on a line, or on the line of its own above it, says."""
    found = {}
    lines = text.splitlines()
    for number, line in enumerate(lines):
        comment = re.search(r"/\* (.*) \*/$", line)
        above = re.fullmatch(r" *\/\* (.*) \*/", lines[number - 1]) if number else None
        if comment or above:
            found[number] = (comment or above)[1]  # type: ignore[index]
    return found


@pytest.mark.parametrize("name", AUTOMATA)
def test_every_equation_cites_its_key_path(name: str) -> None:
    used = program(name)
    text = files_of(name)[f"{used.name}.c"]
    cited, lines = cited_lines(text), text.splitlines()
    places = [k for k, line in enumerate(lines) if re.match(r" *self->equation\.\w+ =", line)]
    assert len(places) == len(equations(used))
    for place in places:
        member = re.match(r" *self->equation\.(\w+) =", lines[place])
        assert member
        key = rf"{used.name} (modes\.\w+\.)?equations\.{member[1]}"
        assert re.fullmatch(key, cited.get(place, "")), lines[place]


def equations(used: Program) -> list[Assign]:
    ops = [op for block in used.blocks.values() for op in walk_ops(block)]
    return [op for op in ops if isinstance(op, Assign) and op.target.startswith("equation.")]


@pytest.mark.parametrize("name", AUTOMATA)
def test_every_key_of_an_assignment_stands_beside_its_target(name: str) -> None:
    used = program(name)
    text = files_of(name)[f"{used.name}.c"]
    cited, lines = cited_lines(text), text.splitlines()
    pairs = {(line.partition(" =")[0].split()[-1], cited[k]) for k, line in enumerate(lines)
             if k in cited and " =" in line}  # fmt: skip
    for block in used.blocks.values():
        for op in walk_ops(block):
            if isinstance(op, Assign) and op.key and not op.target.startswith("work."):
                target = CNames(used)(op.target).replace("self->derived.", "derived->")
                assert (target, op.key) in pairs


def test_what_nothing_reads_is_not_printed() -> None:
    """Angles have no rate of their own here: it is in the linear part."""
    assert "work.rate_theta_d" in {variable.name for variable in program("estimator").variables}
    for text in (files := files_of("estimator")).values():
        assert "rate_theta_d" not in text
    assert "double rate_w_w; /* rad/s^2; at the point of evaluation */" in files["estimator.h"]


def test_each_matrix_of_a_page_is_told_of_once() -> None:
    header = files_of("estimator")["estimator.h"]
    title = "        /* drive_L_row__column: the gain of the correction */\n"
    assert header.count(title) == 1
    assert header[header.index(title) + len(title) :].startswith(
        "        double drive_L_theta_d__y"
    )


@pytest.mark.parametrize("name", AUTOMATA)
def test_files_carry_the_digest_but_no_date_and_no_place(name: str) -> None:
    files = files_of(name)
    own = [text for file, text in files.items() if not file.startswith("ha_math")]
    assert all(digest(program(name)) in text for text in own)
    for text in files.values():
        assert not re.search(r"\b(19|20)\d\d-\d\d?-\d\d?\b|\b\d\d?:\d\d\b", text)
        assert not re.search(r"[\s\"'(]/\w+/", text)
        assert str(Path.home()) not in text
        assert "\t" not in text
        assert not re.search(r"[ \t]$", text, re.MULTILINE)
    assert max(len(line) for text in own for line in text.splitlines()) <= WIDEST


def test_names_of_the_model_are_kept() -> None:
    code = files_of("estimator_simple")["estimator_simple.c"]
    assert "self->equation.w_d = (self->state.w_em * constant.per_R) - self->state.w_w;" in code


def test_what_we_add_to_page_and_inputs_is_named_like_no_parameter_and_no_input() -> None:
    beside_names = files_of("estimator")["estimator.h"].partition("} estimator_In;")[0]
    ours = set(re.findall(r"^    } (\w+);", beside_names, re.MULTILINE))
    assert len(ours) == 2
    assert ours <= reserved_words()["GENERATED"]


@pytest.mark.long
@pytest.mark.parametrize("hash_seed", ["1", "2"])
def test_another_process_generates_the_same_bytes(hash_seed: str) -> None:
    script = (
        "import sys, modewright as mw\n"
        "for name in sys.argv[1:]:\n"
        "    sys.stdout.write(''.join(mw.generate(name).values()))\n"
    )
    environment = {**os.environ, "PYTHONHASHSEED": hash_seed, "TZ": "Asia/Tokyo"}
    command = [sys.executable, "-c", script, *AUTOMATA]
    done = subprocess.run(command, capture_output=True, text=True, check=True, env=environment)
    assert done.stdout == "".join(text for name in AUTOMATA for text in files_of(name).values())


def test_two_generations_are_equal_and_math_is_the_same_for_all() -> None:
    assert files_of("estimator") == files_of("estimator")
    for name in AUTOMATA:
        files = files_of(name)
        if "ha_math.c" in files:
            assert emit_math_files("float64").items() <= files.items()


def test_float32_has_mathematics_of_its_own_without_a_double() -> None:
    files = files_of("estimator_float32")
    assert sorted(files) == [
        "estimator_float32.c",
        "estimator_float32.h",
        "estimator_float32_MemMap.h",
        "ha_mathf.c",
        "ha_mathf.h",
    ]
    assert emit_math_files("float32").items() <= files.items()
    for text in files.values():
        code = re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL)
        assert not re.search(r"\bdouble\b|\bint64_t\b", code)
        assert not re.search(r"(?<![\w.])\d+\.\d*(e[-+]?\d+)?(?![\deF.+-])", code)


def test_an_automaton_whose_inputs_vary_inside_a_step_has_no_c() -> None:
    automaton = load("ev_driveline", "tip_out").system.instances["plant"].automaton
    assert emit_c_files(program_of(automaton))
    with pytest.raises(ValueError, match="inputs of driveline vary inside a step: it has no C"):
        emit_c_files(program_of(automaton, ["T_em"]))


def spec_with(folder: Path, place: str, name: str) -> str:
    names = {other: f"plain_{other}" for other in PLACES} | {place: name}
    path = folder / "small.yaml"
    path.write_text(SMALL.format(**names))
    return str(path)


def test_plain_names_are_fine(tmp_path: Path) -> None:
    assert mw.check(spec_with(tmp_path, "parameter", "plain")) == []


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("keyword", ["double", "register"])
def test_a_word_of_c_is_refused_as_any_name(tmp_path: Path, place: str, keyword: str) -> None:
    problems = mw.check(spec_with(tmp_path, place, keyword))
    assert problems
    assert f"`{keyword}`" in problems[0].label


@pytest.mark.parametrize("keyword", KEYWORDS)
def test_every_keyword_of_c_is_refused(tmp_path: Path, keyword: str) -> None:
    assert mw.check(spec_with(tmp_path, "parameter", keyword))


@pytest.mark.parametrize("macro", MACROS)
def test_a_macro_of_the_headers_is_refused(tmp_path: Path, macro: str) -> None:
    assert mw.check(spec_with(tmp_path, "parameter", macro))


@pytest.mark.parametrize("name", ["main", "ha_math", "../above", "a-b", "1st"])
def test_an_automaton_is_not_called_like_a_path_or_a_file_of_ours(
    tmp_path: Path, name: str
) -> None:
    assert mw.check(spec_with(tmp_path, "automaton", name))
