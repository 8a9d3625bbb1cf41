import sys
import zipfile

import numpy as np
import pandas as pd
import pytest

from tickwise.errors import DataError, MissingExtraError, MissingFileError
from tickwise.inference.reading import read_trajectories, write_npz
from tickwise.inference.space import SearchSpace
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


def saved(**arrays):
    """Writes an archive of correct arrays, but for those given."""
    good = {"X": np.zeros((2, 3, 1)), "y": [1, -1], "names": ["x"]}
    return lambda file: np.savez(file, **(good | arrays))


def one_array(file):
    with file.open("wb") as stream:
        np.save(stream, np.zeros((2, 3, 1)))


def damaged(file):
    np.savez_compressed(file, X=np.arange(600.0).reshape(2, 300, 1), y=[1, -1], names=["x"])
    content = bytearray(file.read_bytes())
    content[200:260] = bytes(60)
    file.write_bytes(content)


def bytes_for_x(file):
    with zipfile.ZipFile(file, "w") as archive:
        for name in ("X", "y", "names"):
            archive.writestr(name, b"text")


SAVEZ = r"; write X, y and names with numpy\.savez$"


@pytest.mark.parametrize(
    ("write", "message"),
    [
        (lambda file: file.touch(), rf"not an npz file of plain arrays: .+{SAVEZ}"),
        (lambda file: file.write_bytes(b"PK\x03\x04 nonsense"), rf"not an npz file of plain arrays: .+{SAVEZ}"),
        (one_array, rf"not an npz file of plain arrays: it is one array alone{SAVEZ}"),
        (damaged, rf"not an npz file of plain arrays: .+{SAVEZ}"),
        (saved(X=np.array([{"a": 1}], dtype=object)), rf"arrays: Object arrays cannot be loaded .+{SAVEZ}"),
        (saved(y=np.array([1, -1], dtype=object)), rf"arrays: Object arrays cannot be loaded .+{SAVEZ}"),
        (bytes_for_x, r"'names' has shape \(\); use a list of texts"),
        (saved(X=1.0), r"values have shape \(\); use \(trajectories, ticks, variables\)"),
        (saved(X=np.zeros(2)), r"values have shape \(2,\); use \(trajectories"),
        (saved(X=np.zeros((2, 3))), r"values have shape \(2, 3\); use \(trajectories"),
        (saved(X=np.zeros((2, 3, 1, 1))), r"values have shape \(2, 3, 1, 1\); use \(trajectories"),
        (saved(X=np.zeros((2, 3, 1)) + 2j), r"the values are not real numbers of one shape; use a float array"),
        (saved(X=np.full((2, 3, 1), "1")), r"the values are not real numbers of one shape; use a float array"),
        (saved(y=np.array([1j, -1j])), r"the labels are not real numbers of one shape; use a float array"),
        (saved(y=1), r"labels have shape \(\) for 2 trajectories; give one label per trajectory"),
        (saved(y=[1, np.inf]), r"label inf of row 1 is not a whole number; use whole numbers"),
        (saved(lengths=3), r"lengths have shape \(\) for 2 trajectories; give one length per trajectory"),
        (saved(names="x"), r"'names' has shape \(\); use a list of texts"),
        (saved(names=[["x"]]), r"'names' has shape \(1, 1\); use a list of texts"),
        (saved(ids="a"), r"'ids' has shape \(\); use a list of texts"),
    ],
)
@pytest.mark.parametrize("labelled", [True, False])
def test_npz_errors_are_one_line(tmp_path, write, message, labelled):
    file = tmp_path / "data.npz"
    write(file)
    with pytest.raises(DataError, match=message) as caught:
        read_trajectories(file, labelled=labelled)
    assert str(file) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_trajectories_of_one_tick_hold_no_window(tmp_path):
    file = tmp_path / "data.npz"
    np.savez(file, X=np.zeros((2, 1, 1)), y=[1, -1], names=["x"])
    data = read_trajectories(file)
    with pytest.raises(DataError, match="every trajectory has a single tick; give trajectories of two ticks or more"):
        SearchSpace.from_data(data)
    assert SearchSpace.from_data(data, horizon=5).horizon == 5
