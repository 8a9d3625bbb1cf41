"""The harness of the benchmarks: turns, what is skipped, the table, the files and the picture."""

from __future__ import annotations

import csv
import importlib
import itertools
import json
from pathlib import Path

import pytest
from benchmarks.__main__ import BENCHMARKS
from benchmarks.contest import Contender, Turn, UnavailableError, contest
from benchmarks.growth import _apart
from benchmarks.report import table, times, write
from benchmarks.result import OURS, Result, duration


def answering(answer: int, log: list[str], name: str) -> Turn:
    def turn() -> int:
        log.append(name)
        return answer

    return turn


def missing(message: str, kind: type[Exception] = UnavailableError) -> Turn:
    raise kind(message)


def test_contenders_take_turns_after_one_that_is_not_timed():
    log: list[str] = []
    ticks = itertools.count()
    results = contest(
        "sum",
        "number",
        [
            Contender(OURS, lambda: answering(1, log, "a"), 10, 3),
            Contender("other", lambda: answering(1, log, "b"), 5, 2, warm=False),
        ],
        agree=int.__eq__,
        clock=lambda: float(next(ticks)),
    )
    assert "".join(log) == "a" + "ab" + "ab" + "a"
    assert [(one.contender, one.seconds, one.cost) for one in results] == [(OURS, 1.0, 0.1), ("other", 1.0, 0.2)]


def test_short_turns_are_timed_together():
    log: list[str] = []
    ticks = itertools.count()
    contender = Contender(OURS, lambda: answering(1, log, "a"), 1, 2, warm=False, rounds=4)
    (result,) = contest("sum", "number", [contender], clock=lambda: float(next(ticks)))
    assert (result.seconds, len(log)) == (0.25, 8)


def test_who_is_not_there_is_skipped_and_says_why():
    results = contest(
        "sum",
        "number",
        [
            Contender(OURS, lambda: answering(1, [], ""), 1, 1),
            Contender("C", lambda: missing("there is no C compiler"), 1, 1),
            Contender("peer", lambda: missing("No module named 'peer'", ImportError), 1, 1),
        ],
    )
    assert [one.skipped for one in results] == ["", "there is no C compiler", "No module named 'peer'"]
    assert "skipped" in table(results)


def test_answers_that_differ_end_the_run():
    contenders = [Contender(name, lambda name=name: answering(len(name), [], ""), 1, 1) for name in (OURS, "C")]
    with pytest.raises(SystemExit, match="C and tickwise do not agree"):
        contest("sum", "number", contenders, agree=int.__eq__)


def test_a_result_has_either_a_time_or_a_reason():
    with pytest.raises(ValueError, match="give either its seconds or why"):
        Result("sum", "none", 0, OURS, None)
    with pytest.raises(ValueError, match="the axis is 'width'"):
        Result("sum", "width", 0, OURS, 1.0)


def test_files_hold_every_result(tmp_path: Path):
    results = [
        Result("sum", "world", size, name, seconds * size, 10, "number")
        for size in (9, 100)
        for name, seconds in ((OURS, 1e-3), ("C", 2e-3), ("peer", 1.0))
    ]
    results.append(Result("sum", "world", 9, "gone", None, skipped="not here"))
    results.append(Result("sum", "none", 0, OURS, 1.0, memory=65.6e6))
    write(results, tmp_path, quick=True)
    document = json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))
    assert [one["contender"] for one in document["results"]] == [one.contender for one in results]
    with (tmp_path / "results.csv").open(encoding="utf-8", newline="") as file:
        assert len(list(csv.DictReader(file))) == len(results)
    lines = (tmp_path / "table.md").read_text(encoding="utf-8").splitlines()
    assert len(lines) == len(results) + 2
    assert "2.00×" in lines[3]
    assert "1,000×" in lines[4]
    assert lines[-1].endswith(" 65.6 MB |")
    picture = (tmp_path / "growth.svg").read_text(encoding="utf-8")
    assert all(f">{name}<" in picture for name in (OURS, "C", "peer", "sum", "9", "100"))
    assert (tmp_path / "growth.png").stat().st_size > 1000


def test_names_are_moved_apart_and_keep_their_order():
    heights = [0.5, 0.5, 0.9, 0.52]
    moved = _apart(heights)
    assert moved[2] == pytest.approx(0.9)
    assert sorted(range(4), key=lambda index: moved[index]) == [0, 1, 3, 2]
    ordered = sorted(moved)
    assert all(b - a > 0.0749 for a, b in itertools.pairwise(ordered))
    assert sum(moved) == pytest.approx(sum(heights))


@pytest.mark.parametrize(
    ("seconds", "text"), [(2.5, "2.5 s"), (0.0123, "12.3 ms"), (4e-6, "4 µs"), (25.34e-9, "25.3 ns")]
)
def test_durations(seconds: float, text: str):
    assert duration(seconds) == text


@pytest.mark.parametrize(("ratio", "text"), [(0.974, "0.97×"), (12.34, "12×"), (1380.0, "1,400×")])
def test_ratios(ratio: float, text: str):
    assert times(ratio) == text


@pytest.mark.parametrize("name", BENCHMARKS)
def test_every_benchmark_is_a_module_that_measures(name: str):
    assert callable(importlib.import_module(f"benchmarks.{name}").measure)
