"""The map of the paper in CONTRIBUTING.md names what there is, and its example of a study works."""

from __future__ import annotations

import re
from functools import reduce
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

from tickwise.envs.planning import best_success_probability, success_probability
from tickwise.errors import MissingExtraError

ROOT = Path(__file__).parents[1]

TEXT = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")

ROWS = re.findall(r"^\| (.+?) \| `([\w/]+)\.py` \| (.+?) \|$", TEXT, flags=re.MULTILINE)


def test_definitions_and_algorithms_are_all_on_the_map():
    what = " ".join(paper for paper, _, _ in ROWS)
    numbers = {number for found in re.findall(r"Definitions? (\d)(?: and (\d))?", what) for number in found if number}
    assert numbers == set("12345678")
    for name in ("Proposition 1", "Problem 1", "Remark 1", "Algorithm 1", "Algorithm 2", "Steps 1 and 2", "Step 3"):
        assert name in what


@pytest.mark.parametrize(("paper", "path", "names"), ROWS, ids=[paper for paper, _, _ in ROWS])
def test_what_is_named_exists(paper: str, path: str, names: str):
    assert (ROOT / "src" / "tickwise" / f"{path}.py").is_file(), paper
    try:
        module = import_module(f"tickwise.{path.replace('/', '.')}")
    except MissingExtraError as error:
        pytest.skip(str(error))
    for name in re.findall(r"`([\w.]+)`", names):
        reduce(getattr, name.split("."), module)


def test_a_study_is_added_in_under_forty_lines():
    block = re.findall(r"^```python\n(.*?)^```", TEXT, flags=re.MULTILINE | re.DOTALL)[0]
    assert len(block.splitlines()) < 40
    names: dict[str, Any] = {}
    exec(block, names)
    study = names["DELIVER"]
    for environment in (study.source, study.target):
        mdp, task = environment.mdp(), environment.task_table()
        assert best_success_probability(mdp, task) > 0.95
        # of the collection's random episodes some dozens get label 1, and by far not all
        assert 30 < study.collection.episodes * success_probability(mdp, task) < 1_000
