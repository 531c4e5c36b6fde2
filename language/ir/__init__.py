"""The intermediate representation: Program, operations, traversal, rewriting and printer."""
