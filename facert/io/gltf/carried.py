"""A character as it was given in a glTF file, with an animation that is added to it.

Meshes, materials, textures, skins, cameras, extras, extensions and their data are carried through:
their JSON is kept, and their bytes stay where they are, so that nothing needs to be understood.
Bytes in other buffers, and pictures in the document's folder, come into the one chunk of a GLB.
"""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any

from facert.data.text import printable
from facert.data.version import CREATED_BY, MARK
from facert.errors import InputError
from facert.io.gltf.buffer import Buffer, write_container
from facert.io.gltf.compression import MESHOPT
from facert.io.gltf.container import Container, is_left_out, read_container
from facert.io.gltf.uris import file_of
from facert.io.guarded import moderate_file, parsing

log = logging.getLogger("facert")

_PICTURES = {
    b"\x89PNG": "image/png",
    b"\xff\xd8\xff": "image/jpeg",
    b"RIFF": "image/webp",
    b"\xabKTX 20": "image/ktx2",
}
"""Kinds of pictures that glTF knows, by their first bytes."""


class CarriedFile:
    """A glTF file in memory, with all its bytes in one buffer that grows.

    Raises `InputError` when the file cannot be read safely.
    """

    def __init__(self, path: Path) -> None:
        with parsing("file", "valid glTF 2.0"):
            container = read_container(path)
            self.root: dict[str, Any] = container.root
            self._others = container.others
            views = self.root.setdefault("bufferViews", [])
            self.buffer = Buffer(views, self.root.setdefault("accessors", []))
            self._gather(container)
            self._embed_pictures(container)

    def write(self, path: Path, overwrite: bool) -> None:
        """Write it as GLB; see `write_container`."""
        asset = self.root["asset"]
        author = str(asset.get("generator", ""))
        if not author.startswith(MARK):
            author = f"{CREATED_BY}, from {author}" if author else CREATED_BY
        # First of all, as the mark is looked for at the beginning.
        named = {"version": asset["version"], "generator": author} | asset | {"generator": author}
        root = {"asset": named} | {key: self.root[key] for key in self.root if key != "asset"}
        write_container(root, self.buffer, path, overwrite, self._others)

    def _gather(self, container: Container) -> None:
        """Bring the buffers into one, and their views with them."""
        described = self.root.get("buffers", [])
        buffers: list[dict[str, Any]] = [{}]
        places: list[tuple[int, int]] = []  # of each: the new buffer, and where it begins in it
        for one, content in zip(described, container.buffers(), strict=True):
            if is_left_out(one):
                places.append((len(buffers), 0))
                buffers.append(one)
                continue
            if one["byteLength"] > len(content):
                raise ValueError(f"a buffer of {one['byteLength']} bytes in {len(content)}")
            container.memory.require(one["byteLength"], "buffers")
            places.append((0, self.buffer.append(content[: one["byteLength"]])))
        self.root["buffers"] = buffers
        for view in self.buffer.views:
            packed = (view.get("extensions", {}).get(name) for name in MESHOPT)
            for place in filter(None, (view, *packed)):
                place["buffer"], begin = places[place["buffer"]]
                if begin:
                    place["byteOffset"] = begin + place.get("byteOffset", 0)

    def _embed_pictures(self, container: Container) -> None:
        """Bring pictures beside the document into the buffer, each once; name all others."""
        outside: list[str] = []
        held: dict[Path, dict[str, Any]] = {}
        for image in self.root.get("images", []):
            uri = image.get("uri")
            if not isinstance(uri, str) or uri.startswith("data:"):
                continue
            path = _path_within(container.path, uri)
            found = None if path is None else held.get(path) or self._embedded(path, container)
            if path is None or found is None:
                outside.append(uri)
                continue
            held[path] = found
            del image["uri"]
            image |= found
        if outside:
            names = printable(", ".join(outside), 200)
            log.warning("pictures that are not in the character's folder stay outside: %s", names)

    def _embedded(self, path: Path, container: Container) -> dict[str, Any] | None:
        """What an image says that has come into the buffer; None where it is no picture."""
        container.memory.include(path)
        container.memory.require(path.stat().st_size, "images")
        found = _picture(path)
        if found is None:
            return None
        content, kind = found
        return {"mimeType": kind, "bufferView": self.buffer.view(content)}


def _path_within(document: Path, uri: str) -> Path | None:
    """A file in the document's folder or below it; None for anything else."""
    try:
        path = file_of(uri, document, "images")
    except InputError:
        return None
    return path if path.is_file() else None


def _picture(path: Path) -> tuple[bytes, str] | None:
    """The bytes of a picture, and its kind; None for anything else."""
    try:
        content = moderate_file(path).read_bytes()
    except InputError:
        return None
    kind = next((kind for start, kind in _PICTURES.items() if content.startswith(start)), None)
    return None if kind is None else (content, kind)
