from itertools import pairwise

import pytest
from tests.approval import approve, refuses

from bridgegen.base.errors import ScenarioError
from bridgegen.scenario.language.constraints import order, problems_of


def rules(build, make_parameter, names="abcd", bounds=(), derived=()):
    scenario = build([make_parameter(name) for name in names], bounds, derived)
    return list(scenario.parameters.values()), scenario.bounds, scenario.derived


def test_no_problems_in_a_graph_without_cycles(build, make_parameter):
    made = rules(
        build, make_parameter, bounds=[("a", "d", None), ("b", "a", "d")], derived=[("e", "b")]
    )
    assert problems_of(*made) == []
    ranks = {name: rank for rank, name in enumerate(order("abcde", made[1], made[2]))}
    assert ranks["d"] < ranks["a"] < ranks["b"] < ranks["e"]


@pytest.mark.parametrize(
    ("bounds", "derived", "cycle"),
    [
        ([("a", "a - 1", None)], [], {"a"}),
        ([("a", "b", None), ("b", None, "a")], [], {"a", "b"}),
        ([("a", "b", None), ("b", "c", None), ("c", None, "a + d")], [], {"a", "b", "c"}),
        ([("a", "e", None)], [("e", "a + b")], {"a", "e"}),
        ([], [("e", "f"), ("f", "e")], {"e", "f"}),
    ],
)
def test_cycle_is_named(build, make_parameter, bounds, derived, cycle):
    (problem,) = problems_of(*rules(build, make_parameter, bounds=bounds, derived=derived))
    chain = problem.removeprefix("constraints must not form a cycle, got ").split(" (")[0]
    walk = chain.split(" → ")
    assert set(walk) == cycle
    assert walk[0] == walk[-1]
    made = [(target, f"{lo} {hi}") for target, lo, hi in bounds] + derived
    for limiting, limited in pairwise(walk):
        assert any(target == limited and limiting in text.split() for target, text in made)


def test_cycle_is_refused_by_the_space(build, make_parameter):
    scenario = build(
        [make_parameter("a"), make_parameter("b")], [("a", "b", None), ("b", "a", None)]
    )
    with refuses(ScenarioError):
        scenario.space()


def test_all_problems_at_once(build, make_parameter):
    made = rules(
        build,
        make_parameter,
        bounds=[("e", "a", None), ("zz", "a", None), ("a", "alpha", None)],
        derived=[("e", "bb"), ("b", "a")],
    )
    problems = problems_of(*made)
    assert [p.split(";")[0].split(":")[0] for p in problems] == [
        "'b' is declared twice, first",
        "the bound 'e >= a' limits 'e', which follows from 'e = bb'",
        "the bound 'zz >= a' limits the unknown parameter 'zz'",
        "unknown name 'alpha' in 'a >= alpha'",
        "unknown name 'bb' in 'e = bb'",
    ]
    approve(problems[4], "b")


def test_names_declared_wrongly_are_not_called_unknown(build, make_parameter):
    made = rules(build, make_parameter, bounds=[("a", "broken", None)])
    assert problems_of(*made, also=["broken"]) == []
    assert len(problems_of(*made)) == 1
