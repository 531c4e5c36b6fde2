"""Reference simulations by solvers of scipy, to check the engine against."""
