"""The examples do what they say."""

import importlib.util
import sys
from pathlib import Path

import pytest

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
