"""Whatever is given, a person gets one line that names the culprit and the remedy: no traceback, no silence.

Each case goes through the Python interface and, where it can be typed, through the command line.
"""

from __future__ import annotations

import json
import os
import re
import signal
import struct
import subprocess
import sys
import time
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tickwise as tw
from tests.test_cli import PLAIN, ROOT, Tickwise, answer_of, process
from tickwise.automata.interchange import from_json, to_json
from tickwise.errors import TickwiseError
from tickwise.experiments.case_studies import find_study
from tickwise.experiments.effect_catalog import find_effect
from tickwise.inference.exact import ExactSettings
from tickwise.inference.reading import read_parts, read_trajectories, write_npz
from tickwise.inference.swarm import SwarmSettings
from tickwise.logic.syntax import Interval

FORMULA = "F[0,2] (x >= 3)"
TABLE = "trajectory,tick,x,label\na,0,1,1\na,1,4,1\nb,0,2,-1\nb,1,2,-1\n"


# ---------------------------------------------------------------- formulas

FORMULAS = {
    "empty": ("", "expected a predicate such as x >= 3"),
    "a word": ("hello", "expected a comparison sign such as >="),
    "cut off": ("F[0,2] (x >= ", "found the end of the text, expected a number"),
    "a bracket too few": ("F[0,2] (x >= 3", r"closing the '\(' of line 1, column 8"),
    "a bracket too many": ("F[0,2] (x >= 3))", r"found '\)'.*there is no '\(' before it"),
    "no interval": ("F (x >= 3)", "an interval such as \\[0,5\\]"),
    "half an interval": ("F[2] (x >= 3)", "expected ','"),
    "a reversed interval": ("F[5,2] (x >= 3)", r"interval \[5,2\] is reversed; write \[2,5\]"),
    "a negative time": ("F[-1,2] (x >= 3)", "the interval bound -1 is before tick 0; use 0 or more"),
    "half a tick": ("F[0,1.5] (x >= 3)", "1.5 is not a whole number of ticks; round it"),
    "endless time": ("F[0,inf] (x >= 3)", "expected a whole number of ticks"),
    "time without measure": (f"F[0,{'9' * 6000}] (x >= 3)", "is too large; use 2147483646 at the most"),
    "a number too large": ("F[0,2] (x >= 1e999)", "the number 1e999 is too large"),
    "a number that is none": ("F[0,2] (x >= nan)", "expected a number"),
    "an empty range": ("F[0,2] (4 <= x <= 3)", "the range of 'x' is empty: 4 > 3; swap the bounds"),
    "a range of two directions": ("F[0,2] (4 <= x >= 3)", "do not make a range; write one such as 3 <= x <= 4"),
    "a foreign operator": ("U[0,2] (x >= 3)", "found '\\['"),
    "a sign of another encoding": ("F[0,2] (x >= 3)\udcff", "found '\\\\udcff', expected &"),
    "nested without end": ("!" * 300 + "(x >= 3)", "nested more than 100 deep; write it flatter"),
}


@pytest.mark.parametrize("name", FORMULAS)
def test_formulas(tickwise: Tickwise, name: str):
    text, message = FORMULAS[name]
    with pytest.raises(TickwiseError, match=message) as caught:
        tw.parse(text)
    summary, *shown = str(caught.value).splitlines()
    assert len(summary) < 300
    assert len(shown) == 2  # the line, and the caret below the place
    assert (
        tickwise.fails("compare", FORMULA, text).splitlines()[0] == summary.encode("utf-8", "backslashreplace").decode()
    )


NORMAL_FORMS = {
    "no time": ("x >= 3", r"stands outside every temporal operator; say when .* for instance F\[0,0\] \(x >= 3\)"),
    "a constant": ("F[0,2] true", "the constant true has no place in a normal form of primitives; leave it out"),
    "windows that overlap": ("F[0,9] (x >= 3) & F[0,9] (y >= 3)", "make the later window start at 10 or after"),
    "three alternations": ("F[0,2] G[0,2] F[0,2] (x >= 3)", "alternate three times; use F, G, F G or G F"),
    "boxes that exclude each other": ("G[0,2] (x > 3 & x < 1)", "exclude each other; make the regions overlap"),
}


