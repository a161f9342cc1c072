"""``facert regions``: parts of a face that can be learned apart, as TOML to edit."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from facert.cli.shared import console
from facert.cli.shared.options import TARGET, argument
from facert.errors import reading


def command(
    take: Annotated[Path, argument("TAKE", "Take with poses in some frames.")],
    target: TARGET = None,
) -> None:
    """Find regions of markers and controls, and print them as TOML.

    These are what `facert train --regions auto` learns apart; edit them, and give the file to
    `facert train --regions regions.toml`. A control may be in several regions.

    facert regions facert-demo/training.h5
    facert regions facert-demo/training.h5 > regions.toml
    """
    from facert.io.formats import read_take_file
    from facert.io.toml import regions_text
    from facert.preprocess.preparation import prepare
    from facert.regions.automatic import find_regions
    from facert.settings import Settings

    found = read_take_file(take, target=target)
    with reading(take):
        regions = find_regions(prepare(found, Settings()).take)
    console.write(regions_text(regions))
