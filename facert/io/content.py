"""What a file holds by its first bytes, whatever its name says.

Some formats begin with bytes that no other file begins with: these count more than the ending.
Others are but likely, and asked for where the ending says nothing.
"""

from __future__ import annotations

from pathlib import Path

from facert.errors import InputError
from facert.io.guarded import read_beginning

_GLTF = (".glb", ".gltf", ".vrm", ".vrma")
_CERTAIN = {
    b"glTF\x02\x00\x00\x00": _GLTF,
    b"\x89HDF\r\n\x1a\n": (".h5", ".hdf5"),
    b"PathFileType": (".trc",),
    b"ply\n": (".ply",),
    b"ply\r\n": (".ply",),
    b"Kaydara FBX Binary": (".fbx",),
    b"PXR-USDC": (".usdc", ".usd"),
    b"#usda ": (".usda", ".usd"),
}
_LIKELY = {b"Timecode,BlendShapeCount": (".csv",), b"HIERARCHY": (".bvh",)}
_ZIP, _NPY = b"PK\x03\x04", b".npy"
_C3D = 0x50
_MARK = b"\xef\xbb\xbf"
_SCENE = (b'"asset"', b'"accessors"')
HEAD = 2**16
"""Bytes that are looked at."""


def endings_by_content(path: Path, likely: bool) -> tuple[str, ...]:
    """The endings that a file with this content should have; none where it is not known.

    With `likely`, also what the content may be by little.
    """
    try:
        head = read_beginning(path, HEAD).removeprefix(_MARK)
    except (OSError, InputError):
        return ()
    known = _CERTAIN | _LIKELY if likely else _CERTAIN
    for first, endings in known.items():
        if head.startswith(first):
            return endings
    if head.startswith(_ZIP):
        length = int.from_bytes(head[26:28], "little")
        return (".npz",) if head[30 : 30 + length].endswith(_NPY) else ()
    if head.lstrip()[:1] == b"{" and all(key in head for key in _SCENE):
        return _GLTF
    if likely and len(head) >= 512 and head[1] == _C3D and 2 <= head[0] <= 10:
        return (".c3d",)
    return ()
