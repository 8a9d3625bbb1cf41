"""The C references: compiled when first asked for, and called in this process on the same arrays."""

from __future__ import annotations

import ctypes
import functools
import hashlib
import os
import shutil
import subprocess
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from benchmarks.contest import UnavailableError

SOURCES = Path(__file__).parent
BUILT = SOURCES.parent / "build" / "native"
# Fused multiply-adds would round differently from ours; without them results can be compared bit for bit.
FLAGS = ("-O3", "-march=native", "-ffp-contract=off", "-shared", "-fPIC")


@functools.cache
def library(name: str) -> ctypes.CDLL:
    """The functions of ``benchmarks/NAME.c``.

    Raises:
        UnavailableError: If there is no C compiler.
    """
    compiler = next(filter(None, map(shutil.which, (os.environ.get("CC", "gcc"), "cc"))), None)
    if compiler is None:
        raise UnavailableError("there is no C compiler; install gcc, or name one in CC")
    source = SOURCES / f"{name}.c"
    command = [compiler, *FLAGS, str(source), "-lm"]
    # by content, since a library once loaded is not loaded anew
    digest = hashlib.sha256(source.read_bytes() + " ".join(command).encode()).hexdigest()[:16]
    built = BUILT / f"{name}-{digest}.so"
    if not built.exists():
        BUILT.mkdir(parents=True, exist_ok=True)
        fresh = built.with_suffix(f".{os.getpid()}")
        subprocess.run([*command, "-o", str(fresh)], check=True)
        fresh.rename(built)
    return ctypes.CDLL(str(built))


def pointer(array: NDArray[Any]) -> ctypes.c_void_p:
    """Where an array's numbers lie; it has to be contiguous and to outlive the call."""
    if not array.flags.c_contiguous:
        raise ValueError("a C function is given contiguous arrays only")
    return ctypes.c_void_p(array.ctypes.data)


class Record(ctypes.Structure):
    """A C struct of sizes (``long``) and then of pointers, made of whole numbers and arrays."""

    def __init__(self, **values: Any) -> None:
        super().__init__(
            **{name: values[name] if isinstance(values[name], int) else pointer(values[name]) for name in values}
        )
        self.kept = values  # the arrays live as long as this does
