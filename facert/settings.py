"""Everything about a training run that a person may change, each described once.

The options of ``facert train``, the checks of a config file, the docstring of `Settings` and the
table in the documentation are made from the fields: another setting is another field.
"""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Annotated, Any, Literal, get_args, get_type_hints

from facert.data.regions import AUTO, Regions
from facert.data.typed import choices, require_type
from facert.errors import InputError

OptimiserName = Literal["lbfgs", "scg"]
LimitRule = Literal["auto", "declared", "none"]
Likelihood = Literal["auto", "exact", "vfe", "fitc"]

FIX = "Change the setting."
EVERYDAY, SHARED, FINE = "Options", "Shared models", "In a config file alone"


@dataclass(frozen=True)
class About:
    """Help text and smallest allowed value of a setting.

    Parameters
    ----------
    help : str
    group : str
        The panel of the help that lists it. Those of `SHARED` and `FINE` only the shared models
        use; the latter are no options of ``facert train``.
    least, above : float, optional
        The least value, or a number that it must be above.
    unset : str
        What None stands for, where that is the default.
    """

    help: str
    group: str = EVERYDAY
    least: float | None = None
    above: float | None = None
    unset: str = "from the data"

    def check(self, name: str, value: Any) -> None:
        """Refuse a value out of range, with an `InputError`."""
        if value is not None and self.least is not None and not value >= self.least:
            raise _bad(name, f"at least {self.least}", value)
        if value is not None and self.above is not None and not value > self.above:
            raise _bad(name, f"a number above {self.above}", value)


