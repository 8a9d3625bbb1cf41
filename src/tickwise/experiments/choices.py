"""What the paper leaves open and what was chosen; numbers come from the specification, so that none goes stale."""

from __future__ import annotations

from dataclasses import dataclass

from tickwise.envs.catalog import EnvironmentSpec
from tickwise.envs.tasks import ReachStayReach
from tickwise.experiments.regions import Name, overlap, ranges_text, read_formula
from tickwise.experiments.study import StudySpec
from tickwise.rl.qlearning import QSettings


@dataclass(frozen=True, slots=True)
class Choice:
    """One thing that the paper leaves open.

    Attributes:
        subject: What it is about, in a few words.
        paper: What the paper says of it.
        ours: What was chosen, and why.
    """

    subject: str
    paper: str
    ours: str


def choices(spec: StudySpec) -> tuple[Choice, ...]:
    """Everything that the paper leaves open in a study, with the choice made."""
    remarks = (Choice(*remark) for remark in spec.remarks)
    return (*remarks, *_world(spec), *_learning(spec), *_inference(spec), *_transfer(spec), *_measures(spec))


def _world(spec: StudySpec) -> tuple[Choice, ...]:
    world = spec.target.world
    found = [
        Choice(
            "Coordinates",
            "Regions are rectangles such as [3, 4] × [3, 5]; how cells and coordinates relate is not said.",
            "A world of n × n cells spans [0, n]², cell (i, j) is the unit square from (i, j), and the robot is at its "
            "cell's centre. So a region is a union of whole cells; every rectangle in the paper then has a cell.",
        ),
        Choice(
            "Motion",
            "The robot may slip with probability 0.04 going straight and fail to turn with 0.03; the initial state is "
            "random.",
            f"Going straight leads one cell forward, or to the cell on the left or on the right with {world.slip:g} "
            f"each; a turn fails with {world.turn_failure:g}; a move out of the world stays. A state is a cell and a "
            "heading, and all are equally likely at tick 0.",
        ),
    ]
    for environment, task, key in ((spec.source, "S", "source"), (spec.target, "T", "target")):
        found.append(_regions(spec, environment, task, key))
    return tuple(found)


def _regions(spec: StudySpec, environment: EnvironmentSpec, task: str, key: str) -> Choice:
    published = read_formula(spec.published.formulas.get(key), task, environment)
    inferred = published.names if published is not None else {}
    parts = []
    for landmark in environment.task.landmarks:
        name = Name(landmark.label, task, inferred=False).plain
        like = [box for box, given in inferred.items() if given.label == landmark.label]
        same = any(overlap(box, landmark.box, environment.world.size) == 1 for box in like)
        origin = "as the paper infers it" if same else f"the paper infers {ranges_text(like[0])}" if like else "ours"
        parts.append(f"{name} = {ranges_text(landmark.box)} ({origin})")
    return Choice(
        f"True regions of the {key} task",
        spec.published.regions or "It has no such task.",
        "; ".join(parts) + ".",
    )


def _learning(spec: StudySpec) -> tuple[Choice, ...]:
    settings, phase = spec.learning.settings, spec.collection
    task = spec.target.task
    initial = f"{settings.initial:g}, the same for every method."
    if isinstance(task, ReachStayReach):
        ahead = task.reward * settings.gamma**task.deadline
        side = "a little below it" if settings.initial < ahead else "above it"
        initial = (
            f"{settings.initial:g}, the same for every method: the value of a success {task.deadline} ticks ahead is "
            f"{task.reward:g} · {settings.gamma:g}{_superscript(task.deadline)} ≈ {ahead:.0f}, and this is {side}. "
            f"With 0, the {signed(task.penalty)} at the end makes every action that was tried look bad."
        )
    criterion = "with a return above 0" if phase.least_ticks is None else f"of at least {phase.least_ticks} ticks"
    needed = f"{phase.positives['source']} trajectories of the source and {phase.positives['target']} of the target"
    return (
        Choice("Initial Q-values", "Not given.", initial),
        Choice(
            "Exploration",
            "Not given.",
            f"{_exploration(settings)}. Actions of equal value are drawn at random in learning; in an evaluation the "
            "lower number wins. α and γ are the paper's.",
        ),
        Choice(
            "Length of the collection",
            f"The first {phase.episodes:,} episodes; both labels must have sufficiently many trajectories.",
            f"{phase.episodes:,} episodes, and more, in steps of a tenth, until {needed} have label 1 (or "
            f"{phase.most_episodes:,} episodes have passed). Label 1 is for trajectories {criterion}; "
            f"{phase.negatives} of the others, drawn at random, get label −1.",
        ),
        Choice(
            "Learning in the source task",
            "Q̄ˢ* is optimal; for how long it was learned is not said.",
            f"{spec.learning.source_episodes:,} episodes in each run before the transfer. "
            f"{_exploration(spec.learning.source)}.",
        ),
    )


def _exploration(settings: QSettings) -> str:
    if settings.epsilon == 0:
        return "No random actions (ε = 0): the initial value makes untried actions worth trying"
    return f"A random action with probability ε = {settings.epsilon:g}"


def capital(text: str) -> str:
    """A text with a capital first letter; the rest stays as it is."""
    return text[:1].upper() + text[1:]


def signed(value: float, form: str = "g") -> str:
    """A number with a proper minus sign."""
    return format(value, form).replace("-", "−")


