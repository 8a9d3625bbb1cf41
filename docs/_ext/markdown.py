"""Docstrings of environments and wrappers are Markdown, as Gymnasium's are; autodoc reads reStructuredText."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import groupby
from typing import Any

from sphinx.application import Sphinx


def setup(app: Sphinx) -> dict[str, Any]:
    """Register what comes before napoleon, and what comes after it."""
    app.connect("autodoc-process-docstring", _process, priority=100)
    app.connect("autodoc-process-docstring", _join, priority=900)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def _process(app: Sphinx, what: str, name: str, obj: object, options: object, lines: list[str]) -> None:
    del app, what, name, obj, options
    if any(_kind(line) for line in lines):
        lines[:] = restructured(lines)


def _join(app: Sphinx, what: str, name: str, obj: object, options: object, lines: list[str]) -> None:
    """Put together what napoleon takes apart: "what: which" on a value is a sentence, not a type and a description."""
    del app, name, obj, options
    if what in ("data", "attribute", "property") and lines and lines[0]:
        types = [line for line in lines if line.startswith(":type: ")]
        lines[:] = [line for line in lines if line not in types]
        lines[0] = ": ".join((*(line.removeprefix(":type: ") for line in types), lines[0]))


def restructured(lines: list[str]) -> list[str]:
    """Headings as rubrics, fenced code as code blocks and tables as list tables; all else as it is."""
    found: list[str] = []
    code = False
    for kind, group in groupby(lines, _kind):
        for line in _table(list(group)) if kind == "table" and not code else group:
            if kind == "fence":
                code = not code
                found += [f".. code-block:: {line.strip('` ')}", ""] if code else [""]
            elif code:
                found.append(f"   {line}")
            elif kind == "heading":
                found += [f".. rubric:: {line.strip('# ')}", ""]
            else:
                found.append(line)
    return found


def _kind(line: str) -> str:
    return next((kind for kind, start in _STARTS.items() if line.startswith(start)), "")


_STARTS = {"heading": "## ", "fence": "```", "table": "|"}


def _table(lines: list[str]) -> Iterator[str]:
    yield from (".. list-table::", "   :header-rows: 1", "")
    for line in lines:
        cells = [cell.strip() for cell in line.strip("| ").split("|")]
        if not all(re.fullmatch(":?-+:?", cell) for cell in cells):
            yield from (
                f"   {'-' if number else '* -'} {cell}".replace("   -", "     -") for number, cell in enumerate(cells)
            )
    yield ""
