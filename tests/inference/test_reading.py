import sys

import numpy as np
import pandas as pd
import pytest

from tickwise.errors import DataError, MissingExtraError, MissingFileError
from tickwise.inference.reading import read_trajectories, write_npz
from tickwise.inference.trajectories import LabelledTrajectories

TABLE = """trajectory,tick,x,y,label
a,0,1,2,1
a,1,1.5,2.5,1
b,0,3,4,-1
"""


def same(a, b):
    np.testing.assert_array_equal(a.values, b.values)
    assert (a.lengths.tolist(), a.labels.tolist()) == (b.lengths.tolist(), b.labels.tolist())
    assert (a.variables, a.ids) == (b.variables, b.ids)


@pytest.fixture
def expected():
    return LabelledTrajectories.from_arrays([[[1, 2], [1.5, 2.5]], [[3, 4]]], [1, -1], ("x", "y"), ids=("a", "b"))


def test_csv(tmp_path, expected):
    file = tmp_path / "data.csv"
    file.write_text(TABLE)
    same(read_trajectories(file), expected)
    file.write_text("\ufeff" + TABLE.replace("\n", "\r\n"), encoding="utf-8")
    same(read_trajectories(str(file)), expected)


def test_interleaved_rows_and_moved_columns(tmp_path, expected):
    file = tmp_path / "data.csv"
    file.write_text("label,tick,x,y,trajectory\n1,0,1,2,a\n-1,0,3,4,b\n1,1,1.5,2.5,a\n")
    same(read_trajectories(file), expected)


def test_parquet(tmp_path, expected, monkeypatch):
    file = tmp_path / "data.parquet"
    (tmp_path / "data.csv").write_text(TABLE)
    pd.read_csv(tmp_path / "data.csv").to_parquet(file)
    same(read_trajectories(file), expected)
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(MissingExtraError, match=r"pip install tickwise\[parquet\]"):
        read_trajectories(file)


def test_npz_round_trip(tmp_path, expected):
    write_npz(tmp_path / "data.npz", expected)
    same(read_trajectories(tmp_path / "data.npz"), expected)
    with pytest.raises(DataError, match=r"does not end in \.npz"):
        write_npz(tmp_path / "data.txt", expected)


def test_npz_without_labels(tmp_path):
    file = tmp_path / "data.npz"
    np.savez(file, X=np.zeros((2, 3, 1)), names=["x"])
    with pytest.raises(DataError, match="has no array 'y'; it has X, names"):
        read_trajectories(file)
    assert read_trajectories(file, labelled=False).labels.tolist() == [1, 1]


def test_csv_without_labels(tmp_path):
    file = tmp_path / "data.csv"
    file.write_text("trajectory,tick,x\na,0,1\n")
    with pytest.raises(DataError, match="has no column 'label'"):
        read_trajectories(file)
    assert len(read_trajectories(file, labelled=False)) == 1


def test_pickles_are_never_loaded(tmp_path):
    file = tmp_path / "data.npz"
    np.savez(file, X=np.array([{"a": 1}], dtype=object), y=[1], names=["x"])
    with pytest.raises(DataError, match="not an npz file of plain arrays"):
        read_trajectories(file)
    file.write_bytes(b"nonsense")
    with pytest.raises(DataError, match="not an npz file"):
        read_trajectories(file)


def test_missing_and_unknown_files(tmp_path):
    with pytest.raises(MissingFileError, match="there is no file"):
        read_trajectories(tmp_path / "none.csv")
    (tmp_path / "data.txt").touch()
    with pytest.raises(DataError, match="convert it"):
        read_trajectories(tmp_path / "data.txt")
    (tmp_path / "data.parquet").write_text("nonsense")
    with pytest.raises(DataError, match="not a Parquet file"):
        read_trajectories(tmp_path / "data.parquet")


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        ("a,1,1.5", "a,2,1.5", r"line 3, column 'tick': 2 where trajectory 'a' needs 1"),
        ("b,0,3,4,-1", "b,0,3,4,2", r"line 4, column 'label': 2; use 1 or -1"),
        ("1.5,2.5,1", "1.5,2.5,-1", r"line 3, column 'label': -1; trajectory 'a' had 1 before"),
        ("1.5,2.5", "1.5,high", r"line 3, column 'y': 'high' is not a number"),
        ("1.5,2.5", "1.5,", r"line 3, column 'y': '' is not a number"),
        ("1.5,2.5", "1.5,nan", r"line 3, column 'y': nan is not finite"),
        ("a,0,1,2,1", "a,0,1,2", r"line 2: 4 fields for 5 columns"),
        ("trajectory,", "name,", r"has no column 'trajectory'"),
        ("x,y,", "x,x,", r"has two columns 'x'"),
    ],
)
def test_csv_errors_name_the_place(tmp_path, before, after, message):
    file = tmp_path / "data.csv"
    file.write_text(TABLE.replace(before, after, 1))
    with pytest.raises(DataError, match=message) as caught:
        read_trajectories(file)
    assert str(file) in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("text", ["", "trajectory,tick,x,label\n", "trajectory,tick,label\na,0,1\n"])
def test_csv_without_content(tmp_path, text):
    file = tmp_path / "data.csv"
    file.write_text(text)
    with pytest.raises(DataError, match=r"no (rows|column|variable column)"):
        read_trajectories(file)


def test_csv_of_bytes(tmp_path):
    file = tmp_path / "data.csv"
    file.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(DataError, match="not a CSV file in UTF-8"):
        read_trajectories(file)
