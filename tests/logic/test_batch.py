from __future__ import annotations

import math

import numpy as np
import pandas as pd
import pytest

from tickwise.errors import DataError, UnknownVariableError
from tickwise.logic.batch import as_batch

ONE = np.array([[1.0, 10.0], [2.0, 20.0], [3.0, 30.0]])
XY = ("x", "y")


def test_one_trajectory() -> None:
    batch = as_batch(ONE, XY)
    assert batch.single
    assert np.array_equal(batch.values, ONE[None])
    assert np.array_equal(batch.lengths, [3])


def test_columns_come_in_the_order_wanted() -> None:
    assert np.array_equal(as_batch(ONE, ("y",), variables=("x", "y")).values[0], ONE[:, 1:])
    assert np.array_equal(as_batch(ONE, ("y", "x"), variables=("x", "y")).values[0], ONE[:, ::-1])


def test_one_variable_may_come_flat() -> None:
    assert as_batch([1, 2, 3], ("x",)).values.shape == (1, 3, 1)
    assert as_batch(np.arange(3), ("x",), variables=("x",)).single
    assert as_batch([np.arange(3), np.arange(2)], ("x",)).values.shape == (2, 3, 1)


def test_a_batch() -> None:
    values = np.stack([ONE, ONE + 1])
    values[1, 2] = math.nan
    batch = as_batch(values, XY, lengths=np.array([3, 2], dtype=np.int32))
    assert not batch.single
    assert batch.lengths.dtype == np.int64
    assert np.array_equal(as_batch(values[:1], XY).lengths, [3])
    assert as_batch(values[:0], XY).values.shape == (0, 3, 2)


def test_a_list_is_padded() -> None:
    batch = as_batch([ONE, ONE[:1]], XY)
    assert np.array_equal(batch.lengths, [3, 1])
    assert np.array_equal(batch.values[0], ONE)
    assert np.isnan(batch.values[1, 1:]).all()
    assert as_batch([], XY).values.shape == (0, 1, 2)


def test_nested_lists_are_arrays() -> None:
    assert as_batch(ONE.tolist(), XY).single
    assert as_batch([ONE.tolist()], XY).values.shape == (1, 3, 2)


def test_data_frames_go_by_name() -> None:
    frame = pd.DataFrame({"label": ["a", "b", "c"], "y": ONE[:, 1], "x": ONE[:, 0]})
    assert np.array_equal(as_batch(frame, XY).values[0], ONE)
    assert as_batch([frame, frame[:2]], XY).lengths.tolist() == [3, 2]
    assert as_batch(frame, ()).values.shape == (1, 3, 0)
    renamed = as_batch(frame[["y", "x"]], XY, variables=("x", "y"))
    assert np.array_equal(renamed.values[0], ONE[:, ::-1])


def test_no_variables_wanted() -> None:
    assert as_batch(ONE, ()).values.shape == (1, 3, 0)


@pytest.mark.parametrize(
    ("X", "kwargs", "message"),
    [
        (
            ONE[:, :1],
            {},
            "the trajectory has 1 column(s), but the formula has the variables x, y; "
            "name the columns with variables=(...)",
        ),
        (
            ONE,
            {"variables": ("x", "y", "z")},
            "the trajectory has 2 column(s) but variables names 3; name each one",
        ),
        (ONE[:0], {}, "the trajectory is empty; it needs at least one state"),
        ([ONE, ONE[:0]], {}, "trajectory 1 is empty; it needs at least one state"),
        (ONE[None, :0], {}, "the trajectories are empty; each needs at least one state"),
        (
            ONE[:, 0],
            {},
            "the trajectory has shape (3,); give (ticks, variables), or (n, ticks, variables) for a batch",
        ),
        (
            [[[1, 2], [3, 4]], [[1, 2]]],
            {},
            "the data is ragged; give a list of (ticks, variables) arrays",
        ),
        (ONE, {"lengths": [3]}, "lengths go with an (n, ticks, variables) array; cut a single one instead"),
        (
            [ONE],
            {"lengths": [3]},
            "lengths go with an (n, ticks, variables) array; a list of arrays has its own",
        ),
        (ONE[None], {"lengths": [4]}, "lengths are from 4 to 4; they must be from 1 to 3 ticks"),
        (ONE[None], {"lengths": [0]}, "lengths are from 0 to 0; they must be from 1 to 3 ticks"),
        (ONE[None], {"lengths": [1.5]}, "lengths has shape (1,) and type float64; give 1 whole numbers"),
        (ONE[None], {"lengths": [1, 2]}, "lengths has shape (2,) and type int64; give 1 whole numbers"),
        (
            np.where(ONE == 20, math.nan, ONE),
            {},
            "the trajectory has NaN at tick 1 in 'y'; fill it, leave it out, or set its length",
        ),
        (
            np.stack([ONE, np.where(ONE == 20, math.nan, ONE)]),
            {"lengths": [3, 2]},
            "trajectory 1 has NaN at tick 1 in 'y'; fill it, leave it out, or set its length",
        ),
        (
            pd.DataFrame(ONE, columns=["x", "x"]),
            {},
            "the trajectory has two columns of the same name, 'x'; rename one",
        ),
    ],
)
def test_bad_data(X: object, kwargs: dict[str, object], message: str) -> None:
    with pytest.raises(DataError) as caught:
        as_batch(X, XY, **kwargs)  # type: ignore[arg-type]
    assert str(caught.value) == message


def test_text_is_not_numeric() -> None:
    with pytest.raises(DataError, match=r"^the data is not numeric \(.*\); give numbers only$"):
        as_batch([["a", "b"]], XY)
    frame = pd.DataFrame({"x": ["a"], "y": [1.0]})
    with pytest.raises(DataError, match=r"^column 'x' of the trajectory is not numeric \(.*\); give numbers only$"):
        as_batch(frame, XY)


@pytest.mark.parametrize("X", [ONE, [ONE], ONE[None]])
def test_an_unknown_variable_is_named_with_what_there_is(X: object) -> None:
    with pytest.raises(UnknownVariableError, match=r"the formula names 'z', which .* does not have; it has 'x', 'y'$"):
        as_batch(X, ("z",), variables=XY)  # type: ignore[arg-type]
    with pytest.raises(UnknownVariableError, match=r"it has 'a', 'b'$"):
        as_batch(pd.DataFrame(ONE, columns=["a", "b"]), XY)
