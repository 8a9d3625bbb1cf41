"""The player in a real browser: what it shows is what was recorded, and what a reader can do with it."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from tests.browsers import Open
from tests.experiments import recorded, synthetic
from tests.experiments.playing import choose, told, watch
from tests.experiments.tiny import TINY
from tickwise.automata.build import timed_automata
from tickwise.automata.run import EdgeStep, run
from tickwise.envs.gridworld import HEADINGS
from tickwise.experiments.jobs import learning_problem
from tickwise.experiments.recording import PREFIX
from tickwise.experiments.report import render_report
from tickwise.experiments.store import Store
from tickwise.logic.parse import parse
from tickwise.logic.sdnf import to_sdnf
from tickwise.logic.semantics import verdict

SPEC = synthetic.small()
DIGITS = str.maketrans("₀₁₂₃₄₅₆₇₈₉", "0123456789")


def test_the_automata_run_as_the_semantics_say(opened: Open, results: dict[str, Any]):
    page = opened()
    choose(page, method="III", run="2", point="1,000")
    sdnf = to_sdnf(parse(recorded.EVERY_OPERATOR))
    automata = timed_automata(sdnf)
    states = results["methods"]["III"][1][PREFIX + "states"][1]
    mdp = SPEC.target.mdp()
    said: set[int] = set()
    for episode in (0, 1):
        choose(page, episode=str(episode + 1))
        path = mdp.coordinates[states[episode][states[episode] >= 0]]
        runs = [run(automaton, path, variables=mdp.variables) for automaton in automata]
        steps = [[step for step in one.steps if isinstance(step, EdgeStep)] for one in runs]
        parts = [part.formula for disjunct in sdnf.disjuncts for part in disjunct.primitives]
        ticks = watch(page)
        assert len(path) == len(ticks)
        for tick, seen in enumerate(ticks):
            assert seen["locations"] == [own[tick].target for own in steps]
            assert seen["clocks"] == [list(own[tick].after) for own in steps]
            wanted = [int(verdict(part, path[: tick + 1], variables=mdp.variables)) for part in parts]
            assert seen["verdicts"] == seen["literals"] == wanted
            said |= set(wanted)
    assert said == {-1, 0, 1}


def test_the_drawing_highlights_the_current_location(opened: Open, results: dict[str, Any]):
    page = opened()
    choose(page, method="III")
    automata = timed_automata(parse(recorded.EVERY_OPERATOR))
    followed = int(results["methods"]["III"][0][PREFIX + "disjunct"][1, 0])
    order = [followed, 1 - followed]  # the one that is followed stands first
    seen = set()
    for tick in watch(page):
        clocks = [clock for number in order for clock in tick["clocks"][number]]
        assert [int(text.split(" = ")[1]) for text in tick["shown"]] == clocks
        names = [automata[number].locations[tick["locations"][number]] for number in order]
        assert [name.translate(DIGITS) for name in tick["current"]] == names
        working = [name for name in names if name.startswith("q")]
        assert len(working) <= tick["taken"] <= len(names)
        seen.add(names[0])
    assert len(seen) > 1


def test_recorded_memory_is_where_the_player_is(finished: Path, opened: Open):
    page = opened(finished / "report.html")
    problem = learning_problem(TINY, Store(finished), "IV")
    (table,) = problem.memory.tables
    content = Store(finished).load("learn-IV-1")
    choose(page, method="IV", run="2")
    for point, learned in enumerate(content[PREFIX + "at"]):
        choose(page, point=f"{learned:,} ", episode="1")
        memory = content[PREFIX + "memory"][point, 0]
        for tick, seen in enumerate(watch(page)):
            assert seen["locations"] == [int(table.location[memory[tick]])]
            active = table.automaton.active[table.location[memory[tick]]]
            (clocks,) = seen["clocks"]
            assert [clocks[clock] for clock in active] == [int(table.clocks[memory[tick], clock]) for clock in active]


def test_the_robot_is_where_it_was(opened: Open, results: dict[str, Any]):
    page = opened()
    choose(page, method="III", run="1", point="0 ", episode="2")
    states = results["methods"]["III"][0][PREFIX + "states"][0, 1]
    before = None
    for tick, seen in enumerate(watch(page)):
        i, j, heading = SPEC.target.world.place(int(states[tick]))
        assert f"the robot is in cell ({i}, {j}), facing {HEADINGS[heading]}" in seen["world"]
        x, y, turn = (float(number) for number in re.findall(r"-?[\d.]+", seen["robot"]))
        assert ((x - 22) / 40, 9 - (y - 8) / 40) == (i + 0.5, j + 0.5)
        assert (-turn / 90) % 4 == heading
        assert before is None or abs(turn - before) <= 90
        before = turn


def test_regions_light_up_with_the_robot_in_them(opened: Open, results: dict[str, Any]):
    page = opened()
    choose(page, method="III")
    boxes = [part.box for one in to_sdnf(parse(recorded.EVERY_OPERATOR)).disjuncts for part in one.primitives]
    boxes = list(dict.fromkeys(boxes))
    mdp = SPEC.target.mdp()
    states = results["methods"]["III"][0][PREFIX + "states"][1, 0]
    counts = set()
    for tick, seen in enumerate(watch(page)):
        place = mdp.coordinates[states[tick]]
        inside = [all(b.lower <= place["xy".index(b.variable)] <= b.upper for b in box.bounds) for box in boxes]
        assert seen["lit"] == inside
        counts.add(sum(inside))
    assert len(counts) > 1


def test_every_method_run_and_episode_can_be_chosen(opened: Open):
    page = opened()
    titles = page.locator("[data-choose=method] option").all_text_contents()
    assert [title.split(":")[0] for title in titles] == ["I", "III", "V", "source task"]
    seen = set()
    for change in (
        {"method": "I", "run": "1", "point": "0 ", "episode": "1"}, {"method": "III"}, {"method": "source"},
        {"run": "2"}, {"run": "3"}, {"point": "1,000 "}, {"episode": "2"}, {"point": "0 "},
    ):  # fmt: skip
        choose(page, **change)
        seen.add(page.locator(".ghost").get_attribute("points"))
    assert len(seen) == 8
    choose(page, method="I")
    assert page.get_by_text("Method I does not know this automaton").is_visible()


def test_it_plays_pauses_and_ends_at_the_last_tick(opened: Open):
    page = opened()
    page.locator("[data-choose=speed]").select_option("16")
    play = page.locator("[data-do=play]")
    play.click()
    assert play.get_attribute("aria-label") == "Pause"
    page.locator('.player:not([data-tick="0"], [data-tick="1"])').wait_for()
    play.click()
    tick = told(page, "tick")
    page.wait_for_timeout(150)
    assert told(page, "tick") == tick
    assert play.get_attribute("aria-label") == "Play"
    page.locator("[data-do=last]").click()
    assert told(page, "tick") == int(page.locator("[data-choose=tick]").get_attribute("max"))
    play.click()  # from the end it begins again
    assert told(page, "tick") < 5


def test_keys_do_all_that_buttons_do(opened: Open):
    page = opened()
    player = page.locator(".player")
    player.focus()
    page.keyboard.press("ArrowRight")
    page.keyboard.press("ArrowRight")
    page.keyboard.press("ArrowLeft")
    assert told(page, "tick") == 1
    page.keyboard.press("End")
    last = told(page, "tick")
    assert last >= 38
    page.keyboard.press("Home")
    assert told(page, "tick") == 0
    page.keyboard.press("Space")
    assert page.locator("[data-do=play]").get_attribute("aria-label") == "Pause"
    page.keyboard.press("Space")
    assert page.locator("[data-do=play]").get_attribute("aria-label") == "Play"
    page.keyboard.press("+")
    assert page.locator("[data-choose=speed]").input_value() == "8"
    page.keyboard.press("-")
    for key, name, values in ((".", "episode", 2), ("[", "point", 2), ("m", "method", 4), ("r", "run", 3)):
        select = page.locator(f"[data-choose={name}]")
        first = select.input_value()
        page.keyboard.press(key)
        assert select.input_value() != first
        for _ in range(values - 1):
            page.keyboard.press(key)
        assert select.input_value() == first
    page.locator(".keys summary").click()
    named = page.locator(".keys kbd").all_text_contents()
    assert {"Space", "←", "→", "↑", "Home", "End", "-", "+", ",", ".", "[", "]", "m", "r", "Enter", "Esc"} == set(named)


def test_the_focus_is_seen_and_controls_have_names(opened: Open):
    page = opened()
    page.locator("[data-choose=method]").focus()
    for _ in range(12):
        page.keyboard.press("Tab")
        outline = page.evaluate("getComputedStyle(document.activeElement).outlineStyle")
        assert outline != "none", page.evaluate("document.activeElement.outerHTML.slice(0, 200)")
    for control in page.locator(".player button, .player select, .player input").all():
        assert control.evaluate("x => x.getAttribute('aria-label') || (x.labels[0] || x).textContent.trim()")
    assert page.locator(".player").get_attribute("role") == "group"
    assert page.locator("[data-choose=tick]").get_attribute("aria-valuetext") == "tick 0 of 40"


def test_the_scrubber_and_the_lanes_choose_the_tick(opened: Open):
    page = opened()
    page.locator("[data-choose=tick]").fill("17")
    assert told(page, "tick") == 17
    lane = page.locator(".lane-strip").first
    box = lane.bounding_box()
    lane.click(position={"x": box["width"] * 25.5 / 41, "y": 5})
    assert told(page, "tick") == 25


def test_old_recordings_are_missed_in_words(opened: Open, tmp_path: Path):
    path = tmp_path / "old.html"
    path.write_text(render_report(synthetic.results(SPEC), SPEC, {}), encoding="utf-8")
    page = opened(path)
    assert page.get_by_text("There is nothing to play").is_visible()
    assert page.locator(".player").count() == 0


def test_a_run_without_a_formula_plays_the_world_alone(opened: Open, tmp_path: Path):
    path = tmp_path / "plain.html"
    path.write_text(render_report(recorded.results(SPEC, formula=None), SPEC, {}), encoding="utf-8")
    page = opened(path)
    choose(page, method="I")
    assert page.get_by_text("No formula was inferred, so there is no automaton.").is_visible()
    assert len(watch(page)) >= 39


def test_a_reader_can_drive_the_robot(opened: Open):
    page = opened()
    choose(page, method="III")
    page.evaluate("() => { window.chances = []; Math.random = () => window.chances.shift(); }")
    mdp = SPEC.target.mdp()
    start = page.locator(".map > title").text_content()
    page.get_by_role("button", name="Drive it yourself").click()
    assert page.locator(".map > title").text_content() == start
    assert page.locator("[data-choose=method]").is_disabled()
    place = re.search(r"cell \((\d), (\d)\), facing (\w+)", start)
    state = SPEC.target.world.state(int(place[1]), int(place[2]), HEADINGS.index(place[3]))
    # (key, action, the number drawn, the outcome by the world's table: forward, left, right; turned, not turned)
    script = [
        ("ArrowUp", 0, 0.5, 0), ("ArrowUp", 0, 0.01, 1), ("ArrowUp", 0, 0.05, 2), ("ArrowLeft", 1, 0.5, 0),
        ("ArrowLeft", 1, 0.02, 1), ("ArrowRight", 2, 0.5, 0), ("ArrowRight", 2, 0.01, 1), ("ArrowUp", 0, 0.99, 0),
    ]  # fmt: skip
    states = [state]
    for tick, (key, action, chance, outcome) in enumerate(script * 5, start=1):
        page.evaluate("chance => { window.chances.push(chance); }", chance)
        page.keyboard.press(key)
        state = int(mdp.successor[state, action, outcome])
        states.append(state)
        i, j, heading = SPEC.target.world.place(state)
        assert f"cell ({i}, {j}), facing {HEADINGS[heading]}" in page.locator(".map > title").text_content()
        assert told(page, "tick") == tick
    page.keyboard.press("ArrowUp")  # past the deadline nothing moves
    assert told(page, "tick") == 40
    automata = timed_automata(parse(recorded.EVERY_OPERATOR))
    path = mdp.coordinates[states]
    last = [run(automaton, path, variables=mdp.variables).steps[-1] for automaton in automata]
    assert told(page, "locations") == [step.target for step in last]
    page.keyboard.press("Escape")
    assert page.get_by_role("button", name="Drive it yourself").is_visible()
    assert page.locator("[data-choose=method]").is_enabled()
