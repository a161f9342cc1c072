"""Every retargeting method behind one small interface.

To add one, write a file with a class that follows `facert.methods.base.Method` and add one line
to the registry.
"""

from collections.abc import Callable

from facert.errors import InputError
from facert.methods.base import Method
from facert.methods.shared_gplvm import SemiSupervisedSGPLVM, SupervisedSGPLVM
from facert.settings import Settings

__all__ = ["REGISTRY", "Method", "make_method"]

REGISTRY: dict[str, Callable[[Settings], Method]] = {
    "ssgplvm": SemiSupervisedSGPLVM,
    "sgplvm": SupervisedSGPLVM,
}


def make_method(settings: Settings) -> Method:
    """A method by the name in the settings.

    Raises
    ------
    InputError
        When there is none of that name.
    """
    if settings.method not in REGISTRY:
        raise InputError(
            "method", "one of " + ", ".join(REGISTRY), repr(settings.method), "Choose one of these."
        )
    return REGISTRY[settings.method](settings)
