"""How long facert takes, beside what else could be done in that time.

    python -m experiments.bench [--runs 5] [--parts likelihood,training,mapping,startup]

CPU time on one thread. Each figure is measured in turn with its reference, where that is not the
paper's word, in the same run: the ratio of the two holds on a busy machine as well. Writes
results.json and results.md beside this file; parts that are not asked for are left out of them.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from experiments.bench import likelihood, mapping, startup, training
from experiments.bench.figure import machine, table, write_json
from experiments.report import write_text

FOLDER = Path(__file__).resolve().parent
PARTS = {
    "likelihood": likelihood,
    "training": training,
    "mapping": mapping,
    "startup": startup,
}


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--runs", type=int, default=5, help="of each (%(default)s)")
    parser.add_argument("--parts", default=",".join(PARTS), help="some of %(default)s")
    parser.add_argument("--to", type=Path, default=FOLDER, help="folder to write to")
    given = parser.parse_args()
    figures = [f for name in given.parts.split(",") for f in PARTS[name].figures(given.runs)]
    where = ", ".join(f"{name} {value}" for name, value in machine().items())
    title = "# How long facert takes"
    write_json(given.to / "results.json", figures)
    write_text(given.to / "results.md", [title, f"One thread, CPU time; {where}.", table(figures)])
    print((given.to / "results.md").read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
