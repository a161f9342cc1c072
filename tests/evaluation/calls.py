"""What is called in processes of their own: a module that is loaded at once."""

import os
import signal
import time

from facert.errors import InputError


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


def reason_of(_folder, name, *rest):
    """What is returned in place of a deed that was never done."""
    return f"{name}: {rest[-1]}"
