"""Tests of the closed loop's settings."""

from __future__ import annotations

import pytest

from tickwise.errors import ConfigurationError
from tickwise.transfer.settings import LoopSettings


@pytest.mark.parametrize(
    "name", ["batch", "hypotheses", "candidates", "imagined", "rounds", "positives", "fresh", "patience"]
)
def test_counts_out_of_range_are_refused(name: str):
    LoopSettings(**{name: 1})  # type: ignore[arg-type]
    with pytest.raises(ConfigurationError, match=f"^{name} of the closed loop is 0; use 1 or more$"):
        LoopSettings(**{name: 0})  # type: ignore[arg-type]


@pytest.mark.parametrize("share", [-0.1, 1.1, float("nan")])
def test_shares_out_of_range_are_refused(share: float):
    with pytest.raises(ConfigurationError, match=r"^random of the closed loop is .*; use a share from 0 to 1$"):
        LoopSettings(random=share)