@dataclass(frozen=True)
class Settings:
    """Settings of training and mapping.

    Lengths and noise are in normalised units: the source (and likewise the target) is centred and
    divided by the largest standard deviation of one of its dimensions.
    """

    method: Annotated[str, About("The method that learns.")] = "auto"
    labels: Annotated[
        int | None, About("Use only so many of the posed frames, at random.", least=0, unset="all")
    ] = None
    unlabelled: Annotated[
        int | None,
        About(
            "Use so many frames without a pose, and poses without a frame, at most.",
            least=0,
            unset="100 for the shared models, else all",
        ),
    ] = None
    seed: Annotated[int, About("For every random choice.", least=0)] = 0
    latent_dim: Annotated[int, About("Dimensions q of the latent space.", SHARED, 1)] = 8
    neighbours: Annotated[int, About("k of the local linear prior, Eq. (7).", SHARED, 1)] = 8
    sigma_c: Annotated[
        float | None, About("Standard deviation of the capture noise, Eq. (13).", SHARED, above=0)
    ] = None
    sigma_t: Annotated[
        float | None,
        About("The same of motion from frame to frame, Eq. (14), --mode online.", FINE, above=0),
    ] = None
    source_noise_floor: Annotated[
        float | None, About("Least noise variance of the source.", FINE, 0, unset="sigma_c²")
    ] = None
    target_noise_floor: Annotated[
        float, About("Least noise variance of the poses: how exactly they are meant.", FINE, 0)
    ] = 0.05
    source_kernel: Annotated[
        str, About("Kernel of the source: squared-exponential, or matern-5/2.", SHARED)
    ] = "squared-exponential"
    target_kernel: Annotated[str, About("The same of the poses.", SHARED)] = "squared-exponential"
    limits: Annotated[
        LimitRule,
        About(
            "Clip poses: to limits near all known poses, else to the range of these (auto); to "
            "limits alone (declared); or not."
        ),
    ] = "auto"
    likelihood: Annotated[
        Likelihood,
        About("Exact for small sets, through inducing latents for large ones (auto: vfe).", FINE),
    ] = "auto"
    inducing: Annotated[int, About("Inducing latents of a view, if any.", FINE, 1)] = 100
    optimizer: Annotated[
        OptimiserName, About("L-BFGS-B, or scaled conjugate gradients (the paper's).", SHARED)
    ] = "lbfgs"
    tolerance: Annotated[
        float, About("Training ends when an iteration gains less than this, relative.", FINE, 0)
    ] = 1e-8
    max_iterations: Annotated[int, About("Iterations at most.", FINE, 1)] = 2000
    checkpoint_every: Annotated[
        int, About("Iterations between stages, at which L-BFGS begins anew.", FINE, 1)
    ] = 500
    checkpoint_seconds: Annotated[
        float, About("Seconds between checkpoints, from which --resume continues.", FINE, 0)
    ] = 10.0
    device: Annotated[str, About("Where the shared models are trained: cpu or cuda.")] = "cpu"
    regions: Annotated[
        Regions | str | None,
        About(
            "Learn parts of the face apart: auto, or a file as facert regions prints it (in a "
            "config file a table for each, [regions.brows]).",
            unset="the face as a whole",
        ),
    ] = None
    detect: Annotated[
        bool,
        About(
            "Take bad markers (frozen, swapped, elsewhere, absurd) and weights (absurd, no face) "
            "as not observed."
        ),
    ] = True
    smooth: Annotated[
        bool, About("Learn from frames without gaps and noise, as far as neighbours show.")
    ] = True
    neutral: Annotated[
        str | None,
        About(
            "Frames in which the actor rests, as 12 or 0..20; of several takes one each, in their "
            "order or as FILE:0..20.",
            unset="the smallest pose",
        ),
    ] = None

    def __post_init__(self) -> None:
        for name, (kind, _) in DESCRIBED.items():
            require_type(kind, getattr(self, name), name, FIX)
        for name, (_, about) in DESCRIBED.items():
            about.check(name, getattr(self, name))
        if isinstance(self.regions, str) and self.regions != AUTO:
            raise _bad("regions", f"{AUTO!r}, or a table a region", self.regions)

    def with_changes(self, changes: dict[str, Any]) -> Settings:
        """These settings with the given ones replaced.

        Raises
        ------
        InputError
            For an unknown name or a value of the wrong type.
        """
        unknown = sorted(changes.keys() - DESCRIBED.keys())
        if unknown:
            near = difflib.get_close_matches(unknown[0], DESCRIBED, n=1)
            expected = "a setting" if near else f"one of {', '.join(sorted(DESCRIBED))}"
            fix = f"Did you mean {near[0]}?" if near else "Remove it."
            raise InputError(unknown[0], expected, "an unknown name", fix)
        regions = changes.get("regions")
        if isinstance(regions, Mapping):
            changes = {**changes, "regions": Regions.of(regions)}
        return replace(self, **changes)

    def as_dict(self) -> dict[str, Any]:
        """Convert to plain values for a file's metadata."""
        regions = self.regions.tables if isinstance(self.regions, Regions) else self.regions
        return {**asdict(self), "regions": regions}


DESCRIBED: dict[str, tuple[Any, About]] = {
    name: get_args(hint) for name, hint in get_type_hints(Settings, include_extras=True).items()
}
"""The type and the description of each setting, in the order of the fields."""
OF_SHARED = tuple(name for name, (_, about) in DESCRIBED.items() if about.group != EVERYDAY)
"""Settings that only the shared models use."""


def default_text(name: str) -> str:
    """The default of a setting, or what it stands for."""
    default = getattr(DEFAULTS, name)
    return DESCRIBED[name][1].unset if default is None else str(default)


def _parameters() -> str:
    """The settings as a section of a docstring."""
    lines = ["Parameters", "----------"]
    for name, (kind, about) in DESCRIBED.items():
        words = ", ".join(f'"{word}"' for word in choices(kind))
        plain = getattr(kind, "__name__", str(kind).rpartition(".")[2])
        types = f"{{{words}}}" if words else plain.replace(" | None", ", optional")
        unset = f" By default {about.unset}." if getattr(DEFAULTS, name) is None else ""
        lines += [f"{name} : {types}", f"    {about.help}{unset}"]
    return "\n    ".join(lines)


def _bad(name: str, expected: str, value: object) -> InputError:
    return InputError(name, expected, repr(value), FIX)


DEFAULTS = Settings()
Settings.__doc__ = f"{Settings.__doc__}\n    {_parameters()}"
