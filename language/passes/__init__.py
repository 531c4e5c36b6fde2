"""Passes from Program to Program: hoisting of constants, common-subexpression elimination."""
