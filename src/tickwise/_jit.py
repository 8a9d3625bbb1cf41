"""The only place that imports numba: a compile decorator whose cache never makes an import fail."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numba

Function = TypeVar("Function", bound=Callable[..., Any])


def _ensure_writable_cache() -> None:
    """Point numba's cache at a temporary folder where neither the package folder nor HOME can be written."""
    if os.environ.get("NUMBA_CACHE_DIR") or numba.config.CACHE_DIR:
        return
    package = Path(__file__).parent / "__pycache__"
    if os.access(package if package.exists() else package.parent, os.W_OK):
        return
    user_cache = Path(os.environ.get("XDG_CACHE_HOME") or Path("~").expanduser())
    if os.access(user_cache, os.W_OK):
        return
    fallback = Path(tempfile.gettempdir()) / f"tickwise-numba-{os.getuid()}"
    fallback.mkdir(mode=0o700, exist_ok=True)
    numba.config.CACHE_DIR = str(fallback)


_ensure_writable_cache()


def njit(function: Function) -> Function:
    """Compile a function in nopython mode, without the interpreter lock, and cache the machine code.

    Args:
        function: A function over NumPy arrays and scalars.

    Returns:
        The compiled function; its plain form stays at ``.py_func``.
    """
    try:
        compiled = numba.njit(cache=True, nogil=True, error_model="numpy")(function)
    except RuntimeError:  # no locator for the cache: compile anew in every process
        compiled = numba.njit(nogil=True, error_model="numpy")(function)
    return compiled  # type: ignore[no-any-return]
