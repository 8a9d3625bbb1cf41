"""``tickwise infer``, ``check`` and ``compare`` on one's own data."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from rich.console import Console

from tests.test_cli import Tickwise, csv
from tickwise.cli import evidence, listing

FORMULA = "F[3,3] (x >= 5)"


@pytest.fixture
def logs(tmp_path: Path) -> Path:
    """Twelve trajectories of six ticks; the even ones have label 1 and x >= 5 at tick 3, but t0 only 4.9."""
    rows = []
    for name in range(12):
        good = name % 2 == 0
        for tick in range(6):
            x = (8.0 if name else 4.9) if good and tick == 3 else 0.1 * ((name * 7 + tick * 3) % 10)
            rows.append(f"t{name},{tick},{x},{1 if good else -1}")
    return csv(tmp_path / "logs.csv", *rows)


# ---------------------------------------------------------------- check


def test_check_as_json_has_what_the_formula_separates(tickwise: Tickwise, logs: Path):
    document = tickwise("check", FORMULA, logs, "--json").document
    assert document["confusion"] == {
        "true_positives": 5, "false_negatives": 1, "false_positives": 0, "true_negatives": 6,
    }  # fmt: skip
    [part] = document["primitives"]
    assert part["alone"] == part["keeping"] == {"positives": 5, "negatives": 0}
    assert part["removing"] == {"positives": 1, "negatives": 6}
    [mistake] = document["misclassified"]
    assert mistake == {"id": "t0", "label": 1, "predicted": -1, "why": f"violates {FORMULA}, by 0.1"}


def test_check_in_short(tickwise: Tickwise, logs: Path):
    assert tickwise("check", FORMULA, logs, "--summary").out.splitlines() == [
        "label\tpredicted 1\tpredicted -1",
        "1\t5\t1",
        "-1\t0\t6",
        "part\tprimitive\tkeeps, alone\treach it\tkeeps\tremoves",
        f"1\t{FORMULA}\t5+ 0−\t6+ 6−\t5+ 0−\t1+ 6−",
        "misclassified\tlabel\tpredicted\twhy",
        f"t0\t1\t-1\tviolates {FORMULA}, by 0.1",
    ]


def test_check_without_labels_says_nothing_of_them(tickwise: Tickwise, tmp_path: Path):
    bare = csv(tmp_path / "bare.csv", "a,0,1", "a,1,2", header="trajectory,tick,x")
    assert list(tickwise("check", "F[0,1] (x >= 2)", bare, "--json").document) == ["trajectories"]
    line = tickwise.fails("check", "F[0,1] (x >= 2)", bare, "--summary")
    assert line.endswith("has no labels, which --summary is about; add them")
    line = tickwise.fails("check", "F[0,1] (x >= 2)", bare, "--page", tmp_path / "page.html")
    assert line.endswith("has no labels, which --page is about; add them")
    assert not (tmp_path / "page.html").exists()


def test_check_on_a_terminal_ends_with_what_it_separates(
    tickwise: Tickwise, logs: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
):
    with (tmp_path / "shown").open("w", encoding="utf-8") as file:
        terminal = Console(file=file, force_terminal=True, width=100, color_system=None, markup=False)
        for module in (evidence, listing):
            monkeypatch.setattr(module, "output", terminal)
        assert tickwise("check", FORMULA, logs, "--summary").status == 0
    shown = (tmp_path / "shown").read_text(encoding="utf-8")
    assert "│ -1    │           0 │            6 │" in shown
    assert "+ counts trajectories with label 1, − those with label -1" in shown


def test_check_writes_a_page(tickwise: Tickwise, logs: Path, tmp_path: Path):
    answer = tickwise("check", FORMULA, logs, "--page", tmp_path / "page.html", "--json")
    assert answer.status == 0
    assert "a formula checked on labelled trajectories" in (tmp_path / "page.html").read_text(encoding="utf-8")


# ---------------------------------------------------------------- infer


def test_infer_with_a_share_held_out(tickwise: Tickwise, logs: Path):
    facts = tickwise("infer", logs, "--depth", 1, "--holdout", "0.34", "--json").document
    assert sum(facts["confusion"].values()) == 8
    judged = facts["validation"]
    assert (judged["method"], judged["held_out"]) == ("holdout", 4)
    [trial] = judged["trials"]
    assert trial["formula"] == facts["formula"]
    assert judged["low"] <= judged["error"] == judged["wrong"] / 4 <= judged["high"]
    again = tickwise("infer", logs, "--depth", 1, "--holdout", "0.34", "--seed", 0, "--json").document
    assert again["validation"]["confusion"] == judged["confusion"]


def test_infer_in_folds(tickwise: Tickwise, logs: Path):
    command = ("infer", logs, "--depth", 1, "--folds", 3)
    answer = tickwise(*command, "--json")
    assert answer.err == ""  # progress is for terminals
    facts = answer.document
    assert sum(facts["confusion"].values()) == 12
    judged = facts["validation"]
    assert [trial["held_out"] for trial in judged["trials"]] == [4, 4, 4]
    assert sum(judged["confusion"].values()) == 12
    assert "pooled" in judged["interval"]
    shown = tickwise(*command).out
    assert f"{judged['wrong']} of 12 trajectories wrong in 3 folds" in shown
    assert "95 % Wilson interval of the pooled held-out predictions" in shown
    assert "label, held out\tpredicted 1\tpredicted -1" in shown


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--holdout", "0.2", "--folds", "5"), "--holdout and --folds exclude each other; use one of them"),
        (("--holdout", "1"), "holdout is 1.0; use a share between 0 and 1, such as 0.2"),
        (("--folds", "7"), "label -1 has 6 trajectories for 7 folds; give one a fold of each label or more"),
        (("--page", "page.pdf"), "the page page.pdf does not end in .html; use that ending"),
        (("--page", "no-such-folder/page.html"), "there is no folder no-such-folder for the page; make it"),
    ],
)
def test_wrong_options_of_infer(tickwise: Tickwise, logs: Path, options: tuple[str, ...], message: str):
    assert tickwise.fails("infer", logs, *options).startswith(message)


def test_one_fold_is_refused(tickwise: Tickwise, logs: Path):
    assert "'--folds'" in tickwise.fails("infer", logs, "--folds", 1, status=2)


@pytest.mark.parametrize("option", ["--page", "--html"])
def test_infer_writes_a_page(tickwise: Tickwise, logs: Path, tmp_path: Path, option: str):
    answer = tickwise("infer", logs, "--depth", 1, "--folds", 2, option, tmp_path / "page.html")
    assert answer.status == 0
    assert answer.out.splitlines()[-1] == f"page: {tmp_path / 'page.html'}"
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "<h1>logs.csv</h1>" in page
    assert "Decision tree" in page


def test_ctrl_c_in_the_folds_keeps_the_formula(tickwise: Tickwise, logs: Path, monkeypatch: pytest.MonkeyPatch):
    from tickwise.inference import validation

    whole, calls = validation._trial, []

    def second_is_interrupted(*arguments):
        calls.append(1)
        if len(calls) == 2:
            raise KeyboardInterrupt
        return whole(*arguments)

    monkeypatch.setattr(validation, "_trial", second_is_interrupted)
    answer = tickwise("infer", logs, "--depth", 1, "--folds", 3, "--json")
    assert (answer.status, answer.err) == (130, "interrupted: this is the best so far\n")
    facts = json.loads(answer.out)
    assert facts["formula"] is not None
    assert facts["interrupted"] is facts["validation"]["interrupted"] is True
    assert len(facts["validation"]["trials"]) == 1
    calls[:] = [1]  # now the first one is
    answer = tickwise("infer", logs, "--depth", 1, "--folds", 3, "--json")
    assert answer.status == 130
    assert "validation" not in answer.document


# ---------------------------------------------------------------- compare


@pytest.mark.parametrize(
    ("target", "reason"),
    [
        ("G[0,2] (x >= 3)", "disjunct 1 of the target is G, where the source has F"),
        ("F[0,2] (x >= 3) | F[0,1] (x <= 1)", None),
        ("F[0,2] (x >= 3) | G[0,1] (x <= 1)", "disjunct 2 of the target is G, where the source has F"),
    ],
)
def test_compare_says_why_not(tickwise: Tickwise, target: str, reason: str | None):
    lines = tickwise("compare", "F[0,9] (x >= 5)", target).out.splitlines()
    assert [line for line in lines if "why not" in line] == ([] if reason is None else [f"why not: {reason}"])


def test_compare_counts_disjuncts(tickwise: Tickwise):
    lines = tickwise("compare", "F[0,9] (x >= 5) | G[0,9] (x >= 5)", "F[0,9] (x >= 5)").out.splitlines()
    assert lines[-1] == "why not: the target has 1 disjunct, the source 2 disjuncts; use as many, or several times"