@pytest.mark.parametrize("name", NORMAL_FORMS)
def test_formulas_without_a_normal_form(tickwise: Tickwise, name: str):
    text, message = NORMAL_FORMS[name]
    with pytest.raises(TickwiseError, match=message) as caught:
        tw.timed_automata(tw.parse(text))
    assert "\n" not in str(caught.value)
    assert tickwise.fails("automaton", text) == str(caught.value)


# ---------------------------------------------------------------- data files


def table(*changes: tuple[str, str], content: str = TABLE) -> Callable[[Path], Path]:
    """A CSV file that is right but for something."""

    def write(folder: Path) -> Path:
        text = content
        for before, after in changes:
            assert before in text
            text = text.replace(before, after, 1)
        path = folder / "logs.csv"
        path.write_bytes(text.encode("utf-8", "surrogateescape"))
        return path

    return write


def archive(**arrays: Any) -> Callable[[Path], Path]:
    """An NPZ file that is right but for something; an array that is None is left out."""

    def write(folder: Path) -> Path:
        path = folder / "logs.npz"
        good: dict[str, Any] = {"X": np.zeros((2, 3, 1)), "y": [1, -1], "names": ["x"]}
        np.savez(path, **{name: array for name, array in (good | arrays).items() if array is not None})
        return path

    return write


def raw(name: str, content: bytes) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        (folder / name).write_bytes(content)
        return folder / name

    return write


def truncated(folder: Path) -> Path:
    path = archive()(folder)
    path.write_bytes(path.read_bytes()[:-100])
    return path


def a_shape_beyond_all_memory(folder: Path) -> Path:
    """An array whose header tells of 30 TiB, though a few bytes follow."""
    path = archive()(folder)
    header = b"{'descr': '<f8', 'fortran_order': False, 'shape': (2, 1000000, 2000000), }".ljust(117) + b"\n"
    entry = b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header + bytes(8)
    with zipfile.ZipFile(path, "w") as stored:
        stored.writestr("X.npy", entry)
    return path


def parquet(name: str, **columns: list[Any]) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        pyarrow = pytest.importorskip("pyarrow")
        pytest.importorskip("pyarrow.parquet")
        good = {"trajectory": ["a", "b"], "tick": [0, 0], "x": [1.0, 2.0], "label": [1, -1]}
        pyarrow.parquet.write_table(pyarrow.table(good | columns), folder / name)
        return folder / name

    return write


def parts_that_differ(folder: Path) -> Path:
    parquet("1.parquet")(folder)
    pyarrow = pytest.importorskip("pyarrow")
    other = {"trajectory": ["c"], "tick": [0], "z": [1.0], "label": [1]}
    pyarrow.parquet.write_table(pyarrow.table(other), folder / "2.parquet")
    return folder


def parts_that_share(folder: Path) -> Path:
    parquet("1.parquet")(folder)
    parquet("2.parquet")(folder)
    return folder


def a_folder(folder: Path) -> Path:
    (folder / "notes.txt").write_text("nothing here")
    return folder


def a_pipe(folder: Path) -> Path:
    path = folder / "logs.csv"
    os.mkfifo(path)
    return path


