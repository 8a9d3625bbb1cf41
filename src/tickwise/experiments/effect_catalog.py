"""The effects that can be named on the command line: the complexity of inference, and what its settings do.

Each is a setting of a study with the values that it is given and the measures that show what it does.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from tickwise.errors import ConfigurationError
from tickwise.experiments import effect_measures as m
from tickwise.experiments.effects import Effect
from tickwise.experiments.study import StudySpec


def _get(part: str, name: str) -> Callable[[StudySpec], float]:
    """A setting of a part of a study."""

    def value(spec: StudySpec) -> float:
        found: float = getattr(getattr(spec, part), name)
        return found

    return value


def _set(part: str, name: str) -> Callable[[StudySpec, float], StudySpec]:
    """A study with another value of such a setting."""
    return lambda spec, value: replace(spec, **{part: replace(getattr(spec, part), **{name: value})})


def _scale_collection(spec: StudySpec, negatives: float) -> StudySpec:
    """A study with so many trajectories of label -1, and with more or less of all else in proportion.

    More of one label alone would be another problem rather than more data: where at least ζ of the trajectories have
    label -1, the tree has no need to grow at all.
    """
    phase = spec.collection
    factor = negatives / phase.negatives
    phase = replace(
        phase,
        negatives=round(negatives),
        positives={task: max(1, round(factor * count)) for task, count in phase.positives.items()},
        episodes=max(1, round(factor * phase.episodes)),
        most_episodes=round(max(1.0, factor) * phase.most_episodes),
    )
    return replace(spec, collection=phase)


def _noisy_depth(spec: StudySpec, depth: float) -> StudySpec:
    """A study with another depth, whose labels are wrong for one trajectory in ten.

    Nothing is satisfying there, and with a size of 1 nothing larger is fitted anew after Algorithm 1.
    """
    spec = replace(spec, inference=replace(spec.inference, size=1), collection=replace(spec.collection, noise=0.1))
    return _set("inference", "depth")(spec, depth)


def _tau(spec: StudySpec, tau: float) -> StudySpec:
    """A study with another τ; its inference is cut short, since nothing that is measured needs a formula."""
    return _set("collection", "tau")(replace(spec, inference=replace(spec.inference, size=1, depth=1)), tau)


_SIZE = replace(m.SOURCE_SIZE, mark=None)

_ALL = (
    Effect(
        name="trajectories",
        title="The number of labelled trajectories",
        symbol="N⁻",
        axis="trajectories with label −1, N⁻",
        value=_get("collection", "negatives"),
        vary=_scale_collection,
        values=(25, 50, 100, 200, 400, 800, 1600),
        few=(50, 200, 800),
        study="case1",
        paper=(
            "200 trajectories have label −1 in both case studies. For N labelled trajectories the complexity of "
            "Algorithm 1 is Θ(N (1 + ∫₁ᴺ f(u)/u² du)), f being that of the particle swarm: N log N where the swarm "
            "takes a time in proportion to the trajectories."
        ),
        reading=(
            "The trajectories with label 1 grow in proportion. The information gain is computed from the prior, which "
            "takes as long whatever their number; only the classification rate takes longer with more of them. More "
            "trajectories make the structure sure, but not the rest. They show more ways of doing the task in time, "
            "and since the windows of a formula in SDNF do not overlap, it gets more of them right with a wider second "
            "region or a shorter stay than with the true ones. A shorter stay makes learning slow. Few trajectories "
            "may give a formula of one region, whose overlap says nothing of the other."
        ),
        measures=(m.STRUCTURE, m.SOURCE_GAIN, m.SOURCE_OVERLAP, m.TARGET_OVERLAP, m.RETURN_III),
        headline=(m.STRUCTURE, m.ALGORITHM_1, m.STEP_2),
        times=(m.ALGORITHM_1, m.STEP_2),
        size=m.TRAJECTORIES,
    ),
    Effect(
        name="depth",
        title="The depth of the decision tree",
        symbol="hₘₐₓ",
        axis="greatest depth hₘₐₓ",
        value=_get("inference", "depth"),
        vary=_set("inference", "depth"),
        values=(1, 2, 3, 4),
        few=(1, 2),
        study="case1",
        paper=(
            "hₘₐₓ = 2 in both case studies. If hₘₐₓ · 2^(hₘₐₓ − 1) is at most ϱₜₕ, which is 4, no formula can be too "
            "large."
        ),
        reading=(
            "A branch ends where at least ζ of its trajectories have one label (condition I), so that a greater depth "
            "changes nothing once all leaves are that pure."
        ),
        measures=(m.SOURCE_RATE, m.SOURCE_SIZE, m.SPLITS, m.SOURCE_GAIN, m.STRUCTURE, m.RETURN_III),
        headline=(m.RETURN_III, m.ALGORITHM_1),
        times=(m.ALGORITHM_1,),
    ),
    Effect(
        name="noisy-depth",
        title="The depth of the decision tree where one label in ten is wrong",
        symbol="hₘₐₓ",
        axis="greatest depth hₘₐₓ",
        value=_get("inference", "depth"),
        vary=_noisy_depth,
        values=(1, 2, 3, 4),
        few=(1, 2, 3),
        study="case1",
        paper=(
            "The tree has at most 2^hₘₐₓ leaves, and the formula at most hₘₐₓ · 2^(hₘₐₓ − 1) primitives: 1, 4, 12 and "
            "32 for hₘₐₓ = 1 to 4. With ϱₜₕ = 4, two is as deep as it may be."
        ),
        reading=(
            "With wrong labels no node is pure enough, and depth alone ends a branch, or want of ticks: a primitive’s "
            "window must lie apart from those above it. What the rate gains beyond depth 2 it gains on the wrong "
            "labels."
        ),
        measures=(m.SOURCE_RATE, m.TRUE_RATE, _SIZE, m.SPLITS),
        headline=(_SIZE, m.TRUE_RATE, m.ALGORITHM_1),
        times=(m.ALGORITHM_1,),
        episodes={},
    ),
    Effect(
        name="information-weight",
        title="The weight of the information gain",
        symbol="λ",
        axis="weight of the information gain λ",
        value=_get("inference", "information_weight"),
        vary=_set("inference", "information_weight"),
        values=(0.0, 0.0001, 0.001, 0.01, 0.1, 0.3),
        few=(0.0, 0.01, 0.1),
        study="case1",
        paper=(
            "λ = 0.01 in both case studies. Without the information gain (λ = 0) the formula is less informative, and "
            "learning with it (Method II) does not become optimal within two million episodes."
        ),
        reading=(
            "One trajectory counts 1/N in the classification rate, for small λ more than any difference of λ I: the "
            "information gain then chooses among formulas that classify alike, and how much it weighs does not matter. "
            "Once it outweighs the positive trajectories together, the best formula is one that they violate."
        ),
        measures=(m.SOURCE_RATE, m.SOURCE_GAIN, m.STRUCTURE, m.SOURCE_OVERLAP, m.TARGET_OVERLAP, m.RETURN_III),
        headline=(m.TARGET_OVERLAP, m.RETURN_III),
    ),
    Effect(
        name="rate",
        title="The least classification rate",
        symbol="ζ",
        axis="least classification rate ζ",
        value=_get("inference", "rate"),
        vary=_set("inference", "rate"),
        values=(0.8, 0.9, 0.93, 0.95, 0.97, 0.99, 1.0),
        few=(0.9, 0.95, 0.99),
        study="case2",
        paper=(
            "ζ = 0.95 in both case studies. A satisfying formula of the target is looked for with one, two, … copies "
            "of the source’s structure; that of Case Study 2 has two."
        ),
        reading=(
            "Where the trajectories with label −1 make up ζ of all, the root of the tree is a leaf already and there "
            "is no formula. Above that, the first number of copies that reaches ζ is taken, even where one more would "
            "be exact."
        ),
        measures=(m.SOURCE_SIZE, m.TRANSFERABLE, m.DISJUNCTS, m.TARGET_RATE, m.TARGET_OVERLAP, m.RETURN_III),
        headline=(m.DISJUNCTS, m.TARGET_OVERLAP),
    ),
    Effect(
        name="tau",
        title="The horizon of the τ-states",
        symbol="τ",
        axis="horizon of the τ-states τ",
        value=_get("collection", "tau"),
        vary=_tau,
        values=(1, 2, 3, 4, 5, 6),
        few=(1, 3, 5),
        study="case2",
        paper=(
            "τ = 5 in both case studies: the data collection phase and Method I learn on the current state and the τ − "
            "1 before it."
        ),
        reading=(
            "Each more tick makes about seven times as many τ-states: what they tell more is learned later. Without "
            "any memory (τ = 1) staying in one place is learned fast, which lasts long but earns nothing."
        ),
        measures=(m.SOURCE_POSITIVES, m.TARGET_POSITIVES, m.RETURN_I, m.END_I),
        headline=(m.SOURCE_POSITIVES, m.END_I),
        episodes={"I": 100_000},
        # without a memory hardly any trajectory gets label 1 there, and often none
        impossible={"case1": (1,)},
    ),
)

EFFECTS = {effect.name: effect for effect in _ALL}
"""All effects by name."""


def find_effect(name: str) -> Effect:
    """An effect by name.

    Raises:
        ConfigurationError: If there is no such effect.
    """
    if name not in EFFECTS:
        raise ConfigurationError(f"there is no effect {name!r}; choose {', '.join(EFFECTS)}")
    return EFFECTS[name]
