"""The command ``tickwise automaton``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tickwise.cli import completion
from tickwise.cli.app import command
from tickwise.errors import ConfigurationError

_FORMATS = "dot, json, mermaid, svg, tchecker or uppaal."


@command
def automaton(
    formula: Annotated[str, typer.Argument(help="A formula in sequential disjunctive normal form.")],
    format: Annotated[str, typer.Option(help=_FORMATS, autocompletion=completion.formats)] = "dot",
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Write to this file instead of printing.")
    ] = None,
) -> None:
    """Print or write the timed automaton of each sequential conjunctive subformula.

    For example: tickwise automaton 'F[1,15] G[0,4] (x >= 3)' --format uppaal -o reach.xml
    """
    from tickwise._files import write_bytes
    from tickwise.automata.build import timed_automata
    from tickwise.automata.formats import FORMATS, export_all
    from tickwise.logic.parse import parse

    formats = tuple(sorted((*FORMATS, "svg")))
    if format not in formats:
        raise ConfigurationError(f"there is no format {format!r}; use one of {', '.join(formats)}")
    automata = timed_automata(parse(formula))
    if format == "svg":
        from tickwise.experiments.figures import draw_automata

        text = draw_automata(automata)
    else:
        text = export_all(automata, format)
    if output is None:
        print(text, end="")
    else:
        write_bytes(output, text.encode())
