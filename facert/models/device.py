"""Choice of the torch device."""

from __future__ import annotations

from typing import TYPE_CHECKING

from facert.errors import DeviceError

if TYPE_CHECKING:
    import torch


def find_device(name: str) -> torch.device:
    """The device of that name.

    Raises
    ------
    DeviceError
        When it is not there: training never falls back to another device in silence.
    """
    import torch  # takes its time: not for those that stay on the CPU

    try:
        if name.partition(":")[0] not in ("cpu", "cuda"):
            raise RuntimeError("expected cpu or cuda")
        device = torch.device(name)
        torch.empty(0, device=device)
    except (RuntimeError, AssertionError, NotImplementedError) as error:
        reason = str(error).splitlines()[0]
        raise DeviceError(f"--device {name}: {reason}. Use --device cpu.") from None
    return device
