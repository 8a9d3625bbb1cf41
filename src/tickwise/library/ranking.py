"""Which entries of a library a new task can begin from, the best first, and why."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from statistics import fmean

from tickwise._seeding import generator
from tickwise._wording import listed
from tickwise.errors import ConfigurationError, DataError, NotTransferableError
from tickwise.inference.fit import Fit
from tickwise.inference.similarity import dissimilarity
from tickwise.inference.space import SearchSpace
from tickwise.inference.template import TransferFit, fit_transferable
from tickwise.library.entry import Entry
from tickwise.library.handover import transferred_values
from tickwise.library.standing import ORDER, Numbers, key_of, reason_of
from tickwise.library.target import Target
from tickwise.logic.alignment import align, aligned
from tickwise.logic.sdnf import SDNF
from tickwise.transfer.promise import promise


@dataclass(frozen=True, slots=True)
class Ranked:
    """An entry that the new task can begin from.

    Attributes:
        entry: The entry.
        fit: The formula of its structure that was fitted to the new task's trajectories.
        numbers: How promising it is.
        why: Why it stands where it stands, in one sentence.
    """

    entry: Entry
    fit: Fit
    numbers: Numbers
    why: str


@dataclass(frozen=True, slots=True)
class Refused:
    """An entry that the new task cannot begin from.

    Attributes:
        entry: The entry.
        why: Why not, in one sentence.
    """

    entry: Entry
    why: str


@dataclass(frozen=True, slots=True)
class Ranking:
    """The entries of a library for a new task.

    Attributes:
        ranked: Those that it can begin from, the best first.
        refused: The others.
        task: The new task's formula, of those fitted the one with the greatest J; None where none is satisfying.
        order: By which numbers they are ranked.
    """

    ranked: tuple[Ranked, ...]
    refused: tuple[Refused, ...]
    task: Fit | None
    order: tuple[str, ...]

    @property
    def best(self) -> Ranked:
        """The first.

        Raises:
            NotTransferableError: If there is none, with the reasons.
        """
        if not self.ranked:
            reasons = " ".join(f"{each.entry.name}: {each.why}" for each in self.refused[:2])
            more = f" And {len(self.refused) - 2} more." if len(self.refused) > 2 else ""
            raise NotTransferableError(f"no entry is transferable to the new task. {reasons}{more}".strip())
        return self.ranked[0]


def rank(
    entries: Iterable[Entry],
    target: Target,
    order: Sequence[str] = ORDER,
    report: Callable[[int, int], None] | None = None,
) -> Ranking:
    """Rank entries by how promising a beginning they are for a new task.

    To each structure among the entries a formula is fitted as in Step 2 of Section IV-B; entries whose structure gives
    no satisfying formula are refused. Structures that say little may give one, too, which is then easily satisfied. So
    all that are left are measured by the same formula, the most convincing of those fitted, which has the greatest J.

    Args:
        entries: The entries.
        target: The new task.
        order: By which `Numbers` they are ranked.
        report: Told how many structures are fitted, and of how many.

    Returns:
        The entries, in order.

    Raises:
        ConfigurationError: If the order names no number.
        KeyboardInterrupt: If Ctrl-C ended a fit.
    """
    if not order or not set(order) <= set(ORDER):
        raise ConfigurationError(f"entries cannot be ranked by {listed(order) or 'nothing'}; use {', '.join(ORDER)}")
    left, refused = _suitable(entries, target)
    found: list[tuple[Entry, Fit]] = []
    for entry, outcome in zip(left, _fits(left, target, report), strict=True):
        if isinstance(outcome, str) or not outcome.transferable:
            refused.append(Refused(entry, outcome if isinstance(outcome, str) else outcome.reason))
        else:
            found.append((entry, outcome.attempts[-1]))
    best = max((fit for _, fit in found), key=lambda fit: fit.objective, default=None)
    measured: list[tuple[Entry, Fit, Numbers]] = []
    for entry, fit in found:
        try:
            measured.append((entry, fit, numbers_of(entry, fit, target, (best or fit).formula)))
        except (DataError, ConfigurationError) as error:  # worlds that differ in kind
            refused.append(Refused(entry, f"It cannot be transferred: {error}."))
    measured.sort(key=lambda row: key_of(row[2], order))
    every = [(entry.name, numbers) for entry, _, numbers in measured]
    ranked = tuple(Ranked(*row, reason_of(place, every, order)) for place, row in enumerate(measured))
    return Ranking(ranked, tuple(sorted(refused, key=lambda each: each.entry.name)), best, tuple(order))


def distance(source: SDNF, target: SDNF, space: SearchSpace) -> float:
    """What remains of regions and windows once a formula lies over another (see `tickwise.logic.alignment`).

    Args:
        source: A formula.
        target: Another one, structurally transferable from it.
        space: The ranges of the target's variables, and its horizon.

    Returns:
        The share of the ranges and of the horizon, the mean over the variables and time; a side that is open in one
        formula only counts as a whole range.

    Raises:
        FormulaError: If the target is not structurally transferable from the source.
    """
    remaining = align(source, target)
    ranges = {name: edges[-1] - edges[0] for name, edges in zip(space.variables, space.edges, strict=True)}
    shares = [min(1.0, amount / ranges[name]) for name, amount in remaining.regions.items()]
    return fmean([*shares, remaining.windows / space.horizon])


def _suitable(entries: Iterable[Entry], target: Target) -> tuple[list[Entry], list[Refused]]:
    """The entries by name, and those that are out of the question before anything is fitted."""
    left, refused = [], []
    ours, mdp = target.task.data.variables, target.mdp
    for entry in sorted(entries, key=lambda entry: entry.name):
        theirs = entry.mdp.variables
        if theirs != ours:
            why = f"Its world has the variables {listed(theirs)}, and the new task's {listed(ours)}."
            refused.append(Refused(entry, why))
        elif mdp is not None and mdp.n_actions != entry.mdp.n_actions:
            why = f"Its world has {entry.mdp.n_actions} actions, and the new task's {mdp.n_actions}."
            refused.append(Refused(entry, why))
        else:
            left.append(entry)
    return left, refused


def _fits(
    entries: Sequence[Entry], target: Target, report: Callable[[int, int], None] | None
) -> list[TransferFit | str]:
    """What Step 2 gives for each entry's structure, or why it cannot be fitted; each structure is fitted once."""
    structures = {_structure(entry.formula): entry.formula for entry in entries}
    fits: dict[str, TransferFit | str] = {}
    for key, formula in structures.items():
        if report is not None:
            report(len(fits), len(structures))
        task, rng = target.task, generator(target.seed, "library", key)
        try:
            fits[key] = fit_transferable(
                task.data, task.prior, task.space, formula, target.settings, target.search, rng
            )
        except ConfigurationError as error:
            fits[key] = f"It cannot be fitted: {error}."
    return [fits[_structure(entry.formula)] for entry in entries]


def _structure(formula: SDNF) -> str:
    """What a fit depends on: operators, and whether their predicates are complements."""
    parts = (
        " & ".join(f"{each.operator}{'!' * each.complemented}" for each in disjunct.primitives)
        for disjunct in formula.disjuncts
    )
    return " | ".join(parts)


def numbers_of(entry: Entry, fit: Fit, target: Target, task: SDNF) -> Numbers:
    """How promising a beginning an entry is.

    Args:
        entry: The entry.
        fit: The formula of its structure that was fitted to the new task, which its values are transferred by.
        target: The new task.
        task: The formula that is to be satisfied.

    Raises:
        DataError: If the worlds' actions, coordinates or orientations differ in number.
    """
    promised = None
    if target.mdp is not None:
        memory, q = transferred_values(entry, fit.formula, target)
        promised = promise(task, target.horizon, target.mdp, memory, q)
    return Numbers(
        promise=promised,
        dissimilarity=dissimilarity(aligned(entry.formula, fit.formula), task, target.task.prior),
        distance=distance(entry.formula, fit.formula, target.task.space),
    )
