"""Tables for people on a terminal, and for programs in a pipe."""

from __future__ import annotations

from collections.abc import Iterator

from rich.table import Table

from tickwise.cli.app import output


def show(item: str | Table) -> None:
    """Print a line, or a table: drawn on a terminal, lines of cells with tabs between them elsewhere."""
    if isinstance(item, str) or output.is_terminal:
        output.print(item)
    else:
        print("\n".join(tab_separated(item)))


def tab_separated(table: Table) -> Iterator[str]:
    """The lines of a table: its title after a ``#``, its headings, its rows."""
    for line in str(table.title or "").splitlines():
        yield f"# {line}"
    yield "\t".join(_cell(column.header) for column in table.columns)
    for row in zip(*(column.cells for column in table.columns), strict=True):
        yield "\t".join(map(_cell, row))


def _cell(content: object) -> str:
    return " ".join(str(content).split())
