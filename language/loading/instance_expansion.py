"""Instance expansion: expansion of other automata into parallel regions of the host.

The modes of the instantiated automaton become a region with the name of the instance, such as
`main`. Its parameters, states, discrete variables and equations get names of the host:
`main_closed` for `closed`. Each of its inputs becomes an equation of the host, such as
`main_command`. The host reads its outputs as `main.closed`. It has the period of the host, and
neither a model nor regions.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from language.expressions.name_rules import NAME_PATTERN, check_name, check_region_name
from language.expressions.text_rewrite import rename_names, substitute_reads
from language.overlays.effect_reader import added_names
from language.overlays.expand_document import expand_document
from language.overlays.name_types import mode_and_template_mappings
from language.overlays.parameter_override import override_parameter
from language.readers.base_reader import Reader
from language.text.diagnostic import Problems, Source, suggest_name
from language.text.document import Document, Entry, MappingNode, ScalarNode, SequenceNode, YamlNode
from language.text.expression_paths import ALL_SCALARS, EFFECT_SITES, KeyPath, map_formulas
from language.text.node_edit import find_node, put_node, replace_source
from language.text.project_files import Project, read_document
from language.text.requirement import find_requirements

FORBIDDEN_KEYS = (
    *("model", "regions", "instances", "tables", "faults", "fault_mode"),
    *("events", "order", "micro_steps"),
)
"""Keys that an automaton must not have if it is instantiated."""
SECTIONS = ("parameters", "states", "discrete", "equations", "flow", "terms", "templates")
"""Sections of the instantiated automaton that are merged into those of the host."""
VARIABLE_SECTIONS = ("parameters", "states", "discrete", "equations", "flow", "terms")
"""Sections at the root whose keys are names of variables."""
VARIABLE_MODE_SECTIONS = ("equations", "flow", "terms", "update", "entry", "exit", "reset")
"""Sections of modes and transitions whose keys are names of variables."""
REGION_SECTIONS = ("initial", "modes", "transition_table")
"""Sections of the instantiated automaton that become keys of the region."""
HOST_EXPRESSIONS = {**EFFECT_SITES, "instances": {"*": {"inputs": ALL_SCALARS}}}
"""The places of expressions in the host, the inputs of its instances included."""


@dataclass(frozen=True)
class _InstanceDeclaration:
    """An instance with its options and the tree of the instantiated automaton.

    `names` gives the host name of each name in that tree.
    """

    entry: Entry
    options: MappingNode
    tree: MappingNode
    names: Mapping[str, str]

    @property
    def name(self) -> str:
        """The name of the instance."""
        return self.entry.key

    @property
    def host_names_of_outputs(self) -> dict[str, str]:
        """The host variable of each output: `main_closed` for `main.closed`."""
        outputs = self.tree.get("outputs")
        sources: dict[str, str] = {}
        for item in outputs.nodes if isinstance(outputs, SequenceNode) else ():
            if isinstance(item, ScalarNode):
                sources[item.text] = item.text
        for output in outputs if isinstance(outputs, MappingNode) else ():
            if isinstance(output.node, ScalarNode):
                sources[output.key] = output.node.text
        known = {out: source for out, source in sources.items() if source in self.names}
        return {f"{self.name}.{out}": self.names[source] for out, source in known.items()}


def expand_instances(tree: MappingNode, project: Project, problems: Problems) -> MappingNode:
    """Return an automaton's tree with its instances replaced by regions. Raises SpecError.

    A tree without instances is returned unchanged. Each instance becomes the region of its name;
    its parameters, variables and equations become `<instance>_<name>` in the host, each input an
    equation with its expression or default, and reads of `<instance>.<output>` are replaced by the
    host name.

    Errors are another kind of document, FORBIDDEN_KEYS, another period, names that are taken or too
    long, unknown parameters and inputs, and inputs without a value.
    """
    node = tree.get("instances")
    if node is None:
        return tree
    reader = _InstanceReader(problems, tree, project)
    read = [reader.read_instance(entry) for entry in reader.read_mapping(node, "instances")]
    instances = [instance for instance in read if instance]
    reads = {
        path: name
        for instance in instances
        for path, name in instance.host_names_of_outputs.items()
    }
    tree = _rename_output_reads(tree, reads)
    for instance in instances:
        options = find_node(tree, ("instances", instance.name))
        assert isinstance(options, MappingNode)
        tree = reader.merge_instance(tree, instance, options)
    problems.raise_if_errors()
    return MappingNode(
        {k: entry for k, entry in tree.entries.items() if k != "instances"}, tree.span
    )


def _rename_output_reads(tree: MappingNode, reads: Mapping[str, str]) -> MappingNode:
    """Return a tree in which outputs of instances are read by the names of their host variables."""

    def change(_path: KeyPath, scalar: ScalarNode) -> ScalarNode:
        """Return an expression with outputs of instances replaced."""
        text, hits = substitute_reads(scalar.text, reads)
        return ScalarNode(text, scalar.span) if hits else scalar

    tree = map_formulas(tree, HOST_EXPRESSIONS, change)
    outputs = tree.get("outputs")
    if isinstance(outputs, SequenceNode):
        named = (_rename_scalar(item, reads) for item in outputs.nodes)
        return put_node(tree, ("outputs",), SequenceNode(tuple(named), outputs.span))
    for output in outputs if isinstance(outputs, MappingNode) else ():
        tree = put_node(tree, ("outputs", output.key), _rename_scalar(output.node, reads))
    return tree


def _rename_scalar(node: YamlNode, new: Mapping[str, str]) -> YamlNode:
    """Return a scalar with its text replaced if `new` has it; another node unchanged."""
    return (
        ScalarNode(new.get(node.text, node.text), node.span)
        if isinstance(node, ScalarNode)
        else node
    )


class _InstanceReader(Reader):
    """Reads and merges the instances of one automaton's tree."""

    def __init__(self, problems: Problems, tree: MappingNode, project: Project) -> None:
        """Report into `problems`; `tree` is the tree of the host."""
        super().__init__(problems)
        self.tree = tree
        self.project = project

    def read_instance(self, entry: Entry) -> _InstanceDeclaration | None:
        """Return an instance with the tree of its automaton, or None with a problem reported."""
        check_region_name(entry.key, entry.span, self.problems)
        options = self.read_mapping(
            entry.node, f"instances.{entry.key}", ("of", "inputs", "values")
        )
        of = self.read_scalar(options.get("of"), "of", entry.span)
        known = len(self.problems.reported)
        root = self._read_root(of) if of else None
        if root is None or len(self.problems.reported) > known:
            return None
        inputs = self.read_mapping(root.get("inputs"), "inputs")
        own = [*added_names(root), *inputs.entries]
        own += [name for mode in mode_and_template_mappings(root) for name in _equation_names(mode)]
        names = {name: f"{entry.key}_{name}" for name in own}
        return _InstanceDeclaration(entry, options, root, names)

    def _read_root(self, reference: ScalarNode) -> MappingNode | None:
        """Return the expanded tree of an instantiated automaton; None with a reported problem."""
        with self.problems.collect_errors():
            document = read_document(self.project.path_of(reference.text, reference.span))
            document = expand_document(document, self.project, self.problems)
            self._check_document(document, reference)
            return document.root
        return None

    def _check_document(self, document: Document, reference: ScalarNode) -> None:
        """Report a document that cannot be instantiated in the host.

        It must be an automaton without forbidden keys and with the period of the host.
        """
        if document.kind != "automaton":
            label = f"`{document.name}` is a {document.kind}, not an automaton"
            self.problems.error("form", reference.span, label)
            return
        for key in FORBIDDEN_KEYS:
            if key in document.root.entries:
                label = f"`{document.name}` has `{key}`: an instance has none"
                self.problems.error("form", reference.span, label)
        periods = [self._read_period(tree) for tree in (document.root, self.tree)]
        if periods[0] != periods[1]:
            label = f"`{document.name}` has another period than the automaton around it"
            hint = "give both one period, or make them instances of a system"
            self.problems.error("form", reference.span, label, hint)

    def _read_period(self, tree: MappingNode) -> object:
        """Return the period [s] of a tree, or None if it is continuous."""
        node = tree.get("period")
        return self.read_quantity(node, "period", node.span, None)[0] if node else None

    def merge_instance(
        self, tree: MappingNode, instance: _InstanceDeclaration, options: MappingNode
    ) -> MappingNode:
        """Return the host's tree with an instance merged into it.

        `options` are the options of the instance in `tree`, whose input expressions already read
        host variables.
        """
        entry, names = instance.entry, instance.names
        for final in names.values():
            self._check_host_name(tree, final, entry)
        source = instance.tree.span.source
        overlay = Source(source.name, source.lines, f"instance {entry.key}", entry.span)
        body = replace_source(instance.tree, overlay)
        assert isinstance(body, MappingNode)
        body = self._apply_values(body, options)
        inputs = self._input_expressions(body, options, entry)
        body = _rename_to_host(body, instance)
        for section in SECTIONS:
            for declaration in self.read_mapping(body.get(section), section):
                tree = put_node(tree, (section, declaration.key), declaration.node)
        for name, node in inputs.items():
            tree = put_node(tree, ("equations", names[name]), node)
        region = {key: body.entries[key] for key in REGION_SECTIONS if key in body.entries}
        region |= _requirements_entry(entry, body)
        if "modes" not in region:
            always = MappingNode(
                {"always": Entry("always", entry.span, MappingNode({}, entry.span))}, entry.span
            )
            region["modes"] = Entry("modes", entry.span, always)
        if find_node(tree, ("regions", entry.key)) is not None:
            label = f"there is a region `{entry.key}` already"
            self.problems.error("duplicate", entry.span, label)
        return put_node(tree, ("regions", entry.key), MappingNode(region, entry.span))

    def _check_host_name(self, tree: MappingNode, host_name: str, entry: Entry) -> None:
        """Report a host name that is too long, taken or not valid."""
        taken = [*added_names(tree), *self.read_mapping(tree.get("inputs"), "inputs").entries]
        if not NAME_PATTERN.fullmatch(host_name):
            label = f"`{entry.key}` would have a name `{host_name}` of {len(host_name)} characters"
            self.problems.error("name", entry.span, label, "a shorter name of the instance")
        elif host_name in taken:
            label = f"`{entry.key}` would have a name `{host_name}`, which is taken"
            self.problems.error("duplicate", entry.span, label, "another name of the instance")
        else:
            check_name(host_name, entry.span, self.problems)

    def _apply_values(self, body: MappingNode, options: MappingNode) -> MappingNode:
        """Return the tree `body` with the parameter values of the instance.

        Unknown and derived parameters are reported.
        """
        parameters = self.read_mapping(body.get("parameters"), "parameters").entries
        for value in self.read_mapping(options.get("values"), "values"):
            known = parameters.get(value.key)
            if known is None or not isinstance(known.node, MappingNode):
                label = f"there is no parameter `{value.key}`"
                self.problems.error("name", value.span, label, suggest_name(value.key, parameters))
            elif "derived" in known.node.entries:
                label = f"`{value.key}` is derived: set the parameters that it reads"
                self.problems.error("values", value.span, label)
            else:
                overridden = override_parameter(known.node, value.node, self.problems)
                body = put_node(body, ("parameters", value.key), overridden)
        return body

    def _input_expressions(
        self, body: MappingNode, options: MappingNode, entry: Entry
    ) -> dict[str, ScalarNode]:
        """Return the expression of each input in `body`: that of the instance, or the default.

        Unknown inputs and inputs without a value are reported.
        """
        declared = self.read_mapping(body.get("inputs"), "inputs").entries
        connected = self.read_mapping(options.get("inputs"), "inputs").entries
        for name, own in connected.items():
            if name not in declared:
                label = f"there is no input `{name}`"
                self.problems.error("name", own.span, label, suggest_name(name, declared))
        expressions: dict[str, ScalarNode] = {}
        for name, declaration in declared.items():
            default = (
                declaration.node.get("default")
                if isinstance(declaration.node, MappingNode)
                else None
            )
            node = connected[name].node if name in connected else default
            if isinstance(node, ScalarNode):
                expressions[name] = node
            else:
                label = f"the input `{name}` of `{entry.key}` has no value"
                hint = f"`inputs: {{{name}: ...}}`"
                self.problems.error("missing", entry.span, label, hint)
        return expressions


