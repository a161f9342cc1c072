"""The expression of the kernel stands once: `facert.models.kernels` alone exponentiates it."""

from __future__ import annotations

import ast
from pathlib import Path

import facert

ROOT = Path(facert.__file__).parent
ROOMS = ("models", "methods", "posing", "regions", "topology")
# File: the arguments of its exponentials, and why they are no kernel of Eq. (3).
OTHERS = {
    "models/factors/censoring.py": {  # densities of the normal distribution
        "-0.5 * (t * t + LOG_2PI)",
        "-0.5 * (a * a + LOG_2PI) - log_ndtr(a)",
    },
    # From log parameters
    "models/gp/curvature.py": {"log_kernel[2]"},
    "models/gp/hyperparameters.py": {"v"},
    "models/gp/lapack.py": {"log_kernel[2]"},
    "models/gp/likelihood.py": {"log_kernel[2]"},
    "models/gp/sparse.py": {"log_kernel[2]"},
    # Exponentials of distances that are not squared
    "posing/completion.py": {"-NEAR * distances"},
    "posing/pose_regression.py": {"-distances"},
    "topology/local_ridge.py": {"-distance / REACH"},
}
NAMES = {"exp", "exp_", "exp2", "expm1", "erf", "rbf_kernel", "RBF"}


def exponentials(path: Path) -> set[str]:
    """The arguments of all exponentials that a file calls: of x.exp() it is x."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if not isinstance(node, ast.Call):
            continue
        name = getattr(node.func, "attr", getattr(node.func, "id", None))
        if name in NAMES:
            argument = node.args[0] if node.args else node.func.value
            found.add(ast.unparse(argument))
    return found


def test_the_expression_of_the_kernel_stands_once() -> None:
    found = {
        path.relative_to(ROOT).as_posix(): arguments
        for room in ROOMS
        for path in sorted((ROOT / room).rglob("*.py"))
        if (arguments := exponentials(path))
    }
    kernels = found.pop("models/kernels.py")
    assert kernels == {"x", "log_kernel"}  # one exponential, in place; the other of parameters
    assert found == OTHERS
