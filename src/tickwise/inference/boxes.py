"""Ranges of boxes, the nodes of an exact search: how they split, which box comes first, what is next to it.

A node is ``[existential, complemented, lo_min…, lo_max…, hi_min…, hi_max…]``: the least and the greatest level of every
lower and of every upper side.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from tickwise.inference.levels import Levels

_FEW = 8  # a node with so few boxes or fewer is split into all of them

Node = NDArray[np.int64]


def ranges(node: Node) -> NDArray[np.int64]:
    """A view of the levels, shape ``(2, 2, variables)``: lower or upper side, least or greatest."""
    return node[2:].reshape(2, 2, -1)


def root(levels: Levels, existential: bool, complemented: bool) -> Node:
    """All boxes."""
    last = [len(sides) - 1 for sides in levels.sides]
    rows = [[0] * len(last), [end - 1 for end in last], [1] * len(last), last]
    return np.array([existential, complemented, *itertools.chain(*rows)], dtype=np.int64)


def everywhere(levels: Levels, existential: bool, complemented: bool) -> Node:
    """All boxes whose sides may also lie between two levels; they may be thinner than the space between them."""
    node = root(levels, existential, complemented)
    ranges(node)[0, 1] += 1
    ranges(node)[1, 0] -= 1
    return node


def single(node: Node) -> bool:
    """Whether it is one box only."""
    sides = ranges(node)
    return bool((sides[:, 0] == sides[:, 1]).all())


def outermost(node: Node) -> Node:
    """The largest box alone."""
    lower, upper = ranges(node)[0, 0], ranges(node)[1, 1]
    return np.concatenate([node[:2], lower, lower, upper, upper])


def split(node: Node) -> list[Node]:
    """Halves of the widest range; or all single boxes where these are few."""
    sides = ranges(node)
    spans = sides[:, 1] - sides[:, 0]
    if np.prod(spans + 1) <= _FEW:
        return list(_boxes(node))
    side, variable = np.unravel_index(int(spans.argmax()), spans.shape)
    middle = (sides[side, 0, variable] + sides[side, 1, variable]) // 2
    halves = []
    for end, level in ((1, middle), (0, middle + 1)):
        half = node.copy()
        levels = ranges(half)
        levels[side, end, variable] = level
        # the lower side is below the upper one
        levels[0, 1] = np.minimum(levels[0, 1], levels[1, 1] - 1)
        levels[1, 0] = np.maximum(levels[1, 0], levels[0, 0] + 1)
        if (levels[:, 0] <= levels[:, 1]).all():
            halves.append(half)
    return halves


def _boxes(node: Node) -> Iterator[Node]:
    choices = [range(low, high + 1) for low, high in ranges(node).transpose(0, 2, 1).reshape(-1, 2).tolist()]
    width = len(choices) // 2
    for levels in itertools.product(*choices):
        lower, upper = levels[:width], levels[width:]
        if all(low < high for low, high in zip(lower, upper, strict=True)):
            yield np.array([*node[:2], *lower, *lower, *upper, *upper])


def split_between(node: Node) -> list[Node]:
    """Halves that share the middle level, for sides that may lie between levels; none of a node that has no middle."""
    sides = ranges(node)
    spans = sides[:, 1] - sides[:, 0]
    if spans.max() <= 1:
        return []
    side, variable = np.unravel_index(int(spans.argmax()), spans.shape)
    middle = (sides[side, 0, variable] + sides[side, 1, variable]) // 2
    halves = [node.copy(), node.copy()]
    ranges(halves[0])[side, 1, variable] = ranges(halves[1])[side, 0, variable] = middle
    return [half for half in halves if (ranges(half)[0, 0] < ranges(half)[1, 1]).all()]


def first_key(node: Node, levels: Levels, *, nested: bool) -> tuple[int, ...]:
    """Where the first of a node's boxes stands among primitives of equal worth.

    In this order: the fewest closed sides of variables whose sides may be open; ◇ and □ before ◇□ and □◇; the plain
    box before its complement; the tightest predicate, variable by variable; ◇ and ◇□ before □ and □◇.
    """
    (lo_min, lo_max), (hi_min, hi_max) = ranges(node).tolist()
    closed, tightest = 0, list[int]()
    for variable, sides in enumerate(levels.sides):
        if math.isinf(sides[0]):
            closed += math.isfinite(sides[lo_min[variable]]) + math.isfinite(sides[hi_max[variable]])
        loose, tight = (lo_min[variable], -hi_max[variable]), (-lo_max[variable], hi_min[variable])
        tightest += loose if node[1] else tight
    return (closed, int(nested), int(node[1]), *tightest, 1 - int(node[0]))


def tighter(node: Node, levels: Levels) -> Iterator[Node]:
    """Boxes one level away from a single one whose predicate is tighter, with no more closed sides."""
    complemented = bool(node[1])
    for variable, sides in enumerate(levels.sides):
        lower, upper = ranges(node)[0, 0, variable], ranges(node)[1, 0, variable]
        step = -1 if complemented else 1
        for side, old, level in ((0, lower, lower + step), (1, upper, upper - step)):
            low, high = (level, upper) if side == 0 else (lower, level)
            if low < 0 or high >= len(sides) or low >= high or (math.isinf(sides[old]) and not complemented):
                continue
            near = node.copy()
            ranges(near)[side, :, variable] = level
            yield near


def box_of(node: Node, sides: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The sides of a single box, lower and upper, shape ``(variables,)``; ``sides`` are those of `Levels.arrays`."""
    columns = np.arange(sides.shape[0])
    return sides[columns, ranges(node)[0, 0]], sides[columns, ranges(node)[1, 1]]
