from __future__ import annotations

import numpy as np
import pytest

from tickwise.errors import DataError
from tickwise.logic.parse import parse
from tickwise.logic.propositions import propositions, signals

PHI = parse("F[0,1] (1 < x <= 3) & !(y >= 2) & G[0,1] (1 < x <= 3)")
X = np.array([[1.0, 2.0], [2.5, 0.0]])


def test_regions_are_named_once_in_order_of_appearance() -> None:
    assert list(propositions(PHI)) == ["p1", "p2"]
    assert str(propositions(PHI)["p1"]) == "1 < x <= 3"


def test_signals_by_hand() -> None:
    assert signals(PHI, X) == {"p1": [(0, False), (1, True)], "p2": [(0, True), (1, False)]}
    assert signals(PHI, X, quantitative=True) == {"p1": [(0, 0.0), (1, 0.5)], "p2": [(0, 0.0), (1, -2.0)]}
    assert signals(PHI, X[:, ::-1], variables=("y", "x")) == signals(PHI, X)


def test_a_batch_is_refused() -> None:
    with pytest.raises(DataError, match="a batch of 3 was given; index it"):
        signals(PHI, np.zeros((3, 2, 2)))
