"""Made-up recordings: random walks of a gridworld in the form in which jobs record episodes."""

from __future__ import annotations

from typing import Any

import numpy as np

from tests.experiments import synthetic
from tickwise.envs.gridworld import GridWorld
from tickwise.experiments.recording import PREFIX
from tickwise.experiments.study import StudySpec

EVERY_OPERATOR = (
    "F[0,6] (4 <= x <= 8) & G[8,12] F[0,3] (y >= 3) & F[17,26] G[0,2] !(5 <= x <= 7 & 5 <= y <= 8) & G[30,36] (x <= 7)"
    " | G[0,3] F[0,4] !(x <= 2 & y <= 2) & F[9,30] G[0,3] (1 <= x <= 6 & 2 <= y <= 7)"
)
"""All operators, complements, and two disjuncts whose automata differ."""

GUESSES = ("F[1,30] (0 <= x <= 3 & 2 <= y <= 7)", synthetic.TARGET)
"""What Method V believes at its two points of learning."""


def results(spec: StudySpec, formula: str | None = EVERY_OPERATOR, seed: int = 0) -> dict[str, Any]:
    """Results of a study in which methods I, III and V have recordings, and the source of method IV too."""
    found = synthetic.results(synthetic.small(spec.runs), formulas=(synthetic.SOURCE, formula, synthetic.PLAIN))
    rng = np.random.default_rng(seed)
    for method in ("I", "III"):
        for run in found["methods"][method]:
            run |= recording(spec.target.world, spec.target.task.deadline, rng, disjunct=-1 if method == "I" else 1)
    for run in found["methods"]["V"]:
        run |= recording(spec.target.world, spec.target.task.deadline, rng, disjunct=0)
        run |= {PREFIX + "formulas": list(GUESSES), "collected": 300}
    for run in found["source_learning"]:
        run |= recording(spec.source.world, spec.source.task.deadline, rng, disjunct=0)
    return found


def recording(world: GridWorld, ticks: int, rng: np.random.Generator, *, disjunct: int) -> dict[str, Any]:
    """Two points with two episodes each; the very last one ends two ticks early."""
    mdp = world.mdp()
    states = np.full((2, 2, ticks + 1), -1, dtype=np.int32)
    actions = np.full((2, 2, ticks), -1, dtype=np.int8)
    for episode in np.ndindex(2, 2):
        states[episode][0] = rng.integers(mdp.n_states)
        for t in range(ticks - 2 * (episode == (1, 1))):
            action = rng.choice(3, p=(0.6, 0.2, 0.2))
            s = states[episode][t]
            outcome = rng.choice(3, p=mdp.probability[s, action])
            actions[episode][t], states[episode][t + 1] = action, mdp.successor[s, action, outcome]
    arrays = {
        "at": np.array([0, 1_000]), "states": states, "actions": actions, "memory": np.full_like(states, -1),
        "disjunct": np.full((2, 2), disjunct, dtype=np.int16), "returns": np.zeros((2, 2), dtype=np.float32),
    }  # fmt: skip
    return {PREFIX + name: array for name, array in arrays.items()}
