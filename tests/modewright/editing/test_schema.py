"""Schema: what editors are told of keys is what the readers know, and is current."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable, Iterator
from pathlib import Path

import jsonschema
import pytest

from expectation.expectation_reader import read_test
from language.loading.automaton_reader import read_automaton
from language.loading.recording_map_reader import read_map
from language.loading.scenario_reader import read_scenario
from language.loading.system_reader import read_system
from language.overlays.calibration import read_calibration
from language.overlays.effect_reader import read_effect
from language.overlays.expand_document import Project, expand_document, read_document
from language.readers.base_reader import Reader
from language.text.diagnostic import Problems, Span, SpecError
from language.text.document import Document, MappingNode, YamlNode
from language.text.project_files import DOCUMENT_KINDS
from modewright.editing.json_schema import json_schema, schema_text
from modewright.editing.key_shape import COMMON_KEYS, Choice, ShapeRef, alternatives_of, shapes
from modewright.editing.node_kinds import places
from sweep.definition.study_reader import read_study
from tests.modewright.editing.example_specs import ROOT, to_plain_data, valid_documents

COMMITTED = ROOT / "spec" / "modewright.schema.json"
TAKEN_BEFORE = {"like", "effects", "calibrations", "extends"}
"""Keys that are gone when a reader sees the mapping: templates and layers are laid."""
WRONG_FORM = re.compile(r"is not a key of|is not one of [a-z_0-9]+,|` is a (mapping|list)$", re.M)
"""What a user is told where a schema can say so, too."""
BEYOND = {"effect_values", "map_windows", "study_contradictions", "unknown_names"}


@pytest.fixture(autouse=True)
def _in_the_project(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)


def test_the_committed_schema_is_current(update: bool) -> None:
    if update:
        COMMITTED.write_text(schema_text(), "utf-8")
    assert COMMITTED.read_text("utf-8") == schema_text(), "make generate"
    jsonschema.Draft7Validator.check_schema(json_schema())


def test_every_valid_spec_is_valid_for_the_schema_too() -> None:
    everything = jsonschema.Draft7Validator(json_schema())
    own = {kind: jsonschema.Draft7Validator(json_schema(kind)) for kind in DOCUMENT_KINDS}
    seen = set()
    for path, document in valid_documents():
        seen.add(document.kind)
        error = next(own[document.kind].iter_errors(to_plain_data(document.root)), None)
        assert error is None, f"{path}: {list(error.absolute_path)}: {error.message}"
        if path.is_relative_to(ROOT / "spec"):
            assert everything.is_valid(to_plain_data(document.root)), path
    assert seen == set(DOCUMENT_KINDS)


def test_a_spec_with_a_wrong_key_or_word_is_not() -> None:
    everything = jsonschema.Draft7Validator(json_schema())
    found = 0
    for told in sorted((ROOT / "tests" / "semantics" / "invalid_specs").glob("*.txt")):
        path = told.with_suffix(".yaml")
        if path.is_file() and WRONG_FORM.search(told.read_text("utf-8")):
            document = _document(path)
            if document and path.stem not in BEYOND:
                found += 1
                assert not everything.is_valid(to_plain_data(document.root)), path
    assert found >= 4


def test_a_schema_of_another_kind_is_refused() -> None:
    with pytest.raises(ValueError, match="`machine` is not one of automaton"):
        json_schema("machine")


def test_the_shapes_have_the_keys_that_the_readers_know() -> None:
    unseen = {name for name, shape in shapes().items() if shape.keys} - {"variant"}
    common = {key.name for key in COMMON_KEYS} | TAKEN_BEFORE
    for path, document in valid_documents():
        wanted = unseen & {"laying"} if document.kind == "variant" else unseen
        tables = [(name, table) for name, table in _tables(document.root) if name in wanted]
        if not tables:
            continue
        asked = _keys_asked(document, Project(_project_of(path)))
        for name, table in tables:
            read = [keys - common for entry in table for keys in asked[_place(entry.span)]]
            if read:
                own = set(shapes()[name].keys) - common
                assert own in read, (
                    f"{table.span}: `{name}`: {own ^ min(read, key=lambda keys: len(own ^ keys))}"
                )
                unseen.discard(name)
    assert not unseen, f"no spec here has these, so nothing holds them to a reader: {unseen}"


def _keys_asked(document: Document, project: Project) -> dict[tuple[str, int, int], list[set[str]]]:
    """Return, by the place of each key, what the readers allowed beside it."""
    found: dict[tuple[str, int, int], list[set[str]]] = defaultdict(list)
    table = Reader.read_mapping

    def recording(
        self: Reader, node: YamlNode | None, what: str, allowed: Iterable[str] | None = None
    ) -> MappingNode:
        known = None if allowed is None else set(allowed)
        for entry in node if isinstance(node, MappingNode) and known is not None else ():
            found[_place(entry.span)].append(known or set())
        return table(self, node, what, known)

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(Reader, "read_mapping", recording)
        _read(document, project)
    return found


def test_a_choice_offers_what_the_reader_takes(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: dict[str, set[str]] = defaultdict(set)
    choice = Reader.read_choice

    def recording(
        self: Reader, node: YamlNode | None, what: str, allowed: Iterable[str], default: str
    ) -> str:
        words = list(allowed)
        asked[what] |= {" ".join(sorted(words))}
        return choice(self, node, what, words, default)

    monkeypatch.setattr(Reader, "read_choice", recording)
    for name in ("estimator", "hko", "leaf", "tip_out", "driveline", "ev_driveline_sensed"):
        project = Project(ROOT)
        _read(read_document(project.path_of(name)), project)
    offered = [
        (key.name, " ".join(sorted(kind.words)))
        for shape in shapes().values()
        for key in shape.keys.values()
        for kind in alternatives_of(key.kind)
        if isinstance(kind, Choice) and key.name not in ("kind", "of", "neutral", "sampling", "by")
    ]
    told = [(name, words) for name, words in offered if name in asked]
    assert len(told) > 12
    for name, words in told:
        assert words in asked[name], name


def _tables(root: MappingNode) -> Iterator[tuple[str, MappingNode]]:
    for place in places(root):
        if isinstance(place.node, MappingNode) and isinstance(place.kind, ShapeRef):
            yield place.kind.shape, place.node


def _place(span: Span) -> tuple[str, int, int]:
    return span.source.name, span.line, span.column


def _document(path: Path) -> Document | None:
    try:
        return read_document(path)
    except SpecError:
        return None


def _project_of(path: Path) -> Path:
    return next((up.parent for up in path.parents if up.name == "spec"), ROOT)


def _read(document: Document, project: Project) -> None:
    problems = Problems()
    with problems.collect_errors():
        base = expand_document(document, project, problems)
        match base.kind:
            case "automaton":
                read_automaton(document, project, None, problems)
            case "system":
                read_system(document, project)
            case "map":
                read_map(document, project)
            case "effect":
                read_effect(document, problems)
            case "calibration":
                read_calibration(document, problems)
            case "study":
                read_study(document, project)
            case "test":
                read_test(document, project)
            case "scenario":
                of = base.root.get("of")
                assert of is not None
                system = read_document(project.path_of(getattr(of, "text", ""), of.span))
                read_scenario(document, project, read_system(system, project))
