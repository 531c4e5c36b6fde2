"""Signal types: the type of each signal of a system."""

from __future__ import annotations

from language.checks.declared_names import declaration_type
from language.loading.connection_reader import output_types
from language.model.system import System
from language.typecheck.types import ExprType


def signal_types(system: System) -> dict[str, ExprType]:
    """Return the types of the inputs, outputs of instances, sensors and outputs of a system.

    Keys are `input`, `instance.output`, `sensor` and `output`. An output of the system has the type
    of the signal that it names, or the dimension of its real expression. Outputs without a known
    type, such as modes and expressions of another type, are left out.
    """
    kinds: dict[str, ExprType] = {
        name: declaration_type(declaration) for name, declaration in system.inputs.items()
    }
    for instance in system.instances.values():
        kinds.update(output_types(instance))
    kinds.update({name: sensor.dimension for name, sensor in system.sensors.items()})
    for name, output in system.outputs.items():
        if isinstance(output, str) and output in kinds:
            kinds[name] = kinds[output]
        elif name in system.dimensions:
            kinds[name] = system.dimensions[name]
    return kinds
