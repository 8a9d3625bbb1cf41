from __future__ import annotations

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from typer.testing import CliRunner

import tests
from tests.experiments.tiny_suite import in_place
from tickwise import cli
from tickwise.cli import app, main

ROOT = Path(tests.__file__).parents[1]
NAVAL = ROOT.parent / "shared" / "data" / "naval" / "naval.npz"
COMMANDS = (
    "reproduce",
    "infer",
    "check",
    "automaton",
    "compare",
    "report",
    "effect",
    "library",
)  # doctor has tests of its own
FORMULA = "F[0,2] (x >= 3)"
PLAIN = {"PATH": os.environ.get("PATH", ""), "HOME": os.environ.get("HOME", ""), "TERM": "dumb", "NO_COLOR": "1"}


@dataclass(frozen=True)
class Answer:
    status: int
    out: str
    err: str

    @property
    def document(self) -> Any:
        """What was printed, which must be one JSON document and nothing else."""
        return json.loads(self.out)


class Tickwise:
    """The command line in this process."""

    def __init__(self, capture: pytest.CaptureFixture[str]) -> None:
        self.capture = capture

    def __call__(self, *arguments: object) -> Answer:
        self.capture.readouterr()
        before = signal.getsignal(signal.SIGINT)
        try:
            status = main([str(argument) for argument in arguments])
        finally:  # an interrupted command ignores further ones until its process ends
            signal.signal(signal.SIGINT, before)
        return Answer(status, *self.capture.readouterr())

    def fails(self, *arguments: object, status: int = 1) -> str:
        """The one line that a command fails with; a caret's two lines may follow."""
        answer = self(*arguments)
        assert answer.status == status
        assert answer.out == ""
        lines = answer.err.splitlines()
        assert lines[0].startswith("error: ")
        assert len(lines) == 1 or (len(lines) == 3 and lines[2].strip() == "^"), answer.err
        return answer.err.removeprefix("error: ").rstrip("\n")


@pytest.fixture
def tickwise(capsys: pytest.CaptureFixture[str]) -> Tickwise:
    return Tickwise(capsys)


