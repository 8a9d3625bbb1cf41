"""Arrays that cannot be written to."""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

Scalar = TypeVar("Scalar", bound=np.generic)


def frozen_array(values: Any, dtype: type[np.generic]) -> NDArray[Any]:
    """A contiguous copy of an array that cannot be written to, so that a frozen value stays what it is."""
    return read_only(np.array(values, dtype=dtype, order="C"))


def read_only(array: NDArray[Scalar]) -> NDArray[Scalar]:
    """A view of an array that cannot be written to.

    A function is compiled once for arrays that can be written to and once more for those that cannot. Frozen ones can
    be again after a journey to another process. So a function that is given either had better get such views.

    Args:
        array: An array.

    Returns:
        A view of the same shape.
    """
    view = array.view()
    view.flags.writeable = False
    return view
