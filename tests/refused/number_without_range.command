generate tests/refused/kinds_of_values.repaired.yaml
