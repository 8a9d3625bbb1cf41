import numpy as np
import pytest

from tickwise.errors import DataError
from tickwise.inference.trajectories import LabelledTrajectories


def three():
    return LabelledTrajectories.from_arrays(
        [[[1.0, 2.0]], [[3.0, 4.0], [5.0, 6.0]], [[7.0, 8.0], [9.0, 0.0]]], [1, -1, 1], ("x", "y"), ids=("a", "b", "c")
    )


def test_a_ragged_list_is_padded_with_nan():
    data = three()
    assert data.values.shape == (3, 2, 2)
    assert np.isnan(data.values[0, 1]).all()
    assert data.lengths.tolist() == [1, 2, 2]
    assert (len(data), data.positives, data.negatives, data.horizon) == (3, 2, 1, 1)


def test_values_are_copied_and_frozen():
    source = np.zeros((2, 3, 1))
    data = LabelledTrajectories.from_arrays(source, [1, -1])
    source[:] = 7
    assert (data.values == 0).all()
    assert data.variables == ("x0",)
    with pytest.raises(ValueError, match="read-only"):
        data.values[0, 0, 0] = 1


def test_numbers_past_the_length_do_not_matter():
    X = np.array([[[1.0], [np.inf]], [[1.0], [2.0]]])
    data = LabelledTrajectories.from_arrays(X, [1, -1], lengths=[1, 2])
    assert np.isnan(data.values[0, 1, 0])


def test_select_and_drop_last():
    data = three()
    assert data.select(data.labels == 1).ids == ("a", "c")
    shorter = data.drop_last(np.array([False, True, True]))
    assert shorter.lengths.tolist() == [1, 1, 1]
    assert np.isnan(shorter.values[1, 1]).all()
    with pytest.raises(DataError, match="'a' has length 0"):
        data.drop_last(np.array([True, False, False]))


@pytest.mark.parametrize(
    ("X", "y", "more", "message"),
    [
        ([[[1.0], [np.nan]]], [1], {}, r"trajectory '0', tick 1, variable 'x0' is nan"),
        ([[[1.0]], [[np.inf]]], [1, -1], {"variables": ["v"]}, r"trajectory '1', tick 0, variable 'v' is inf"),
        ([[[1.0]]], [0], {}, r"trajectory '0' has label 0; use 1 or -1"),
        ([[[1.0]]], [0.5], {}, r"label 0.5 of row 0 is not a whole number"),
        ([[[1.0]]], [np.nan], {}, r"label nan of row 0 is not a whole number"),
        ([], [], {}, r"there is no trajectory"),
        (np.zeros((0, 3, 2)), [], {}, r"at least one trajectory"),
        (np.zeros((2, 0, 1)), [1, 1], {}, r"at least one trajectory"),
        ([np.zeros((0, 1)), np.zeros((2, 1))], [1, -1], {}, r"trajectory '0' has length 0"),
        (np.zeros((2, 3)), [1, -1], {}, r"use \(trajectories, ticks, variables\)"),
        (np.zeros((2, 3, 1)), [1], {}, r"labels have shape \(1,\) for 2 trajectories"),
        (np.zeros((2, 3, 1)), [1, -1], {"lengths": [3, 4]}, r"trajectory '1' has length 4; use 1 to 3"),
        (np.zeros((2, 3, 2)), [1, -1], {"variables": ["x", "x"]}, r"variable 'x' occurs twice"),
        (np.zeros((2, 3, 2)), [1, -1], {"variables": ["x"]}, r"2 columns of values but 1 variable"),
        (np.zeros((2, 3, 1)), [1, -1], {"ids": ["k", "k"]}, r"trajectory id 'k' occurs twice"),
        (np.zeros((2, 3, 1)), [1, -1], {"ids": ["k"]}, r"2 trajectories but 1 ids"),
        ([np.zeros((2, 1)), np.zeros((2, 2))], [1, -1], {}, r"trajectory 1 has shape \(2, 2\)"),
        ([["a"]], [1], {}, r"are not real numbers"),
        ([np.zeros((2, 1))], [1], {"lengths": [3]}, r"leave lengths out"),
    ],
)
def test_wrong_data_is_named_in_one_line(X, y, more, message):
    with pytest.raises(DataError, match=message) as caught:
        LabelledTrajectories.from_arrays(X, y, **more)
    assert "\n" not in str(caught.value)


def test_both_classes():
    data = three()
    assert data.require_both_classes() is data
    with pytest.raises(DataError, match="no trajectory has label -1"):
        data.select(data.labels == 1).require_both_classes()