FILES: dict[str, tuple[Callable[[Path], Path], str]] = {
    # what is there at all
    "a missing file": (lambda folder: folder / "none.csv", "there is no file .*none.csv; check the path"),
    "a name that is too long": (
        lambda folder: folder / ("x" * 300 + ".csv"),
        "cannot read .*: File name too long; check",
    ),
    "a folder without data": (a_folder, "has no .parquet file; give a file, or a folder of Parquet files"),
    "a pipe": (a_pipe, "is neither a file nor a folder; copy what it gives to a file"),
    "another ending": (raw("logs.xlsx", b"PK"), "is not a .csv, .parquet or .npz file; convert it to one of these"),
    "no ending": (raw("logs", TABLE.encode()), "is not a .csv, .parquet or .npz file; convert it"),
    # tables as a whole
    "an empty file": (raw("logs.csv", b""), "has no column 'trajectory'; it has no header"),
    "only a header": (table(content="trajectory,tick,x,label\n"), "has no rows; give at least one trajectory"),
    "no header": (table(("trajectory,tick,x,label\n", "")), "has no column 'trajectory'; it has a, 0, 1, 1"),
    "no labels": (table(content="trajectory,tick,x\na,0,1\n"), "has no column 'label'; it has trajectory, tick, x"),
    "no variable": (table(content="trajectory,tick,label\na,0,1\n"), "has no variable column beside .*; add one"),
    "two columns of one name": (table(content="trajectory,tick,x,x,label\na,0,1,1,1\n"), "two columns 'x'; rename one"),
    "another separator": (table(content=TABLE.replace(",", ";")), "has no column 'trajectory'; it has trajectory;tick"),
    "a thousand columns": (
        table(content=",".join(f"v{i}" for i in range(1000)) + "\n"),
        "has no column 'trajectory'; it has v0, v1, .* and 988 more",
    ),
    "bad UTF-8": (raw("logs.csv", TABLE.encode() + b"\xff,0,1,1\n"), "not a CSV file in UTF-8: .*; save it as UTF-8"),
    "UTF-16": (raw("logs.csv", TABLE.encode("utf-16")), "not a CSV file in UTF-8: .*; save it as UTF-8"),
    "a huge field": (
        table(("b,0,2", f"b,0,{'9' * 200_000}")),
        r"not a CSV file, at line 4: field larger than field limit \(131072\); check the quotes",
    ),
    "a quote that is never closed": (table(("b,0", '"b,0')), "line 5: 1 fields for 4 columns; fix the row"),
    # rows and cells
    "a short row": (table(("a,1,4,1", "a,1,4")), "line 3: 3 fields for 4 columns; fix the row"),
    "a long row": (table(("a,1,4,1", "a,1,4,1,1")), "line 3: 5 fields for 4 columns; fix the row"),
    "a word for a number": (table(("a,1,4", "a,1,high")), "line 3, column 'x': 'high' is not a number; fix it"),
    "an empty cell": (table(("a,1,4", "a,1,")), "line 3, column 'x': '' is not a number; fix it"),
    "a comma in a number": (table(("a,1,4", 'a,1,"4,5"')), "line 3, column 'x': '4,5' is not a number; fix it"),
    "a NUL byte": (table(("a,1,4", "a,1,4\0")), r"line 3, column 'x': '4\\x00' is not a number; fix it"),
    "NaN": (table(("a,1,4", "a,1,nan")), "line 3, column 'x': nan is not finite; fill it in"),
    "infinity": (table(("a,1,4", "a,1,-inf")), "line 3, column 'x': -inf is not finite; fill it in"),
    "a number beyond all floats": (table(("a,1,4", "a,1,1e999")), "column 'x': inf is not finite; fill it in"),
    "a line break in a cell": (table(("a,1,4", 'a,1,"4\n5"')), r"line 4, column 'x': '4\\n5' is not a number"),
    "a gap in time": (table(("a,1,4", "a,2,4")), "column 'tick': 2 where trajectory 'a' needs 1; ticks go 0, 1, 2"),
    "time backwards": (table(("a,0,1", "a,1,1")), "column 'tick': 1 where trajectory 'a' needs 0; ticks go 0, 1, 2"),
    "the same tick twice": (table(("a,1,4", "a,0,4")), "column 'tick': 0 where trajectory 'a' needs 1"),
    "a negative tick": (table(("a,0,1", "a,-1,1")), "column 'tick': -1 where trajectory 'a' needs 0"),
    "half a tick": (table(("a,1,4", "a,0.5,4")), "column 'tick': 0.5 where trajectory 'a' needs 1"),
    "dates for ticks": (table(("a,0,1", "a,2024-01-01,1")), "column 'tick': '2024-01-01' is not a number"),
    "label 0": (table(("a,0,1,1", "a,0,1,0")), "line 2, column 'label': 0; use 1 or -1"),
    "a word for a label": (table(("a,0,1,1", "a,0,1,good")), "column 'label': 'good' is not a number; fix it"),
    "a label that changes": (table(("a,1,4,1", "a,1,4,-1")), "-1; trajectory 'a' had 1 before; use one label"),
    # archives
    "no archive": (raw("logs.npz", b"nonsense"), "is not an npz file of plain arrays: .*; write X, y and names with"),
    "an empty archive": (raw("logs.npz", b""), "is not an npz file of plain arrays: .*; write X, y and names with"),
    "a truncated archive": (truncated, "is not an npz file of plain arrays: .*; write X, y and names with numpy.savez"),
    "a pickle in the archive": (archive(y=np.array([1, "a"], dtype=object)), "Object arrays cannot be loaded"),
    "more than all memory": (a_shape_beyond_all_memory, "is not an npz file of plain arrays: .*; write X, y and names"),
    "no states": (archive(X=None), "has no array 'X'; it has y, names"),
    "no labels in the archive": (archive(y=None), "has no array 'y'; it has X, names"),
    "no names": (archive(names=None), "has no array 'names'; it has X, y"),
    "states in two dimensions": (
        archive(X=np.zeros((2, 3))),
        r"shape \(2, 3\); use \(trajectories, ticks, variables\)",
    ),
    "no trajectory": (archive(X=np.zeros((0, 3, 1)), y=[]), "give at least one trajectory of at least one tick"),
    "texts for states": (
        archive(X=np.full((2, 3, 1), "1")),
        "the values are not real numbers of one shape; use a float",
    ),
    "complex states": (
        archive(X=np.zeros((2, 3, 1)) + 1j),
        "the values are not real numbers of one shape; use a float",
    ),
    "dates for states": (archive(X=np.zeros((2, 3, 1), "M8[s]")), "the values are not real numbers of one shape"),
    "NaN in the states": (archive(X=np.full((2, 3, 1), np.nan)), "'0', tick 0, variable 'x' is nan; fill it in, or"),
    "a name too few": (archive(X=np.zeros((2, 3, 2))), "2 columns of values but 1 variable names; name every column"),
    "names that are numbers with a point": (archive(names=[1.5]), "'names' has type float64, .*; use a list of texts"),
    "a label too few": (archive(y=[1]), r"labels have shape \(1,\) for 2 trajectories; give one label per trajectory"),
    "label 2": (archive(y=[1, 2]), "trajectory '1' has label 2; use 1 or -1"),
    "half a label": (archive(y=[1, 0.5]), "label 0.5 of row 1 is not a whole number; use whole numbers"),
    "a label beyond all": (archive(y=[1, 1e300]), "trajectory '1' has label .*; use 1 or -1"),
    "a length beyond the end": (archive(lengths=[3, 4]), "trajectory '1' has length 4; use 1 to 3 states"),
    "length 0": (archive(lengths=[3, 0]), "trajectory '1' has length 0; use 1 to 3 states"),
    "two of one id": (archive(ids=["a", "a"]), "trajectory id 'a' occurs twice; make the names unique"),
    # Parquet
    "no Parquet": (raw("logs.parquet", b"nonsense"), "is not a Parquet file of plain columns: .*; write it anew"),
    "nothing in a cell": (parquet("logs.parquet", x=[1.0, None]), "row 2, column 'x': None is not a number; fix it"),
    "lists in a column": (parquet("logs.parquet", x=[[1.0], [2.0]]), "is not a|is not a number"),
    "files that differ": (parts_that_differ, "has variables z where 1.parquet has x; use the same in all files"),
    "files that share": (parts_that_share, "trajectory 'a' of .* is in 1.parquet too; make the names unique"),
}


