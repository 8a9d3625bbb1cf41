"""The map of the paper in CONTRIBUTING.md names what there is."""

from __future__ import annotations

import re
from functools import reduce
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]

ROWS = re.findall(
    r"^\| (.+?) \| `([\w/]+)\.py` \| (.+?) \|$",
    (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8"),
    flags=re.MULTILINE,
)


def test_definitions_and_algorithms_are_all_on_the_map():
    what = " ".join(paper for paper, _, _ in ROWS)
    numbers = {number for found in re.findall(r"Definitions? (\d)(?: and (\d))?", what) for number in found if number}
    assert numbers == set("12345678")
    for name in ("Proposition 1", "Problem 1", "Remark 1", "Algorithm 1", "Algorithm 2", "Steps 1 and 2", "Step 3"):
        assert name in what


@pytest.mark.parametrize(("paper", "path", "names"), ROWS, ids=[paper for paper, _, _ in ROWS])
def test_what_is_named_exists(paper: str, path: str, names: str):
    assert (ROOT / "src" / "tickwise" / f"{path}.py").is_file(), paper
    module = import_module(f"tickwise.{path.replace('/', '.')}")
    for name in re.findall(r"`([\w.]+)`", names):
        reduce(getattr, name.split("."), module)