def process(*arguments: object, module: str = "tickwise", **options: Any) -> subprocess.Popen[str]:
    """The command line, or that of the tiny studies, in a process group of its own."""
    return subprocess.Popen(
        [sys.executable, "-m", module, *map(str, arguments)],
        cwd=ROOT, text=True, encoding="utf-8", start_new_session=True,
        **{"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "env": {**os.environ, **PLAIN}, **options},
    )  # fmt: skip


def answer_of(*arguments: object, **options: Any) -> Answer:
    running = process(*arguments, **options)
    out, err = running.communicate(timeout=120)
    return Answer(running.returncode, out or "", err)


def csv(path: Path, *rows: str, header: str = "trajectory,tick,x,label") -> Path:
    path.write_text("\n".join((header, *rows)) + "\n", encoding="utf-8")
    return path


@pytest.fixture
def logs(tmp_path: Path) -> Path:
    """Twenty trajectories of six ticks; those with label 1 have x >= 5 at tick 3."""
    rows = []
    for name in range(20):
        good = name % 2 == 0
        for tick in range(6):
            x = 8.0 if good and tick == 3 else 0.1 * ((name * 7 + tick * 3) % 10)
            rows.append(f"t{name},{tick},{x},{1 if good else -1}")
    return csv(tmp_path / "logs.csv", *rows)


# ---------------------------------------------------------------- help and version


def test_the_version(tickwise: Tickwise):
    assert tickwise("--version") == Answer(0, f"tickwise {version('tickwise')}\n", "")


@pytest.mark.parametrize("arguments", [(), ("--help",)])
def test_help_lists_the_commands(tickwise: Tickwise, arguments: tuple[str, ...]):
    answer = tickwise(*arguments)
    assert (answer.status, answer.err) == (0, "")
    assert all(re.search(rf"^ +{command} ", answer.out, re.MULTILINE) for command in COMMANDS)


@pytest.mark.parametrize("command", COMMANDS)
def test_help_of_each_command_has_an_example(tickwise: Tickwise, command: str):
    answer = tickwise(command, "--help")
    assert (answer.status, answer.err) == (0, "")
    _, examples = answer.out.split("\n  Examples:\n")
    assert all(line.startswith(f"    tickwise {command} ") for line in examples.splitlines())
    if command in ("infer", "check", "compare"):
        assert "--json" in answer.out


def test_typers_runner_works_too():
    assert CliRunner().invoke(app, ["--version"]).output == f"tickwise {version('tickwise')}\n"
    failed = CliRunner().invoke(app, ["compare", "F[0,1]", FORMULA])
    assert failed.exit_code == 1
    assert failed.stderr.startswith("error: line 1, column 7: ")


# ---------------------------------------------------------------- bad command lines


@pytest.mark.parametrize(
    ("arguments", "culprit"),
    [
        (("reproduce",), "Missing argument 'study'"),
        (("reproduce", "case1", "--workers", "0"), "'--workers'"),
        (("reproduce", "case1", "--runs", "0"), "'--runs'"),
        (("reproduce", "case1", "--seed", "-1"), "'--seed'"),
        (("reproduce", "case1", "--runs", "many"), "'--runs'"),
        (("effect",), "Missing argument 'name'"),
        (("effect", "tau", "--runs", "0"), "'--runs'"),
        (("infer", "logs.csv", "--seed", "-1"), "'--seed'"),
        (("infer", "logs.csv", "--depth", "0"), "'--depth'"),
        (("check", FORMULA), "Missing argument 'data'"),
        (("chekc",), "No such command 'chekc'"),
        (("compare", FORMULA, FORMULA, "--jsn"), "No such option: --jsn"),
    ],
)
def test_a_wrong_command_line_is_one_line(tickwise: Tickwise, arguments: tuple[str, ...], culprit: str):
    # the words are typer's, and differ between its versions
    line = tickwise.fails(*arguments, status=2)
    assert culprit.lower() in line.lower()
    command = f"tickwise {arguments[0]}" if arguments[0] in COMMANDS else "tickwise"
    assert line.endswith(f"; see {command} --help")


def test_an_unknown_study_names_those_there_are(tickwise: Tickwise, tmp_path: Path):
    line = tickwise.fails("reproduce", "case7", "--out", tmp_path / "run")
    assert line.startswith("there is no study 'case7'; choose case1")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("study", ["case1", "pair-01", "random"])
def test_an_unknown_protocol_names_those_there_are(tickwise: Tickwise, tmp_path: Path, study: str):
    line = tickwise.fails("reproduce", study, "--protocol", "best", "--out", tmp_path / "run")
    assert line == "there is no protocol 'best'; choose paper or full"
    assert list(tmp_path.iterdir()) == []


def test_tasks_belong_to_suites(tickwise: Tickwise, tmp_path: Path):
    line = tickwise.fails("reproduce", "case1", "--tasks", 3, "--out", tmp_path / "run")
    assert line == "case1 has no random tasks; leave --tasks out, or reproduce random or all"
    assert "'--tasks'" in tickwise.fails("reproduce", "random", "--tasks", 0, "--out", tmp_path / "run", status=2)
    assert list(tmp_path.iterdir()) == []


def test_a_suite_is_reproduced_shown_and_rendered_again(tickwise: Tickwise, tmp_path: Path):
    folder = tmp_path / "all"
    with in_place():
        first = tickwise("reproduce", "all", "--tasks", 2, "--runs", 1, "--out", folder, "--workers", 1)
        assert first.status == 0
        lines = first.out.splitlines()
        assert lines[0] == "== tiny"
        assert "similar pairs identified: 1 of 1" in lines
        assert "dissimilar pairs refused: 1 of 1" in lines
        assert lines[-1] == f"report: {folder / 'report.html'}"
        again = tickwise("report", folder)
        assert (again.status, again.out, again.err) == (0, first.out, "")
        line = tickwise.fails("reproduce", "all", "--tasks", 3, "--runs", 1, "--out", folder)
    assert "holds a run of another configuration (its tasks is 2, not 3)" in line


def test_an_unknown_effect_names_those_there_are(tickwise: Tickwise, tmp_path: Path):
    line = tickwise.fails("effect", "gamma", "--out", tmp_path / "run")
    assert line == (
        "there is no effect 'gamma'; choose trajectories, depth, noisy-depth, information-weight, rate, tau"
    )
    line = tickwise.fails("effect", "tau", "--study", "case7", "--out", tmp_path / "run")
    assert line.startswith("there is no study 'case7'; choose case1")
    assert list(tmp_path.iterdir()) == []


# ---------------------------------------------------------------- bad formulas


@pytest.mark.parametrize(
    ("formula", "message"),
    [
        ("F[0,2] (x >= ", "line 1, column 13: found the end of the text"),
        ("F[5,2] (x >= 3)", "line 1, column 2: interval [5,2] "),
        ("F[-1,2] (x >= 3)", "line 1, column 3: the interval bound -1 is before tick 0; use 0 or more"),
        ("F[0,1.5] (x >= 3)", "line 1, column 5: the interval bound 1.5 is not a whole number of ticks; round it"),
        ("", "line 1, column 1: found the end of the text, expected a predicate"),
    ],
)
def test_a_malformed_formula_is_shown_with_a_caret(tickwise: Tickwise, logs: Path, formula: str, message: str):
    for arguments in (("check", formula, logs), ("automaton", formula), ("compare", FORMULA, formula)):
        error = tickwise.fails(*arguments)
        assert error.startswith(message)
        summary, shown, caret = error.splitlines()
        assert shown == formula
        assert f"column {len(caret)}:" in summary


def test_a_formula_without_normal_form_is_refused(tickwise: Tickwise):
    for arguments in (("automaton", "F[0,9] (x >= 3) & F[0,9] (y >= 3)"), ("compare", FORMULA, "x >= 3")):
        assert "\n" not in tickwise.fails(*arguments)


def test_brackets_are_printed_as_they_are(tickwise: Tickwise, logs: Path):
    # nothing in a formula may be taken for the console's markup
    assert "[bold]" in tickwise.fails("check", '"[bold]" >= 3', logs)


# ---------------------------------------------------------------- bad data


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        (("a,0,1,1", "a,1,nan,1"), "line 3, column 'x': nan is not finite; fill it in"),
        (("a,0,inf,1",), "line 2, column 'x': inf is not finite"),
        (("a,0,1,1", "a,1,,1"), "line 3, column 'x': '' is not a number; fix it"),
        (("a,0,1,1", "a,1,1"), "line 3: 3 fields for 4 columns; fix the row"),
        (("a,0,1,1", "a,2,1,1"), "line 3, column 'tick': 2 where trajectory 'a' needs 1"),
        (("a,0,1,2",), "line 2, column 'label': 2; use 1 or -1"),
        (("a,0,1,1", "a,1,1,-1"), "line 3, column 'label': -1; trajectory 'a' had 1 before"),
        (("a,0,1,0",), "line 2, column 'label': 0; use 1 or -1"),
        ((), "has no rows; give at least one trajectory"),
        (("a,0,1,1", "b,0,2,1"), "no trajectory has label -1; give trajectories of both labels"),
    ],
)
def test_wrong_data_are_named_to_the_column(tickwise: Tickwise, tmp_path: Path, rows: tuple[str, ...], message: str):
    error = tickwise.fails("infer", csv(tmp_path / "logs.csv", *rows))
    assert message in error
    assert "\n" not in error


