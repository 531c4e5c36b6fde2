"""Difference: two specs are compared in terms of values, modes, transitions and guards."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path

import pytest
from typer.testing import CliRunner

from language.text.diagnostic import MissingToolError, SpecError
from language.text.project_files import parse_document, source_of
from modewright.cli.app import app
from modewright.editing.spec_diff.difference import SpecChange, diff_documents
from modewright.editing.spec_diff.rendering import diff_html

BASE = """\
language: 1
automaton: gap
period: 1 ms
parameters: {k: {value: 4000 N*m/rad, range: [0, 9000]}, alpha: {value: 0.2 rad}}
equations: {T: k * theta}
templates: {contact: {number: 7, entry: {n: n + 1}}}
modes:
  drive: {like: contact, transitions: {free: {when: T < 0 N*m, wait: 5 ms}}}
  free: {transitions: {drive: {when: T > 0 N*m, priority: 1}, late: {to: drive, when: T > k}}}
"""


def changes(text: str, before: str = BASE) -> list[SpecChange]:
    old, new = (
        parse_document(source_of(Path(name), each), each)
        for name, each in (("old.yaml", before), ("new.yaml", text))
    )
    return list(diff_documents(old, new))


def only(text: str, before: str = BASE) -> tuple[str, ...]:
    (found,) = changes(text, before)
    return (found.kind, found.group, found.thing, found.aspect, found.before, found.after)


def test_a_value_is_told_with_how_much_it_changed_and_where_both_stand() -> None:
    (found,) = changes(BASE.replace("value: 4000 N*m/rad", "value: 5000 N*m/rad"))
    assert found == SpecChange(
        kind="changed",
        group="parameters",
        thing="k",
        aspect="value",
        before="4000 N*m/rad",
        after="5000 N*m/rad",
        note="+25 %",
        before_place="old.yaml:4",
        after_place="new.yaml:4",
    )


@pytest.mark.parametrize(
    ("value", "note"),
    [
        ("4 kN*m/rad", "same value"),
        ("2000 N*m/rad", "-50 %"),
        ("40000 N*m/rad", "times 10"),
        ("-4000 N*m/rad", "-200 %"),
        ("4000 N*m", "other unit"),
    ],
)
def test_numbers_are_compared_in_si(value: str, note: str) -> None:
    (found,) = changes(BASE.replace("value: 4000 N*m/rad", f"value: {value}"))
    assert found.note == note


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        (
            "when: T < 0 N*m,",
            "when: T <= 0 N*m,",
            "changed | transitions | drive -> free | guard | T < 0 N*m | T <= 0 N*m",
        ),
        ("wait: 5 ms", "wait: 7 ms", "changed | transitions | drive -> free | wait | 5 ms | 7 ms"),
        (", priority: 1", "", "removed | transitions | free -> drive | priority | 1 | "),
        (
            ", late: {to: drive, when: T > k}",
            "",
            "removed | transitions | free -> drive (late) |  | to: drive, when: T > k | ",
        ),
        (
            "{to: drive, when: T > k}",
            "{to: free, when: T > k}",
            "changed | transitions | free -> free (late) | target | drive | free",
        ),
        ("T: k * theta", "T: k * x", "changed | equations | T |  | k * theta | k * x"),
        ("period: 1 ms", "period: 2 ms", "changed | settings | period |  | 1 ms | 2 ms"),
        ("n: n + 1", "n: n + 2", "changed | actions | n in drive | entry | n + 1 | n + 2"),
        ("number: 7", "number: 8", "changed | modes | drive | number | 7 | 8"),
    ],
)
def test_a_change_is_told_of_what_it_is_about(old: str, new: str, told: str) -> None:
    assert BASE.count(old) == 1
    assert " | ".join(only(BASE.replace(old, new))) == told


def test_blanks_order_comments_and_templates_make_no_difference() -> None:
    text = BASE.replace("T < 0 N*m", "T   < 0 N*m").replace("k * theta", "k*theta")
    text = text.replace("period: 1 ms\n", "").replace("equations:", "period: 1 ms # c\nequations:")
    text = text.replace("templates: {contact: {number: 7, entry: {n: n + 1}}}\n", "")
    text = text.replace("like: contact", "number: 7, entry: {n: n + 1}")
    assert changes(text) == []


def test_a_new_mode_is_told_with_its_transitions_and_equations() -> None:
    text = BASE + "  stop: {number: 9, equations: {w: 0}, transitions: {free: {when: T > 1 N*m}}}\n"
    found = [(c.kind, c.group, c.thing, c.after) for c in changes(text)]
    assert found == [
        ("added", "modes", "stop", "number: 9"),
        ("added", "equations", "w in stop", "0"),
        ("added", "transitions", "stop -> free", "when: T > 1 N*m"),
    ]
    gone = [(c.kind, c.group, c.thing, c.before) for c in changes(BASE, text)]
    assert gone == [("removed", *rest) for _, *rest in found]


def test_modes_in_regions_and_in_modes_have_their_path() -> None:
    text = "language: 1\nautomaton: a\nregions: {r: {modes: {up: {modes: {in: {number: 1}}}}}}\n"
    told = only(text.replace("number: 1", "number: 2"), text)
    assert told == ("changed", "modes", "r.up.in", "number", "1", "2")


def test_texts_come_last_for_they_change_nothing() -> None:
    text = "about: a gap\n" + BASE.replace("period: 1 ms", "period: 3 ms")
    assert [change.group for change in changes(text)] == ["settings", "texts"]


def test_specs_of_two_kinds_are_not_compared() -> None:
    with pytest.raises(SpecError, match="of kind map"):
        changes("language: 1\nmap: m\n")


def test_the_page_shows_what_was_written_not_what_it_would_do() -> None:
    text = BASE.replace("T: k * theta", 'T: "<script>alert(1)</script>"')
    page = diff_html(changes(text), "a", "b")
    assert "<script>" not in page and "&lt;script&gt;alert(1)" in page
    assert "old.yaml:5" in page


def test_parameters_of_the_model_are_compared_with_what_is_laid_over_them() -> None:
    told = CliRunner().invoke(app, ["diff", "estimator", "leaf", "--json"])
    found = {(c["thing"], c["aspect"]): c for c in json.loads(told.output)["changes"]}
    assert found["k_hs", "value"]["before"] == "4800 N*m/rad"
    assert found["k_hs", "value"]["note"] == "+97.9 %"


def test_the_exit_code_says_whether_something_differs_where_it_is_asked_for() -> None:
    run = CliRunner().invoke
    assert run(app, ["diff", "driveline", "driveline", "--exit-code"]).exit_code == 0
    assert run(app, ["diff", "driveline", "driveline"]).output == "no differences\n"
    assert run(app, ["diff", "driveline", "driveline_load"]).exit_code == 0
    assert run(app, ["diff", "driveline", "driveline_load", "--exit-code"]).exit_code == 1


@pytest.mark.skipif(shutil.which("git") is None, reason="Git is not installed")
def test_a_spec_is_compared_with_what_it_was_in_a_revision(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "spec").mkdir()
    base, variant = tmp_path / "spec" / "base.yaml", tmp_path / "spec" / "more.yaml"
    base.write_text(
        "language: 1\nautomaton: base\nparameters: {k: {value: 1 N}, d: {value: 2 N}}\n"
    )
    variant.write_text("language: 1\nvariant: more\nextends: base\nparameters: {k: {value: 3 N}}\n")
    who = ["-c", "user.name=a", "-c", "user.email=a@b.c"]
    for words in (["init", "-q"], ["add", "."], [*who, "commit", "-q", "-m", "first"]):
        subprocess.run(["git", *words], check=True)
    base.write_text(base.read_text().replace("2 N", "4 N"))
    page = tmp_path / "diff.html"
    told = CliRunner().invoke(app, ["diff", "HEAD:more", "more", "--json", "--html", str(page)])
    (found,) = json.loads(told.output)["changes"]
    assert (found["thing"], found["before"], found["after"]) == ("d", "2 N", "4 N")
    assert found["before_place"] == "HEAD:spec/base.yaml:3"
    assert "HEAD:more" in page.read_text()
    same = CliRunner().invoke(app, ["diff", "HEAD:spec/more.yaml", "HEAD:more", "--exit-code"])
    assert same.exit_code == 0
    refused = CliRunner().invoke(app, ["diff", "nowhere:more", "more"])
    assert "Git has no `nowhere` here" in str(refused.exception)
    written = tmp_path / "written"
    for option in (f"--output={written}", "--remote=.", "-o", "--"):
        refused = CliRunner().invoke(app, ["diff", "--", f"{option}:more", "more"])
        assert isinstance(refused.exception, SpecError)
        assert f"`{option}` is no revision of Git" in str(refused.exception)
    assert not written.exists()


def test_without_git_a_revision_is_answered_with_the_line_that_installs_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PATH", str(tmp_path))
    refused = CliRunner().invoke(app, ["diff", "HEAD:more", "more"])
    assert isinstance(refused.exception, MissingToolError)
    assert str(refused.exception) == "`git` is missing: apt-get install git"


def test_a_priority_has_no_size_but_a_factor_has() -> None:
    (found,) = changes(BASE.replace("priority: 1", "priority: 3"))
    assert (found.before, found.after, found.note) == ("1", "3", "")
    text = BASE.replace("alpha: {value: 0.2 rad}", "alpha: {value: 0.2}")
    (found,) = changes(text.replace("value: 0.2}", "value: 0.25}"), text)
    assert found.note == "+25 %"


ORDER = """\
language: 1
automaton: order
events: {e: {from: input}, f: {from: input}}
faults: {left: {}, right: {}}
modes: {a: {}, b: {modes: {c: {}, d: {}}}}
regions: {r: {modes: {on: {number: 1}, off: {number: 0}}}, s: {modes: {up: {}}}}
parameters: {k: {value: 1}, m: {value: 2}}
instances: {x: {of: z}, y: {of: z}}
"""


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        (
            "e: {from: input}, f: {from: input}",
            "f: {from: input}, e: {from: input}",
            ["events | order | e, f | f, e | simultaneous events are processed in another order"],
        ),
        (
            "{left: {}, right: {}}",
            "{right: {}, left: {}}",
            ["faults | order | left, right | right, left | bits of faults move"],
        ),
        (
            "{c: {}, d: {}}",
            "{d: {}, c: {}}",
            ["modes | order in b | c, d | d, c | numbers of modes move"],
        ),
        (
            "left: {}, r",
            "new: {}, left: {}, r",
            [
                "faults | order | left, right | new, left, right | bits of faults move",
                "faults | new |  |  | ",
            ],
        ),
        (
            "x: {of: z}, y: {of: z}",
            "y: {of: z}, x: {of: z}",
            [
                "instances | order | x, y | y, x | "
                "simultaneous actions are executed in another order"
            ],
        ),
        ("right: {}", "right: {}, new: {}", ["faults | new |  |  | "]),
        ("e: {from: input}, f", "g: {}, e: {from: input}, f", ["events | g |  |  | "]),
        ("{on: {number: 1}, off: {number: 0}}", "{off: {number: 0}, on: {number: 1}}", []),
        ("{k: {value: 1}, m: {value: 2}}", "{m: {value: 2}, k: {value: 1}}", []),
    ],
)
def test_an_order_is_told_where_it_means_something(old: str, new: str, told: list[str]) -> None:
    assert ORDER.count(old) == 1
    found = changes(ORDER.replace(old, new), ORDER)
    assert [" | ".join((c.group, c.thing, c.before, c.after, c.note)) for c in found] == told


def test_the_instances_of_a_system_have_no_order() -> None:
    text = "language: 1\nsystem: s\ninstances: {x: {of: z}, y: {of: z}}\n"
    assert changes(text.replace("x: {of: z}, y: {of: z}", "y: {of: z}, x: {of: z}"), text) == []
