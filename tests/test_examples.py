"""The examples do what they say."""

import importlib.util
import subprocess
import sys
from pathlib import Path

import pytest

from tickwise.inference.reading import read_trajectories

ROOT = Path(__file__).parents[1]
NAVAL = ROOT.parent / "shared" / "data" / "naval" / "naval.npz"


@pytest.mark.skipif(not NAVAL.exists(), reason=f"there is no naval data set at {NAVAL}")
@pytest.mark.parametrize("number", [0, *(pytest.param(fold, marks=pytest.mark.slow) for fold in range(1, 10))])
def test_a_fold_of_the_naval_data(number: int):
    spec = importlib.util.spec_from_file_location("naval", ROOT / "examples" / "naval.py")
    assert spec is not None
    naval = importlib.util.module_from_spec(spec)
    sys.modules["naval"] = naval
    spec.loader.exec_module(naval)
    states, labels, other, truth = naval.folds(NAVAL)[number]
    assert len(states) == 1_800
    assert len(other) == 200
    fitted = naval.model(threads=1).fit(states, labels)
    assert fitted.satisfying_
    assert fitted.formula_.size <= 3
    assert 1 - fitted.score(other, truth) <= 0.005


@pytest.mark.skipif(not NAVAL.exists(), reason=f"there is no naval data set at {NAVAL}")
def test_the_naval_data_are_exported_for_the_command_line(tmp_path: Path):
    out = tmp_path / "vessels.npz"
    command = [sys.executable, ROOT / "examples" / "naval.py", NAVAL, "--export", out]
    assert subprocess.run(command, check=True, capture_output=True, text=True).stdout == ""
    data = read_trajectories(out)
    assert data.values.shape == (2_000, 61, 2)
    assert data.variables == ("x", "y")
    assert (data.positives, data.negatives) == (1_000, 1_000)
    # by the data's own rule a vessel is anomalous if it dips below y = 20, or ends beyond x = 30
    anomalous = (data.values[:, :, 1].min(axis=1) < 20) | (data.values[:, -1, 0] > 30)
    assert (anomalous == (data.labels == -1)).all()
