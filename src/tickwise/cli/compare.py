"""The command ``tickwise compare``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

import typer

from tickwise.cli.app import JsonFlag, command, output, print_json


@command
def compare(
    source: Annotated[str, typer.Argument(help="A formula in sequential disjunctive normal form.")],
    target: Annotated[str, typer.Argument(help="Another one.")],
    as_json: JsonFlag = False,
) -> None:
    """Tell whether two formulas are structurally equivalent, and the second transferable from the first.

    For example: tickwise compare 'F[1,15] (x >= 3)' 'F[2,9] (y <= 1)'
    """
    from tickwise.logic.parse import parse
    from tickwise.logic.structure import structurally_equivalent, structurally_transferable, structure

    first, second = parse(source), parse(target)
    equivalent = structurally_equivalent(first, second)
    transferable = structurally_transferable(second, first)
    structures = {
        f"{name}_structure": [[str(operator) for operator in part] for part in structure(phi)]
        for name, phi in (("source", first), ("target", second))
    }
    if as_json:
        print_json({"structurally_equivalent": equivalent, "structurally_transferable": transferable, **structures})
        return
    output.print(f"structurally equivalent: {'yes' if equivalent else 'no'}")
    output.print(f"target structurally transferable from source: {'yes' if transferable else 'no'}")
    for name, parts in structures.items():
        output.print(f"{name.replace('_', ' ')}: {' | '.join(' & '.join(part) for part in parts)}")
    if not transferable:
        output.print(f"why not: {_difference(*structures.values())}")


def _difference(source: Sequence[Sequence[str]], target: Sequence[Sequence[str]]) -> str:
    """Where the target is no copy of the source's structure, nor several of them."""
    if len(target) % len(source):
        return f"the target has {_count(len(target))}, the source {_count(len(source))}; use as many, or several times"
    number, part = next((n, part) for n, part in enumerate(target) if part != source[n % len(source)])
    wanted = " & ".join(source[number % len(source)])
    return f"disjunct {number + 1} of the target is {' & '.join(part)}, where the source has {wanted}"


def _count(disjuncts: int) -> str:
    return f"{disjuncts} disjunct{'' if disjuncts == 1 else 's'}"
