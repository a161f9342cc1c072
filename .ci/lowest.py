"""Prints constraints.txt with the lowest versions that pyproject.toml allows, where it names any.

    python .ci/lowest.py [--but torch] > constraints-lowest.txt

For what people install: dependencies and extras, but for the tools of development.
"""

import argparse
import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
TOOLS = ("dev", "test", "bench", "fuzz", "docs")  # extras of those who work on facert


def canonical(name: str) -> str:
    """The name by which a package is the same however it is spelt."""
    return re.sub(r"[-_.]+", "-", name).lower()


def lowest() -> dict[str, str]:
    """The lower bound of each dependency, by its name."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = project["optional-dependencies"].items()
    wanted = project["dependencies"] + [w for name, of in extras if name not in TOOLS for w in of]
    pairs = (requirement.split(">=") for requirement in wanted)
    return {canonical(name): version for name, version in pairs}


def main() -> None:
    """Print the constraints."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--but", nargs="*", default=[], help="packages that stay as they are")
    given = parser.parse_args()
    versions = {name: version for name, version in lowest().items() if name not in given.but}
    for line in (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines():
        name, separator, version = line.partition("==")
        print(name, versions.get(canonical(name), version), sep=separator)


if __name__ == "__main__":
    main()
