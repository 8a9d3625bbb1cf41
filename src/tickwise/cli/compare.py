"""The command ``tickwise compare``."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tickwise.cli.app import COLUMNS, JsonFlag, command, output, print_json
from tickwise.cli.evidence import read_any

if TYPE_CHECKING:
    from tickwise.logic.alignment import Alignment
    from tickwise.logic.syntax import Formula

_DATA = f"Also tell how often trajectories drawn from the ranges of these disagree: {COLUMNS}, labels are not needed."
_PICTURE = "Also draw both formulas over one another, as one SVG file."


@command
def compare(
    source: Annotated[str, typer.Argument(help="A formula in sequential disjunctive normal form.")],
    target: Annotated[str, typer.Argument(help="Another one.")],
    data: Annotated[Path | None, typer.Option("--data", help=_DATA)] = None,
    picture: Annotated[Path | None, typer.Option("--picture", metavar="FILE.svg", help=_PICTURE)] = None,
    as_json: JsonFlag = False,
) -> None:
    """Tell whether the second formula is structurally transferable from the first, and how far they are apart.

    For example: tickwise compare 'F[1,15] (x >= 3)' 'F[2,9] (y <= 1)'
    """
    from tickwise._files import write_bytes
    from tickwise.logic.alignment import align
    from tickwise.logic.parse import parse
    from tickwise.logic.sdnf import to_sdnf
    from tickwise.logic.structure import structurally_equivalent, structurally_transferable, structure

    first, second = parse(source), parse(target)
    equivalent = structurally_equivalent(first, second)
    transferable = structurally_transferable(second, first)
    structures = {
        f"{name}_structure": [[str(operator) for operator in part] for part in structure(phi)]
        for name, phi in (("source", first), ("target", second))
    }
    alignment = align(first, second) if transferable else None
    apart = None if data is None else _apart(first, second, data)
    if picture is not None:
        from tickwise.experiments.figures import draw_overlay

        write_bytes(picture, draw_overlay(to_sdnf(first), to_sdnf(second)).encode())
    if as_json:
        known = {"structurally_equivalent": equivalent, "structurally_transferable": transferable, **structures}
        print_json(known | ({} if alignment is None else {"alignment": _document(alignment)}) | (apart or {}))
        return
    output.print(f"structurally equivalent: {'yes' if equivalent else 'no'}")
    output.print(f"target structurally transferable from source: {'yes' if transferable else 'no'}")
    for name, parts in structures.items():
        output.print(f"{name.replace('_', ' ')}: {' | '.join(' & '.join(part) for part in parts)}")
    if alignment is None:
        output.print(f"why not: {_difference(*structures.values())}")
    else:
        output.print(f"target is displaced by: {_amounts(alignment.shifts, alignment.delay)}")
        output.print(f"mean difference that remains: {_amounts(alignment.regions, alignment.windows)}")
    if apart is not None:
        output.print(f"probability that they disagree: {apart['disagreement']:.4g}")
        output.print(f"the same where either is satisfied: {apart['dissimilarity']:.4g}")


def _apart(source: Formula, target: Formula, data: Path) -> dict[str, float]:
    """How often the formulas disagree on independent uniform draws from the data's ranges, as long as the data are."""
    from tickwise.inference.similarity import disagreement, dissimilarity
    from tickwise.inference.space import SearchSpace

    known, _ = read_any(data)
    prior = SearchSpace.from_data(known).box_prior(known.horizon)
    return {
        "disagreement": disagreement(source, target, prior),
        "dissimilarity": dissimilarity(source, target, prior),
    }


def _document(alignment: Alignment) -> dict[str, Any]:
    regions = {name: value if math.isfinite(value) else None for name, value in alignment.regions.items()}
    return {
        "shifts": alignment.shifts,
        "delay": alignment.delay,
        "regions": regions,
        "windows": alignment.windows,
    }


def _amounts(values: Mapping[str, float], ticks: float) -> str:
    """Amounts of variables and of ticks, as text."""
    return ", ".join([*(f"{name} {value:g}" for name, value in values.items()), f"{ticks:g} ticks"])


def _difference(source: Sequence[Sequence[str]], target: Sequence[Sequence[str]]) -> str:
    """Where the target is no copy of the source's structure, nor several of them."""
    if len(target) % len(source):
        return f"the target has {_count(len(target))}, the source {_count(len(source))}; use as many, or several times"
    number, part = next((n, part) for n, part in enumerate(target) if part != source[n % len(source)])
    wanted = " & ".join(source[number % len(source)])
    return f"disjunct {number + 1} of the target is {' & '.join(part)}, where the source has {wanted}"


def _count(disjuncts: int) -> str:
    return f"{disjuncts} disjunct{'' if disjuncts == 1 else 's'}"
