"""The intermediate representation: Program, operations, traversal, printer."""
