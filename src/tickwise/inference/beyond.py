"""What more levels of continuous variables could give an exact search at most."""

from __future__ import annotations

import heapq
import itertools

from tickwise.inference.bounding import BATCH, Bounds, Clock
from tickwise.inference.boxes import Node, everywhere, split_between
from tickwise.inference.exact import ExactProblem, ExactSettings
from tickwise.inference.gains import gain_bound


def beyond_levels(problem: ExactProblem, settings: ExactSettings) -> float:
    """A bound on J for sides anywhere, at least the levels' resolution apart: the most that more levels could give.

    Between two levels a side is treated as loose for trajectories with label 1 and as tight for the others, so the
    bound is above what is there. Where all thresholds are levels, it says nothing that `exact_search` does not.

    Args:
        problem: What is looked for.
        settings: The limits; a search that is stopped gives a greater bound.

    Returns:
        No primitive with such sides is worth more than this, in units of J.
    """
    prior = problem.prior.arrays(problem.levels.variables)
    clock, order = Clock(settings.seconds), itertools.count()
    heap: list[tuple[float, int, Node]] = []
    limits = gain_bound(prior, problem.levels, problem.slot, problem.levels.resolution)
    with Bounds(problem.coded, problem.gaps, problem.worth, limits, settings.threads) as bounds:
        nodes = [everywhere(problem.levels, *kind) for kind in problem.kinds]
        while True:
            for node, bound in zip(nodes, bounds(nodes), strict=True):
                heapq.heappush(heap, (-bound, next(order), node))
            if clock.over or len(heap) > settings.nodes or not split_between(heap[0][-1]):
                return -heap[0][0]
            nodes = []
            while heap and len(nodes) < BATCH and (halves := split_between(heap[0][-1])):
                heapq.heappop(heap)
                nodes += halves