def _requirements_entry(entry: Entry, body: MappingNode) -> dict[str, Entry]:
    """Return `req` of an instance as an entry; empty if there are no requirements.

    These are the requirements of the instance and of the sections of `body` that are not merged.
    """
    unmerged = {
        key: requirement
        for key, requirement in body.entries.items()
        if key not in (*SECTIONS, *REGION_SECTIONS)
    }
    named = [*find_requirements(entry.node), *find_requirements(MappingNode(unmerged, body.span))]
    names = tuple(ScalarNode(requirement.requirement, requirement.span) for requirement in named)
    return {"req": Entry("req", entry.span, SequenceNode(names, entry.span))} if names else {}


def _equation_names(mode: MappingNode) -> Iterator[str]:
    """Yield the names of the equations of a mode."""
    table = mode.get("equations")
    yield from table.entries if isinstance(table, MappingNode) else ()


def _rename_to_host(body: MappingNode, instance: _InstanceDeclaration) -> MappingNode:
    """Return the tree of an instantiated automaton with all its names replaced by host names."""

    def change(_path: KeyPath, scalar: ScalarNode) -> ScalarNode:
        """Return an expression with host names."""
        text = rename_names(scalar.text, instance.names)
        return ScalarNode(text, scalar.span) if text != scalar.text else scalar

    return _rename_keys(map_formulas(body, EFFECT_SITES, change), instance, ())


def _rename_keys(table: MappingNode, instance: _InstanceDeclaration, path: KeyPath) -> MappingNode:
    """Return a mapping whose keys, and names of templates, are host names, at any depth."""
    renamed = {}
    for entry in table:
        key, node = entry.key, entry.node
        if isinstance(node, MappingNode):
            node = _rename_keys(node, instance, (*path, key))
        elif key == "like" and isinstance(node, ScalarNode):
            node = ScalarNode(f"{instance.name}_{node.text}", node.span)
        if (len(path) == 1 and path[0] in VARIABLE_SECTIONS) or (
            len(path) > 2 and path[-1] in VARIABLE_MODE_SECTIONS
        ):
            key = instance.names.get(key, key)
        elif path == ("templates",):
            key = f"{instance.name}_{key}"
        renamed[key] = Entry(key, entry.span, node)
    return MappingNode(renamed, table.span)
