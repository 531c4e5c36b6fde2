"""Instance: another automaton as a parallel region of this one, read as `main.closed`.

Its modes become the region `main`; its parameters, states, discrete variables and equations get
names of ours, `main_closed`. What stands for one of its inputs is an expression of ours, as the
equation `main_command`. Its period is ours, and it has neither a model nor regions itself.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from language.document import Document, Entry, Items, Node, Scalar, Table
from language.effect import own_names
from language.finding import Project, read_document
from language.known import mode_tables
from language.names import NAME, check_name, check_region_name
from language.passage import EFFECT, EVERY, Path, changed
from language.problem import Problems, Source, nearest
from language.project import expanded
from language.reader import Reader
from language.requirement import requirements_in
from language.rewrite import renamed, substituted
from language.tree import at, put, resourced
from language.values import with_given

ALONE = (
    *("model", "regions", "instances", "tables", "faults", "fault_mode"),
    *("events", "order", "micro_steps"),
)
"""What only an automaton on its own has."""
SECTIONS = ("parameters", "states", "discrete", "equations", "flow", "terms", "templates")
NAMED = ("parameters", "states", "discrete", "equations", "flow", "terms")
"""Sections whose keys are names of variables; so are those of stages and balances in modes."""
IN_MODES = ("equations", "flow", "terms", "update", "entry", "exit", "reset")
REGION = ("initial", "modes", "transition_table")
OURS = {**EFFECT, "instances": {"*": {"inputs": EVERY}}}


@dataclass(frozen=True)
class _Instance:
    """One instance: what is asked of it, and the tree of what it is of."""

    entry: Entry
    asked: Table
    tree: Table
    names: Mapping[str, str]

    @property
    def name(self) -> str:
        return self.entry.key

    @property
    def reads(self) -> dict[str, str]:
        """What its outputs are to us: `main.closed` is `main_closed`."""
        outputs = self.tree.get("outputs")
        found: dict[str, str] = {}
        for item in outputs.nodes if isinstance(outputs, Items) else ():
            if isinstance(item, Scalar):
                found[item.text] = item.text
        for output in outputs if isinstance(outputs, Table) else ():
            if isinstance(output.node, Scalar):
                found[output.key] = output.node.text
        known = {out: source for out, source in found.items() if source in self.names}
        return {f"{self.name}.{out}": self.names[source] for out, source in known.items()}


def with_instances(tree: Table, project: Project, problems: Problems) -> Table:
    """Return an automaton's tree with its instances as regions. Raises SpecError."""
    node = tree.get("instances")
    if node is None:
        return tree
    reader = _InstanceReader(problems, tree, project)
    read = [reader.instance(entry) for entry in reader.table(node, "instances")]
    instances = [instance for instance in read if instance]
    reads = {path: name for instance in instances for path, name in instance.reads.items()}
    tree = _reading(tree, reads)
    for instance in instances:
        asked = at(tree, ("instances", instance.name))
        assert isinstance(asked, Table)
        tree = reader.laid(tree, instance, asked)
    problems.stop_if_any()
    return Table({k: entry for k, entry in tree.entries.items() if k != "instances"}, tree.span)


def _reading(tree: Table, reads: Mapping[str, str]) -> Table:
    """Return a tree in which outputs of instances are read by their names among ours."""

    def change(path: Path, scalar: Scalar) -> Scalar:
        text, found = substituted(scalar.text, reads)
        return Scalar(text, scalar.span) if found else scalar

    tree = changed(tree, OURS, change)
    outputs = tree.get("outputs")
    if isinstance(outputs, Items):
        named = (_renamed_scalar(item, reads) for item in outputs.nodes)
        return put(tree, ("outputs",), Items(tuple(named), outputs.span))
    for output in outputs if isinstance(outputs, Table) else ():
        tree = put(tree, ("outputs", output.key), _renamed_scalar(output.node, reads))
    return tree


def _renamed_scalar(node: Node, new: Mapping[str, str]) -> Node:
    return Scalar(new.get(node.text, node.text), node.span) if isinstance(node, Scalar) else node


