"""The command ``tickwise infer``."""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tickwise.cli import completion
from tickwise.cli.app import COLUMNS, INTERRUPTED, JsonFlag, busy, command, messages, output, print_json
from tickwise.cli.evidence import page_path, show_explanation, show_validation, write_page
from tickwise.errors import ConfigurationError

if TYPE_CHECKING:
    from tickwise.inference.classifier import MITLClassifier
    from tickwise.inference.explanation import Explanation
    from tickwise.inference.trajectories import LabelledTrajectories
    from tickwise.inference.validation import Trial, Validation

_PAGE = "Also write a page with the formula, what it separates and a drawing, as one HTML file."
_FOLDS = "Also infer without each of so many parts, and judge on it (cross-validation)."
_SEARCH = "exact, joint (all primitives at once) or the paper's swarm."


@command
def infer(
    data: Annotated[Path, typer.Argument(help=f"Labelled trajectories: {COLUMNS}.")],
    size: Annotated[int, typer.Option(min=1, help="The most primitives, ϱ_th.")] = 4,
    rate: Annotated[float, typer.Option(help="The least classification rate, ζ.")] = 0.95,
    information_weight: Annotated[float, typer.Option(min=0, help="The weight of the information gain, λ.")] = 0.01,
    depth: Annotated[int, typer.Option(min=1, help="The depth of the decision tree, h_max.")] = 2,
    class_weight: Annotated[str | None, typer.Option(help="'balanced' lets both labels count the same.")] = None,
    search: Annotated[str, typer.Option(help=_SEARCH, autocompletion=completion.searches)] = "exact",
    levels: Annotated[int, typer.Option(min=1, help="The most thresholds an exact search has of a variable.")] = 32,
    seconds: Annotated[float | None, typer.Option(help="The most that one exact search may take.")] = None,
    holdout: Annotated[
        float | None, typer.Option(help="Infer without this share, such as 0.2, and judge on it.")
    ] = None,
    folds: Annotated[int | None, typer.Option(min=2, help=_FOLDS)] = None,
    seed: Annotated[int, typer.Option(min=0, help="The seed of the swarm, and of what is held out.")] = 0,
    page: Annotated[Path | None, typer.Option("--page", "--html", metavar="FILE.html", help=_PAGE)] = None,
    as_json: JsonFlag = False,
) -> None:
    """Infer the formula that tells trajectories with label 1 from those with label -1.

    With --holdout or --folds its error on trajectories that it was not inferred from is told, too. Ctrl-C ends an exact
    search with the best formula so far. For example: tickwise infer logs.csv --folds 10 --page logs.html
    """
    from tickwise.inference.classifier import MITLClassifier
    from tickwise.inference.exact import ExactSettings
    from tickwise.inference.explanation import explain
    from tickwise.inference.reading import read_trajectories
    from tickwise.inference.validation import stratified_folds

    if holdout is not None and folds is not None:
        raise ConfigurationError("--holdout and --folds exclude each other; use one of them")
    page = page_path(page)
    known = read_trajectories(data).require_both_classes()
    if folds is not None:
        stratified_folds(known.labels, folds, seed)  # complains before the long work, if it has to
    model = MITLClassifier(
        size=size, rate=rate, information_weight=information_weight, depth=depth, class_weight=class_weight,
        random_state=seed, variables=known.variables, search=search,
        limits=ExactSettings(levels=levels, seconds=seconds, threads=os.cpu_count() or 1),
    )  # fmt: skip
    began = time.monotonic()
    model, learned, judged = _fit(model, known, holdout, seed)
    spent = time.monotonic() - began
    if folds is not None and not model.interrupted_:
        judged = _in_folds(model, known, folds, seed)
    wanted = holdout is not None or folds is not None
    interrupted = model.interrupted_ or (wanted and (judged is None or judged.interrupted))
    found = explain(None if model.formula_ is None else model.formula_.formula, learned)
    facts = _facts(model, learned, spent)
    if page is not None:
        from tickwise.inference.page import render_page

        settings = {
            "Most primitives, ϱ_th": size, "Least classification rate, ζ": rate,
            "Weight of the information gain, λ": information_weight, "Depth, h_max": depth, "Search": search,
            "Class weight": class_weight or "none", "Seed": seed,
        }  # fmt: skip
        text = render_page(
            found, known, source=data.name, settings=settings, facts=facts, tree=model.tree_, judged=judged
        )
        write_page(page, text)
    if as_json:
        held_out = {} if judged is None else {"validation": judged.document()}
        print_json({**facts, "interrupted": interrupted, **found.document(), **held_out})
    else:
        _show(model, facts, found, judged)
        if page is not None:
            output.print(f"page: {page}")
    if interrupted:
        messages.print("interrupted: this is the best so far")
        raise typer.Exit(INTERRUPTED)


def _fit(
    model: MITLClassifier, known: LabelledTrajectories, holdout: float | None, seed: int
) -> tuple[MITLClassifier, LabelledTrajectories, Validation | None]:
    """The fitted model, the trajectories that it was fitted to, and how it did on the others."""
    import numpy as np

    from tickwise.inference.validation import hold_out, states_of

    with busy("searching ..."):
        if holdout is None:
            return model.fit(states_of(known), known.labels), known, None
        model, judged = hold_out(model, known, holdout, seed)
    kept = np.setdiff1d(np.arange(len(known)), judged.trials[0].rows)
    return model, known.select(kept), judged


def _in_folds(model: MITLClassifier, known: LabelledTrajectories, folds: int, seed: int) -> Validation | None:
    """Cross-validate; on a terminal a line tells of each fold. None where Ctrl-C came before the first was finished."""
    from tickwise.inference.validation import cross_validate, percent

    with busy(f"fold 1 of {folds} ...") as say:

        def report(number: int, trial: Trial) -> None:
            if messages.is_terminal:
                line = f"held-out error {percent(trial.error)}, {trial.seconds:.1f} s, {trial.formula or 'no formula'}"
                messages.print(f"fold {number} of {folds}: {line}")
            say(f"fold {min(number + 1, folds)} of {folds} ...")

        try:
            return cross_validate(model, known, folds, seed, report)
        except KeyboardInterrupt:
            return None


def _facts(model: MITLClassifier, learned: LabelledTrajectories, spent: float) -> dict[str, Any]:
    from tickwise.inference.information import information_gain
    from tickwise.inference.tree import classification_rate

    formula = model.formula_
    return {
        "formula": None if formula is None else str(formula),
        "classification_rate": classification_rate(formula, learned),
        "information_gain": None if formula is None else information_gain(formula, model.prior_),
        "size": None if formula is None else formula.size,
        "satisfying": model.satisfying_,
        "seconds": round(spent, 3), "search": model.search, "gap": model.gap_, "interrupted": model.interrupted_,
    }  # fmt: skip


def _show(model: MITLClassifier, facts: dict[str, Any], found: Explanation, judged: Validation | None) -> None:
    if found.formula is None:
        output.print("no formula: no leaf of the decision tree has label 1; a greater --depth may help")
    else:
        output.print(facts["formula"])
        output.print(f"in words: {found.english}")
        output.print(
            f"classification rate {facts['classification_rate']:.4f}, information gain "
            f"{facts['information_gain']:.4f}, size {facts['size']}, "
            f"{'' if facts['satisfying'] else 'not '}satisfying (Problem 1), {facts['seconds']:.1f} s"
        )
        if model.gap_ is not None:
            proved = model.gap_ <= 1e-12
            output.print("each node's best, proved" if proved else f"a node's J can be {model.gap_:.2g} better at most")
    show_explanation(found)
    if judged is not None:
        show_validation(judged)
