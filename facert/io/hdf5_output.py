"""The bytes of a new HDF5 file: a full disk is an error of facert, and no crash of HDF5."""

from __future__ import annotations

from io import FileIO

CALLED_BY_C = True
"""HDF5 calls this module, and an exception would not get through: a signal is raised later."""


class HDF5Output:
    """The bytes of a new HDF5 file, whose first error waits until the file is closed.

    HDF5 cannot close a file that it cannot write, and crashes at the end of the process. So it
    never hears of a full disk: what does not fit stays here, and `require_written` ends the work
    before that is much.
    """

    def __init__(self, raw: FileIO) -> None:
        self._raw = raw
        self._unwritten: dict[int, bytes] = {}  # by their place
        self._place = 0
        self._error: OSError | None = None

    def require_written(self) -> None:
        """Raise the first OSError of writing, if there was any."""
        if self._error is not None:
            raise self._error

    def seek(self, offset: int, whence: int = 0) -> int:
        """Go to a place, or to the end, by which h5py asks for the length."""
        self._place = offset if whence == 0 else self._raw.seek(offset, whence)
        return self._place

    def read(self, size: int = -1) -> bytes:
        """Read as a plain file does; h5py asks for this method, and uses `readinto`."""
        buffer = bytearray(max(size, 0))
        return bytes(buffer[: self.readinto(memoryview(buffer))])

    def tell(self) -> int:
        """The place."""
        return self._place

    def readinto(self, buffer: memoryview) -> int:
        """Read what was written here."""
        kept = self._unwritten.get(self._place)
        if kept is None:
            self._raw.seek(self._place)
            return self._raw.readinto(buffer) or 0
        size = min(len(kept), len(buffer))
        buffer[:size] = kept[:size]
        return size

    def write(self, content: memoryview) -> int:
        """Write bytes, or keep them where they do not fit."""
        if self._error is None:
            try:
                self._raw.seek(self._place)
                return self._raw.write(content)
            except OSError as error:
                self._error = error
        self._unwritten[self._place] = bytes(content)
        return len(content)

    def truncate(self, size: int) -> int:
        """Set the length."""
        if self._error is None:
            try:
                return self._raw.truncate(size)
            except OSError as error:
                self._error = error
        return size

    def flush(self) -> None:
        """Do nothing: nothing waits."""
