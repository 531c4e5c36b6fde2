generate tests/codegen/emit/golden/heater.yaml
