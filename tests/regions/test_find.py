import numpy as np
import pytest
from tests.approval import approve, refuses

from bridgegen.base.errors import InputError
from bridgegen.scenario.language.box_sampling import in_box
from bridgegen.search.regions.box import ANYWHERE, rule, whole
from bridgegen.search.regions.find import MOST_CONDITIONS, find_regions


def planted(v):
    return (v["bv_start"] <= 12.0) & (v["bv_trigger_time"] >= 4.0)


def tossed(seed, chance):
    """Each row is critical by chance alone."""
    coin = np.random.default_rng(seed)
    return lambda v: coin.random(len(v["bv_speed"])) < chance


def column(space, name):
    return space.variables.index(name)


def test_a_planted_region_is_found_and_confirmed(space, world):
    simulator = world(space, planted)
    X, critical = simulator.random(2000)
    found = find_regions(space, simulator, X, critical)
    (region,) = found.regions
    assert region.confirmed
    assert rule(region.box, space).startswith("bv_start ≤ ")
    approve(rule(region.box, space), "bv_trigger_time")
    assert region.box.high[column(space, "bv_start")] == pytest.approx(12.0, abs=0.3)
    assert region.box.low[column(space, "bv_trigger_time")] == pytest.approx(4.0, abs=0.3)
    assert (region.fresh.rows, region.fresh.failed) == (300, 0)
    assert region.fresh.share > 0.95
    # By hand: bv_start has 5 of its 18 m, the trigger time 6 of its 10 s.
    assert region.space_share == pytest.approx(5 / 18 * 6 / 10, rel=0.05)
    assert found.space_share == region.space_share
    assert found.critical_held >= 0.97 * found.critical
    assert (found.rows, found.critical) == (2000, critical.sum())
    assert found.simulations == 300


def test_what_the_search_says_of_its_own_rows_does_not_count(space, world):
    """Where the two planted conditions hold, it met fast egos only, and all were critical."""
    simulator = world(space, lambda v: planted(v) & (v["ego_speed"] >= 8.0))
    X, critical = simulator.random(4000)
    chosen = critical | ~planted(simulator.values(X))
    found = find_regions(space, simulator, X[chosen], critical[chosen])
    (wrong,) = [one for one in found.regions if one.narrowed]
    assert wrong.search.interval[0] > 0.9
    assert not wrong.confirmed
    assert wrong.fresh.interval[1] < 0.4  # the truth is 0.9 m/s of the ego's 4, somewhat fewer
    # Its fresh rows tell the tree what the run's did not.
    (right,) = found.confirmed
    assert right.box.low[column(space, "ego_speed")] == pytest.approx(8.0, abs=0.2)
    assert right.fresh.share > 0.9
    assert found.regions[0] is right


@pytest.mark.parametrize("seed", range(6))
def test_chance_is_not_confirmed(space, world, seed):
    """Every box's true share is 45 %; the tree chooses those where more fell on the right side."""
    simulator = world(space, tossed(seed, 0.45))
    X, critical = simulator.random(1000, seed)
    found = find_regions(space, simulator, X, critical, seed=seed)
    assert any(one.search.share > 0.5 for one in found.regions)  # or there is nothing to refute
    assert found.confirmed == ()
    assert (found.critical_held, found.space_share) == (0, 0.0)


def test_fresh_rows_are_new_feasible_and_in_the_region(every, world):
    simulator = world(every, lambda v: (v["lanes_per_direction"] >= 2) & (v["fog_density"] > 30))
    X, critical = simulator.random(20_000)  # such fog is met in 3 % of them
    found = find_regions(every, simulator, X, critical, samples=100)
    (region,) = found.regions
    assert region.confirmed
    approve(rule(region.box, every), "lanes_per_direction")
    (rows,) = simulator.asked
    assert rows.shape == (100, len(every.names))
    assert every.violations(rows) == []
    assert in_box(every, rows, region.box.low, region.box.high).all()
    assert not {row.tobytes() for row in rows} & {row.tobytes() for row in X}