@pytest.mark.parametrize("name", FILES)
def test_data_files(tickwise: Tickwise, tmp_path: Path, name: str):
    make, message = FILES[name]
    path = make(tmp_path)
    with pytest.raises(TickwiseError, match=message) as caught:
        read_trajectories(path)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) - len(str(path)) < 400
    assert tickwise.fails("infer", path) == str(caught.value)


ARGUMENTS: dict[str, tuple[Callable[[Path], tuple[object, ...]], str]] = {
    "one class only": (
        lambda folder: ("infer", table(content=TABLE.replace("-1", "1"))(folder)),
        "no trajectory has label -1; give trajectories of both labels, 1 and -1",
    ),
    "trajectories of a single tick": (
        lambda folder: ("infer", archive(X=np.zeros((2, 1, 1)))(folder)),
        "every trajectory has a single tick; give trajectories of two ticks or more",
    ),
    "an unknown variable": (
        lambda folder: ("check", "F[0,2] (z >= 3)", table()(folder)),
        "the formula names 'z', which the batch does not have; it has 'x'",
    ),
    "an unknown search": (
        lambda folder: ("infer", table()(folder), "--search", "luck"),
        "search is 'luck'; use 'exact', 'joint', 'swarm'",
    ),
    "a rate above 1": (
        lambda folder: ("infer", table()(folder), "--rate", "1.5"),
        "rate is 1.5; use a number above 0 and at most 1",
    ),
    "a rate that is none": (
        lambda folder: ("infer", table()(folder), "--rate", "nan"),
        "rate is nan; use a number above 0 and at most 1",
    ),
    "an endless weight": (
        lambda folder: ("infer", table()(folder), "--information-weight", "inf"),
        "information_weight is inf; use 0 or more",
    ),
    "an unknown class weight": (
        lambda folder: ("infer", table()(folder), "--class-weight", "heavy"),
        "class_weight is 'heavy'; use None, 'balanced' or a mapping",
    ),
    "no time to search": (
        lambda folder: ("infer", table()(folder), "--seconds", "-1"),
        "exact setting seconds is -1.0; use a number above 0, or None",
    ),
    "an unknown case study": (
        lambda folder: ("reproduce", "case7", "--out", folder / "run"),
        "there is no study 'case7'; choose case1, case2, or a random pair such as pair-07",
    ),
    "an unknown protocol": (
        lambda folder: ("reproduce", "case1", "--protocol", "best", "--out", folder / "run"),
        "there is no protocol 'best'; choose paper or full",
    ),
    "an unknown setting": (
        lambda folder: ("effect", "gamma", "--out", folder / "run"),
        "there is no effect 'gamma'; choose trajectories, ",
    ),
    "an unknown format": (
        lambda _: ("automaton", FORMULA, "--format", "pdf"),
        "there is no format 'pdf'; use one of dot, ",
    ),
    "an automaton too large": (
        lambda _: ("automaton", f"F[0,{2**31 - 1}] (x >= 3)"),
        "the interval bound 2147483647 is too large; use 2147483646 at the most",
    ),
    "a report of nothing": (lambda folder: ("report", folder / "none"), "there is no|holds no run"),
    "a report of a folder without a run": (lambda folder: ("report", a_folder(folder)), "holds no run"),
    "a report of a file": (lambda folder: ("report", table()(folder)), "cannot read|holds no run|Not a directory"),
    "a configuration that is no JSON": (
        lambda folder: ("report", raw("config.json", b"{")(folder).parent),
        "config.json holds no configuration of a run; choose another folder, or remove this one",
    ),
    "a run folder with other files": (
        lambda folder: ("reproduce", "case1", "--out", a_folder(folder)),
        "holds files but no run .*; choose an empty folder with --out",
    ),
    "a run of another configuration": (
        lambda folder: ("reproduce", "case1", "--out", raw("config.json", b'{"format": 2}')(folder).parent),
        "holds a run of another configuration .*; choose another folder with --out, or remove this one",
    ),
    "an output below a file": (
        lambda folder: ("reproduce", "case1", "--out", table()(folder) / "run"),
        "(Not a directory|cannot write).*; (check|make|choose)",
    ),
}


