"""What makes results the same to the byte: the version and the code of Tickwise, and of what it computes with."""

from __future__ import annotations

import hashlib
import platform
from collections.abc import Mapping
from functools import cache
from importlib.metadata import version
from pathlib import Path


@cache
def identity() -> dict[str, str]:
    """Names of programs, and the version of each on this machine; imports nothing that is heavy."""
    return {
        "Python": ".".join(platform.python_version_tuple()[:2]),
        **{name: version(name) for name in ("tickwise", "numpy", "numba")},
        "the code of tickwise": _digest(),
    }


def difference(theirs: Mapping[str, str], ours: Mapping[str, str]) -> str | None:
    """The first thing in which another machine differs from this one, in words; None if there is nothing."""
    for name, wanted in ours.items():
        found = theirs.get(name)
        if found != wanted:
            return f"{name} {found} instead of {wanted}"
    return None


def _digest() -> str:
    """What tells the source code of Tickwise from any other: a version under development stays the same for long."""
    root = Path(__file__).parents[1]
    digest = hashlib.sha256()
    for path in sorted(root.rglob("*.py")):
        digest.update(f"{path.relative_to(root).as_posix()}\n".encode() + path.read_bytes())
    return digest.hexdigest()[:12]
