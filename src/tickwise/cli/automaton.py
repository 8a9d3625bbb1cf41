"""The command ``tickwise automaton``."""

from __future__ import annotations

import json
from typing import Annotated

import typer

from tickwise.cli.app import command
from tickwise.errors import ConfigurationError


@command
def automaton(
    formula: Annotated[str, typer.Argument(help="A formula in sequential disjunctive normal form.")],
    format: Annotated[str, typer.Option(help="dot, json, mermaid or svg.")] = "dot",
) -> None:
    """Print the timed automaton of each sequential conjunctive subformula.

    For example: tickwise automaton 'F[1,15] G[0,4] (x >= 3)' --format mermaid
    """
    from tickwise.automata.build import timed_automata
    from tickwise.automata.interchange import EXPORTERS
    from tickwise.logic.parse import parse

    formats = (*EXPORTERS, "svg")
    if format not in formats:
        raise ConfigurationError(f"there is no format {format!r}; use one of {', '.join(formats)}")
    automata = timed_automata(parse(formula))
    if format == "svg":
        from tickwise.experiments.figures import draw_automata

        print(draw_automata(automata), end="")
        return
    texts = [each.to(format) for each in automata]
    if format == "json":
        print(json.dumps([json.loads(text) for text in texts], indent=1, ensure_ascii=False))
    else:
        print("\n".join(texts), end="")