class _InstanceReader(Reader):
    """Reads the instances of one automaton's tree."""

    def __init__(self, problems: Problems, tree: Table, project: Project) -> None:
        super().__init__(problems)
        self.tree = tree
        self.project = project

    def instance(self, entry: Entry) -> _Instance | None:
        """Return an instance with the tree of what it is of, None where that cannot be one."""
        check_region_name(entry.key, entry.span, self.problems)
        asked = self.table(entry.node, f"instances.{entry.key}", ("of", "inputs", "values"))
        of = self.scalar(asked.get("of"), "of", entry.span)
        known = len(self.problems.found)
        root = self._root(of) if of else None
        if root is None or len(self.problems.found) > known:
            return None
        inputs = self.table(root.get("inputs"), "inputs")
        own = [*own_names(root), *inputs.entries]
        own += [name for mode in mode_tables(root) for name in _equations(mode)]
        names = {name: f"{entry.key}_{name}" for name in own}
        return _Instance(entry, asked, root, names)

    def _root(self, of: Scalar) -> Table | None:
        with self.problems.collecting():
            document = read_document(self.project.path_of(of.text, of.span))
            document = expanded(document, self.project, self.problems)
            self._check(document, of)
            return document.root
        return None

    def _check(self, document: Document, of: Scalar) -> None:
        if document.kind != "automaton":
            label = f"`{document.name}` is a {document.kind}, not an automaton"
            self.problems.error("form", of.span, label)
            return
        for key in ALONE:
            if key in document.root.entries:
                label = f"`{document.name}` has `{key}`: an instance has none"
                self.problems.error("form", of.span, label)
        periods = [self._period(tree) for tree in (document.root, self.tree)]
        if periods[0] != periods[1]:
            label = f"`{document.name}` has another period than what it is an instance in"
            hint = "give both one period, or make them instances of a system"
            self.problems.error("form", of.span, label, hint)

    def _period(self, tree: Table) -> object:
        node = tree.get("period")
        return self.quantity(node, "period", node.span, None)[0] if node else None

    def laid(self, tree: Table, instance: _Instance, asked: Table) -> Table:
        """Return our tree with one instance in it; `asked` has its inputs as we read them."""
        entry, names = instance.entry, instance.names
        for final in names.values():
            self._check_final(tree, final, entry)
        theirs = instance.tree.span.source
        layer = Source(theirs.name, theirs.lines, f"instance {entry.key}", entry.span)
        body = resourced(instance.tree, layer)
        assert isinstance(body, Table)
        body = self._with_values(body, asked)
        inputs = self._inputs(body, asked, entry)
        body = _in_our_names(body, instance)
        for section in SECTIONS:
            for thing in self.table(body.get(section), section):
                tree = put(tree, (section, thing.key), thing.node)
        for name, node in inputs.items():
            tree = put(tree, ("equations", names[name]), node)
        region = {key: body.entries[key] for key in REGION if key in body.entries}
        region |= _required(entry, body)
        if "modes" not in region:
            always = Table(
                {"always": Entry("always", entry.span, Table({}, entry.span))}, entry.span
            )
            region["modes"] = Entry("modes", entry.span, always)
        if at(tree, ("regions", entry.key)) is not None:
            label = f"there is a region `{entry.key}` already"
            self.problems.error("duplicate", entry.span, label)
        return put(tree, ("regions", entry.key), Table(region, entry.span))

    def _check_final(self, tree: Table, final: str, entry: Entry) -> None:
        taken = [*own_names(tree), *self.table(tree.get("inputs"), "inputs").entries]
        if not NAME.fullmatch(final):
            label = f"`{entry.key}` would have a name `{final}` of {len(final)} characters"
            self.problems.error("name", entry.span, label, "a shorter name of the instance")
        elif final in taken:
            label = f"`{entry.key}` would have a name `{final}`, which is taken"
            self.problems.error("duplicate", entry.span, label, "another name of the instance")
        else:
            check_name(final, entry.span, self.problems)

    def _with_values(self, body: Table, asked: Table) -> Table:
        parameters = self.table(body.get("parameters"), "parameters").entries
        for value in self.table(asked.get("values"), "values"):
            known = parameters.get(value.key)
            if known is None or not isinstance(known.node, Table):
                label = f"there is no parameter `{value.key}`"
                self.problems.error("name", value.span, label, nearest(value.key, parameters))
            elif "derived" in known.node.entries:
                label = f"`{value.key}` is derived: set what it follows from"
                self.problems.error("values", value.span, label)
            else:
                made = with_given(known.node, value.node, self.problems)
                body = put(body, ("parameters", value.key), made)
        return body

    def _inputs(self, body: Table, asked: Table, entry: Entry) -> dict[str, Scalar]:
        """Return what stands for each input: an expression of ours, or its default."""
        declared = self.table(body.get("inputs"), "inputs").entries
        given = self.table(asked.get("inputs"), "inputs").entries
        for name, own in given.items():
            if name not in declared:
                label = f"there is no input `{name}`"
                self.problems.error("name", own.span, label, nearest(name, declared))
        found: dict[str, Scalar] = {}
        for name, thing in declared.items():
            default = thing.node.get("default") if isinstance(thing.node, Table) else None
            node = given[name].node if name in given else default
            if isinstance(node, Scalar):
                found[name] = node
            else:
                label = f"the input `{name}` of `{entry.key}` has no value"
                hint = f"`inputs: {{{name}: ...}}`"
                self.problems.error("missing", entry.span, label, hint)
        return found


def _required(entry: Entry, body: Table) -> dict[str, Entry]:
    """Return `req` of an instance: its own, and all of what it is of that becomes nothing else."""
    kept = {key: each for key, each in body.entries.items() if key not in (*SECTIONS, *REGION)}
    named = [*requirements_in(entry.node), *requirements_in(Table(kept, body.span))]
    names = tuple(Scalar(each.requirement, each.span) for each in named)
    return {"req": Entry("req", entry.span, Items(names, entry.span))} if names else {}


def _equations(mode: Table) -> Iterator[str]:
    table = mode.get("equations")
    yield from table.entries if isinstance(table, Table) else ()


def _in_our_names(body: Table, instance: _Instance) -> Table:
    """Return a tree whose names are ours, where they are read and where they are written."""

    def change(path: Path, scalar: Scalar) -> Scalar:
        text = renamed(scalar.text, instance.names)
        return Scalar(text, scalar.span) if text != scalar.text else scalar

    return _keys(changed(body, EFFECT, change), instance, ())


def _keys(table: Table, instance: _Instance, path: Path) -> Table:
    made = {}
    for entry in table:
        key, node = entry.key, entry.node
        if isinstance(node, Table):
            node = _keys(node, instance, (*path, key))
        elif key == "like" and isinstance(node, Scalar):
            node = Scalar(f"{instance.name}_{node.text}", node.span)
        if (len(path) == 1 and path[0] in NAMED) or (len(path) > 2 and path[-1] in IN_MODES):
            key = instance.names.get(key, key)
        elif path == ("templates",):
            key = f"{instance.name}_{key}"
        made[key] = Entry(key, entry.span, node)
    return Table(made, table.span)
