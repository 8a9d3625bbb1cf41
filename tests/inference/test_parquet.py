"""Parquet, by whole columns and by folders: what reading row by row and one file gives."""

from __future__ import annotations

import sys

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.inference.test_reading import same
from tickwise.errors import DataError, MissingExtraError, MissingFileError
from tickwise.inference.longform import LongTable
from tickwise.inference.parquet import _by_columns
from tickwise.inference.reading import read_parts, read_trajectories
from tickwise.inference.trajectories import LabelledTrajectories

pyarrow = pytest.importorskip("pyarrow")
ROWS = {
    "trajectory": ["b", "a", "b", "a", "c"],
    "tick": [0, 0, 1, 1, 0],
    "x": [1.0, 2.0, 3.0, 4.0, 5.0],
    "label": [1, -1, 1, -1, 1],
}


def by_rows(table):
    rows = LongTable("table", table.column_names, labelled=False)
    for number, row in enumerate(zip(*(column.to_pylist() for column in table.columns), strict=True), start=1):
        rows.add(row, f"row {number}")
    return rows.finish()


@st.composite
def tables(draw):
    names = draw(st.lists(st.sampled_from([*"abcde", " a", "b "]), min_size=1, max_size=12))
    labels = {name: draw(st.sampled_from([1, -1])) for name in names}
    columns = {
        "trajectory": names,
        "tick": [names[:row].count(name) for row, name in enumerate(names)],
        "x": draw(st.lists(st.floats(-5, 5), min_size=len(names), max_size=len(names))),
        "n": draw(st.lists(st.integers(-3, 3), min_size=len(names), max_size=len(names))),
        "label": [labels[name] for name in names],
    }
    for name in draw(st.sets(st.sampled_from(["tick", "x", "n", "label", "trajectory"]), max_size=2)):  # perhaps wrong
        row = draw(st.integers(0, len(names) - 1))
        columns[name] = [*columns[name][:row], draw(st.sampled_from([2, 0, -1, None])), *columns[name][row + 1 :]]
    columns["trajectory"] = [None if name is None else str(name) for name in columns["trajectory"]]
    table = pyarrow.table(columns)
    if draw(st.booleans()):  # as pandas stores categories; in another order than that of the rows
        words = pyarrow.array(["z", *sorted({name for name in columns["trajectory"] if name is not None})])
        codes = pyarrow.array(
            [None if n is None else words.to_pylist().index(n) for n in columns["trajectory"]], "int8"
        )
        table = table.set_column(0, "trajectory", pyarrow.DictionaryArray.from_arrays(codes, words))
    return table.drop_columns(["label"]) if draw(st.booleans()) else table


@settings(max_examples=300)
@given(table=tables())
def test_whole_columns_are_read_as_rows_are(table):
    quick = _by_columns(table.combine_chunks().column, table.column_names)
    try:
        expected = by_rows(table)
    except DataError:
        assert quick is None
    else:
        if quick is not None:  # what is unusual but right is left to the rows
            same(quick, expected)


def test_whole_columns_are_the_rule():
    table = pyarrow.table(ROWS)
    assert _by_columns(table.column, table.column_names).ids == ("b", "a", "c")
    for name in ("label", "x", "tick", "trajectory"):
        without = table.set_column(table.column_names.index(name), name, [[None] * 5])
        assert _by_columns(without.column, table.column_names) is None


def write(folder, *parts):
    folder.mkdir(exist_ok=True)
    for number, part in enumerate(parts):
        pd.DataFrame(part).to_parquet(folder / f"part-{number}.parquet")
    return folder


def renamed(letter):
    return ROWS | {"trajectory": [letter + name for name in ROWS["trajectory"]]}


def test_a_folder_is_its_files_one_after_the_other(tmp_path):
    folder = write(tmp_path / "logs", renamed("p"), renamed("q"), pd.DataFrame(renamed("r")).iloc[[0, 1, 4]])
    (folder / "notes.txt").write_text("not data")
    parts = read_parts(str(folder))
    read = list(parts)
    assert [part.ids for part in read] == [("pb", "pa", "pc"), ("qb", "qa", "qc"), ("rb", "ra", "rc")]
    for again, part, file in zip(parts, read, sorted(folder.glob("*.parquet")), strict=True):
        same(again, part)
        same(read_trajectories(file), part)
    whole = read_trajectories(folder)
    same(whole, LabelledTrajectories.joined(read))
    frames = [pd.read_parquet(file) for file in sorted(folder.glob("*.parquet"))]
    pd.concat(frames).to_parquet(tmp_path / "whole.parquet")
    same(read_trajectories(tmp_path / "whole.parquet"), whole)


def test_a_folder_without_labels(tmp_path):
    bare = {name: column for name, column in ROWS.items() if name != "label"}
    folder = write(tmp_path / "logs", bare)
    with pytest.raises(DataError, match="has no column 'label'"):
        read_trajectories(folder)
    assert read_trajectories(folder, labelled=False).labels.tolist() == [1, 1, 1]


@pytest.mark.parametrize(
    ("part", "message"),
    [
        (ROWS, r"trajectory 'b' of .*part-1\.parquet is in part-0\.parquet too; make the names unique"),
        (renamed("p") | {"y": range(5)}, r"part-1\.parquet has variables x, y where part-0\.parquet has x; use"),
        (renamed("p") | {"label": [1, -1, -1, -1, 1]}, r"part-1\.parquet, row 3, column 'label': -1; trajectory 'pb'"),
        (renamed("p") | {"label": [1, -1, 1, -1, 3]}, r"part-1\.parquet, row 5, column 'label': 3; use 1 or -1"),
        (renamed("p") | {"tick": [0, 0, 1, 2, 0]}, r"part-1\.parquet, row 4, column 'tick': 2 where trajectory"),
        (renamed("p") | {"x": [0, np.inf, 1, 2, 0]}, r"part-1\.parquet, row 2, column 'x': inf is not finite"),
        ({"trajectory": ["d"]}, r"part-1\.parquet has no column 'tick'; it has trajectory"),
    ],
)  # fmt: skip
def test_errors_name_the_file(tmp_path, part, message):
    folder = write(tmp_path / "logs", ROWS, part)
    with pytest.raises(DataError, match=message) as caught:
        read_trajectories(folder)
    assert "\n" not in str(caught.value)


def test_names_of_equal_hash_are_compared(tmp_path, monkeypatch):
    folder = write(tmp_path / "logs", ROWS, renamed("p"))
    monkeypatch.setattr("tickwise.inference.parquet.hash", lambda _: 0, raising=False)
    assert len(read_trajectories(folder)) == 6
    write(folder, ROWS, ROWS)
    with pytest.raises(DataError, match="is in part-0"):
        read_trajectories(folder)


def test_folders_that_are_none(tmp_path, monkeypatch):
    with pytest.raises(DataError, match=r"has no \.parquet file; give a file, or a folder of Parquet files"):
        read_trajectories(tmp_path)
    with pytest.raises(MissingFileError, match=r"there is no folder .*none; check the path"):
        read_parts(tmp_path / "none")
    folder = write(tmp_path / "logs", ROWS)
    (folder / "part-1.parquet").write_text("nonsense")
    with pytest.raises(DataError, match=r"part-1\.parquet is not a Parquet file"):
        read_trajectories(folder)
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(MissingExtraError, match=r"pip install tickwise\[parquet\]"):
        read_trajectories(folder)
