"""The blocks of pages print what the pages say that they print."""

from __future__ import annotations

import re
from pathlib import Path

import pages
import pytest

NEEDED = {"how-to/other-tools": ("mtl", "rtamt")}
"""What pages import that cannot be had everywhere."""


@pytest.mark.filterwarnings("ignore::DeprecationWarning")  # of the tools that a page imports
@pytest.mark.parametrize("name", pages.PAGES)
def test_every_output_is_as_shown(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    for needed in NEEDED.get(name, ()):
        pytest.importorskip(needed)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "agg")
    page = (pages.DOCS / f"{name}.md").read_text(encoding="utf-8")
    names = pages.names_for(page)
    for step in pages.steps(page):
        printed = pages.run(step, names)
        assert pages.same(printed, step.shown), f"line {step.line} prints\n{printed}\nand not\n{step.shown}"
    if name == "tutorial":
        assert all((tmp_path / figure).stat().st_size for figure in pages.FIGURES)


def test_code_fits_into_the_column():
    for path in pages.DOCS.rglob("*.md"):
        for block in re.findall(r"^```(?:python|sh)\n(.*?)^```$", path.read_text(encoding="utf-8"), re.M | re.S):
            assert max(map(len, block.splitlines())) <= 100, f"{path.name}: {block}"


def test_the_tutorial_has_commands_and_code():
    kinds = [step.kind for step in pages.steps((pages.DOCS / "tutorial.md").read_text(encoding="utf-8"))]
    assert kinds.count("console") >= 3
    assert kinds.count("python") >= 10


TEXT = """
```python
print(1)
```

```text
1
```

```console
$ tickwise compare 'F[0,9] (x > 1)' 'F[3,5] (y < 2)'
first
second
$ tickwise --version
```
"""


def test_a_page_becomes_steps():
    code, first, second = pages.steps(TEXT)
    assert (code.line, code.kind, code.source, code.shown) == (3, "python", "print(1)\n", "1\n")
    assert (first.kind, first.source) == ("console", "tickwise compare 'F[0,9] (x > 1)' 'F[3,5] (y < 2)'")
    assert (first.line, first.shown) == (11, "first\nsecond\n")
    assert (second.source, second.shown) == ("tickwise --version", "")
    assert [TEXT[slice(*step.span)] for step in (code, first) if step.span] == ["1\n", "first\nsecond\n"]


def test_an_output_belongs_to_code():
    with pytest.raises(ValueError, match=r"line 2: a text block without a python block"):
        pages.steps("```text\n1\n```\n")


def test_times_may_differ_and_nothing_else():
    assert pages.same("rate 1.0, 0.9 s\n", "rate 1.0, 12.1 s\n")
    assert pages.same("added 2026-01-31\n", "added 2025-12-01\n")
    assert not pages.same("rate 1.0, 0.9 s\n", "rate 1.1, 0.9 s\n")


def test_a_command_that_fails_is_told():
    (step,) = pages.steps("```console\n$ tickwise check 'F[0,9]' nowhere.csv\n```\n")
    with pytest.raises(ValueError, match=r"line 2: .* is no command that succeeds"):
        pages.run(step, {})
