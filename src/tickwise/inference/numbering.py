"""A small hash table from codes to row numbers, for compiled loops: of many possible codes few are in use at once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tickwise._jit import njit


@njit
def place(keys: NDArray[np.int64], code: int) -> int:
    """Where a code is in a table whose length is a power of two, or the free place where it may go."""
    mixed = np.int64(code) * np.int64(0x5851F42D4C957F2D)
    at = int((mixed ^ (mixed >> 32)) & (len(keys) - 1))
    while keys[at] >= 0 and keys[at] != code:
        at = (at + 1) & (len(keys) - 1)
    return at


@njit
def roomier(least: int, codes: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """A table of codes and their numbers, with room for more than twice as many as ``least``."""
    room = 64
    while room < 4 * least:
        room *= 2
    keys, rows = np.full(room, -1, dtype=np.int64), np.empty(room, dtype=np.int64)
    for row in range(len(codes)):
        at = place(keys, codes[row])
        keys[at], rows[at] = codes[row], row
    return keys, rows
