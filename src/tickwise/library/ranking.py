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
from tickwise.library.outlook import Outlook
from tickwise.library.standing import ORDER, Numbers, key_of, reason_of, warning_of
from tickwise.library.target import Target
from tickwise.logic.alignment import align, aligned
from tickwise.logic.sdnf import SDNF
from tickwise.transfer.promise import greedy_success
from tickwise.transfer.rehearsal import Goal

Report = Callable[[str, int, int], None]
"""Is told what is done, such as ``fitting structure``, how many of it are done, and of how many."""


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
        without: Episodes of learning in the model of the world without transferred values, which those of the entries'
            `Numbers.rehearsal` are held against; None where no world is known or no entry is transferable.
        goal: What had to be reached in a rehearsal; one that did not get there counts with the goal's most episodes.
    """

    ranked: tuple[Ranked, ...]
    refused: tuple[Refused, ...]
    task: Fit | None
    order: tuple[str, ...]
    without: float | None
    goal: Goal

    @property
    def warning(self) -> str | None:
        """Why the first had better not be transferred, in one sentence; None where a gain is foreseen, or no world."""
        if not self.ranked:
            return None
        first = self.ranked[0]
        return warning_of(first.entry.name, first.numbers, self.without, self.goal.most)

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
    report: Report | None = None,
) -> Ranking:
    """Rank entries by how promising a beginning they are for a new task.

    To each structure among the entries a formula is fitted as in Step 2 of Section IV-B; entries whose structure gives
    no satisfying formula are refused. Structures that say little may give one, too, which is then easily satisfied. So
    all that are left are measured by the same formula, the most convincing of those fitted, which has the greatest J.
    Where a world is known, this formula is learned in it from each entry's values, and once without any.

    Args:
        entries: The entries.
        target: The new task.
        order: By which `Numbers` they are ranked.
        report: Told how far it is.

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
    without, goal = None, target.goal
    if best is not None:
        outlook = Outlook(target, best.formula)
        measured, failed = _measured(found, outlook, report)
        refused += failed
        if measured and target.mdp is not None:
            without, goal = outlook.without, outlook.goal
    measured.sort(key=lambda row: key_of(row[2], order))
    every = [(entry.name, numbers) for entry, _, numbers in measured]
    ranked = tuple(Ranked(*row, reason_of(place, every, order, goal.most)) for place, row in enumerate(measured))
    refused.sort(key=lambda each: each.entry.name)
    return Ranking(ranked, tuple(refused), best, tuple(order), without, goal)


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


def _fits(entries: Sequence[Entry], target: Target, report: Report | None) -> list[TransferFit | str]:
    """What Step 2 gives for each entry's structure, or why it cannot be fitted; each structure is fitted once."""
    structures = {_structure(entry.formula): entry.formula for entry in entries}
    fits: dict[str, TransferFit | str] = {}
    for key, formula in structures.items():
        if report is not None:
            report("fitting structure", len(fits), len(structures))
        task, rng = target.task, generator(target.seed, "library", key)
        try:
            fits[key] = fit_transferable(
                task.data, task.prior, task.space, formula, target.settings, target.search, rng
            )
        except ConfigurationError as error:
            fits[key] = f"It cannot be fitted: {error}."
    return [fits[_structure(entry.formula)] for entry in entries]


def _measured(
    found: Sequence[tuple[Entry, Fit]], outlook: Outlook, report: Report | None
) -> tuple[list[tuple[Entry, Fit, Numbers]], list[Refused]]:
    """How promising each entry is, and those that cannot be transferred after all."""
    measured, refused = [], []
    for done, (entry, fit) in enumerate(found):
        if report is not None:
            report("measuring entry", done, len(found))
        try:
            measured.append((entry, fit, numbers_of(entry, fit, outlook)))
        except (DataError, ConfigurationError) as error:  # worlds that differ in kind
            refused.append(Refused(entry, f"It cannot be transferred: {error}."))
    return measured, refused


def _structure(formula: SDNF) -> str:
    """What a fit depends on: operators, and whether their predicates are complements."""
    parts = (
        " & ".join(f"{each.operator}{'!' * each.complemented}" for each in disjunct.primitives)
        for disjunct in formula.disjuncts
    )
    return " | ".join(parts)


def numbers_of(entry: Entry, fit: Fit, outlook: Outlook) -> Numbers:
    """How promising a beginning an entry is.

    Args:
        entry: The entry.
        fit: The formula of its structure that was fitted to the new task, which its values are transferred by.
        outlook: The new task, and the formula that is to be satisfied.

    Raises:
        DataError: If the worlds' actions, coordinates or orientations differ in number.
        ConfigurationError: If a region contains no cell of the world, or the formula's table would be too large.
    """
    target, rehearsed, promised = outlook.target, None, None
    if target.mdp is not None:
        memory, q = transferred_values(entry, fit.formula, target)
        problem = outlook.problem(memory)
        rehearsed, promised = outlook.rehearsal(problem, q), greedy_success(problem, q)
    return Numbers(
        rehearsal=rehearsed,
        promise=promised,
        dissimilarity=dissimilarity(aligned(entry.formula, fit.formula), outlook.formula, target.task.prior),
        distance=distance(entry.formula, fit.formula, target.task.space),
    )