def _superscript(number: int) -> str:
    return str(number).translate(str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹"))


def _inference(spec: StudySpec) -> tuple[Choice, ...]:
    swarm = spec.swarm
    return (
        Choice(
            "Satisfaction at the end of a trajectory",
            "L is assumed large enough for every formula to be decided.",
            "A predicate beyond the last tick is unknown, and a trajectory counts as satisfying unless the formula is "
            "false (the weak view). Where the horizon fits, all views agree.",
        ),
        Choice(
            "Prior of the information gain",
            "Uniform over the possible trajectories.",
            "Uniform over the trajectories that the MDP can generate: the paths of the graph of its states, a cell "
            "and a heading, of which predicates see the position. The probability is computed exactly by dynamic "
            "programming, never sampled. Paths of positions alone would make dwelling, which two of three actions do, "
            "look surprising, and so favour ◇□ over ◇.",
        ),
        Choice(
            "Particle swarm",
            "Its settings are not given.",
            f"{swarm.restarts} swarms of {swarm.particles} particles, at most {swarm.iterations} iterations each, "
            "half of the particles started from windows and regions that occur in the data; a pattern search with "
            "whole steps finishes each swarm. Ties go to the primitive structure that comes first: ◇, □, ◇□, □◇.",
        ),
        Choice(
            "Comparing structures (Algorithm 1, line 11)",
            "The greatest objective J.",
            "The same, less the price of the additional parameter of ◇□ and □◇, "
            f"{spec.inference.nesting_cost:g} × ½ ln N nats of information for N trajectories at the node, as the "
            "Bayesian information criterion has it: at equal classification rates the structures differ by "
            "ten-thousandths of J, which a few dozen trajectories cannot tell apart.",
        ),
        Choice(
            "Formula of the source task",
            "That of the decision tree, if it is satisfying.",
            "Less the disjuncts that it is satisfying without. Where it is not satisfying, the operators of the tree's "
            "formula are kept and all parameters optimised together, as in the target.",
        ),
        _full(spec),
        Choice(
            "Negated primitives",
            "A primitive may be the negation of a structure.",
            "Kept as primitives by duality: ¬◇ρ is □¬ρ. Where all leaves below a node have label 1, its path formula "
            "stands for them.",
        ),
        Choice(
            "Which formulas the methods use",
            "One formula of each kind.",
            f"Those of the first collection, in all {spec.runs} learning runs; what the other collections give is "
            "shown under robustness.",
        ),
    )


def _full(spec: StudySpec) -> Choice:
    sampled, rate = spec.collection.negatives, spec.inference.rate
    learned = (
        "The methods learn with its formulas."
        if spec.protocol == "full"
        else "The methods do not learn with its formulas, unless --protocol full is asked for."
    )
    return Choice(
        "The full protocol, beside the paper’s",
        f"Inference sees {sampled} of the trajectories with label −1, and finds the primitives one by one with a "
        "particle swarm.",
        "Inference sees all of them, and searches exactly, all primitives together. An error among more trajectories "
        f"is a smaller share; so that it counts what it counts among {sampled}, P trajectories with label 1 and N "
        f"with −1 have the rate 1 − (1 − {rate:g}) s and the weight {spec.inference.information_weight:g} s, where "
        f"s = (P + {sampled}) / (P + N), in each task its own. {learned}",
    )


def _transfer(spec: StudySpec) -> tuple[Choice, ...]:
    return (
        Choice(
            "The disjunct of an episode",
            "Some heuristic criterion, for example the nearest centroid of the first predicate's region.",
            f"{capital(spec.learning.disjunct.replace('_', ' '))}, ties to the first. The strategy can be replaced.",
        ),
        Choice(
            "Ties in Algorithm 2, line 6",
            "The source state with the most similar relative position; several may be equally similar.",
            "First a state in which the predicate has the truth value that it has in the target state, then the lower "
            "number; the heading is kept.",
        ),
        Choice(
            "Clock valuations",
            f"Every clock takes the values 0 to {spec.target.task.deadline} in every location.",
            "A clock that a location does not use is held at 0 there (activity reduction), which merges states with "
            "the same future; in the transfer, the nearest valuation that occurs in the mapped location is taken.",
        ),
        Choice(
            "Rejection",
            "The automaton accepts what satisfies the formula.",
            "One rejecting location for each primitive, so that it is known at every location which primitive is at "
            "stake; a verdict is given at the first tick at which it is determined.",
        ),
    )


def _measures(spec: StudySpec) -> tuple[Choice, ...]:
    learning = spec.learning
    return (
        Choice(
            "Convergence",
            "“Convergence to the optimal policy” is not defined; the curves are averaged for every 10 episodes.",
            f"Two measures. (a) Nearest to the curves: {spec.learning.goal.text}. (b) The first evaluation of the "
            f"greedy policy, {learning.evaluation_episodes} episodes on fixed seeds, at 80, 90 and 95 % of the way "
            "from the return of always failing to V*, and the first from which on it stays there. V* comes from exact "
            "planning on the product of the world and the hidden task.",
        ),
        Choice(
            "Episodes of each method",
            "Up to 2 million.",
            ", ".join(f"{name}: {most:,}" for name, most in learning.most_episodes.items())
            + ". A run that does not get there within them counts with its limit, and what is computed from it is "
            "marked ≥.",
        ),
        Choice(
            "Box plot",
            f"The average of {learning.window:,} episodes after the data collection phase.",
            f"The first {learning.window:,} episodes of each method, which starts afresh after the collection.",
        ),
    )
