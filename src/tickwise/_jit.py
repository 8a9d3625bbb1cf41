"""The only place that imports numba: a compile decorator whose cache never makes an import fail."""

from __future__ import annotations

import os
import stat
import tempfile
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Any, TypeVar

import numba
from numba.cpython.unsafe.numbers import trailing_zeros as _trailing_zeros

__all__ = ["cache_folder", "njit", "threading_layers", "trailing_zeros"]

trailing_zeros: Any = _trailing_zeros  # how many bits below the lowest set one; in compiled code only

Function = TypeVar("Function", bound=Callable[..., Any])


def _ensure_writable_cache() -> None:
    """Point numba's cache at a temporary folder where neither the package folder nor HOME can be written."""
    config: Any = numba.config
    if os.environ.get("NUMBA_CACHE_DIR") or config.CACHE_DIR:
        return
    package = Path(__file__).parent / "__pycache__"
    user_cache = Path(os.environ.get("XDG_CACHE_HOME") or Path("~").expanduser())
    for folder in (package if package.exists() else package.parent, user_cache):
        if os.access(folder, os.W_OK):
            return
    try:
        config.CACHE_DIR = str(_private_temporary_folder())
    except OSError:  # nothing can be written at all: compile without a cache
        return


def _private_temporary_folder() -> Path:
    """A folder that only this user can write: what lies in a cache of machine code is run."""
    if not hasattr(os, "getuid"):
        return Path(tempfile.mkdtemp(prefix="tickwise-numba-"))
    folder = Path(tempfile.gettempdir()) / f"tickwise-numba-{os.getuid()}"
    folder.mkdir(mode=0o700, exist_ok=True)
    found = folder.lstat()
    if stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid() and not found.st_mode & 0o022:
        return folder
    return Path(tempfile.mkdtemp(prefix="tickwise-numba-"))


_ensure_writable_cache()


def njit(function: Function) -> Function:
    """Compile a function in nopython mode, without the interpreter lock, and cache the machine code.

    Args:
        function: A function over NumPy arrays and scalars.

    Returns:
        The compiled function; its plain form stays at ``.py_func``.
    """
    options: dict[str, Any] = {"nogil": True, "error_model": "numpy"}
    try:
        compiled: Any = numba.njit(cache=True, **options)(function)
    except RuntimeError:  # no place for the cache: compile anew in every process
        compiled = numba.njit(**options)(function)
    return compiled  # type: ignore[no-any-return]


def _nothing() -> None:
    """Compiled by no one; where its code would be kept is where that of this package is."""


def cache_folder() -> Path | None:
    """Where compiled code is kept between runs; None where no folder can be written."""
    path = getattr(getattr(njit(_nothing), "_cache", None), "cache_path", None)
    return None if path is None else Path(path)


def threading_layers() -> tuple[str, ...]:
    """The layers for loops that numba itself runs in parallel; this package's kernels run in Python's threads."""
    pools = {"tbb": "tbbpool", "omp": "omppool", "workqueue": "workqueue"}
    return tuple(name for name, pool in pools.items() if find_spec(f"numba.np.ufunc.{pool}") is not None)
