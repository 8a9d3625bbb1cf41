"""What someone new does from the README alone: from data of their own to a formula, from an environment to an agent."""

from __future__ import annotations

import csv
import json
import random
import re
import shutil
from pathlib import Path

import pages
import pytest

from tests.test_cli import answer_of
from tests.test_readme import BLOCKS, README


@pytest.fixture
def kettles(tmp_path: Path) -> Path:
    """Two hundred kettles, a reading of temperature and power every half minute, written with the standard library.

    A kettle is good if it has 90 degrees or more at some reading from 6 to 10. One in four of the others gets as hot,
    but only from reading 13 on.
    """
    draw = random.Random(5)
    path = tmp_path / "kettles.csv"
    with path.open("w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file)
        rows.writerow(["trajectory", "tick", "temperature", "power", "label"])
        for number in range(200):
            good, late = number % 2 == 0, number % 8 == 1
            hottest = draw.randint(6, 10) if good else draw.randint(13, 16) if late else None
            for tick in range(18):
                temperature = draw.uniform(92, 100) if tick == hottest else draw.uniform(20, 86)
                row = [f"kettle {number}", tick, round(temperature, 1), draw.randint(0, 2200), 1 if good else -1]
                rows.writerow(row)
    return path


def test_one_command_finds_the_hidden_rule(kettles: Path, tmp_path: Path):
    page = tmp_path / "kettles.html"
    answer = answer_of("infer", kettles, "--folds", 4, "--page", page)
    assert (answer.status, answer.err) == (0, "")
    formula = answer.out.splitlines()[0]
    # every number may be any that leaves all kettles on the right side
    match = re.fullmatch(r"F\[(\d+),(\d+)\] \(temperature >= ([\d.]+)\)", formula)
    assert match is not None, formula
    first, last, threshold = map(float, match.groups())
    assert first <= 6
    assert 10 <= last <= 12
    assert 86 <= threshold <= 92
    assert "held-out error 0.00 % [0.00 %, 1.88 %], 0 of 200 trajectories wrong in 4 folds" in answer.out
    assert "temperature" in page.read_text(encoding="utf-8")


def test_the_formula_carries_over_to_new_data(kettles: Path, tmp_path: Path):
    formula = json.loads(answer_of("infer", kettles, "--json").out)["formula"]
    fresh = tmp_path / "fresh.csv"  # labels are not needed
    readings = {"hot in time": 8, "hot too late": 15, "never hot": None}
    lines = ["trajectory,tick,temperature,power"]
    for name, hottest in readings.items():
        lines += [f"{name},{tick},{95 if tick == hottest else 50},1000" for tick in range(18)]
    fresh.write_text("\n".join(lines) + "\n", encoding="utf-8")
    rows = [line.split("\t")[:2] for line in answer_of("check", formula, fresh).out.splitlines()]
    assert rows == [
        ["trajectory", "verdict"],
        ["hot in time", "true"],
        ["hot too late", "false"],
        ["never hot", "false"],
    ]


def test_the_readmes_command_prints_what_it_shows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    shutil.copytree(README.parent / "examples", "examples", ignore=shutil.ignore_patterns("__pycache__"))
    (step,) = pages.steps("\n".join(re.findall(r"^```console\n.*?^```$", README.read_text("utf-8"), re.M | re.S)))
    printed = re.sub(r"\d+\.\d s\b", "… s", pages.run(step, {}))
    parts = re.sub(r"\d+\.\d s\b", "… s", step.shown).split("[…]\n")
    assert len(parts) == 3  # what is left out
    assert re.fullmatch(".*".join(map(re.escape, parts)), printed, re.S), printed
    assert Path("kiln.html").stat().st_size > 10_000


def test_from_gymnasium_make_to_a_trained_agent_in_under_25_lines(capsys: pytest.CaptureFixture[str]):
    pytest.importorskip("stable_baselines3", reason="Stable-Baselines3 is not installed; run make sb3")
    torch = pytest.importorskip("torch")
    block = BLOCKS[0]
    assert "gymnasium.make(" in block
    assert len(block.splitlines()) < 25
    torch.set_num_threads(1)  # tests run side by side
    exec(block, {})
    assert capsys.readouterr().out == "True\n"