@pytest.mark.parametrize("name", ARGUMENTS)
def test_arguments(tickwise: Tickwise, tmp_path: Path, name: str):
    make, message = ARGUMENTS[name]
    line = tickwise.fails(*make(tmp_path))
    summary = line.splitlines()[0]
    assert re.search(message, summary), line
    assert len(summary) - len(str(tmp_path)) < 400
    # and as one document for programs
    arguments = make(tmp_path)
    if arguments[0] in ("infer", "check"):
        answer = tickwise(*arguments, "--json")
        assert (answer.status, answer.document) == (1, {"error": line})


USAGE = {
    "no command of that name": (("chekc",), "No such command"),
    "no option of that name": (("infer", "logs.csv", "--sise", "4"), "No such option"),
    "an argument too few": (("check", FORMULA), "Missing argument"),
    "an argument too many": (("report", "a", "b"), "unexpected extra argument"),
    "a value too few": (("infer", "logs.csv", "--size"), "--size"),
    "a word for a number": (("infer", "logs.csv", "--size", "four"), "--size"),
    "a negative seed": (("infer", "logs.csv", "--seed", "-1"), "--seed"),
    "a negative root seed": (("reproduce", "case1", "--seed", "-1"), "--seed"),
    "no primitives": (("infer", "logs.csv", "--size", "0"), "--size"),
    "no depth": (("infer", "logs.csv", "--depth", "0"), "--depth"),
    "a negative weight": (("infer", "logs.csv", "--information-weight", "-1"), "--information-weight"),
    "no workers": (("reproduce", "case1", "--workers", "0"), "--workers"),
    "no runs": (("reproduce", "case1", "--runs", "0"), "--runs"),
}


@pytest.mark.parametrize("name", USAGE)
def test_command_lines(tickwise: Tickwise, name: str):
    arguments, culprit = USAGE[name]
    line = tickwise.fails(*arguments, status=2)
    assert culprit.lower() in line.lower()
    assert "; see tickwise" in line
    assert line.endswith(" --help")


# ---------------------------------------------------------------- Python alone

