"""A short run of the fuzzer finds nothing; a reader that breaks its promise is found, and what broke it kept."""

from __future__ import annotations

import random
import time

import pytest
from benchmarks.fuzz import Target, attempt, fuzz, targets

from benchmarks import fuzz as fuzzing
from benchmarks import mutation
from tickwise.errors import DataError
from tickwise.logic.parse import parse


def test_the_readers_keep_their_promise():
    fuzz(0.5)  # compiles and imports
    tallies = fuzz(4.0, seed=20)
    assert {"formula", "csv", "npz", "json"} <= tallies.keys()
    for name, tally in tallies.items():
        assert not tally.escapes, (name, tally.escapes)
        assert tally.outcomes["accepted"], name  # valid inputs are among them
        assert len(tally.outcomes) > 1, name  # and others


@pytest.mark.parametrize("name", sorted(targets()))
def test_a_seed_gives_the_same_inputs(name: str):
    make = targets()[name].make
    first, again, other = (random.Random(seed) for seed in (3, 3, 4))
    inputs = [make(first) for _ in range(20)]
    if name != "npz":  # an archive has the time of writing in it
        assert inputs == [make(again) for _ in range(20)]
    assert inputs != [make(other) for _ in range(20)]


def test_formulas_of_the_grammar_are_mostly_formulas():
    rng, read = random.Random(0), 0
    for _ in range(200):
        try:
            parse(mutation.formula(rng))
            read += 1
        except ValueError:
            pass
    assert read > 100


def _raises(error: BaseException):
    def read(*_: object) -> None:
        raise error

    return Target(lambda _: "an input", read)


@pytest.mark.parametrize(
    ("target", "outcome", "escaped"),
    [
        (_raises(DataError("the culprit; the remedy")), "DataError", None),
        (_raises(KeyError("x")), "KeyError", "KeyError"),
        (_raises(MemoryError()), "MemoryError", "MemoryError"),
        (_raises(DataError("two\nlines")), "DataError", "BrokenPromiseError"),
        (_raises(DataError("")), "DataError", "BrokenPromiseError"),
        (_raises(DataError("long " * 1000)), "DataError", "BrokenPromiseError"),
        (Target(lambda _: "", lambda *_: time.sleep(5)), "SlowError", "SlowError"),
        (Target(lambda _: "", lambda *_: None), "accepted", None),
    ],
)
def test_what_escapes_is_told(tmp_path, target, outcome, escaped):
    found, error = attempt(target, "an input", tmp_path, 0.2)
    assert found == outcome
    assert (None if error is None else type(error).__name__) == escaped


def test_what_escapes_is_kept_once(tmp_path, monkeypatch):
    monkeypatch.setattr(fuzzing, "targets", lambda: {"broken": _raises(KeyError("x"))})
    tally = fuzz(0.05, out=tmp_path)["broken"]
    assert tally.inputs > 1
    [path] = tally.escapes.values()
    assert path.with_suffix(".input").read_text() == "an input"
    assert "KeyError: 'x'" in path.with_suffix(".txt").read_text()
    assert len(list(tmp_path.iterdir())) == 2
