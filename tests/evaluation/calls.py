"""What is called in processes of their own: a module that is loaded at once."""

import os
import pickle
import signal
import time
from pathlib import Path

from facert.errors import InputError
from facert.io.atomic import NewBytes
from facert.io.hdf5 import create


def deed(folder, name, deaths=0):
    """Die so many times, each told by a file in the folder; then return the name."""
    died = len(list(folder.glob(f"{name}-*")))
    if died < deaths:
        (folder / f"{name}-{died}").touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return name


def refuse(number):
    print("this is no result")
    raise InputError("number", "another", str(number), "Change it.")


def cleaning_up(folder, name):
    """Work without end on a file that it removes at last."""
    file = folder / name
    file.touch()
    try:
        time.sleep(60)
    finally:
        file.unlink()


def reason_of(_folder, *rest):
    """What is returned in place of a deed that was never done."""
    return ": ".join(map(str, rest if len(rest) == 1 else (rest[0], rest[-1])))


def ended_while_writing(folder):
    """Be asked to end while HDF5 writes a file."""
    write = NewBytes.write

    def asked(self, content):
        os.kill(os.getpid(), signal.SIGTERM)
        return write(self, content)

    NewBytes.write = asked
    with create(Path(folder, f"{os.getpid()}.h5"), "a", 1, False):
        pass
    time.sleep(5.0)


class Heavy:
    """What no message can hold for want of memory."""

    def __reduce__(self):
        raise MemoryError


def at_its_end(_folder, end):
    """Come to the limit of CPU time, or to a result for which there is no memory at all."""
    if end == "time":
        os.kill(os.getpid(), signal.SIGXCPU)
    pickle.dumps = lambda _message: Heavy().__reduce__()
    return Heavy()
