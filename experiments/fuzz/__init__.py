"""Fuzzing of everything that reads what comes from elsewhere.

    python -m experiments.fuzz --minutes 30 [TARGET ...]

Each target of `experiments.fuzz.targets` is fed with mutated inputs by atheris (the extra
``fuzz``), which keeps those that reach new code. An input is a finding when it raises anything
but facert's own errors, warns, or takes more than `experiments.fuzz.execute.SLOW` seconds of
processor time or `LARGE` bytes of memory. Findings are written to ``tests/fuzz/findings``, where
the tests feed them to their targets from then on.
"""