def test_an_empty_file_and_one_without_labels(tickwise: Tickwise, tmp_path: Path):
    empty = tmp_path / "empty.csv"
    empty.write_text("")
    assert "has no column 'trajectory'; it has no header" in tickwise.fails("infer", empty)
    bare = csv(tmp_path / "bare.csv", "a,0,1", header="trajectory,tick,x")
    assert "has no column 'label'" in tickwise.fails("infer", bare)
    assert tickwise("check", FORMULA, bare).status == 0


def test_an_unknown_variable_is_named_with_those_there_are(tickwise: Tickwise, logs: Path):
    error = tickwise.fails("check", "F[0,2] (speed >= 3)", logs)
    assert "'speed'" in error
    assert re.search(r"\bx\b", error)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("logs.txt", b"hello", "is not a .csv, .parquet or .npz file; convert it"),
        ("logs.csv", b"\xff\xfe\x00\x01", "is not a CSV file in UTF-8"),
        ("logs.npz", b"hello", "is not an npz file of plain arrays"),
        ("logs.parquet", b"hello", "is not a Parquet file"),
    ],
)
def test_a_file_that_is_no_data_file(tickwise: Tickwise, tmp_path: Path, name: str, content: bytes, message: str):
    if name.endswith("parquet"):
        pytest.importorskip("pyarrow")
    (tmp_path / name).write_bytes(content)
    error = tickwise.fails("check", FORMULA, tmp_path / name)
    assert error.startswith(str(tmp_path / name))
    assert message in error
    assert "\n" not in error


