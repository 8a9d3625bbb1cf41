from __future__ import annotations

import json
from dataclasses import dataclass
from math import inf
from typing import Any

import pytest

from tests.experiments.tiny import TINY
from tests.experiments.tiny_suite import pairs
from tickwise.errors import ConfigurationError
from tickwise.experiments.case_studies import CASE_STUDY_1, CASE_STUDY_2
from tickwise.experiments.plain import from_plain, to_plain
from tickwise.experiments.random_pairs import random_pairs
from tickwise.experiments.suites import effect_suite


@dataclass(frozen=True)
class Foreign:
    value: int = 0


def there_and_back(value: Any) -> Any:
    return from_plain(json.loads(json.dumps(to_plain(value))))


@pytest.mark.parametrize("spec", [CASE_STUDY_1, CASE_STUDY_2, TINY, *pairs(2), *random_pairs(2)])
def test_a_study_comes_back_as_it_was(spec: object):
    assert there_and_back(spec) == spec


def test_so_do_the_studies_of_an_effect(tmp_path):
    for unit in effect_suite("noisy-depth", quick=True).units(tmp_path).all:
        assert there_and_back(unit.spec) == unit.spec


@pytest.mark.parametrize(
    "value", [None, True, 0, 0.1, -inf, "φ", (), (1, (2,)), [1, (2.0,)], {"a": (1,), "tuple": {}, "b": []}, {1: None}]
)
def test_plain_values_come_back_as_they_were(value: object):
    found = there_and_back(value)
    assert found == value
    assert type(found) is type(value)


@pytest.mark.parametrize("value", [Foreign(), (1, object()), {"a": {1}}, TINY.as_dict])
def test_what_is_not_ours_stays_here(value: object):
    with pytest.raises(ConfigurationError, match="cannot be sent to a cluster; run this study without --cluster"):
        to_plain(value)


@pytest.mark.parametrize(
    "kind",
    ["os:system", "tickwise.experiments.plain:to_plain", "tickwise.cli:os", "tests.experiments.test_plain:Foreign"],
)
def test_nothing_but_our_values_is_made(kind: str):
    with pytest.raises(ConfigurationError, match=f"there is no {kind} in a specification"):
        from_plain({kind: {}})