def test_failed_rows_are_counted_apart(space, world):
    simulator = world(space, planted, fails=lambda v: v["bv_speed"] > 2.05)
    X, critical = simulator.random(2000)
    (region,) = find_regions(space, simulator, X, critical).confirmed
    assert region.fresh.rows + region.fresh.failed == 300
    assert 100 < region.fresh.failed < 200
    assert region.fresh.share > 0.95

    every_row = world(space, planted, fails=lambda v: v["bv_speed"] > 0.0)
    (region,) = find_regions(space, every_row, X, critical).regions
    assert not region.confirmed
    assert (region.fresh.rows, region.fresh.failed, region.fresh.share) == (0, 300, None)


def test_one_seed_gives_one_result(space, world):
    def search(seed):
        simulator = world(space, lambda v: planted(v) & (v["ego_speed"] > 5.5))
        X, critical = simulator.random(1500)
        found = find_regions(space, simulator, X, critical, seed=seed, samples=50)
        facts = [
            (one.box.low.tobytes(), one.box.high.tobytes(), one.fresh, one.space_share)
            for one in found.regions
        ]
        return facts, [rows.tobytes() for rows in simulator.asked]

    assert search(3) == search(3)
    assert search(3)[1] != search(4)[1]


def test_where_everything_is_critical_the_region_is_anywhere(space, world):
    simulator = world(space, lambda v: v["bv_speed"] > 0.0)
    X, critical = simulator.random(200)
    found = find_regions(space, simulator, X, critical)
    (region,) = found.confirmed
    assert rule(region.box, space) == ANYWHERE
    assert np.array_equal(region.box.low, whole(space).low)
    assert (found.space_share, found.critical_held) == (1.0, 200)


def test_a_few_rows_are_no_evidence(space, world):
    simulator = world(space, planted)
    X, critical = simulator.random(30)
    assert 0 < critical.sum() < 15
    found = find_regions(space, simulator, X, critical)
    assert found.regions == ()
    assert simulator.asked == []


def test_what_counts_as_critical_can_be_set(space, world):
    coin = tossed(0, 0.8)
    simulator = world(space, lambda v: planted(v) & coin(v))
    X, critical = simulator.random(2000)
    share = {
        at_least: find_regions(space, simulator, X, critical, at_least=at_least).space_share
        for at_least in (0.6, 0.79)
    }
    assert share[0.6] > 0.1
    assert share[0.79] < share[0.6]


def test_rules_are_short_and_progress_is_told(space, world):
    simulator = world(
        space, lambda v: v["ego_speed"] / 8 + v["bv_speed"] / 3 + v["fog_density"] / 99 > 1.9
    )
    X, critical = simulator.random(3000)
    told = []
    found = find_regions(
        space, simulator, X, critical, samples=60, progress=lambda *now: told.append(now)
    )
    assert len(found.confirmed) > 1
    for one in found.regions:
        assert 1 <= rule(one.box, space).count(" and ") + 1 <= MOST_CONDITIONS
    done = [now for now, _ in told]
    assert done == sorted(done)
    assert told[-1] == (found.simulations, found.simulations)
    # What two regions share is counted once.
    held = np.zeros(len(X), bool)
    for one in found.confirmed:
        held |= in_box(space, X, one.box.low, one.box.high)
    assert found.critical_held == (held & critical).sum()
    assert found.space_share == pytest.approx(held.mean(), abs=0.03)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"samples": 0}, "100000"),
        ({"at_least": 1.0}, "at_least"),
        ({"at_least": float("nan")}, "at_least"),
    ],
)
def test_numbers_out_of_range_are_refused(space, world, change, said):
    X, critical = world(space, planted).random(100)
    with refuses(InputError, said):
        find_regions(space, world(space, planted), X, critical, **change)


def test_without_a_critical_row_there_is_nothing_to_find(space, world):
    X, critical = world(space, planted).random(100)
    with refuses(InputError, "100"):
        find_regions(space, world(space, planted), X, critical & False)
    with refuses(InputError):
        find_regions(space, world(space, planted), X[:0], critical[:0])
