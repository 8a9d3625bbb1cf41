"""The command ``tickwise check``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from tickwise.cli.app import COLUMNS, JsonFlag, command, output, print_json


@command
def check(
    formula: Annotated[str, typer.Argument(help="A formula, such as 'F[1,15] G[0,4] (x >= 3)'.")],
    data: Annotated[Path, typer.Argument(help=f"Trajectories, labels are not needed: {COLUMNS}.")],
    as_json: JsonFlag = False,
) -> None:
    """Check a formula on every trajectory: verdict and robustness.

    For example: tickwise check 'G[0,26] (y >= 21)' logs.npz
    """
    import numpy as np

    from tickwise.inference.reading import read_trajectories
    from tickwise.logic.parse import parse
    from tickwise.logic.syntax import Verdict

    phi = parse(formula)
    known = read_trajectories(data, labelled=False)
    verdicts = phi.verdict(known.values, variables=known.variables, lengths=known.lengths)
    robustness = phi.robustness(known.values, variables=known.variables, lengths=known.lengths)
    rows = [
        (name, Verdict(int(verdict)).name.lower(), float(value) if np.isfinite(value) else None)
        for name, verdict, value in zip(known.ids, np.atleast_1d(verdicts), np.atleast_1d(robustness), strict=True)
    ]
    if as_json:
        keys = ("id", "verdict", "robustness")
        print_json({"trajectories": [dict(zip(keys, row, strict=True)) for row in rows]})
    elif output.is_terminal:
        table = Table("trajectory", "verdict", "robustness")
        for name, shown, value in rows:
            table.add_row(name, shown, "" if value is None else f"{value:.6g}")
        output.print(table)
    else:
        for name, shown, value in rows:
            print(name, shown, "" if value is None else value, sep="\t")
