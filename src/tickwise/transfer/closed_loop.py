"""The closed loop: collecting, inferring and learning in the target task at once, from the source's structure on.

The paper collects thousands of episodes, infers φ^T once (Section IV-B, Step 2) and learns then. Here episodes are
played to satisfy formulas of the source's structure that nothing has contradicted yet, such that as many of them as can
be are put to the test. Once some episodes were good, a formula that agrees with all is acted on and tested on fresh
ones. If it misjudges them, the next formula follows, and values go from one to the next by ξ (Algorithm 2).
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tickwise.errors import DataError
from tickwise.inference.exact import ExactSettings
from tickwise.inference.growth import infer_jointly
from tickwise.inference.hypotheses import Hypotheses
from tickwise.inference.neighbours import neighbours, weaker_neighbours
from tickwise.inference.objective import formula_signature
from tickwise.inference.prior import Prior
from tickwise.inference.space import SearchSpace
from tickwise.inference.tree import InferenceSettings
from tickwise.logic.sdnf import SDNF
from tickwise.logic.structure import structurally_transferable
from tickwise.rl.learner import Learner
from tickwise.rl.model import ModelBased, ModelLearner, imagined, no_counts, satisfying_plan
from tickwise.rl.qlearning import Problem
from tickwise.rl.states import DisjunctChoice, automaton_memory, nearest_centroid
from tickwise.transfer.episodes import Episodes, Good
from tickwise.transfer.hypothesis import tick_tables
from tickwise.transfer.qtransfer import transfer_q
from tickwise.transfer.settings import LoopSettings

_FAILURES = 3  # selections without a satisfying formula, one after the other, before another copy is tried
_MARGIN = 0.02  # by how much another formula has to promise more, as a probability, to be tried
_MORE = 1.25  # how many times as many episodes, or good ones, it takes to look for a structure again
_TRIES = 6  # formulas that are tried because they promise more
_NODES = 10_000  # of an exact search; a limit of time would make results depend on the machine
_TIE = 1e-9  # 1 - 0.9 is a little less than 0.1


@dataclass(slots=True)
class Attempt:
    """A formula that was acted on.

    Attributes:
        formula: The formula.
        begun: Episodes before it was acted on.
        episodes: Episodes that it was acted on for, so far.
        wrong: How many of them it misjudged.
        good: How many of them were good.
    """

    formula: SDNF
    begun: int
    episodes: int = 0
    wrong: int = 0
    good: int = 0


@dataclass(frozen=True, slots=True)
class Target:
    """What the closed loop knows of the target task beforehand.

    Attributes:
        problem: The world and the hidden task; what the world does is learned, and of the task only rewards and ends
            are seen.
        prior: The prior of the information gain.
        space: What boxes and times may be chosen.
        settings: ζ, ϱ_th and λ.
        is_good: Which episodes are good.
        choose: Chooses the disjunct at the start of an episode.
    """

    problem: Problem
    prior: Prior
    space: SearchSpace
    settings: InferenceSettings
    is_good: Good
    choose: DisjunctChoice = nearest_centroid

    def extended(self, formula: SDNF) -> Problem:
        """The problem on the extended states of a formula."""
        mdp, task = self.problem.mdp, self.problem.task
        return Problem(mdp, task, automaton_memory(mdp, tick_tables(formula, task.horizon), self.choose))


class ClosedLoop:
    """Collects, infers and learns at once; a `tickwise.rl.learner.Learner` whose memory follows its formula.

    Args:
        target: The target task.
        source: φ^S, whose structure is looked for first.
        settings: How to go about it.
        rng: Draws hypotheses; episodes draw from the generator that `learn` is given.

    Attributes:
        episodes: All episodes so far.
        attempts: The formulas that were acted on, in order.
        collected: Episodes until a formula was satisfying on fresh episodes for the first time; None until then.
    """

    def __init__(self, target: Target, source: SDNF, settings: LoopSettings, rng: np.random.Generator) -> None:
        self.target, self.source, self.settings, self.rng = target, source, settings, rng
        self.episodes = Episodes(target.problem, target.is_good)
        self.hypotheses = Hypotheses(source, target.space, target.prior, settings.hypotheses, rng)
        self.outcomes = no_counts(target.problem.mdp).outcomes
        self.attempts: list[Attempt] = []
        self.collected: int | None = None
        self._refuted = ""
        self._acting: Attempt | None = None
        self._learner: Learner = self._model(source)
        self._guess: Learner | None = None
        self._judged: deque[bool] = deque(maxlen=settings.fresh)
        self._explored = self._failed = self._tried = 0
        self._again = float(settings.patience), math.inf  # good episodes, or all, until a structure is due
        self._aside: Hypotheses | None = None  # what is gone back to where another structure turns out to be wrong

    @property
    def assumed(self) -> SDNF:
        """The formula acted on, or that would be if one had to be now."""
        return self.formula or self.hypotheses.formula(self.hypotheses.best[0])

    @property
    def problem(self) -> Problem:
        """The target task on the extended states of that formula."""
        return self._best_so_far.problem

    @property
    def q(self) -> NDArray[np.float32]:
        """The values on these states, shape ``(memory states, states, actions)``."""
        return self._best_so_far.q

    @property
    def _best_so_far(self) -> Learner:
        if self._acting is not None:
            return self._learner
        if self._guess is None:
            self._guess = self._rewarded(self.assumed)
        return self._guess

    @property
    def formula(self) -> SDNF | None:
        """φ^T, the formula that is acted on; None while there is none."""
        return None if self._acting is None else self._acting.formula

    @property
    def transferable(self) -> bool:
        """Whether the target's formula has the source's structure (Definition 7), which holds until it is refuted."""
        formula = self.formula
        return not self._refuted or (formula is not None and structurally_transferable(formula, self.source))

    @property
    def reason(self) -> str:
        """Why it is not transferable, in one sentence; empty where it is."""
        return "" if self.transferable else self._refuted

    def learn(self, rng: np.random.Generator, episodes: int) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
        """Go on for some episodes; see `tickwise.rl.learner.Learner`."""
        returns = np.empty(episodes, np.float32)
        paths = np.empty((episodes, self.target.problem.task.horizon + 1), np.int32)
        for episode in range(episodes):
            played = self._explore(rng) if self._acting is None else self._act(rng)
            returns[episode], paths[episode] = played[0][0], played[1][0]
        return returns, paths

    def _explore(self, rng: np.random.Generator) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
        """One episode that puts as many hypotheses as can be to the test; after a batch of them, a selection."""
        if rng.random() < self.settings.random:
            plan = self._model(self.hypotheses.source)
            played = plan.play(rng, plan.indifferent)
        else:
            plan, table = self._most_probable()
            played = plan.play(rng, table)
        self.episodes.add(*played)
        self._explored, self._guess = self._explored + 1, None
        if self._explored % self.settings.batch == 0:
            self.hypotheses.update(*self.episodes.labelled())
            self._infer()
        return played

    def _most_probable(self) -> tuple[ModelLearner, NDArray[np.float32]]:
        """The plan to satisfy a hypothesis, and its table, whose imagined episodes most of the hypotheses accept."""
        best = self.hypotheses.best
        found = []
        for formula in self._some(self.hypotheses, self.settings.candidates):
            plan = self._model(formula)
            table = satisfying_plan(plan)
            found.append((self._mass(plan, best, self.settings.imagined, table), plan, table))
        return max(found, key=lambda each: each[0])[1:]

    def _some(self, hypotheses: Hypotheses, most: int) -> list[SDNF]:
        """Some of those that agree best."""
        best = hypotheses.best
        rows = self.rng.choice(len(best), min(most, len(best)), replace=False)
        return [hypotheses.formula(best[row]) for row in rows]

    def _mass(
        self, plan: ModelLearner, among: NDArray[np.float64], episodes: int, table: NDArray[np.float32] | None = None
    ) -> float:
        """The share of hypotheses that accept an imagined episode of a plan: how probably it is good."""
        paths = imagined(plan, self.episodes.starts, episodes, self.rng, table)
        return self.hypotheses.mass(self.episodes.trajectories(paths, np.ones(len(paths), np.int8)), among)

    def _model(self, formula: SDNF) -> ModelLearner:
        """Plans on the world as far as it was met, with a formula's automaton; its rewards are not counted yet."""
        form = self.settings.form if isinstance(self.settings.form, ModelBased) else ModelBased()
        counts = no_counts(self.target.problem.mdp)._replace(outcomes=self.outcomes)
        return form.learner(self.target.extended(formula), counts=counts)

    def _rewarded(self, formula: SDNF) -> ModelLearner:
        """The same with all rewards so far."""
        model = self._model(formula)
        model.recount(self.episodes.paths)
        return model

    def _infer(self) -> None:
        """Act on a formula that is satisfying on all episodes, if there is one (Problem 1, Step 2)."""
        good = self.episodes.good
        if not self.settings.positives <= good.sum() < len(good):
            return
        data, weights = self.episodes.labelled()
        self.hypotheses.update(data, weights, self.settings.rounds)
        if not self._satisfying and self._aside is not None:
            self.hypotheses, self._aside = self._aside, None
            self.hypotheses.update(data, weights, self.settings.rounds)
        if not self._satisfying:
            self._failed += 1
            if self._failed % _FAILURES == 0:
                self._grow(int(good.sum()))
        if self._satisfying:
            self._failed = 0
            self.hypotheses.shrink(data, weights, self.settings.rounds)
            self._act_on(self._most_sure())

    @property
    def _satisfying(self) -> bool:
        return self._is_satisfying(self.hypotheses)

    def _is_satisfying(self, hypotheses: Hypotheses) -> bool:
        return bool(hypotheses.errors.min() <= 1 - self.target.settings.rate + _TIE)

    def _grow(self, good: int) -> None:
        """One more copy of the structure, or the end of the supposition that it is the source's."""
        hypotheses, (data, weights) = self.hypotheses, self.episodes.labelled()
        if (hypotheses.copies + 1) * hypotheses.source.size <= self.target.settings.size:
            before = hypotheses.copies, hypotheses.positions, hypotheses.errors
            hypotheses.grow(data, weights)
            hypotheses.update(data, weights, 3 * self.settings.rounds)
            if not self._satisfying:
                hypotheses.copies, hypotheses.positions, hypotheses.errors = before
        if not self._satisfying and (good >= self._again[0] or len(self.episodes) >= self._again[1]):
            self._again = _MORE * good, _MORE * len(self.episodes)  # either kind may be rare
            self._refuted = self._refuted or self._refutation()
            self._start_over()

    def _refutation(self) -> str:
        """That the source's structure does not say the target's rule."""
        rate, least = 1 - float(self.hypotheses.errors.min()), self.target.settings.rate
        return (
            f"Logical transferability is not identified: the best formula of the source's structure judges {rate:.1%} "
            f"of the target's episodes rightly, below the {least:.1%} that are asked for."
        )

    def _start_over(self) -> None:
        """Go on without the source, from a formula of any structure; again whenever that structure fails as well."""
        data, _ = self.episodes.labelled(prefixes=False)
        limits = ExactSettings(joint=True, nodes=_NODES)
        balanced = replace(self.target.settings, class_weight="balanced")
        try:
            fit = infer_jointly(data, self.target.prior, self.target.space, balanced, limits)
        except DataError:  # nothing tells them apart; more episodes may
            return
        self.hypotheses = self._around(fit.formula)
        if not self._satisfying:  # then an operator may be another: the search that found it was not to its end
            found = [self.hypotheses, *map(self._around, neighbours(fit.formula))]
            self.hypotheses = min(found, key=lambda each: float(each.errors.min()))

    def _around(self, formula: SDNF) -> Hypotheses:
        """Hypotheses of a formula's structure, itself one of them at first."""
        target, (data, weights) = self.target, self.episodes.labelled()
        found = Hypotheses(formula, target.space, target.prior, self.settings.hypotheses, self.rng)
        found.positions[0] = target.space.encode(formula)
        found.update(data, weights, 3 * self.settings.rounds)
        return found

    def _most_sure(self) -> SDNF:
        """Of the hypotheses that agree best, the one whose plan for the rewards most of them accept."""
        best = self.hypotheses.best
        masses = {
            formula: self._mass(self._rewarded(formula), best, 4 * self.settings.imagined)
            for formula in self._some(self.hypotheses, 4 * self.settings.candidates)
        }
        return max(masses, key=masses.__getitem__)

    def _more_promising(self) -> SDNF | None:
        """A formula that agrees as well and could be satisfied clearly more often; None if none is found.

        Where the structure is a guess, too, it may be one that asks for less: what a formula forbids for nothing is
        never done, so that no episode tells.
        """
        if not self._satisfying:
            return None
        other = self._most_promising(self.hypotheses)
        if other is not None or self.transferable:
            return other
        for hypotheses in map(self._around, weaker_neighbours(self.attempts[-1].formula)):
            other = self._most_promising(hypotheses) if self._is_satisfying(hypotheses) else None
            if other is not None:
                self.hypotheses, self._aside = hypotheses, self.hypotheses
                return other
        return None

    def _most_promising(self, hypotheses: Hypotheses) -> SDNF | None:
        """Of some hypotheses the one that could be satisfied most often; None if the formula acted on does as well."""
        formula = self.attempts[-1].formula
        others = self._some(hypotheses, 4 * self.settings.candidates)
        promises = {each: self._promise(each) for each in dict.fromkeys([formula, *others])}
        found = max(promises, key=promises.__getitem__)
        return found if promises[found] > promises[formula] + _MARGIN else None

    def _promise(self, formula: SDNF) -> float:
        """The probability to satisfy a formula, in the world as far as it was met."""
        plan, starts = self._model(formula), self.episodes.starts
        values = satisfying_plan(plan)[plan.problem.memory.start[starts], starts]
        return float(values.max(axis=1).mean())

    def _act_on(self, formula: SDNF) -> None:
        """Go on with a formula, with what was learned on the one before."""
        form, before = self.settings.form, self._learner
        if isinstance(form, ModelBased):
            self._learner = self._rewarded(formula)
        elif not (self.attempts and structurally_transferable(formula, self.attempts[-1].formula)):
            self._learner = form.learner(self.target.extended(formula))  # nothing was learned that ξ could take along
        else:
            problem, fallback = self.target.extended(formula), float(np.median(before.q))
            q = transfer_q(problem.mdp, before.problem.memory, before.q, problem.mdp, problem.memory, fallback)
            self._learner = form.learner(problem, q)
        self._acting, self._guess = Attempt(formula, len(self.episodes)), None
        self.attempts.append(self._acting)
        self._judged.clear()

    def _act(self, rng: np.random.Generator) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
        """One episode of learning on the formula, which it has to judge rightly."""
        attempt = self.attempts[-1]
        played = self._learner.learn(rng, 1)
        good = bool(self.episodes.add(*played)[0])
        path = self.episodes.trajectories(played[1], np.ones(1, np.int8))
        right = good == bool(formula_signature(attempt.formula, path)[0])
        self._judged.append(right)
        attempt.episodes, attempt.good = attempt.episodes + 1, attempt.good + good
        attempt.wrong += not right
        fresh = self.settings.fresh
        if self._judged.count(False) > (1 - self.target.settings.rate + _TIE) * fresh:
            self._refute()
        elif attempt.episodes % fresh == 0:
            self._review(attempt)
        return played

    def _refute(self) -> None:
        """The formula misjudges too much: another one, or more exploration."""
        self._acting = None
        self._infer()

    def _review(self, attempt: Attempt) -> None:
        """After as many fresh episodes as a test takes: it is passed, nothing good comes, or another promises more."""
        if attempt.good < self.settings.positives:
            if attempt.episodes >= 3 * self.settings.fresh:
                self._acting = None  # nothing is wrong with it, and nothing good comes of it
            return
        if self._tried < _TRIES:
            self._tried += 1
            self.hypotheses.update(*self.episodes.labelled(), self.settings.rounds)
            other = self._more_promising()
            if other is not None:
                self._act_on(other)
                return
        if self.collected is None:
            self.collected = len(self.episodes)
