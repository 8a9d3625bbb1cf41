"""From an entry to a new task: its Q-function, transferred (Algorithm 2)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tickwise.inference.fit import Fit
from tickwise.library.entry import Entry, centroids, stamped
from tickwise.library.target import Target
from tickwise.logic.sdnf import SDNF
from tickwise.rl.states import Memory
from tickwise.transfer.qtransfer import transfer_q


def transferred_values(entry: Entry, formula: SDNF, target: Target) -> tuple[Memory, NDArray[np.float32]]:
    """The extended states of a new task, and the values that an entry gives them.

    Args:
        entry: The source.
        formula: φ^T, structurally transferable from the entry's.
        target: The new task, in a world.

    Returns:
        The extended states, and Q̄^T, shape ``(memory states, states, actions)``.

    Raises:
        ConfigurationError: If the task has no world.
        DataError: If the worlds' actions, coordinates or orientations differ in number.
        AutomatonError: If φ^T is not structurally transferable from the entry's formula.
    """
    world, memory, source = target.world, target.memory(formula), entry.memory()
    # a start, before the first letter, is where nothing is learned: it has the value that learning began with
    initial = float(entry.q[source.offsets[0], 0, 0])
    places = entry.landmarks, centroids(formula, world)
    return memory, transfer_q(entry.mdp, source, entry.q, world, memory, initial, places)


def transfer(entry: Entry, fit: Fit, target: Target, name: str) -> Entry:
    """A new task with the values of an entry, as an entry of its own: what learning goes on from.

    ```python
    start = transfer(entry, fit, target, "mine")
    problem, q = Problem(start.mdp, task, start.memory()), start.q.copy()
    learn(problem, q, QSettings(), rng, 10_000)
    ```

    Args:
        entry: The source.
        fit: φ^T, as fitted to the new task's trajectories.
        target: The new task, in a world.
        name: The name of the new entry.

    Returns:
        The entry; its provenance tells the source's.

    Raises:
        ConfigurationError: If the task has no world, or the name is none.
        DataError: If the worlds' actions, coordinates or orientations differ in number.
        AutomatonError: If φ^T is not structurally transferable from the entry's formula.
    """
    _, q = transferred_values(entry, fit.formula, target)
    return Entry(
        name=name,
        formula=fit.formula,
        mdp=target.world,
        horizon=target.horizon,
        q=q,
        disjunct=target.disjunct,
        facts={
            "rate": fit.rate, "gain": fit.gain, "size": fit.size, "satisfying": fit.satisfying,
            "positives": target.task.data.positives, "negatives": target.task.data.negatives,
        },
        provenance=stamped(
            {"method": "transferred, nothing learned yet", "episodes": 0, "from": entry.name,
             "source": {"formula": str(entry.formula), **entry.provenance}}
        ),
    )  # fmt: skip
