"""A library, and a new task for it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.experiments.tiny import TINY
from tests.library.learned import learned, walks
from tests.library.test_ranking import MIRRORED, NEW
from tickwise.envs.gridworld import GridWorld
from tickwise.experiments.inferences import labelled_data
from tickwise.experiments.store import Store
from tickwise.inference.reading import write_npz
from tickwise.library.folder import Library
from tickwise.library.worlds import write_world


@pytest.fixture(scope="session")
def tasks(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A library of two entries; not to be changed."""
    folder = tmp_path_factory.mktemp("library") / "tasks"
    for entry in (learned(), learned("mirrored", MIRRORED)):
        Library.open(folder, create=True).add(entry)
    return folder


@pytest.fixture(scope="session")
def poor(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A library of values that are worse than none: they despise all actions; not to be changed."""
    folder = tmp_path_factory.mktemp("poor") / "tasks"
    Library.open(folder, create=True).add(replace(learned(), name="poor", q=np.full_like(learned().q, -10.0)))
    return folder


@pytest.fixture(scope="session")
def new(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Trajectories of a new task, and its world beside them."""
    folder = tmp_path_factory.mktemp("new")
    mdp = GridWorld(5).mdp()
    write_npz(folder / "logs.npz", walks(NEW, mdp))
    write_world(folder / "world.npz", mdp)
    return folder / "logs.npz"


@pytest.fixture
def study_data(finished: Path, tmp_path: Path) -> Path:
    """The trajectories of the tiny study's target task."""
    path = tmp_path / "target.npz"
    write_npz(path, labelled_data(TINY, Store.open(finished, TINY.as_dict()), "target", 0))
    return path