def test_a_folder_of_parquet_is_read_as_one_file_is(tickwise: Tickwise, logs: Path, tmp_path: Path):
    pytest.importorskip("pyarrow")
    pandas, folder = pytest.importorskip("pandas"), tmp_path / "folder"
    folder.mkdir()
    for number, (_, rows) in enumerate(pandas.read_csv(logs).groupby("trajectory", sort=False)):
        rows.to_parquet(folder / f"{number:03}.parquet")
    answers = [json.loads(tickwise("infer", data, "--json").out) | {"seconds": 0} for data in (folder, logs)]
    assert answers[0] == answers[1]
    assert answers[0]["satisfying"]


def test_missing_files(tickwise: Tickwise, tmp_path: Path):
    assert tickwise.fails("check", FORMULA, tmp_path / "no.csv").endswith("no.csv; check the path")
    assert tickwise.fails("infer", tmp_path).startswith(f"{tmp_path} has no .parquet file; give a file")
    assert "holds no run" in tickwise.fails("report", tmp_path / "no")


def test_a_pickle_in_an_npz_is_never_loaded(tickwise: Tickwise, tmp_path: Path):
    path = tmp_path / "logs.npz"
    np.savez(path, X=np.array([[[{}]]], dtype=object), y=np.array([1]), names=np.array(["x"]))
    assert "is not an npz file of plain arrays: Object arrays cannot be loaded" in tickwise.fails("infer", path)


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ({"names": ["x"], "y": [1, -1]}, "has no array 'X'; it has names, y"),
        ({"X": np.zeros((2, 5)), "names": ["x"], "y": [1, -1]}, "values have shape (2, 5)"),
        ({"X": np.zeros((2, 5, 1)), "names": ["x", "y"], "y": [1, -1]}, "1 columns of values but 2 variable names"),
        ({"X": np.zeros((2, 5, 1)), "names": ["x"], "y": [1, 3]}, "trajectory '1' has label 3; use 1 or -1"),
        ({"X": np.zeros((2, 5, 1)), "names": ["x"], "y": [1]}, "labels have shape (1,) for 2 trajectories"),
        ({"X": np.zeros((0, 5, 1)), "names": ["x"], "y": []}, "give at least one trajectory"),
        (
            {"X": np.full((2, 5, 1), np.nan), "names": ["x"], "y": [1, -1]},
            "trajectory '0', tick 0, variable 'x' is nan; fill it in",
        ),
        ({"X": np.zeros((2, 5, 1)), "names": ["x"], "y": [1, -1], "lengths": [5, 9]}, "has length 9; use 1 to 5"),
    ],
)
def test_wrong_arrays(tickwise: Tickwise, tmp_path: Path, arrays: dict[str, Any], message: str):
    path = tmp_path / "logs.npz"
    np.savez(path, **{name: np.asarray(array) for name, array in arrays.items()})
    error = tickwise.fails("infer", path)
    assert error.startswith(str(path))
    assert message in error
    assert "\n" not in error


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--rate", "1.5"), "rate is 1.5; use a number above 0 and at most 1"),
        (("--class-weight", "heavy"), "class_weight is 'heavy'; use None, 'balanced'"),
    ],
)
def test_wrong_settings_of_infer(tickwise: Tickwise, logs: Path, options: tuple[str, ...], message: str):
    assert message in tickwise.fails("infer", logs, *options)


@pytest.mark.parametrize(
    "arguments", [("check", "F[0,2] (x >= ", "logs.csv"), ("infer", "no.csv"), ("compare", FORMULA, "x >")]
)
def test_an_error_as_json_is_one_document(tickwise: Tickwise, arguments: tuple[str, ...]):
    answer = tickwise(*arguments, "--json")
    assert answer.status == 1
    assert list(answer.document) == ["error"]
    assert answer.err == f"error: {answer.document['error']}\n"


def test_a_wrong_command_line_as_json_is_one_document(tickwise: Tickwise):
    answer = tickwise("check", FORMULA, "--json")
    assert answer.status == 2
    assert answer.document["error"].endswith("; see tickwise check --help")


# ---------------------------------------------------------------- what works


