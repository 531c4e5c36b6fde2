"""Simulated recordings of machines with relays: an oven, a switched winding, two tanks."""

import os

# Same bytes on every machine, and each worker keeps to its core.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
