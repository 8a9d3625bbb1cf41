"""A search over data in parts finds what one over all of them finds."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.inference.test_exact import WEIGHTS, cells, numbers
from tests.inference.worlds import grid_prior
from tickwise._seeding import generator
from tickwise.errors import ConfigurationError, DataError
from tickwise.inference.exact import ExactSettings
from tickwise.inference.levels import Levels
from tickwise.inference.parts import scan_parts
from tickwise.inference.prior import BoxPrior
from tickwise.inference.reading import read_parts, read_trajectories
from tickwise.inference.space import SearchSpace
from tickwise.inference.trajectories import LabelledTrajectories
from tickwise.inference.tree import InferenceSettings, infer_tree

LIMITS = ExactSettings(levels=6)


@st.composite
def problems(draw):
    """Data with a space and a prior: on a grid, continuous, or both."""
    seed, count, kind = draw(st.integers(0, 2**32 - 1)), draw(st.integers(3, 14)), draw(st.sampled_from("gcm"))
    ragged = draw(st.booleans())
    if kind == "g":
        return cells(seed, 3, 6, count, ragged=ragged), SearchSpace.grid(3, 5), grid_prior(3, 5)
    data = numbers(seed, 6, count, 2, ragged=ragged)
    prior = BoxPrior({"x": (0.0, 4.0), "y": (0.0, 4.0)}, 5)
    flags, edges = ((True, True), ((0.0, 4.0),) * 2) if kind == "c" else ((True, False), ((0.0, 4.0), (0.0, 1.5, 4.0)))
    return data, SearchSpace(("x", "y"), edges, 5, flags), prior


def cut(data: LabelledTrajectories, where) -> list[LabelledTrajectories]:
    """Parts as files would have them: no wider than their longest trajectory."""
    parts = [data.select(rows) for rows in np.split(np.arange(len(data)), sorted(where))]
    return [
        LabelledTrajectories(part.values[:, : part.horizon + 1], part.lengths, part.labels, part.variables, part.ids)
        for part in parts
    ]


@settings(max_examples=60)
@given(problem=problems(), cuts=st.sets(st.integers(1, 13)), weight=st.sampled_from(WEIGHTS))
def test_parts_give_what_the_whole_gives(problem, cuts, weight):
    data, space, prior = problem
    parts = cut(data, {place for place in cuts if place < len(data)})
    levels, expected = Levels.of_parts(space, parts, 6), Levels.of(space, data, 6)
    assert [sides.tolist() for sides in levels.sides] == [sides.tolist() for sides in expected.sides]
    assert (levels.complete, levels.resolution.tolist()) == (expected.complete, expected.resolution.tolist())
    # a rate of 1 keeps the tree from stopping at its root
    constants = InferenceSettings(class_weight=weight, information_weight=0.1, rate=1.0)
    found = scan_parts(parts, space, prior, constants, LIMITS)
    assert found == scan_parts([data], space, prior, constants, LIMITS)
    root = infer_tree(data, prior, space, constants, LIMITS, generator(0))
    assert found.primitive == root.primitive
    assert (found.objective, found.rate, found.gain, found.gap) == (root.objective, root.rate, root.gain, root.gap)


def test_a_folder_gives_what_one_file_gives(tmp_path):
    pytest.importorskip("pyarrow")
    data = cells(5, 3, 6, 40, ragged=True)
    rows = [
        (name, tick, *data.values[i, tick], data.labels[i])
        for i, name in enumerate(data.ids)
        for tick in range(data.lengths[i])
    ]
    frame = pd.DataFrame(rows, columns=["trajectory", "tick", "x", "y", "label"])
    frame.to_parquet(tmp_path / "one.parquet")
    folder = tmp_path / "many"
    folder.mkdir()
    for number in range(4):
        frame[frame["trajectory"].astype(int) // 10 == number].to_parquet(folder / f"{number}.parquet")
    one = read_trajectories(tmp_path / "one.parquet")
    rest = SearchSpace.grid(3, 5), grid_prior(3, 5), InferenceSettings(), LIMITS
    whole = scan_parts([one], *rest)
    assert scan_parts(read_parts(folder), *rest) == whole
    assert scan_parts(iter(read_parts(folder)), *rest) == whole  # one pass


def test_what_cannot_be_searched():
    data, prior = cells(1, 3, 6, 10), grid_prior(3, 5)
    grid, free = SearchSpace.grid(3, 5), SearchSpace.from_data(data)
    with pytest.raises(ConfigurationError, match="two passes, but an iterator gives one; give a list, or what read"):
        scan_parts(iter([data]), free, prior, InferenceSettings(), LIMITS)
    renamed = LabelledTrajectories(data.values, data.lengths, data.labels, ("a", "b"), data.ids)
    with pytest.raises(ConfigurationError, match="the space has variables x, y, the data a, b; use the same"):
        scan_parts([data, renamed], grid, prior, InferenceSettings(), LIMITS)
    for space in (grid, free):
        with pytest.raises(DataError, match="there is no part; give at least one"):
            scan_parts([], space, prior, InferenceSettings(), LIMITS)
    with pytest.raises(DataError, match="no trajectory has label -1; give trajectories of both labels"):
        scan_parts([data.select(data.labels == 1)] * 2, grid, prior, InferenceSettings(), LIMITS)


def test_parts_that_do_not_join():
    data = cells(1, 3, 6, 10)
    with pytest.raises(DataError, match="0 different lists of variables; give one part or more"):
        LabelledTrajectories.joined([])
    with pytest.raises(DataError, match="trajectory id '0' occurs twice"):
        LabelledTrajectories.joined([data, data])
