"""The command ``tickwise check``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tickwise.cli.app import COLUMNS, JsonFlag, command, output, print_json
from tickwise.cli.evidence import page_path, read_any, show_explanation, write_page
from tickwise.cli.listing import show_rows
from tickwise.errors import DataError

if TYPE_CHECKING:
    from tickwise.inference.trajectories import LabelledTrajectories
    from tickwise.logic.syntax import Formula

_SUMMARY = "Show how many of each label the formula and each of its primitives keep, not every trajectory."
_PAGE = "Also write a page with what the formula separates and a drawing, as one HTML file."


@command
def check(
    formula: Annotated[str, typer.Argument(help="A formula, such as 'F[1,15] G[0,4] (x >= 3)'.")],
    data: Annotated[Path, typer.Argument(help=f"Trajectories, labels are not needed: {COLUMNS}.")],
    summary: Annotated[bool, typer.Option("--summary", help=_SUMMARY)] = False,
    page: Annotated[Path | None, typer.Option("--page", "--html", metavar="FILE.html", help=_PAGE)] = None,
    as_json: JsonFlag = False,
) -> None:
    """Check a formula on every trajectory: verdict and robustness; with labels also what it separates.

    For example: tickwise check 'G[0,26] (y >= 21)' logs.npz --summary
    """
    from tickwise.inference.explanation import explain
    from tickwise.logic.parse import parse

    page = page_path(page)
    phi = parse(formula)
    known, labelled = read_any(data)
    if not labelled and (summary or page is not None):
        raise DataError(f"{data} has no labels, which --{'summary' if summary else 'page'} is about; add them")
    found = explain(phi, known) if labelled else None
    if page is not None and found is not None:
        from tickwise.inference.page import render_page

        write_page(page, render_page(found, known, source=data.name))
    if as_json:
        keys = ("id", "verdict", "robustness")
        rows = [dict(zip(keys, row, strict=True)) for row in _rows(phi, known)]
        print_json({"trajectories": rows, **({} if found is None else found.document())})
        return
    if not summary:
        digits = ".6g" if output.is_terminal else ""
        cells = (
            (name, verdict, "" if robustness is None else format(robustness, digits))
            for name, verdict, robustness in _rows(phi, known)
        )
        show_rows(("trajectory", "verdict", "robustness"), cells, numbers=2)
    if found is not None and (summary or output.is_terminal):
        show_explanation(found)
    if page is not None and output.is_terminal:
        output.print(f"page: {page}")


def _rows(phi: Formula, known: LabelledTrajectories) -> list[tuple[str, str, float | None]]:
    """Name, verdict and robustness of each trajectory; None where no number says how robust."""
    import numpy as np

    from tickwise.logic.syntax import Verdict

    verdicts = phi.verdict(known.values, variables=known.variables, lengths=known.lengths)
    robustness = phi.robustness(known.values, variables=known.variables, lengths=known.lengths)
    return [
        (name, Verdict(int(verdict)).name.lower(), float(value) if np.isfinite(value) else None)
        for name, verdict, value in zip(known.ids, np.atleast_1d(verdicts), np.atleast_1d(robustness), strict=True)
    ]