X = np.zeros((4, 3, 1))
Y = [1, 1, -1, -1]
PHI = tw.parse(FORMULA)
DOCUMENT = json.loads(to_json(tw.timed_automata(PHI)[0]))


def changed(**fields: Any) -> str:
    """An automaton's document with fields changed, or, where None, left out."""
    return json.dumps({key: value for key, value in (DOCUMENT | fields).items() if value is not None})


def deep(levels: int) -> str:
    return "[" * levels + "]" * levels


EDGES = DOCUMENT["edges"]
CALLS: dict[str, tuple[Callable[[], object], str]] = {
    "a formula that is no text": (lambda: tw.parse(3), "the formula 3 is of type int; give it as text"),
    "a text that is no formula": (lambda: tw.to_sdnf("F"), "'F' is of type str; give a formula, as parse reads it"),
    "half a tick": (lambda: Interval(0, 1.5), "interval bound 1.5 is not a whole number of ticks; round it"),
    "a box of one number": (lambda: tw.Box.of(x=3), r"the range of 'x' is 3; give two numbers, such as \(3, 4\)"),
    "an empty box": (lambda: tw.Box.of(x=(4, 3)), "the range of 'x' is empty: 4 > 3; swap the bounds"),
    "ragged data": (lambda: PHI.verdict([[1], [2, 3]]), r"is ragged; give a list of \(ticks, variables\) arrays"),
    "words for data": (lambda: PHI.verdict([["a"]]), "is not numeric .*; give numbers only"),
    "complex data": (lambda: PHI.verdict(np.array([[1j]])), "the data is complex; give real numbers only"),
    "NaN in the data": (lambda: PHI.verdict([[np.nan]]), "has NaN at tick 0 in 'x'; fill it, leave it out, or set its"),
    "no ticks": (lambda: PHI.verdict(np.zeros((0, 1))), "is empty; it needs at least one state"),
    "four dimensions": (
        lambda: PHI.verdict(np.zeros((1, 1, 1, 1))),
        r"shape \(1, 1, 1, 1\); give \(ticks, variables\)",
    ),
    "a column too many": (lambda: PHI.verdict(np.zeros((3, 2))), r"has 2 column\(s\), .*; name the columns with"),
    "columns of one name": (
        lambda: PHI.verdict(np.zeros((3, 2)), variables=("x", "x")),
        "has two columns of the same name, 'x'; rename one",
    ),
    "an unknown column": (
        lambda: PHI.verdict(np.zeros((3, 1)), variables=("y",)),
        "names 'x', which the trajectory does not have; it has 'y'",
    ),
    "lengths beyond the end": (
        lambda: PHI.verdict(X, lengths=[1, 2, 3, 4]),
        "lengths are from 1 to 4; they must be from 1 to 3 ticks",
    ),
    "labels of one class": (lambda: tw.MITLClassifier().fit(X, [1] * 4), "no trajectory has label -1; give"),
    "labels of another set": (
        lambda: tw.MITLClassifier().fit(X, [0, 1, 2, 2]),
        "there are 3 different labels, 0, 1, 2",
    ),
    "labels too few": (lambda: tw.MITLClassifier().fit(X, [1]), "for 4 trajectories; give one label per trajectory"),
    "no trajectories": (lambda: tw.MITLClassifier().fit([], []), "there is no trajectory; give at least one"),
    "nothing to fit": (lambda: tw.MITLClassifier().fit(None, Y), "the trajectories are None; give an array, or a list"),
    "a prediction too early": (lambda: tw.MITLClassifier().predict(X), "is not fitted yet; call fit first"),
    "a size of text": (lambda: tw.MITLClassifier(size="4").fit(X, Y), "size is '4'; use a whole number, 1 or more"),
    "half a depth": (lambda: tw.MITLClassifier(depth=1.5).fit(X, Y), "depth is 1.5; use a whole number, 1 or more"),
    "a negative seed": (lambda: tw.MITLClassifier(random_state=-1).fit(X, Y), "random_state is -1; use a whole number"),
    "no threads": (lambda: ExactSettings(threads=0), "exact setting threads is 0; use 1 or more"),
    "no particles": (lambda: SwarmSettings(particles=0), "swarm setting particles is 0; use 1 or more"),
    "a world without cells": (lambda: tw.GridWorld(0).mdp(), "size is 0; use a whole number of cells, 1 or more"),
    "a prior that lacks a variable": (
        lambda: tw.probability(PHI, tw.BoxPrior({"z": (0, 1)}, 5)),
        "the prior has no variable 'x'; it has z",
    ),
    "a prior of nothing": (
        lambda: tw.BoxPrior({"x": (1, 1)}, 5),
        r"range of 'x' is \[1,1\]; use finite numbers, lo < hi",
    ),
    "an adjacency that is not square": (
        lambda: tw.PathPrior(np.zeros((2, 3)), np.zeros((2, 2)), horizon=4),
        "the adjacency has shape .2, 3.; use a square matrix",
    ),
    "a path that is none": (lambda: read_trajectories(None), "the path None is of type NoneType; give text or a Path"),
    "a path with a NUL": (lambda: read_trajectories("a\0b.csv"), "there is no file a.b.csv; check the path"),
    "a folder that is none": (lambda: read_parts("none"), "there is no folder none; check the path"),
    "an unknown study": (lambda: find_study("case7"), "there is no study 'case7'; choose case1, case2"),
    "an unknown effect": (lambda: find_effect("gamma"), "there is no effect 'gamma'; choose trajectories"),
    "a study without runs": (lambda: find_study("case1", runs=0), "use --runs 1 or more"),
    "a study with a negative seed": (lambda: find_study("case1", seed=-1), "the seed is -1; use 0 or more"),
    "a format that is none": (lambda: tw.timed_automata(PHI)[0].to("pdf"), "format 'pdf' is unknown; use one of dot"),
    # automata in JSON
    "no JSON": (lambda: from_json("{"), "not a JSON document: .*; write one with to_json"),
    "no text": (lambda: from_json(None), "not a JSON document: .*; write one with to_json"),
    "a list": (lambda: from_json("[]"), "the JSON lacks 'format'; write it with to_json"),
    "JSON without end": (lambda: from_json(deep(100_000)), "not a JSON document: .*; write one with to_json"),
    "another version": (lambda: from_json(changed(version=2)), "version 2 cannot be read; give .* version 1"),
    "another format": (lambda: from_json(changed(format="uppaal")), "format 'uppaal' version 1 cannot be read; give"),
    "no version": (lambda: from_json(changed(version=None)), "the JSON lacks 'version'; write it with to_json"),
    "a text for the version": (
        lambda: from_json(changed(version="1")),
        "'version' in the JSON is '1'; give a value of",
    ),
    "no edges": (lambda: from_json(changed(edges=None)), "the JSON lacks 'edges'; write it with to_json"),
    "a formula that cannot be read": (
        lambda: from_json(changed(formula="F[")),
        "a formula in the JSON cannot be read: line 1",
    ),
    "an edge to nowhere": (
        lambda: from_json(changed(edges=[EDGES[0] | {"target": "q9"}])),
        "the location 'q9' in the JSON is unknown; use one of q0",
    ),
    "two edges at once": (
        lambda: from_json(changed(edges=[*EDGES, EDGES[0]])),
        "not deterministic: .*; make their letters",
    ),
    "a cycle out of acceptance": (
        lambda: from_json(changed(edges=[*EDGES, EDGES[0] | {"source": "acc", "target": "q0"}])),
        "leaves 'acc'; accepting and rejecting locations absorb|can be enabled",
    ),
    "an initial location that is none": (
        lambda: from_json(changed(initial="q9")),
        "location 'q9' in the JSON is unknown",
    ),
    "a name of a thousand signs": (
        lambda: from_json(changed(clocks=["c" * 1000])),
        "the name 'c+… of a clock has 1000 characters; use 100 at the most",
    ),
}


