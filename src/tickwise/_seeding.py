"""One tree of seeds: a root seed and a path of names give an independent, reproducible stream."""

from __future__ import annotations

import hashlib
import json

import numpy as np


def seed_sequence(seed: int, *path: str | int) -> np.random.SeedSequence:
    """The seed at a place in the tree, the same whatever else was drawn before and in whatever order.

    Args:
        seed: The root seed, at least 0.
        *path: Names and numbers from the root to the place, such as ``"case1", "learn", "III", 4``.

    Returns:
        A seed sequence that no other path shares (short of a collision of SHA-256).
    """
    digest = hashlib.sha256(json.dumps(path).encode()).digest()
    key = np.frombuffer(digest, dtype="<u4").tolist()
    return np.random.SeedSequence(entropy=seed, spawn_key=tuple(key))


def generator(seed: int, *path: str | int) -> np.random.Generator:
    """A NumPy generator (PCG64) at a place in the seed tree; see `seed_sequence`."""
    return np.random.default_rng(seed_sequence(seed, *path))
