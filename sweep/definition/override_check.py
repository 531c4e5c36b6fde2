"""Override check: refuse values from the command line for parameters that the study itself sets."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from sweep.definition.study import Study, Target


def require_overridable(study: Study, names: Iterable[str]) -> None:
    """Raise ValueError if the study assigns one of the named parameters in each variant.

    These are the parameters among the targets of `vary` and `set`. A name without an instance
    matches the parameter of every instance; unknown names pass. With one-at-a-time sampling the
    targets of `vary` may be overridden, because only one variable at a time has a value.
    """
    for name in names:
        owner, _, short = name.rpartition(".")
        for target, why in _assigned_targets(study):
            is_same = target.path[-1] == short and owner in ("", target.path[0])
            if target.kind == "parameter" and is_same:
                others = "" if owner else _free_parameters_hint(study, target)
                raise ValueError(f"`{name}` {why} in this study{others}")


def _assigned_targets(study: Study) -> Iterator[tuple[Target, str]]:
    """Yield the targets that the study assigns in each variant, with the reason for the message."""
    alone = study.sampling.one_at_a_time
    left = {varied.name for varied in study.variables if not varied.targets} if alone else set()
    for varied in () if alone else study.variables:
        yield from ((target, "varies") for target in varied.targets)
    for setting in study.settings:
        if left.isdisjoint(setting.formula.reads):
            yield from ((target, "follows from `set`") for target in setting.targets)


def _free_parameters_hint(study: Study, target: Target) -> str:
    """Return a hint with the instances whose parameter of this name the study does not assign.

    The hint is empty if there are none.
    """
    owned = {each.path for each, _ in _assigned_targets(study)}
    instances = study.system_variants[0].system.instances
    found = [
        f"`{name}.{target.path[1]}`"
        for name, instance in instances.items()
        if target.path[1] in instance.automaton.parameters and (name, target.path[1]) not in owned
    ]
    return f"; left alone: {', '.join(found)}" if found else ""
