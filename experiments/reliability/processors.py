"""A command as it runs on other processors: their kernels of linear algebra, on this machine.

    python -m experiments.reliability.processors [--only avx2,sse] [--threads 1,2] -- COMMAND ...

NumPy's and SciPy's BLAS, torch, MKL and NumPy's own loops choose their kernels by the processor.
Each of them can be told to take those of an older one. Whether they did is asked in a process of
its own before the command runs; a processor that this one cannot stand for is passed over with a
line. Ends with 1 if the command failed under any.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import Any

# Asked in another process: what took effect is settled when the libraries are loaded.
PROBE = """
import json, sys
import numpy, scipy.linalg, torch
from numpy._core import _multiarray_umath as loops
from threadpoolctl import threadpool_info
K = numpy.eye(256) + 0.5
# What this processor lacks, it ends of here and not within the command.
numpy.linalg.cholesky(K @ K), scipy.linalg.cholesky(K), torch.from_numpy(K).cholesky().exp()
blas = [pool for pool in threadpool_info() if pool["internal_api"] == "openblas"]
print(json.dumps({
    "blas": sorted({pool["architecture"] for pool in blas}),
    "copies": len(blas),
    "threads": sorted({pool["num_threads"] for pool in blas} | {torch.get_num_threads()}),
    "torch": torch.backends.cpu.get_cpu_capability().lower(),
    "wide": [name for name in loops.__cpu_dispatch__ if loops.__cpu_features__.get(name)],
}))
"""
LOOPS = "from numpy._core import _multiarray_umath as l; print(*l.__cpu_dispatch__)"


@dataclass(frozen=True)
class Processor:
    """Kernels that go together, as on one kind of processor."""

    name: str
    blas: str  # OPENBLAS_CORETYPE
    # What OpenBLAS may call it: builds without a kernel of its own name one that is the same
    called: tuple[str, ...]
    torch: str  # ATEN_CPU_CAPABILITY
    mkl: str  # MKL_ENABLE_INSTRUCTIONS
    # Beginnings of the names of NumPy's loops that it lacks
    without: tuple[str, ...]

    def environment(self, threads: int) -> dict[str, str]:
        """The variables of a process that takes these kernels."""
        lacking = [name for name in dispatched() if name.startswith(self.without)]
        counts = {f"{library}_NUM_THREADS": str(threads) for library in ("OMP", "OPENBLAS", "MKL")}
        return counts | {
            "OPENBLAS_CORETYPE": self.blas,
            "ATEN_CPU_CAPABILITY": self.torch,
            "MKL_ENABLE_INSTRUCTIONS": self.mkl,
            "NPY_DISABLE_CPU_FEATURES": " ".join(lacking),
        }

    def missing(self, found: dict[str, Any], threads: int) -> str:
        """What did not take effect in a process that found so much (`probe`), or nothing."""
        if "ended" in found:
            return f"a process that ended with {found['ended']}"
        wide = [name for name in found["wide"] if name.startswith(self.without)]
        expected = {
            "BLAS": (found["blas"], [name for name in self.called if name in found["blas"]]),
            "copies of BLAS": (found["copies"], max(found["copies"], 2)),
            "threads": (found["threads"], [threads]),
            "torch": (found["torch"], self.torch),
            "loops of NumPy": (wide, []),
        }
        return ", ".join(f"{of} {has}" for of, (has, due) in expected.items() if has != due)


AVX512, AVX2 = ("AVX512", "X86_V4"), ("AVX2", "FMA3", "X86_V3")
PROCESSORS = (
    Processor("avx512", "SkylakeX", ("SkylakeX",), "avx512", "AVX512", ("none",)),
    Processor("avx2", "Haswell", ("Haswell",), "avx2", "AVX2", AVX512),
    Processor("sse", "Nehalem", ("Nehalem",), "default", "SSE4_2", AVX512 + AVX2),
    Processor("old", "Prescott", ("Prescott", "Katmai"), "default", "SSE4_2", AVX512 + AVX2),
)


def probe(environment: dict[str, str]) -> dict[str, Any]:
    """What a process with these variables finds, or how it ended: by a signal, it is below 0."""
    try:
        found: dict[str, Any] = json.loads(_output(PROBE, environment))
    except subprocess.CalledProcessError as error:
        return {"ended": error.returncode}
    return found


@cache
def dispatched() -> list[str]:
    """Names of NumPy's loops that are chosen by the processor; they differ between releases."""
    return _output(LOOPS, {}).split()


def present(only: list[str], threads: list[int]) -> Iterator[tuple[Processor, int]]:
    """Processors, and numbers of threads, that this machine can stand for; says which it cannot."""
    for processor in PROCESSORS:
        for count in threads if processor.name in only else ():
            missing = processor.missing(probe(processor.environment(count)), count)
            if not missing:
                yield processor, count
            else:
                print(f"skipped: {processor.name}, {count} threads: found {missing}", flush=True)


def _output(code: str, environment: dict[str, str]) -> str:
    done = subprocess.run(
        [sys.executable, "-c", code],
        env=os.environ | environment,
        check=True,
        capture_output=True,
        text=True,
    )
    return done.stdout


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    names = ",".join(processor.name for processor in PROCESSORS)
    parser.add_argument("--only", default=names, help="some of %(default)s")
    parser.add_argument("--threads", default="1", help="numbers of threads (%(default)s)")
    parser.add_argument("command", nargs="+", metavar="COMMAND")
    given = parser.parse_args()
    failed = []
    counts = [int(count) for count in given.threads.split(",")]
    for processor, count in present(given.only.split(","), counts):
        what = f"{processor.name} ({processor.blas}), threads: {count}"
        print(f"== {what}", flush=True)
        began = time.perf_counter()
        environment = os.environ | processor.environment(count)
        if subprocess.run(given.command, env=environment, check=False).returncode:
            failed.append(what)
        print(f"== {what}: {time.perf_counter() - began:.0f} s", flush=True)
    print("\n".join(f"failed: {what}" for what in failed), end="\n" if failed else "")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
