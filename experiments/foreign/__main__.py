"""Files of every program that is here, made, read with facert and compared.

python -m experiments.foreign [--keep FOLDER] [PROGRAM ...]
"""

from __future__ import annotations

from experiments.foreign.command import main

if __name__ == "__main__":
    raise SystemExit(main())
