"""The registry of methods: to add one, write a file with its class, and one line here."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

from facert.data.text import did_you_mean
from facert.errors import InputError
from facert.settings import Settings

if TYPE_CHECKING:
    from facert.methods.base import Method

# Name: module and class. A module is loaded with its first method: the libraries behind them take
# their time, and the names alone are wanted for help.
REGISTRY = {
    "auto": ("blend", "Auto"),
    "ssgpr": ("ssgpr", "SemiSupervisedGPR"),
    "ssgplvm": ("shared_gplvm", "SemiSupervisedSGPLVM"),
    "sgplvm": ("shared_gplvm", "SupervisedSGPLVM"),
    "gpr": ("gpr", "GPR"),
    "gpr-linear": ("gpr", "LinearGPR"),
    "svr": ("svr", "SVR"),
    "ridge": ("linear", "Ridge"),
    "pls": ("linear", "PLS"),
    "rbf": ("interpolation", "RBF"),
    "nearest": ("interpolation", "Nearest"),
}


def method_class(name: str) -> type[Method]:
    """The class of a method.

    Raises
    ------
    InputError
        When there is none of that name.
    """
    if name not in REGISTRY:
        raise InputError(
            "method", "one of " + ", ".join(REGISTRY), repr(name), did_you_mean(name, REGISTRY)
        )
    module, class_name = REGISTRY[name]
    found: type[Method] = getattr(importlib.import_module(f"facert.methods.{module}"), class_name)
    return found


def make_method(settings: Settings, dense: bool = False) -> Method:
    """The method that the settings name, untrained; raises InputError as `require_known` does.

    One for a dense source sees it by its leading directions, see `facert.methods.dense`.
    """
    require_known(settings)
    method = method_class(settings.method)(settings)
    if not dense:
        return method
    from facert.methods.dense import Dense, DenseStepwise

    return DenseStepwise(method) if method.stepwise else Dense(method)


def require_known(settings: Settings) -> None:
    """Raise InputError when the settings name a method or a kernel that facert does not have."""
    from facert.models.kernels import kernel_class  # NumPy, which the names do without

    method_class(settings.method)
    for field in ("source_kernel", "target_kernel"):
        kernel_class(getattr(settings, field), field)
