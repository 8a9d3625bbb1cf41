"""Run the blocks of pages: what they print has to be what the pages show.

``python docs/_ext/pages.py [PAGE ...]`` writes the outputs into the pages, and the tutorial's figure into
``docs/images``.
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import shlex
import shutil
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from unittest.mock import patch

os.environ["NO_COLOR"] = "1"  # is looked at when the command line is imported

from tickwise.cli import main
from tickwise.cli.app import output

DOCS = Path(__file__).parents[1]
PAGES = (
    "tutorial",
    "concepts",
    "how-to/add-a-case-study",
    "how-to/forms",
    "how-to/library",
    "how-to/many-seeds",
    "how-to/other-tools",
)
"""The pages whose blocks are run, each in a folder of its own."""

FIGURES = {"curves.svg": "tutorial-curves.svg"}
"""What blocks write that pages show, and its name in ``docs/images``."""

_FENCE = re.compile(r"^```(?P<kind>python|console|text)\n(?P<body>.*?)^```$", flags=re.MULTILINE | re.DOTALL)


WIDTH = 96
"""Columns of the terminal in which commands are run: as wide as a page's column."""


class _Terminal(io.StringIO):
    """Keeps what is printed, and is a terminal, so that tables are drawn as a reader will see them."""

    def isatty(self) -> bool:
        return True


@dataclass(frozen=True, slots=True)
class Step:
    """A block of code, or a command, and what it prints.

    Attributes:
        line: The line of the page, from 1.
        kind: ``python``, or ``console`` for a command.
        source: The code, or the command without the prompt.
        shown: What the page says that it prints.
        span: Where that is in the page's text; None where there is no place for it.
    """

    line: int
    kind: str
    source: str
    shown: str
    span: tuple[int, int] | None


def steps(page: str) -> list[Step]:
    """The steps of a page, in order: a ``python`` block prints the ``text`` block after it, a command what follows it.

    Raises:
        ValueError: If a ``text`` block does not follow a ``python`` block.
    """
    found: list[Step] = []
    for match in _FENCE.finditer(page):
        kind, body, start = match["kind"], match["body"], match.start("body")
        line = page.count("\n", 0, start) + 1
        if kind == "python":
            found.append(Step(line, kind, body, "", None))
        elif kind == "console":
            found += _commands(body, start, line)
        elif not found or found[-1].kind != "python" or found[-1].span:
            raise ValueError(f"line {line}: a text block without a python block before it")
        else:
            last = found.pop()
            found.append(Step(last.line, last.kind, last.source, body, (start, match.end("body"))))
    return found


def _commands(body: str, start: int, line: int) -> Iterator[Step]:
    for match in re.finditer(r"^\$ (.*)\n((?:(?!\$ ).*\n)*)", body, flags=re.MULTILINE):
        span = (start + match.start(2), start + match.end(2))
        yield Step(line + body.count("\n", 0, match.start()), "console", match[1], match[2], span)


def run(step: Step, names: dict[str, object]) -> str:
    """What a step prints, in the current folder.

    Args:
        step: The step.
        names: The names that Python blocks share; new ones are added.

    Returns:
        The output, without spaces at the ends of lines; that of a command is what a terminal without colours shows.

    Raises:
        ValueError: If the command is not ``tickwise`` or fails.
    """
    printed = io.StringIO() if step.kind == "python" else _Terminal()
    with contextlib.redirect_stdout(printed):
        if step.kind == "python":
            exec(compile("\n" * (step.line - 1) + step.source, "<page>", "exec"), names)
        else:
            _command(step)
    return "".join(f"{line.rstrip()}\n" for line in printed.getvalue().splitlines())


def _command(step: Step) -> None:
    program, *arguments = shlex.split(step.source)
    with patch.dict(os.environ, TERM="xterm"), patch.object(output, "_width", WIDTH):
        if program != "tickwise" or main(arguments) != 0:
            raise ValueError(f"line {step.line}: {step.source} is no command that succeeds")


def same(printed: str, shown: str) -> bool:
    """Whether two outputs agree but for times, such as ``0.3 s``, and dates."""
    times = re.compile(r"\d+\.\d s\b|\b\d{4}-\d\d-\d\d\b")
    return times.sub("… s", printed) == times.sub("… s", shown)


def names_for(page: str) -> dict[str, object]:
    """The names that a page's first block may use: what the page includes from CONTRIBUTING.md is run before."""
    names: dict[str, object] = {}
    if "CONTRIBUTING.md" in page:
        text = (DOCS.parent / "CONTRIBUTING.md").read_text(encoding="utf-8")
        run(steps(text[text.index("## Adding a case study") :])[0], names)
    return names


def rewrite(path: Path) -> None:
    """Write what the steps of a page print into it, and keep its figures."""
    page = path.read_text(encoding="utf-8")
    names, found = names_for(page), steps(page)
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        outputs = [run(step, names) for step in found]
        for name, kept in FIGURES.items():
            if Path(name).exists():
                shutil.copy(name, DOCS / "images" / kept)
    for step, printed in reversed(list(zip(found, outputs, strict=True))):
        if same(printed, step.shown):
            continue
        if step.span is None:
            raise ValueError(f"{path.name}, line {step.line}: this block prints something; put a text block after it")
        page = page[: step.span[0]] + printed + page[step.span[1] :]
    path.write_text(page, encoding="utf-8")


if __name__ == "__main__":
    for each in sys.argv[1:] or PAGES:
        rewrite(DOCS / f"{each}.md")
