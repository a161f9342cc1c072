"""Everything about a training run that a person may change, in one place."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from typing import Any, Literal, get_args, get_type_hints

from facert.data.regions import AUTO, Regions
from facert.errors import InputError

OptimiserName = Literal["lbfgs", "scg"]
LimitRule = Literal["auto", "declared", "none"]
Likelihood = Literal["auto", "exact", "vfe", "fitc"]

OF_SHARED = (
    "latent_dim", "neighbours", "sigma_c", "sigma_t", "source_noise_floor", "target_noise_floor",
    "likelihood", "inducing", "optimizer", "tolerance", "max_iterations", "checkpoint_every",
)  # fmt: skip
"""Settings that only the shared models use."""


@dataclass(frozen=True)
class Settings:
    """How to train and how to map.

    Lengths and noise are in normalised units: the source (and likewise the target) is centred and
    divided by the largest standard deviation of one of its dimensions.

    Parameters
    ----------
    method : str
        Name in the registry of methods.
    labels : int, optional
        Use only so many of the posed frames, drawn at random; by default all of them.
    unlabelled : int, optional
        Frames without a pose and poses without a frame used in training, at most so many of each,
        drawn at random; by default as many as the method has use for: 100 for the shared Gaussian
        process models, all for the others.
    seed : int
        For every random choice.
    latent_dim : int
        q, dimensions of the latent space.
    neighbours : int
        k of the reconstruction constraints, Eq. (7).
    sigma_c : float, optional
        Standard deviation of the measurement noise of the source, Eq. (13). It also sets the
        noise floor of the source view. By default expected from the data, see
        `facert.methods.noise`.
    sigma_t : float, optional
        Standard deviation of the change from one cleaned frame to the next, Eq. (14); used when
        frames are mapped one after the other. By default that of the take.
    source_noise_floor : float, optional
        Least noise variance 1/θ3 of the source view; by default sigma_c².
    target_noise_floor : float
        The same for the target view: how far, squared, a posed control may be off.
    limits : {"auto", "declared", "none"}
        What poses are clipped to: the limits that the take declares; ``"auto"`` falls back on the
        range of all poses in the take.
    likelihood : {"auto", "exact", "vfe", "fitc"}
        Of the shared models: exact, or through inducing latents by the variational bound or the
        older FITC, see `facert.models.gp.sparse`; ``"auto"`` is exact for small sets and the bound
        for large ones.
    inducing : int
        Inducing latents of a view, where there are any.
    optimizer : {"lbfgs", "scg"}
        L-BFGS-B, or the paper's scaled conjugate gradients.
    tolerance : float
        Training ends when the objective falls by less than this, relative, an iteration.
    max_iterations : int
        Iterations at most.
    checkpoint_every : int
        Iterations between two checkpoints; L-BFGS begins with a new memory after each.
    device : str
        Where training runs: ``"cpu"`` or a torch CUDA device.
    regions : Regions or "auto", optional
        Parts of the face that are learned apart; ``"auto"`` finds them, see
        `facert.regions.automatic`. By default the face is learned as a whole.
    detect : bool
        Take frozen, swapped and otherwise bad markers as not observed.
    smooth : bool
        Learn from frames without noise and gaps, as far as neighbouring frames tell.
    neutral : str, optional
        Frames in which the actor rests, as ``"12"`` or ``"0..20"``; by default the posed frame that
        moves the character least.
    """

    method: str = "auto"
    labels: int | None = None
    unlabelled: int | None = None
    seed: int = 0
    latent_dim: int = 8
    neighbours: int = 8
    sigma_c: float | None = None
    sigma_t: float | None = None
    source_noise_floor: float | None = None
    target_noise_floor: float = 0.05
    limits: LimitRule = "auto"
    likelihood: Likelihood = "auto"
    inducing: int = 100
    optimizer: OptimiserName = "lbfgs"
    tolerance: float = 1e-6
    max_iterations: int = 2000
    checkpoint_every: int = 500
    device: str = "cpu"
    regions: Regions | str | None = None
    detect: bool = True
    smooth: bool = True
    neutral: str | None = None

    def __post_init__(self) -> None:
        hints = get_type_hints(Settings)
        for field in fields(self):
            _check_type(field.name, getattr(self, field.name), hints[field.name])
        for name in ("latent_dim", "neighbours", "inducing", "max_iterations", "checkpoint_every"):
            self._at_least(name, 1)
        for name in ("seed", "target_noise_floor", "tolerance"):
            self._at_least(name, 0)
        for name in ("labels", "unlabelled", "source_noise_floor"):
            if getattr(self, name) is not None:
                self._at_least(name, 0)
        for name in ("sigma_c", "sigma_t"):
            value = getattr(self, name)
            if value is not None and not value > 0:
                raise _bad(name, "a number above 0", value)
        if isinstance(self.regions, str) and self.regions != AUTO:
            raise _bad("regions", f"{AUTO!r}, or a table a region", self.regions)

    def _at_least(self, name: str, least: int) -> None:
        value = getattr(self, name)
        if not value >= least:
            raise _bad(name, f"at least {least}", value)

    def with_changes(self, changes: dict[str, Any]) -> Settings:
        """These settings with the given ones replaced.

        Raises
        ------
        InputError
            For an unknown name or a value of the wrong type.
        """
        known = {field.name for field in fields(self)}
        unknown = sorted(set(changes) - known)
        if unknown:
            raise InputError(
                unknown[0], "one of " + ", ".join(sorted(known)), "an unknown setting", "Remove it."
            )
        regions = changes.get("regions")
        if isinstance(regions, Mapping):
            changes = {**changes, "regions": Regions.of(regions)}
        return replace(self, **changes)

    def as_dict(self) -> dict[str, Any]:
        """For a file's metadata."""
        regions = self.regions.tables if isinstance(self.regions, Regions) else self.regions
        return {**asdict(self), "regions": regions}


def _check_type(name: str, value: object, hint: Any) -> None:
    options = get_args(hint)
    if options and all(isinstance(option, str) for option in options):  # Literal
        if value not in options:
            raise _bad(name, "one of " + ", ".join(options), value)
        return
    allowed = options or (hint,)
    if float in allowed:
        allowed = (*allowed, int)
    if isinstance(value, bool) != (bool in allowed) or not isinstance(value, allowed):
        kinds = " or ".join(kind.__name__ for kind in allowed if kind is not type(None))
        raise _bad(name, kinds, value)
    if isinstance(value, float) and not math.isfinite(value):
        raise _bad(name, "a finite number", value)


def _bad(name: str, expected: str, value: object) -> InputError:
    return InputError(name, expected, repr(value), "Change the setting.")
