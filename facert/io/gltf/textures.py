"""Colours of vertices by the texture of their material, for pictures: an iris shows the gaze.

Pictures are foreign: they are opened as one of the few kinds that glTF knows, and not if they are
huge. What cannot be read gives no colours.
"""

from __future__ import annotations

from contextlib import suppress
from io import BytesIO
from typing import Any

import numpy as np

from facert.data.arrays import FloatArray
from facert.errors import InputError
from facert.io.gltf.document import Document
from facert.io.gltf.uris import data_of
from facert.io.guarded import parsing

KINDS = ("PNG", "JPEG", "WEBP")
MOST = 2**25
"""Pixels at most."""
_SIZE = 1024  # pixels a side that are kept


def texture_colours(
    document: Document, material: dict[str, Any], attributes: dict[str, int]
) -> FloatArray | None:
    """Colours of a mesh's vertices as a screen shows them, (V, 3); None without a texture."""
    surface = material.get("pbrMetallicRoughness", {})
    if "baseColorTexture" not in surface:
        return None
    with suppress(InputError), parsing("texture", "a picture of a usual kind"):
        chosen = surface["baseColorTexture"]
        uv = document.numbers(attributes[f"TEXCOORD_{chosen.get('texCoord', 0)}"])[:, :2]
        image = document.root["images"][document.root["textures"][chosen["index"]]["source"]]
        pixels = _pixels(_content(document, image))
        height, width = pixels.shape[:2]
        # v grows downwards, and a texture is repeated beyond 0 and 1.
        column, row = (np.mod(np.nan_to_num(uv), 1.0) * [width, height]).astype(np.int64).T
        found = pixels[np.minimum(row, height - 1), np.minimum(column, width - 1)]
        return np.asarray(found / 255.0)
    return None


def _content(document: Document, image: dict[str, Any]) -> bytes:
    if "bufferView" in image:
        return document.content(image["bufferView"])
    return data_of(image["uri"]) or b""


def _pixels(content: bytes) -> FloatArray:
    """Red, green and blue (H, W, 3), 0 to 255."""
    from PIL import Image

    with Image.open(BytesIO(content), formats=KINDS) as image:
        if image.width * image.height > MOST:
            raise ValueError(f"{image.width} x {image.height} pixels")
        shown = image.convert("RGB")
        shown.thumbnail((_SIZE, _SIZE))
        return np.asarray(shown, dtype=np.float64)