def test_check_gives_verdicts_and_robustness(tickwise: Tickwise, tmp_path: Path):
    rows = ["up,0,1,1", "up,1,4.5,1", "up,2,2,1", "down,0,1,-1", "down,1,1,-1", "down,2,2.5,-1", "short,0,0,-1"]
    path = csv(tmp_path / "logs.csv", *rows)
    answer = tickwise("check", FORMULA, path, "--json")
    assert (answer.status, answer.err) == (0, "")
    assert answer.document["trajectories"] == [
        {"id": "up", "verdict": "true", "robustness": 1.5},
        {"id": "down", "verdict": "false", "robustness": -0.5},
        {"id": "short", "verdict": "unknown", "robustness": None},
    ]
    assert tickwise("check", FORMULA, path).out.splitlines() == [
        "trajectory\tverdict\trobustness", "up\ttrue\t1.5", "down\tfalse\t-0.5", "short\tunknown\t",
    ]  # fmt: skip


def test_check_of_a_constant_has_no_finite_robustness(tickwise: Tickwise, tmp_path: Path):
    path = csv(tmp_path / "logs.csv", "a,0,1,1")
    row = {"id": "a", "verdict": "true", "robustness": None}
    assert tickwise("check", "true", path, "--json").document["trajectories"] == [row]


@pytest.mark.skipif(not NAVAL.exists(), reason=f"there is no naval data set at {NAVAL}")
def test_check_tells_all_naval_trajectories_apart(tickwise: Tickwise, tmp_path: Path):
    with np.load(NAVAL, allow_pickle=False) as found:
        states, labels = found["X"].transpose(0, 2, 1), found["y"]
    np.savez(tmp_path / "naval.npz", X=states, y=labels, names=np.array(["x", "y"]))
    formula = "G[0,26] (y >= 21) & G[47,60] (x <= 31)"
    rows = tickwise("check", formula, tmp_path / "naval.npz", "--json").document["trajectories"]
    assert len(rows) == 2_000
    assert {row["verdict"] for row in rows} == {"true", "false"}
    np.testing.assert_array_equal([row["verdict"] == "true" for row in rows], labels == 1)
    assert all((row["robustness"] > 0) == (row["verdict"] == "true") for row in rows)


def test_infer_finds_what_tells_the_labels_apart(tickwise: Tickwise, logs: Path):
    answer = tickwise("infer", logs, "--depth", "1", "--json")
    assert (answer.status, answer.err) == (0, "")
    facts = answer.document
    told = ["formula", "classification_rate", "information_gain", "size", "satisfying", "seconds"]
    assert list(facts) == [*told, "search", "gap", "interrupted", "confusion", "primitives", "misclassified"]
    assert (facts["search"], facts["gap"], facts["interrupted"]) == ("exact", 0, False)
    assert facts["classification_rate"] == 1.0
    assert facts["satisfying"] is True
    assert 1 <= facts["size"] <= 4
    assert facts["information_gain"] > 0
    assert facts["seconds"] > 0
    # the formula that is printed tells them apart, too
    rows = tickwise("check", facts["formula"], logs, "--json").document["trajectories"]
    assert [row["verdict"] != "false" for row in rows] == [True, False] * 10
    again = tickwise("infer", logs, "--depth", "1", "--json").document
    assert {**again, "seconds": 0} == {**facts, "seconds": 0}


def test_infer_for_people(tickwise: Tickwise, logs: Path):
    answer = tickwise("infer", logs, "--depth", "1", "--class-weight", "balanced")
    assert answer.status == 0
    formula, words, facts, proof, *separated = answer.out.splitlines()
    assert separated[:3] == ["label\tpredicted 1\tpredicted -1", "1\t10\t0", "-1\t0\t10"]
    assert proof == "each node's best, proved"
    assert tickwise("compare", formula, formula).status == 0
    assert words.startswith("in words: ")
    assert re.fullmatch(
        r"classification rate 1\.0000, information gain \d\.\d{4}, size \d, satisfying \(Problem 1\), [\d.]+ s", facts
    )


@pytest.mark.parametrize("search", ["joint", "swarm"])
def test_infer_by_another_search(tickwise: Tickwise, logs: Path, search: str):
    facts = tickwise("infer", logs, "--search", search, "--json").document
    assert (facts["search"], facts["gap"], facts["classification_rate"]) == (search, None, 1.0)


def test_infer_says_which_searches_there_are(tickwise: Tickwise, logs: Path):
    answer = tickwise("infer", logs, "--search", "luck")
    assert answer.status == 1
    assert answer.err.splitlines() == ["error: search is 'luck'; use 'exact', 'joint', 'swarm'"]