@pytest.mark.parametrize("name", CALLS)
def test_calls(name: str):
    call, message = CALLS[name]
    with pytest.raises(TickwiseError, match=message) as caught:
        call()
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 400


def test_there_are_many_kinds():
    assert sum(map(len, (FORMULAS, NORMAL_FORMS, FILES, ARGUMENTS, USAGE, CALLS))) >= 150


# ---------------------------------------------------------------- what the system does


class Nobody:
    """This process without the rights of root, where it has them."""

    def __enter__(self) -> None:
        if os.geteuid() == 0:
            os.seteuid(65534)

    def __exit__(self, *_: object) -> None:
        if os.getuid() == 0:
            os.seteuid(0)


@pytest.fixture
def open_folder(tmp_path: Path) -> Path:
    """A folder that everyone can go through."""
    for folder in (tmp_path, *tmp_path.parents):
        if str(folder).startswith(str(Path(os.environ.get("TMPDIR", "/tmp")).resolve()) + os.sep):
            folder.chmod(0o755)
    return tmp_path


@pytest.mark.skipif(not hasattr(os, "geteuid"), reason="has no users")
@pytest.mark.parametrize("make", [table(), archive(), parquet("logs.parquet")])
def test_a_file_that_may_not_be_read(tickwise: Tickwise, open_folder: Path, make: Callable[[Path], Path]):
    path = make(open_folder)
    path.chmod(0)
    tickwise.fails("infer", open_folder / "none.csv")  # what a command imports late may lie where nobody can read
    message = f"cannot read {path}: Permission denied; check its permissions, and the room on the disk"
    with Nobody():
        with pytest.raises(TickwiseError) as caught:
            read_trajectories(path)
        assert str(caught.value) == message
        assert tickwise.fails("infer", path) == message
    assert isinstance(caught.value, OSError)


