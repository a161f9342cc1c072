"""How long things take; run as modules, e.g. ``python -m experiments.bench.training``."""
