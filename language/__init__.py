"""The language: translation of YAML text to a checked model and to a lowered Program.

The data pass through the sub-packages in this order: `text` and `overlays` (documents),
`expressions` and `typecheck` (expressions), `reading` and `loading` (model), `checks` and `smt`
(proofs about the model), `lowering`, `charts`, `integration`, `observers` and `programs` (Program),
`passes` (Program to Program). `ir` defines the Program, `numerics` the elementary operations and
small matrices.
"""
