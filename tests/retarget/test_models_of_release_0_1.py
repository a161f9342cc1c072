"""Model files of an earlier release: they load, and map frames as they did.

`models` holds a file a method and one with regions, written by release 0.1.0 from `take.h5`, and
the poses that each of them gave for its frames.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import facert
from facert.methods.registry import REGISTRY

KEPT = Path(__file__).parent / "models"
NAMES = sorted(path.stem for path in KEPT.glob("*.safetensors"))


def test_every_method_has_a_file() -> None:
    assert {*REGISTRY} <= {*NAMES}


@pytest.mark.parametrize("name", NAMES)
def test_a_model_file_of_an_earlier_release_maps_as_it_did(name: str) -> None:
    result = facert.load(KEPT / f"{name}.safetensors").retarget(facert.read_take(KEPT / "take.h5"))
    expected = np.load(KEPT / "poses.npz")
    np.testing.assert_allclose(result.params, expected[f"{name}.params"], atol=1e-7)
    if f"{name}.std" in expected:
        np.testing.assert_allclose(result.std, expected[f"{name}.std"], atol=1e-7)
