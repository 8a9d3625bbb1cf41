from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

from tests.experiments import tiny_suite
from tickwise.experiments.figures import draw_pairs
from tickwise.experiments.measures import median_statistics, sure_ratio
from tickwise.experiments.pairs import gather_pairs
from tickwise.experiments.pairs_part import pairs_part, pairs_verdict
from tickwise.experiments.progress import Display
from tickwise.experiments.runner import Unit, run_units
from tickwise.experiments.store import Store
from tickwise.experiments.study import StudySpec


@pytest.fixture(scope="module")
def specs() -> tuple[StudySpec, ...]:
    return tiny_suite.pairs(2, runs=2)


@pytest.fixture(scope="module")
def stores(specs: tuple[StudySpec, ...], tmp_path_factory: pytest.TempPathFactory) -> list[Store]:
    folder = tmp_path_factory.mktemp("pairs")
    return run_units([Unit(spec.name, spec, folder / spec.name) for spec in specs], 1, Display(Console(quiet=True)))


@pytest.fixture(scope="module")
def results(specs: tuple[StudySpec, ...], stores: list[Store]) -> dict[str, Any]:
    return gather_pairs(specs, stores, "1.2.3")


def test_similar_pairs_are_identified_and_others_refused(results: dict[str, Any]):
    similar, other = results["pairs"]
    assert (similar["similar"], similar["identified"], similar["right"]) == (True, True, True)
    assert (other["similar"], other["identified"], other["right"]) == (False, False, True)
    assert "not identified" in other["reason"]
    # nothing was transferred, and only Method I carried out
    assert set(similar["episodes"]) == {"I", "III", "IV"}
    assert (set(other["episodes"]), other["speed_ups"]) == ({"I"}, {})
    # Wilson's interval for one of one, z = 1.96: from 1 / (1 + z²) on
    share = results["identification"]["similar"]
    assert (share["right"], share["of"], share["share"], share["high"]) == (1, 1, 1.0, 1.0)
    assert share["low"] == pytest.approx(1 / (1 + 1.959964**2))
    assert results["speed_ups"]["I/III"]["goal"]["count"] == 1


def test_a_pair_that_is_judged_wrongly_counts_as_such(specs: tuple[StudySpec, ...], stores: list[Store]):
    turned = [replace(spec, similar=not spec.similar) for spec in specs]
    found = gather_pairs(turned, stores, "1.2.3")["identification"]
    assert [found[kind]["right"] for kind in ("similar", "dissimilar")] == [0, 0]
    assert found["dissimilar"]["low"] == 0.0


def test_runs_that_did_not_get_there_count_with_the_limit():
    assert sure_ratio([None, 200], [10, 0], 1_000) == pytest.approx(600 / 5.5)  # 0 counts as 1
    assert sure_ratio([50], [None], 100) == 0.5


def test_the_median_has_an_interval():
    found = median_statistics([1.0, 2.0, 4.0, 8.0, 16.0], 0)
    assert (found["median"], found["count"], found["quartiles"]) == (4.0, 5, [2.0, 8.0])
    assert 1.0 <= found["low"] <= 4.0 <= found["high"] <= 16.0
    assert median_statistics([3.0], 0)["low"] == 3.0
    assert median_statistics([], 0)["median"] is None


def test_the_part_of_the_page(results: dict[str, Any], specs: tuple[StudySpec, ...], tmp_path: Path):
    part = pairs_part(results, specs, draw_pairs(results, tmp_path), "tickwise <random>")
    assert {path.name for path in tmp_path.iterdir()} == {"pairs.svg", "pairs.png"}
    said = " ".join(pairs_verdict(results))
    assert "identified in 1 of 1 similar pairs and refused in 1 of 1 dissimilar pairs" in said
    assert part.headline == said
    assert "identified, rightly" in part.body
    assert "refused, rightly" in part.body
    assert "tickwise &lt;random&gt;" in part.body
    assert "□[2, 10] ◇[0, 3]" in part.body or "□" in part.body
    for anchor, _ in part.links:
        assert f'id="{anchor}"' in part.body
