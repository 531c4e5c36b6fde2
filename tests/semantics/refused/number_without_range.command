generate tests/semantics/refused/kinds_of_values.repaired.yaml
