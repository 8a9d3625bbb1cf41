"""A table of nodes, for the directives beside this file."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from docutils import nodes


def table(head: Sequence[str], rows: Iterable[Sequence[nodes.Node]], widths: Sequence[int]) -> nodes.table:
    """A table with a head.

    Args:
        head: The titles of the columns.
        rows: One node a column in each, an inline one or a paragraph.
        widths: The columns' shares of the width.

    Returns:
        The table's node.
    """
    group = nodes.tgroup(cols=len(head))
    group += [nodes.colspec(colwidth=width) for width in widths]
    group += nodes.thead("", _row([nodes.Text(title) for title in head]))
    group += nodes.tbody("", *(_row(row) for row in rows))
    return nodes.table("", group, classes=["colwidths-given"])


def _row(cells: Iterable[nodes.Node]) -> nodes.row:
    row = nodes.row()
    for cell in cells:
        row += nodes.entry("", cell if isinstance(cell, nodes.Body) else nodes.paragraph("", "", cell))
    return row
