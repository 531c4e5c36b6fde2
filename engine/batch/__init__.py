"""Many runs of a system: variants of parameters, interpreted or compiled."""
