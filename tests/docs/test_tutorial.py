"""The tutorial prints what it says that it prints."""

from __future__ import annotations

from pathlib import Path

import pytest
import tutorial


@pytest.fixture(scope="module")
def page() -> str:
    return tutorial.PAGE.read_text(encoding="utf-8")


def test_every_output_is_as_shown(page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "agg")
    names: dict[str, object] = {}
    for step in tutorial.steps(page):
        printed = tutorial.run(step, names)
        assert tutorial.same(printed, step.shown), f"line {step.line} prints\n{printed}\nand not\n{step.shown}"
    assert (tmp_path / tutorial.FIGURE).stat().st_size > 0


def test_there_are_commands_and_code(page: str):
    kinds = [step.kind for step in tutorial.steps(page)]
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
    code, first, second = tutorial.steps(TEXT)
    assert (code.line, code.kind, code.source, code.shown) == (3, "python", "print(1)\n", "1\n")
    assert (first.kind, first.source) == ("console", "tickwise compare 'F[0,9] (x > 1)' 'F[3,5] (y < 2)'")
    assert (first.line, first.shown) == (11, "first\nsecond\n")
    assert (second.source, second.shown) == ("tickwise --version", "")
    assert [TEXT[slice(*step.span)] for step in (code, first) if step.span] == ["1\n", "first\nsecond\n"]


def test_an_output_belongs_to_code():
    with pytest.raises(ValueError, match="line 2: a text block without a python block"):
        tutorial.steps("```text\n1\n```\n")


def test_times_may_differ_and_nothing_else():
    assert tutorial.same("rate 1.0, 0.9 s\n", "rate 1.0, 12.1 s\n")
    assert not tutorial.same("rate 1.0, 0.9 s\n", "rate 1.1, 0.9 s\n")


def test_a_command_that_fails_is_told():
    (step,) = tutorial.steps("```console\n$ tickwise check 'F[0,9]' nowhere.csv\n```\n")
    with pytest.raises(ValueError, match="line 2: .* is no command that succeeds"):
        tutorial.run(step, {})
