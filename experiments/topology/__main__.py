"""Section 4 of Zhang, Li and Liang (2017) on real recordings.

    python -m experiments.topology [driving] [propagation] [pipeline]

Figures, tables and every number go into experiments/results/topology.
"""

from __future__ import annotations

import argparse
import time
from importlib import import_module
from pathlib import Path

from threadpoolctl import threadpool_limits

RESULTS = Path(__file__).resolve().parents[1] / "results" / "topology"
PARTS = ("driving", "propagation", "pipeline")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("parts", nargs="*", metavar="PART", help=", ".join(PARTS))
    parser.add_argument("--results", type=Path, default=RESULTS)
    options = parser.parse_args()
    if not set(options.parts) <= set(PARTS):
        parser.error(f"there are the parts {', '.join(PARTS)}")
    for part in options.parts or PARTS:
        began = time.perf_counter()
        with threadpool_limits(1):
            import_module(f"experiments.topology.{part}").run(options.results)
        print(f"{part}: {time.perf_counter() - began:.0f} s, written to {options.results}")


if __name__ == "__main__":
    main()
