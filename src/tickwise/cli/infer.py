"""The command ``tickwise infer``."""

from __future__ import annotations

import os
import time
from contextlib import nullcontext
from pathlib import Path
from typing import Annotated

import typer

from tickwise.cli.app import COLUMNS, INTERRUPTED, JsonFlag, command, messages, output, print_json


@command
def infer(
    data: Annotated[Path, typer.Argument(help=f"Labelled trajectories: {COLUMNS}.")],
    size: Annotated[int, typer.Option(min=1, help="The most primitives, ϱ_th.")] = 4,
    rate: Annotated[float, typer.Option(help="The least classification rate, ζ.")] = 0.95,
    information_weight: Annotated[float, typer.Option(min=0, help="The weight of the information gain, λ.")] = 0.01,
    depth: Annotated[int, typer.Option(min=1, help="The depth of the decision tree, h_max.")] = 2,
    class_weight: Annotated[str | None, typer.Option(help="'balanced' lets both labels count the same.")] = None,
    search: Annotated[str, typer.Option(help="exact, joint (all primitives at once) or the paper's swarm.")] = "exact",
    seconds: Annotated[float | None, typer.Option(help="The most that one exact search may take.")] = None,
    seed: Annotated[int, typer.Option(min=0, help="The seed of the swarm.")] = 0,
    as_json: JsonFlag = False,
) -> None:
    """Infer the formula that tells trajectories with label 1 from those with label -1.

    Ctrl-C ends an exact search with the best formula so far. For example: tickwise infer logs.csv --search joint
    """
    from tickwise.inference.classifier import MITLClassifier
    from tickwise.inference.exact import ExactSettings
    from tickwise.inference.information import information_gain
    from tickwise.inference.reading import read_trajectories
    from tickwise.inference.tree import classification_rate
    from tickwise.logic.render import to_english

    known = read_trajectories(data).require_both_classes()
    model = MITLClassifier(
        size=size, rate=rate, information_weight=information_weight, depth=depth, class_weight=class_weight,
        random_state=seed, variables=known.variables, search=search,
        limits=ExactSettings(seconds=seconds, threads=os.cpu_count() or 1),
    )  # fmt: skip
    began = time.monotonic()
    with messages.status("searching ...") if messages.is_terminal else nullcontext():
        model.fit([values[:length] for values, length in zip(known.values, known.lengths, strict=True)], known.labels)
    spent = time.monotonic() - began
    formula = model.formula_
    facts = {
        "formula": None if formula is None else str(formula),
        "classification_rate": classification_rate(formula, known),
        "information_gain": None if formula is None else information_gain(formula, model.prior_),
        "size": None if formula is None else formula.size,
        "satisfying": model.satisfying_,
        "seconds": round(spent, 3), "search": search, "gap": model.gap_, "interrupted": model.interrupted_,
    }  # fmt: skip
    if as_json:
        print_json(facts)
    elif formula is None:
        output.print("no formula: no leaf of the decision tree has label 1; a greater --depth may help")
    else:
        output.print(facts["formula"])
        output.print(f"in words: {to_english(formula)}")
        output.print(
            f"classification rate {facts['classification_rate']:.4f}, information gain "
            f"{facts['information_gain']:.4f}, size {facts['size']}, "
            f"{'' if facts['satisfying'] else 'not '}satisfying (Problem 1), {spent:.1f} s"
        )
        if model.gap_ is not None:
            proved = model.gap_ <= 1e-12
            output.print("each node's best, proved" if proved else f"a node's J can be {model.gap_:.2g} better at most")
    if model.interrupted_:
        messages.print("interrupted: this is the best so far")
        raise typer.Exit(INTERRUPTED)
