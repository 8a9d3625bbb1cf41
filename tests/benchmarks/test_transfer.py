"""What the benchmark of transfer counts and tells."""

import pytest

from benchmarks import transfer


def test_the_first_evaluation_at_a_level():
    assert transfer.first([0.1, 0.8, 0.7, 0.9], [0, 100, 200, 300], 0.75) == 100
    assert transfer.first([0.1, 0.8], [0, 100], 0.9) is None


def test_medians_where_some_runs_never_get_there():
    assert transfer.median_interval([3.0, 3.0, 3.0]) == [3.0, 3.0, 3.0]
    assert transfer.median_interval([1.0, None, 2.0])[0] == 2.0
    assert transfer.median_interval([None, None, 2.0]) == [None, 2.0, None]
    middle, low, high = transfer.median_interval([float(n) for n in range(1, 22)])
    assert middle == 11.0
    # the median of 21 lies between the 6th and the 16th with 97 %; the bootstrap is close to that
    assert 6 <= low <= 8
    assert 14 <= high <= 16


def test_pairs_are_compared_with_algorithm_2_run_by_run(monkeypatch: pytest.MonkeyPatch):
    """Twice and eight times the episodes are four times; a run that never gets there counts with all 100,000."""
    monkeypatch.setattr(transfer, "VARIANTS", {transfer.PAPER: None, "slow": None})

    def result(mean: float, episodes: int | None) -> dict[str, object]:
        return {"mean": mean, "episodes": {f"{level:.0%}": episodes for level in transfer.LEVELS}}

    pairs = {
        "pair-00": [
            {transfer.PAPER: result(0.5, 1_000), "slow": result(0.25, 2_000)},
            {transfer.PAPER: result(0.5, 12_500), "slow": result(0.25, None)},
        ]
    }
    told = transfer.of_pairs(pairs)
    assert told["slow"]["mean"] == [-0.25] * 3
    assert told["slow"]["95%"] == pytest.approx([4.0] * 3)
    assert told[transfer.PAPER]["95%"] == [1.0] * 3


def test_a_task_has_its_evaluations_at_the_end_of_the_window_and_of_learning():
    lake = transfer.task("lake 4x4")
    assert lake.points[lake.window // lake.step] == lake.window
    assert lake.points[-1] == lake.episodes
