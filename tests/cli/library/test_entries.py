"""``tickwise library add`` and ``list``."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from tests.experiments.tiny import TINY
from tests.library.learned import REACH
from tests.library.test_ranking import MIRRORED
from tests.test_cli import Tickwise
from tickwise.experiments.learned import learned_entry
from tickwise.experiments.store import Store, read_json
from tickwise.library.folder import Library

pytestmark = pytest.mark.usefixtures("studies")


def test_where_a_run_is_from_is_kept(finished: Path):
    entry = learned_entry(finished, "tiny")
    store = Store.open(finished, TINY.as_dict())
    returns = [store.load(f"learn-source-{run}")["evaluation_returns"][-1] for run in range(2)]
    run = int(np.argmax(returns))
    origin = {key: value for key, value in entry.provenance.items() if key not in ("version", "date")}
    assert origin == {
        "folder": str(finished), "study": "tiny", "task": "source", "method": "source", "protocol": "paper", "seed": 0,
        "run": run, "runs": 2, "episodes": 30_000, "mean_return": float(max(returns)),
        "made_by": read_json(finished / "environment.json")["version"],
    }  # fmt: skip
    np.testing.assert_array_equal(entry.q, store.load(f"learn-source-{run}")["q"])
    inferred = store.load("infer-0")["source"]
    assert str(entry.formula) == inferred["formula"]
    assert entry.facts["rate"] == inferred["rate"]
    assert entry.facts["positives"] == store.load("collect-source-0")["positives"]


def test_list_as_a_table_and_as_a_document(tickwise: Tickwise, tasks: Path):
    lines = tickwise("library", "list", tasks).out.splitlines()
    assert lines[0].split("\t") == ["name", "from", "episodes", "mean return", "rate", "added", "formula"]
    *cells, added, formula = lines[1].split("\t")
    assert (cells, formula) == (["mirrored", "", "20,000", "", "1"], MIRRORED)
    assert re.fullmatch(r"\d{4}-\d\d-\d\d", added)
    document = tickwise("library", "list", tasks, "--json").document
    assert document["folder"] == str(tasks)
    assert [each["name"] for each in document["entries"]] == ["mirrored", "reach"]
    first = document["entries"][1]
    assert first["formula"] == REACH
    assert first["world"] == {"states": 64, "actions": 3, "variables": ["x", "y"]}
    assert first["facts"] == {"rate": 1.0, "size": 2}
    assert first["provenance"].keys() == {"version", "date", "episodes"}
    assert first["checksum"].startswith("sha256:")


def test_an_empty_library_lists_nothing(tickwise: Tickwise, tmp_path: Path):
    Library.open(tmp_path / "tasks", create=True)
    assert tickwise("library", "list", tmp_path / "tasks", "--json").document["entries"] == []
    assert len(tickwise("library", "list", tmp_path / "tasks").out.splitlines()) == 1