@pytest.mark.skipif(not hasattr(os, "geteuid"), reason="has no users")
def test_a_folder_that_may_not_be_read(open_folder: Path):
    table()(open_folder)
    open_folder.chmod(0)
    try:
        with Nobody(), pytest.raises(TickwiseError, match=r"cannot read .*: Permission denied; check its permissions"):
            read_trajectories(open_folder / "logs.csv")
    finally:
        open_folder.chmod(0o700)


def test_a_folder_that_is_not_there(tmp_path: Path):
    data = read_trajectories(table()(tmp_path))
    with pytest.raises(TickwiseError, match=r"cannot write .*: No such file or directory; check its permissions"):
        write_npz(tmp_path / "none" / "logs.npz", data)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no /dev/full")
def test_a_full_disk(tmp_path: Path):
    data = read_trajectories(table()(tmp_path))
    (tmp_path / "full.npz").symlink_to("/dev/full")
    with pytest.raises(TickwiseError, match=r"cannot write .*: No space left on device; .* the room on the disk"):
        write_npz(tmp_path / "full.npz", data)


def test_a_reader_that_goes_away(tmp_path: Path):
    rows = "".join(f"t{name},0,1\n" for name in range(20_000))
    logs = table(content=f"trajectory,tick,x\n{rows}")(tmp_path)
    command = f'"{sys.executable}" -m tickwise check "{FORMULA}" "{logs}" | head -1'
    piped = subprocess.run(
        ["bash", "-c", f"set -o pipefail; {command}"], cwd=ROOT, text=True, capture_output=True, check=False,
        env={**os.environ, **PLAIN}, timeout=120,
    )  # fmt: skip
    assert piped.stdout.startswith("trajectory\t")
    assert piped.stderr == ""
    assert piped.returncode == 1
    # where messages go there too
    reading, writing = os.pipe()
    os.close(reading)
    gone = answer_of("check", FORMULA, tmp_path / "none.csv", stdout=writing, stderr=writing)
    os.close(writing)
    assert gone.status == 1


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="sends signals")
def test_ctrl_c_while_inferring(tmp_path: Path):
    rng = np.random.default_rng(0)
    path = tmp_path / "logs.npz"
    np.savez(path, X=rng.uniform(size=(400, 60, 4)), y=np.repeat([1, -1], 200), names=["a", "b", "c", "d"])
    running = process("--verbose", "infer", path, "--depth", 3, "--rate", 1)
    assert running.stderr is not None
    read = []
    while line := running.stderr.readline():  # until the data are read, and the search begins
        read.append(line)
        if "400 trajectories" in line:
            break
    time.sleep(1.0)
    running.send_signal(signal.SIGINT)
    out, err = running.communicate(timeout=120)
    assert running.returncode == 130, (read, out, err)
    assert "Traceback" not in err
    assert "interrupted" in err


def test_a_defect_is_one_line_too(tickwise: Tickwise, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    def defective(*_: object, **__: object) -> None:
        raise ZeroDivisionError("of\nall things")

    monkeypatch.setattr("tickwise.inference.reading.read_trajectories", defective)
    path = table()(tmp_path)
    line = tickwise.fails("infer", path, status=3)
    assert line.startswith("ZeroDivisionError: of (test_bad_input.py, line ")
    assert line.endswith(
        "this is a defect of tickwise: report it with what tickwise --verbose says of the same command"
    )
    assert "Traceback (most recent call last)" in tickwise("--verbose", "infer", path).err
