"""Method V of a study: the closed loop, from the source's formula to the optimum of the target task."""

from __future__ import annotations

from typing import Any

from tickwise._seeding import generator
from tickwise.errors import ConfigurationError
from tickwise.experiments.artefacts import Artefacts
from tickwise.experiments.course import learning_course
from tickwise.experiments.inferences import satisfying_source, search_space, uniform_prior
from tickwise.experiments.job import Job, Outcome, Report
from tickwise.experiments.study import StudySpec
from tickwise.rl.qlearning import Problem
from tickwise.rl.states import disjunct_choice, tau_memory
from tickwise.transfer.closed_loop import Attempt, ClosedLoop, Target
from tickwise.transfer.episodes import good_return, unbroken


def learn_in_closed_loop(job: Job, spec: StudySpec, store: Artefacts, report: Report) -> Outcome:
    """Collect, infer and learn in the target task at once; every episode in it counts.

    Raises:
        ConfigurationError: If no satisfying formula of the source task was inferred.
    """
    loop = closed_loop(spec, store, job.run)
    episodes = spec.learning.most_episodes["V"]
    points = [*range(0, episodes, spec.learning.loop_steps), episodes]
    course = learning_course(job, spec, loop, lambda: loop.target.extended(loop.assumed).memory, points, report)
    good = loop.episodes.good
    facts = {
        **course.manifest, "collected": loop.collected,
        "first_good": int(good.argmax()) + 1 if good.any() else None,
        "formula": None if loop.formula is None else str(loop.formula), "transferable": loop.transferable,
        "reason": loop.reason, "attempts": [_attempt(attempt) for attempt in loop.attempts],
    }  # fmt: skip
    return Outcome(facts, course.arrays)


def closed_loop(spec: StudySpec, store: Artefacts, run: int) -> ClosedLoop:
    """The closed loop of a run, before its first episode.

    Raises:
        ConfigurationError: If no satisfying formula of the source task was inferred.
    """
    source = satisfying_source(spec, store)
    if source is None:
        raise ConfigurationError("V needs a satisfying formula of the source, and none was inferred; leave it out")
    environment = spec.target
    mdp = environment.mdp()
    target = Target(
        Problem(mdp, environment.task_table(), tau_memory(mdp, 1)),
        uniform_prior(environment),
        search_space(environment),
        spec.inference,
        good_return if spec.collection.least_ticks is None else unbroken,
        disjunct_choice(spec.learning.disjunct),
    )
    return ClosedLoop(target, source, spec.learning.loop, generator(spec.seed, spec.name, "loop", run))


def _attempt(attempt: Attempt) -> dict[str, Any]:
    return {
        "formula": str(attempt.formula), "begun": attempt.begun, "episodes": attempt.episodes, "wrong": attempt.wrong,
        "good": attempt.good,
    }  # fmt: skip
