import numpy as np
import pytest

from bridgegen.search.triage.neighbours import NEIGHBOURS, PLACEBO, cause_of, neighbourhoods
from bridgegen.search.triage.record import Treatment


def at(space, **values):
    return space.row(values)[np.newaxis]


def one(pipeline, x, **more):
    (found,) = neighbourhoods(pipeline, x, np.array([3]), 0, **more)
    return found


def fast(limit):
    return lambda v, fix: np.where((v["ego_speed"] >= limit) & (fix != 1), 0.7, 0.0)


def test_in_the_middle_of_harm_all_neighbours_are_harmful_and_the_fix_is_the_cause(
    space, world, fixed
):
    found = one(world(space, fast(6.0), fixed), at(space, ego_speed=7.5))
    assert (found.harmful, found.rows, found.robustness) == (32, 32, 1.0)
    assert not found.knife_edge
    assert found.cause == "planning"
    perception, planning, control = found.fixes
    assert (planning.gone, planning.new, planning.drop) == (32, 0, 1.0)
    assert planning.low > 0.8
    assert planning.works
    assert planning.exceeds(found.placebo)
    assert (perception.gone, control.gone, found.placebo.gone) == (0, 0, 0)
    assert found.fix == planning
    assert found.placebo.name == PLACEBO


def test_on_the_edge_it_says_so_and_credits_no_fix(space, world, fixed):
    """Uniform neighbours: the edge lies 40 % of the radius ahead, so 30 % are harmful."""
    radius = 0.025 * (8.9 - 4.9)
    shares = []
    for number in range(40):
        pipeline = world(space, fast(7.0 + 0.4 * radius), fixed)
        (found,) = neighbourhoods(pipeline, at(space, ego_speed=7.0), np.array([number]), 0)
        shares.append(found.robustness)
        assert found.knife_edge == (found.robustness < 0.5)
        assert (found.cause == "sensitive") == found.knife_edge
    assert np.mean(shares) == pytest.approx(0.3, abs=0.03)


def test_a_fix_that_does_as_much_as_a_random_move_is_no_cause(space, world, fixed):
    """The perception of this driver matters to nobody; a fix moves the edge a little."""
    radius = 0.025 * (8.9 - 4.9)

    def harm(v, fix):
        edge = np.where(fix == 0, 7.0 - 0.75 * radius, 7.0 - 0.8 * radius)
        return np.where(v["ego_speed"] >= edge, 0.7, 0.0)

    pipeline = world(space, harm, fixed)
    for number in range(40):
        (found,) = neighbourhoods(pipeline, at(space, ego_speed=7.0), np.array([number]), 0)
        assert found.cause == "unavoidable"
        assert found.fix is None


def test_all_neighbours_have_the_row_s_random_numbers(space, world, fixed):
    pipeline, x = world(space, fast(6.0), fixed), at(space, ego_speed=7.5)
    one(pipeline, x)
    for X, _, noise in pipeline.asked:
        assert (noise == x).all()
        assert len(X) % NEIGHBOURS == 0


def test_a_row_s_neighbours_do_not_depend_on_the_rows_beside_it(space, world, fixed):
    pipeline = world(space, fast(7.4), fixed)
    X = space.decode(np.random.default_rng(0).random((6, space.n_var)))
    together = neighbourhoods(pipeline, X, np.arange(6), 0)
    alone = [neighbourhoods(pipeline, X[[k]], np.array([k]), 0)[0] for k in range(6)]
    backwards = neighbourhoods(pipeline, X[::-1], np.arange(6)[::-1], 0)[::-1]
    assert together == alone == backwards
    known = {}
    neighbourhoods(pipeline, X, np.arange(6), 0, fixes=False, as_is=known)
    assert neighbourhoods(pipeline, X, np.arange(6), 0, as_is=known) == together


def test_neighbours_without_a_result_do_not_count(space, world, fixed):
    pipeline = world(space, fast(6.0), fixed, fails=lambda v: v["ego_speed"] > 7.5)
    found = one(pipeline, at(space, ego_speed=7.5))
    assert 8 <= found.rows <= 24
    assert found.harmful == found.rows
    assert all(each.rows <= found.rows for each in found.fixes)
    nothing = world(space, fast(6.0), fixed, fails=lambda v: v["ego_speed"] > 0.0)
    found = one(nothing, at(space, ego_speed=7.5))
    assert (found.rows, found.robustness, found.cause) == (0, None, "")


def test_without_fixes_only_robustness_is_known(space, world, fixed):
    found = one(world(space, fast(6.0), fixed), at(space, ego_speed=7.5), fixes=False)
    assert (found.robustness, found.fixes, found.placebo, found.cause) == (1.0, (), None, "")


def test_a_fix_must_beat_the_placebo_in_both_counts():
    def made(gone, new):
        drop = (gone - new) / 32
        return Treatment(name="", cause="", rows=32, gone=gone, new=new, drop=drop, low=-1, high=1)

    assert made(10, 0).exceeds(made(9, 0))
    assert not made(10, 0).exceeds(made(10, 4))  # as many are helped
    assert not made(10, 6).exceeds(made(9, 0))  # and others harmed


def spoiled_after(time):
    """With the fix the harm is gone, and the traffic is implausible from some time on."""
    return {"fails": lambda v, fix: fix == 1, "spoiled": time}


def test_a_fix_that_removes_the_conflict_counts_though_what_follows_is_implausible(
    space, world, fixed
):
    """The conflict is at 2 s. By the earlier rule no neighbour was known: "unavoidable"."""
    pipeline = world(space, fast(6.0), fixed, **spoiled_after(9.0))
    found = one(pipeline, at(space, ego_speed=7.5))
    _, planning, _ = found.fixes
    assert (planning.rows, planning.before, planning.gone) == (32, 32, 32)
    assert found.cause == "planning"


def test_what_is_implausible_before_the_conflict_says_nothing(space, world, fixed):
    pipeline = world(space, fast(6.0), fixed, **spoiled_after(1.0))
    found = one(pipeline, at(space, ego_speed=7.5))
    assert found.fixes[1].rows == 0
    assert found.cause == "not known"
    assert found.fix is None


def test_unavoidable_needs_enough_neighbours_with_each_fix(space, world, fixed):
    found = one(world(space, lambda v, fix: np.full(len(fix), 0.7), fixed), at(space))
    assert found.cause == "unavoidable"
    few = [each.model_copy(update={"rows": 15}) for each in found.fixes]
    assert cause_of(32, 32, few, found.placebo) == "not known"
    enough = [each.model_copy(update={"rows": 16}) for each in found.fixes]
    assert cause_of(32, 32, enough, found.placebo) == "unavoidable"
