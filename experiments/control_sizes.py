"""A control in another unit: what one with 30 times as large values does to the others' error.

    python -m experiments.control_sizes

The demo's training take and performance, with `jaw_open` once as it is and once as in degrees.
"""

from __future__ import annotations

import argparse
from dataclasses import replace

import numpy as np

import facert
from facert.data.arrays import rms
from facert.data.take import Controls
from facert.demo import performance_take, training_take

CONTROL, LARGER = "jaw_open", 30.0


def main() -> None:
    """Train and test with both sizes."""
    argparse.ArgumentParser(description=__doc__).parse_args()
    take, performance = training_take(), performance_take()
    assert take.params is not None
    assert take.controls is not None
    assert take.animation is not None
    assert performance.params is not None
    column = take.controls.names.index(CONTROL)
    for factor in (1.0, LARGER):
        sizes = np.ones(len(take.controls.names))
        sizes[column] = factor
        limits = take.controls.limits
        scaled = replace(
            take,
            params=take.params * sizes,
            animation=take.animation * sizes,
            controls=Controls(
                take.controls.names, None if limits is None else limits * sizes[:, None]
            ),
        )
        found = facert.train(scaled).retarget(performance).params
        assert found is not None
        off = found / sizes - performance.params
        others = rms(np.delete(off, column, axis=1))
        print(f"{CONTROL} x {factor:g}: its RMS {rms(off[:, column]):.4f}, others {others:.4f}")


if __name__ == "__main__":
    main()
