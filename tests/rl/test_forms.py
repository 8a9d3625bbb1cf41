"""What all forms of learning have in common: names, plain data, and the interface of a learner."""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from typing import Any

import numpy as np
import pytest

from tests.rl.form_twins import chance_world, formula_problem
from tickwise.errors import ConfigurationError
from tickwise.experiments.plain import from_plain, to_plain
from tickwise.logic.parse import parse
from tickwise.logic.sdnf import to_sdnf
from tickwise.rl.forms import FORMS, find_form
from tickwise.rl.qlearning import Problem

NAMES = list(FORMS)


def a_problem() -> Problem:
    return formula_problem(chance_world(2), to_sdnf(parse("F[0,3] G[0,2] (x >= 1)")))


@pytest.mark.parametrize("name", NAMES)
def test_plain_data_tell_the_form(name: str):
    form = find_form(name)()
    document = asdict(form)
    assert document["form"] == form.form == name
    assert json.loads(json.dumps(document)) == document
    # as a cluster's jobs carry it
    assert from_plain(json.loads(json.dumps(to_plain(form)))) == form


def test_no_two_forms_have_the_same_plain_data():
    documents = [json.dumps(asdict(form())) for form in FORMS.values()]
    assert len(set(documents)) == len(FORMS)


@pytest.mark.parametrize("name", NAMES)
def test_settings_under_the_name_of_another_form_are_refused(name: str):
    form: Any = FORMS[name]()
    for other in NAMES:
        if other != name:
            with pytest.raises(ConfigurationError, match=f"is '{name}', not '{other}'; leave it out"):
                replace(form, form=other)


def test_a_name_that_there_is_not_is_refused():
    with pytest.raises(ConfigurationError, match="no form of learning 'sarsa'; use q, counterfactual") as caught:
        find_form("sarsa")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", NAMES)
def test_learning_in_two_parts_is_learning_at_once(name: str):
    problem, form = a_problem(), find_form(name)()
    once, twice = form.learner(problem), form.learner(problem)
    rngs = [np.random.default_rng(1) for _ in range(2)]
    returns, paths = once.learn(rngs[0], 30)
    parts = [twice.learn(rngs[1], episodes) for episodes in (10, 20)]
    assert np.concatenate([part[0] for part in parts]).tobytes() == returns.tobytes()
    np.testing.assert_array_equal(np.concatenate([part[1] for part in parts]), paths)
    assert twice.q.tobytes() == once.q.tobytes()
    assert rngs[0].bit_generator.state == rngs[1].bit_generator.state
    assert twice.problem.mdp is problem.mdp
    assert twice.problem.task is problem.task


@pytest.mark.parametrize("name", NAMES)
def test_values_to_begin_with_are_left_as_they_are_and_must_fit(name: str):
    problem, form = a_problem(), find_form(name)()
    shape = (problem.memory.n_states, problem.mdp.n_states, problem.mdp.n_actions)
    q = np.full(shape, 3.0, dtype=np.float32)
    form.learner(problem, q).learn(np.random.default_rng(0), 5)
    assert (q == 3.0).all()
    with pytest.raises(ConfigurationError, match="the values to begin with have shape"):
        form.learner(problem, q[:1])
