"""Runaway: der(x) = x^2 from 10 1/s is 10 / (1 - 10 t), and no number at 0.1 s."""

RUNAWAY = """language: 1
automaton: runaway
step: 1 ms
states: {x: {unit: 1/s, initial: 10 1/s}}
flow: {x: der(x) = x^2}
initial: only
modes: {only: {number: 0}}
outputs: [x]
"""
