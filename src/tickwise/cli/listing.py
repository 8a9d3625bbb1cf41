"""Tables for people on a terminal, and for programs in a pipe."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from rich.table import Table

from tickwise.cli.app import output


def show(item: str | Table) -> None:
    """Print a line, or a table: drawn on a terminal, lines of cells with tabs between them elsewhere."""
    if isinstance(item, str) or output.is_terminal:
        output.print(item)
    else:
        print("\n".join(tab_separated(item)))


def show_rows(header: Sequence[str], rows: Iterable[Sequence[str]], *, numbers: int | None = None) -> None:
    """Show rows of cells as :func:`show` shows a table.

    Args:
        header: The names of the columns.
        rows: The cells.
        numbers: From which column on there are numbers, which are never broken into two lines; None for nowhere.
    """
    table = Table()
    for index, name in enumerate(header):
        right = numbers is not None and index >= numbers
        table.add_column(name, justify="right" if right else "left", overflow="fold", no_wrap=right)
    for row in rows:
        table.add_row(*row)
    show(table)


def tab_separated(table: Table) -> Iterator[str]:
    """The lines of a table: its title after a ``#``, its headings, its rows."""
    for line in str(table.title or "").splitlines():
        yield f"# {line}"
    yield "\t".join(_cell(column.header) for column in table.columns)
    for row in zip(*(column.cells for column in table.columns), strict=True):
        yield "\t".join(map(_cell, row))


def _cell(content: object) -> str:
    return " ".join(str(content).split())