def test_infer_may_find_nothing(tickwise: Tickwise, tmp_path: Path):
    rows = [f"t{name},{tick},{name % 2},{1 if name < 3 else -1}" for name in range(20) for tick in range(3)]
    answer = tickwise("infer", csv(tmp_path / "logs.csv", *rows), "--depth", "1", "--json")
    assert answer.status == 0
    facts = answer.document
    assert facts["formula"] is facts["size"] is facts["information_gain"] is None
    assert facts["classification_rate"] == 0.85
    assert facts["satisfying"] is False
    assert "no formula" in tickwise("infer", tmp_path / "logs.csv", "--depth", "1").out


@pytest.mark.parametrize(
    ("format", "beginning"), [("dot", "digraph automaton {"), ("mermaid", "flowchart LR"), ("json", "[")]
)
def test_automaton_in_each_format(tickwise: Tickwise, format: str, beginning: str):
    answer = tickwise("automaton", "F[0,2] (x >= 3) | G[1,4] (y <= 2)", "--format", format)
    assert (answer.status, answer.err) == (0, "")
    assert answer.out.startswith(beginning)
    assert answer.out.endswith("\n")
    assert answer.out.count("digraph" if format == "dot" else "flowchart" if format == "mermaid" else '"version"') == 2


def test_automaton_as_json_reads_back(tickwise: Tickwise):
    from tickwise.automata.build import timed_automata
    from tickwise.automata.interchange import from_json
    from tickwise.logic.parse import parse

    formula = "F[1,5] G[0,4] (x >= 3) & F[10,20] (y <= 2)"
    documents = tickwise("automaton", formula, "--format", "json").document
    assert [from_json(json.dumps(document)) for document in documents] == list(timed_automata(parse(formula)))


def test_automaton_as_svg(tickwise: Tickwise):
    formula = "F[0,2] (x >= 3) | G[1,4] (y <= 2)"
    answer = tickwise("automaton", formula, "--format", "svg")
    assert (answer.status, answer.err) == (0, "")
    assert ElementTree.fromstring(answer.out).tag.endswith("svg")
    assert answer.out.endswith("</svg>\n")
    assert tickwise("automaton", formula, "--format", "svg") == answer


def test_an_unknown_format_names_those_there_are(tickwise: Tickwise):
    line = tickwise.fails("automaton", FORMULA, "--format", "pdf")
    assert line.startswith("there is no format 'pdf'; use one of dot, ")
    listed = line.split("use one of ")[1].split(", ")
    for format in listed:
        assert tickwise("automaton", FORMULA, "--format", format).status == 0
        assert format in tickwise("automaton", "--help").out


def test_compare(tickwise: Tickwise):
    source, other = "F[1,5] G[0,4] (x >= 3) & F[10,20] (y <= 2)", "F[2,6] G[0,1] (z >= 1) & F[9,9] (z <= 0)"
    assert tickwise("compare", source, f"({other}) | ({other})", "--json").document == {
        "structurally_equivalent": False,
        "structurally_transferable": True,
        "source_structure": [["FG", "F"]],
        "target_structure": [["FG", "F"], ["FG", "F"]],
        # no side of one is a side of the other, so they are infinitely far from each other
        "alignment": {
            "shifts": {"x": 0.0, "z": 0.0, "y": 0.0},
            "delay": 0.0,
            "regions": {"x": None, "z": None, "y": None},
            "windows": 3.4,
        },
    }
    # windows: 1, 1, -1 and -11 later, so as late, and 14 remains; with the 3 of the duration it is 17 of 5
    assert tickwise("compare", source, other).out.splitlines() == [
        "structurally equivalent: yes",
        "target structurally transferable from source: yes",
        "source structure: FG & F",
        "target structure: FG & F",
        "target is displaced by: x 0, z 0, y 0, 0 ticks",
        "mean difference that remains: x inf, z inf, y inf, 3.4 ticks",
    ]
    assert tickwise("compare", FORMULA, "G[0,2] (x >= 3)").out.splitlines()[1].endswith(": no")


# ---------------------------------------------------------------- studies


