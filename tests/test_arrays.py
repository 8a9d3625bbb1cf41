"""Tests of arrays that cannot be written to."""

from __future__ import annotations

import numpy as np
import pytest

from tickwise._arrays import frozen_array, read_only


def test_a_frozen_array_is_a_copy_that_stays_what_it_is():
    given = np.arange(6.0).reshape(2, 3).T
    frozen = frozen_array(given, np.int64)
    given[0, 0] = 7
    assert frozen.tolist() == [[0, 3], [1, 4], [2, 5]]
    assert frozen.dtype == np.int64
    assert frozen.flags.c_contiguous
    with pytest.raises(ValueError, match="read-only"):
        frozen[0, 0] = 1


def test_a_read_only_view_follows_what_it_is_a_view_of():
    given = np.zeros((2, 3))
    view = read_only(given)
    with pytest.raises(ValueError, match="read-only"):
        view[0, 0] = 1
    given[0, 0] = 2
    assert view[0, 0] == 2
    assert np.shares_memory(given, view)
    assert read_only(view).base is not None
