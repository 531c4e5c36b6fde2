generate tests/codegen/golden/heater.yaml
