"""Plain data and arrays as the bytes of files: the same content has the same bytes, and nothing in them can run."""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tickwise._wording import reason

_EPOCH = (1980, 1, 1, 0, 0, 0)


def json_bytes(content: Any) -> bytes:
    """Plain data as the JSON of a file."""
    return (json.dumps(content, indent=1, ensure_ascii=False) + "\n").encode()


def npz_bytes(arrays: Mapping[str, NDArray[Any]]) -> bytes:
    """An npz file whose bytes depend on the arrays alone: NumPy's own carries the time of writing."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED, compresslevel=3) as archive:
        for name, array in sorted(arrays.items()):
            entry = io.BytesIO()
            np.lib.format.write_array(entry, np.asanyarray(array), allow_pickle=False)
            info = zipfile.ZipInfo(f"{name}.npy", _EPOCH)
            info.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(info, entry.getvalue())
    return buffer.getvalue()


def npz_arrays(content: bytes, names: Iterable[str] | None = None) -> dict[str, NDArray[Any]]:
    """The arrays of an npz file.

    Args:
        content: The bytes of the file.
        names: Those that are wanted; None for all.

    Raises:
        ValueError: If it is no npz file, or lacks one of them.
    """
    try:
        with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
            return {name: arrays[name] for name in (arrays.files if names is None else names)}
    except Exception as error:  # a damaged archive fails in a dozen ways: what is in it has lengths and code of its own
        raise ValueError(reason(error)) from error