@pytest.mark.usefixtures("studies")
class TestStudies:
    def test_effect_and_report(self, tickwise: Tickwise, tmp_path: Path):
        folder = tmp_path / "run"
        command = ("effect", "rate", "--study", "tiny", "--quick", "--out", folder, "--workers", 1)
        first = tickwise(*command)
        assert first.status == 0
        assert "at ζ =" in first.out
        assert "Number of disjuncts of φᵀ" in first.out
        assert first.out.splitlines()[-1] == f"report: {folder / 'report.html'}"
        assert {path.name for path in (folder / "figures").iterdir()} == {"rate.svg", "rate.png"}
        assert "The least classification rate" in (folder / "report.html").read_text(encoding="utf-8")
        assert tickwise("report", folder).out == first.out
        assert "another configuration (its " in tickwise.fails("effect", "tau", "--study", "tiny", "--out", folder)
        again = tickwise(*command)
        assert again.out == first.out
        assert "finished before" in again.err

    def test_reproduce_and_report(
        self, tickwise: Tickwise, finished: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ):
        folder = shutil.copytree(finished, tmp_path / "run")
        first = tickwise("reproduce", "tiny", "--out", folder, "--workers", 1)
        assert first.status == 0
        assert first.err.splitlines()[0] == "Collect: 4 jobs finished before"
        lines = first.out.splitlines()
        summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
        assert lines[0] == f"source: {summary['formulas']['source']}"
        assert lines[3] == "logically transferable: yes"
        assert lines[-1] == f"report: {folder / 'report.html'}"
        assert all(re.search(rf"^{method}\t", first.out, re.MULTILINE) for method in ("I", "II", "III", "IV"))
        assert re.search(r"^paper, learned with\t.*\nfull\t.* of 2\t", first.out, re.MULTILINE)
        monkeypatch.setattr("tickwise.experiments.publish.draw_figures", lambda *_: {})
        again = tickwise("report", folder)
        assert (again.status, again.out, again.err) == (0, first.out, "")

    def test_the_folder_of_another_configuration(self, tickwise: Tickwise, finished: Path):
        line = tickwise.fails("reproduce", "tiny", "--out", finished, "--runs", 5)
        assert "holds a run of another configuration (its runs is 2, not 5); choose another folder with --out" in line
        assert "another configuration (its " in tickwise.fails("reproduce", "case1", "--out", finished)

    def test_a_folder_with_foreign_files(self, tickwise: Tickwise, tmp_path: Path):
        (tmp_path / "thesis.tex").write_text("dear reader")
        assert "holds files but no run" in tickwise.fails("reproduce", "tiny", "--out", tmp_path)
        assert "holds no run" in tickwise.fails("report", tmp_path)
        assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]

    def test_a_broken_artefact_is_named(self, tickwise: Tickwise, finished: Path, tmp_path: Path):
        folder = shutil.copytree(finished, tmp_path / "run")
        (folder / "artefacts" / "learn-I-0.npz").write_bytes(b"broken")
        assert "learn-I-0.npz is broken (" in tickwise.fails("report", folder)
        (folder / "artefacts" / "learn-I-0.npz").unlink()
        line = tickwise.fails("report", folder)
        assert (
            f"(Method I, run 1 is missing); go on with `tickwise reproduce tiny --runs 2 --seed 0 --out {folder}"
            in line
        )


def test_memory_and_unexpected_files_are_explained(tickwise: Tickwise, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    def out_of_memory(*_: object, **__: object) -> None:
        raise MemoryError

    monkeypatch.setattr("tickwise.inference.reading.read_trajectories", out_of_memory)
    assert tickwise.fails("infer", tmp_path / "logs.csv").startswith("out of memory; use fewer")
    line = tickwise.fails("report", "x" * 300)
    assert "File name too long; check the path" in line


def test_an_interrupt_is_one_line(tickwise: Tickwise, monkeypatch: pytest.MonkeyPatch):
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("tickwise.inference.reading.read_trajectories", interrupted)
    assert tickwise("infer", "logs.csv") == Answer(130, "", "interrupted\n")


# ---------------------------------------------------------------- as a process


def test_python_m_tickwise():
    answer = answer_of("compare", FORMULA, "F[0,9] (y <= 1)", "--json")
    assert (answer.status, answer.err) == (0, "")
    assert answer.document["structurally_equivalent"] is True
    failed = answer_of("compare", FORMULA, "F[0,9] (y <= ")
    assert failed.status == 1
    assert failed.err.splitlines()[0].startswith("error: line 1, column 13: ")
    assert "Traceback" not in failed.err


def test_a_narrow_encoding_does_not_matter():
    answer = answer_of("automaton", FORMULA, env={**os.environ, **PLAIN, "PYTHONIOENCODING": "ascii"})
    assert answer.status == 0
    assert "\\u03c11" in answer.out  # ρ1


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no /dev/full")
def test_output_that_nobody_can_take(logs: Path):
    with Path("/dev/full").open("w") as full:
        failed = answer_of("check", FORMULA, logs, stdout=full)
    assert failed.status == 1
    assert failed.err == "error: No space left on device; check the path and the room on the disk\n"
    reading, writing = os.pipe()
    os.close(reading)
    broken = answer_of("check", FORMULA, logs, stdout=writing)
    os.close(writing)
    assert (broken.status, broken.err) == (1, "")


def small_files(limit: int) -> Any:
    """A limit on the size of files, which fails as a full disk does."""
    import resource

    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))


