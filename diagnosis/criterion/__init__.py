"""Criteria that compare models: penalised likelihood, cross-validation, support by recordings."""
