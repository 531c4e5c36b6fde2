"""Reference simulations by scipy and filterpy, for comparison with the engine."""
