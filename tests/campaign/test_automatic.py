"""`--algorithm auto` is an algorithm that the run then names."""

import pytest

import bridgegen as bg
from bridgegen.base.errors import InputError
from bridgegen.search.algorithms import names
from bridgegen.search.algorithms.automatic import AUTO, MOST_MODELLED, MOST_PARAMETERS, automatic

QUIET = {"keep": 0, "causes": False, "deliver": False}


@pytest.mark.parametrize(
    ("rows", "parameters", "many", "closed_loop", "name"),
    [
        (10, 5, False, False, "surrogate"),
        (MOST_MODELLED, MOST_PARAMETERS, False, False, "surrogate"),
        (MOST_MODELLED + 1, 5, False, False, "es"),
        (100, MOST_PARAMETERS + 1, False, False, "es"),
        (100, 5, False, True, "es"),
        (10**6, 5, True, False, "nsga2"),
    ],
)
def test_what_it_is(rows, parameters, many, closed_loop, name):
    assert automatic(rows, parameters, many=many, closed_loop=closed_loop) == name
    assert name in names()


def test_a_run_is_that_of_the_algorithm_it_chose(tmp_path):
    chosen = bg.run_search("crossroads-s1", algorithm=AUTO, budget=30, out=tmp_path / "a", **QUIET)
    named = bg.run_search(
        "crossroads-s1", algorithm="surrogate", budget=30, out=tmp_path / "b", **QUIET
    )
    assert chosen.settings.algorithm == "surrogate"
    assert "--algorithm surrogate" in chosen.settings.command(tmp_path)
    assert (chosen.rows().X == named.rows().X).all()


def test_many_objectives_and_a_wrong_axis(tmp_path):
    many = bg.run_search(
        "crossroads-s4", algorithm=AUTO, objectives="many", budget=40, out=tmp_path / "a", **QUIET
    )
    assert many.settings.algorithm == "nsga2"
    with pytest.raises(InputError, match="nonsense"):
        bg.run_search("crossroads-s4", algorithm=AUTO, fixed={"nonsense": 1.0}, **QUIET)
