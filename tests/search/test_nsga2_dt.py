import json
from dataclasses import replace

import numpy as np
import pytest

from bridgegen.base.arrays import Bool, Float
from bridgegen.search.algorithms import Problem, Results
from bridgegen.search.algorithms.nsga2_dt import NSGA2DT
from bridgegen.search.algorithms.sampling import Random

N_VAR = 3


def in_corner(U: Float) -> Bool:
    return (U[:, 0] > 0.7) & (U[:, 1] < 0.5)


def nowhere(U: Float) -> Bool:
    return np.zeros(len(U), np.bool_)


def drive(search, is_critical, n_batches: int, fails=nowhere) -> list[Float]:
    batches = []
    for _ in range(n_batches):
        U = search.ask()
        batches.append(U)
        F = np.stack([np.abs(U[:, 0] - 0.9), np.abs(U[:, 1] - 0.2) + U[:, 2]], axis=1)
        ok = ~fails(U)
        critical = is_critical(U) & ok
        search.tell(
            U, replace(Results.of_F(np.where(ok[:, None], F, np.nan), ok), critical=critical)
        )
    return batches


def dt(seed: int = 0, **settings) -> NSGA2DT:
    return NSGA2DT(Problem(("speed", "gap", "fog"), (), 2), seed, **settings)


def test_the_first_sample_fills_the_space():
    (U,) = drive(dt(initial=60), in_corner, 1)
    strata = np.sort(np.floor(U * 60).astype(int), axis=0)
    assert (strata == np.arange(60)[:, None]).all()


def test_it_searches_where_the_tree_found_harm():
    search = dt(initial=200)
    batches = drive(search, in_corner, 13)
    trees, boxes = search.notes()["decision trees"], search.notes()["critical boxes"]
    first = trees[0]
    assert first["evaluations"] == 200
    assert first["critical leaves"] == 1
    (box,) = [one for one in boxes if one["tree"] == 1]
    # The tree's edges lie between rows of the sample, near the truth.
    assert set(box["box"]) == {"speed", "gap"}
    assert box["box"]["speed"] == [pytest.approx(0.7, abs=0.02), 1.0]
    assert box["box"]["gap"] == [0.0, pytest.approx(0.5, abs=0.02)]
    inside = (batches[0][:, 0] >= box["box"]["speed"][0]) & (
        batches[0][:, 1] <= box["box"]["gap"][1]
    )
    assert (box["rows"], box["critical"]) == (inside.sum(), in_corner(batches[0]).sum())
    for U in batches[1:7]:  # the box's first population and five generations
        assert len(U) == 40
        assert (U[:, 0] >= box["box"]["speed"][0]).all()
        assert (U[:, 1] <= box["box"]["gap"][1]).all()
    assert trees[1]["evaluations"] > 400


def test_a_box_begins_with_what_is_known_there():
    batches = drive(dt(initial=200), in_corner, 2)
    first, known = batches[1], {row.tobytes() for row in batches[0]}
    seeds = [row for row in first if row.tobytes() in known]
    U = batches[0][in_corner(batches[0])]
    F = np.stack([np.abs(U[:, 0] - 0.9), np.abs(U[:, 1] - 0.2) + U[:, 2]], axis=1)
    front = [
        row
        for row, f in zip(U, F, strict=True)
        if not any((other <= f).all() and (other < f).any() for other in F)
    ]
    assert {row.tobytes() for row in seeds} == {row.tobytes() for row in front}
    assert len(np.unique(first, axis=0)) == 40


@pytest.mark.parametrize("is_critical", [nowhere, lambda U: ~nowhere(U)])
def test_no_harm_or_nothing_else_the_whole_cube_is_searched(is_critical):
    search = dt()
    U = np.concatenate(drive(search, is_critical, 8))
    assert (U.min(axis=0) < 0.1).all()
    assert (U.max(axis=0) > 0.9).all()
    tree = search.notes()["decision trees"][0]
    assert tree["leaves"] == 1
    assert tree["critical leaves"] == int(is_critical(U)[0])


def test_the_surest_box_comes_first():
    """9 of 10 in one, 100 of 100 in the other, at opposite ends of a parameter."""

    def two(U: Float) -> Bool:
        return (U[:, 0] < 0.1) | (U[:, 0] > 0.6)

    search = dt(initial=250)
    batches = drive(search, two, 8)
    boxes = [one for one in search.notes()["critical boxes"] if one["tree"] == 1]
    estimates = [(box["critical"] + 1) / (box["rows"] + 2) for box in boxes]
    assert len(boxes) == 2
    assert estimates == sorted(estimates, reverse=True)
    assert (batches[1][:, 0] > 0.58).all()
    assert (batches[7][:, 0] < 0.12).all()


def test_a_leaf_with_too_few_rows_or_too_little_harm_is_no_box():
    few = dt(initial=200, min_rows=150)
    drive(few, in_corner, 2)
    assert few.notes()["decision trees"][0]["critical leaves"] == 0

    def striped(U: Float) -> Bool:  # a third of what lies in it, too fine for any leaf
        return in_corner(U) & (np.floor(U[:, 2] * 1e6) % 3 == 0)

    strict, lenient = dt(initial=400, min_rows=40), dt(initial=400, min_rows=40, share=0.2)
    for search in (strict, lenient):
        drive(search, striped, 2)
    assert strict.notes()["decision trees"][0]["critical leaves"] == 0
    assert lenient.notes()["decision trees"][0]["critical leaves"] > 0


def test_who_failed_is_neither():
    """Failed rows are in no leaf, and no box is looked for where all fail."""
    search = dt(initial=200)
    drive(search, in_corner, 3, fails=lambda U: U[:, 2] > 0.5)
    assert search.notes()["decision trees"][0]["evaluations"] == pytest.approx(100, abs=1)


def test_it_finds_much_more_than_chance():
    by_chance = np.mean(
        [
            in_corner(Random(Problem.unnamed(N_VAR), seed, population=1000).ask()).mean()
            for seed in range(5)
        ]
    )
    for seed in range(5):
        U = np.unique(np.concatenate(drive(dt(seed), in_corner, 25)), axis=0)
        assert in_corner(U).mean() > 3 * by_chance


def test_its_notes_are_json_and_bounded():
    search = dt(initial=2000, min_rows=1)

    def noise(U: Float) -> Bool:
        return np.floor(U[:, 2] * 1e6) % 2 == 0

    drive(search, noise, 1)
    (tree,) = search.notes()["decision trees"]
    assert tree["critical leaves"] > 100
    assert len(search.notes()["critical boxes"]) == 100
    json.dumps(search.notes(), allow_nan=False)
