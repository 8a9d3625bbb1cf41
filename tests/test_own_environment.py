"""The guide for an environment of one's own prints what it says."""

from __future__ import annotations

import contextlib
import importlib.util
import io
import re
from pathlib import Path

import pytest

PAGE = Path(__file__).parents[1] / "docs" / "how-to" / "own-environment.md"
BLOCK = re.compile(r"^```python\n(.*?)^```\n(?:\n```text\n(.*?)^```)?", flags=re.MULTILINE | re.DOTALL)


def test_every_block_runs_and_prints_what_is_shown(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    deep = importlib.util.find_spec("stable_baselines3") is not None  # it is optional
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    blocks = BLOCK.findall(PAGE.read_text(encoding="utf-8"))
    assert len(blocks) >= 10
    for source, shown in blocks:
        if "stable_baselines3" in source and not deep:
            continue
        with contextlib.redirect_stdout(io.StringIO()) as printed:
            exec(source, names)
        assert printed.getvalue() == shown, source
