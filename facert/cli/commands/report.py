"""``facert report``: results as one page that opens anywhere."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from facert.cli.shared import console
from facert.cli.shared.files import read_character, require_name, save_text
from facert.cli.shared.in_and_out import require_inputs
from facert.cli.shared.options import (
    DRIVERS,
    OVERWRITE,
    RIG,
    SHAPES,
    TARGET,
    TRUTH,
    argument,
    file_option,
    option,
)
from facert.data.text import plural

ENDINGS = (".html", ".htm")


def command(
    results: Annotated[
        list[Path],
        argument("RESULT...", "What eval --json or retarget wrote, or a folder of these."),
    ],
    output: Annotated[Path, option("The page.", "--output", "-o", metavar="PAGE.html")] = Path(
        "report.html"
    ),
    rig_path: RIG = None,
    drivers_path: DRIVERS = None,
    truth_path: TRUTH = None,
    model_path: Annotated[
        Path | None,
        file_option("The model, for a verdict where the result holds none.", "--model", "-m"),
    ] = None,
    title: Annotated[str, option("Stands above all.")] = "",
    shapes: SHAPES = None,
    target: TARGET = None,
    overwrite: OVERWRITE = False,
) -> None:
    """Write one HTML file with verdicts, tables, figures and faces, that opens without a network.

    facert report retargeted.h5 --rig facert-demo/character.h5
    facert report . -o whole-folder.html
    """
    require_inputs(*results, rig_path, drivers_path, truth_path, model_path)
    require_name(output, overwrite, ENDINGS)

    from facert.io.formats import read_take_file
    from facert.pages.report.folder import file_section, folder_sections
    from facert.pages.report.page import make_report, to_html
    from facert.pages.report.sections import Section
    from facert.retarget.retargeter import load

    rig = read_character(rig_path, shapes, drivers_path)
    truth = read_take_file(truth_path, target) if truth_path is not None else None
    model = None if model_path is None else load(model_path)
    sections: list[Section] = []
    for path in results:
        if path.is_dir():
            sections.extend(folder_sections(path, rig, truth, model))
        else:
            sections.append(file_section(path, rig, truth, model))
    name = title or ", ".join(path.resolve().name for path in results)
    save_text(to_html(make_report(name, tuple(sections))), output, overwrite)
    console.show(f"{output}: {plural(len(sections), 'section')}")