def lines_without_progress(err: str) -> list[str]:
    return [line for line in err.splitlines() if not re.match(r"(Collect|Infer|Learn|Transfer): ", line)]


@pytest.mark.skipif(not hasattr(signal, "SIGXFSZ"), reason="has no limit on the size of files")
def test_a_full_disk_is_one_line_and_loses_nothing(finished: Path, tmp_path: Path):
    folder = tmp_path / "run"
    study = ("reproduce", "tiny", "--out", folder, "--workers", 2)
    start = answer_of(*study, module="tests.experiments.tiny", preexec_fn=lambda: small_files(512))
    assert start.status == 1
    assert start.out == ""
    [line] = lines_without_progress(start.err)
    assert line.startswith(f"error: cannot write {folder / 'config.json'}: File too large; make room or choose")
    assert list(folder.iterdir()) == []
    # the source's values are the first file that is larger
    later = answer_of(*study, module="tests.experiments.tiny", preexec_fn=lambda: small_files(8_000))
    assert later.status == 1
    [line] = lines_without_progress(later.err)
    assert re.match(r"error: cannot write .*/learn-source-[01]\.npz: File too large; make room", line)
    assert not list(folder.rglob("*.tmp"))
    kept = {path.name for path in (folder / "artefacts").iterdir()}
    assert {"collect-source-0.npz", "infer-1.json"} <= kept
    assert "learn-source-0.json" not in kept
    for name in kept:
        if not name.startswith("cost-"):
            assert (folder / "artefacts" / name).read_bytes() == (finished / "artefacts" / name).read_bytes()


def members(leader: int) -> list[int]:
    """The living processes of a process group."""
    found = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, _, group = path.read_text().rpartition(")")[2].split()[:3]
        except OSError:  # it has just ended
            continue
        if int(group) == leader and state != "Z":
            found.append(int(path.parent.name))
    return found


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc")
@pytest.mark.parametrize("again", [False, True])
def test_ctrl_c_ends_a_study_at_once(tmp_path: Path, again: bool):
    folder = tmp_path / "run"
    running = process(
        "reproduce", "long", "--out", folder, "--workers", 2, module="tests.experiments.tiny",
        env={**os.environ, **PLAIN, "TMPDIR": str(tmp_path)},
    )  # fmt: skip
    # a key press reaches all processes; the workers are there once something is collected
    wanted = folder / "artefacts" / ("infer-0.json" if again else "collect-source-0.json")
    deadline = time.monotonic() + 60
    while not wanted.exists() and running.poll() is None and time.monotonic() < deadline:
        time.sleep(0.02)
    assert len(members(running.pid)) >= 3
    began = time.monotonic()
    os.killpg(running.pid, signal.SIGINT)
    if again:
        time.sleep(0.05)
        os.killpg(running.pid, signal.SIGINT)
    out, err = running.communicate(timeout=30)
    assert running.returncode == 130, err
    assert time.monotonic() - began < 10
    assert out == ""
    assert lines_without_progress(err) == [
        f"interrupted; what is finished is kept in {folder}: run the same command again to go on"
    ]
    while members(running.pid) and time.monotonic() < began + 10:  # Python's resource tracker ends after its parent
        time.sleep(0.02)
    assert members(running.pid) == []
    assert wanted.exists()
    assert not list(folder.rglob("*.tmp"))
    assert [path.name for path in tmp_path.iterdir()] == ["run"]  # the progress board is gone


def test_the_console_script_is_the_same():
    assert cli.main is main
    script = shutil.which("tickwise", path=str(Path(sys.executable).parent))
    if script is None:
        pytest.skip("the console script is not installed beside this Python")
    found = subprocess.run([script, "--version"], capture_output=True, text=True, check=True)
    assert found.stdout == f"tickwise {version('tickwise')}\n"
