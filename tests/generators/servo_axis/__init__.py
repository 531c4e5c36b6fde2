"""Cases of two servo axes with a known missing effect: a belt axis and a rotary table."""
