"""What the guides begin with."""

from __future__ import annotations

from pathlib import Path

import pytest
from following import DOCS, follow


@pytest.fixture(scope="session")
def quick_start(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What the quick start leaves: the demo, a model and a result, from which others go on."""
    folder = tmp_path_factory.mktemp("quick-start")
    follow(DOCS / "quick-start.md", folder)
    return folder
