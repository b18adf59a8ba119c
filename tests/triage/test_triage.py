from dataclasses import replace

import numpy as np
import pytest
from tests.approval import approve

from bridgegen.scenario.language.reader import load
from bridgegen.search.triage.effort import FULL, NONE, SHORT
from bridgegen.search.triage.influence import ends_in_words, in_words, influences
from bridgegen.search.triage.triage import harmful_rows, triage
from bridgegen.search.triage.words import headline, mode_in_words


def two_ways(v, fix):
    """The faster the worse; slow ones fail late and by a hair, whatever is put right."""
    fast = np.where((v["ego_speed"] >= 7.9) & (fix != 1), 0.6 + 0.04 * v["ego_speed"], 0.0)
    comb = np.abs(np.mod(v["ego_speed"], 0.4) - 0.2) <= 0.02
    return np.where((v["ego_speed"] < 7.0) & comb, 0.99, fast)


def label(v):
    return np.where(v["ego_speed"] >= 7.0, "front-to-rear striking", "side-swipe")


TYPES = ["side-swipe", "front-to-rear striking"]


@pytest.fixture(scope="module")
def made(space, world, fixed):
    pipeline = world(space, two_ways, fixed, label=label)
    rows = pipeline.rows(600)
    return pipeline, rows, triage(pipeline, rows, algorithm="random", seed=0, keep=6)


def test_robust_modes_come_before_those_on_a_knife_s_edge(made):
    """The knife-edge mode has the worse harm, and ranks behind all the same."""
    _, rows, (found) = made
    robust, edge = found.record.modes
    assert robust.conflict_type == "front-to-rear striking"
    assert (robust.cause, robust.tested) == ("planning", True)
    assert robust.robustness >= 0.5
    assert (edge.conflict_type, edge.cause) == ("side-swipe", "sensitive")
    assert edge.knife_edge
    assert edge.harm > robust.harm
    assert found.record.robust == 1
    assert robust.count + edge.count == rows.critical.sum()
    assert "knife-edge" in mode_in_words(edge, found.record)
    words = mode_in_words(robust, found.record)
    approve(words, "32", "un-r157")


def test_each_mode_is_exported_robust_rows_first_then_the_most_harmful(made):
    pipeline, rows, found = made
    modes = {i: one.number for one in found.record.modes for i in one.examples}
    robust, edge = found.record.modes
    assert len(found.exports) == len(set(found.exports)) == 6
    assert found.exports[0] == robust.shown
    assert robust.exports[0] == "0001"
    _, harm = harmful_rows(
        rows.metrics, pipeline.metrics, pipeline.objective.harm, rows.status, rows.findings
    )
    keys = [(found.record.neighbourhood(i).knife_edge, -harm[i]) for i in found.exports]
    assert keys == sorted(keys)
    assert edge.shown in found.exports
    assert {modes.get(i, 1) for i in found.exports} == {1, 2}
    assert rows.critical[list(found.exports)].all()


def test_a_stated_sample_of_the_others_is_tested_too(made):
    _, _, found = made
    sampled = [one.evaluation for one in found.record.neighbourhoods if one.sampled]
    assert len(sampled) == found.record.sampled == FULL.sampled
    assert not {*sampled} & {*found.exports}
    assert all(one.fixes for one in found.record.neighbourhoods)


def test_shares_of_random_rows_are_the_run_s(made):
    _, rows, found = made
    space = found.record.bound.space
    assert (space.drawn, space.rows, space.harmful) == ("random", 600, rows.critical.sum())
    assert sum(one.space.harmful for one in found.record.modes) == space.harmful
    # By hand: 1.0 of 4 m/s is fast, and a tenth of 2.1 m/s is on the comb's teeth.
    assert space.low < 0.25 + 0.0525 < space.high
    approve(headline(found.record), "driver")


def test_an_optimiser_s_rows_tell_no_share_fresh_ones_do(made):
    pipeline, rows, _ = made
    found = triage(pipeline, rows, algorithm="pso", seed=0, keep=6).record
    assert (found.bound.space.drawn, found.bound.space.rows) == ("fresh", FULL.fresh)
    fresh = found.fresh
    assert len(fresh.harm) == len(fresh.mode) == FULL.fresh
    assert sum(one >= 0.3 for one in fresh.harm) == found.bound.space.harmful
    for mode in found.modes:
        assert fresh.mode.count(mode.number) == mode.space.harmful
    assert all(harm >= 0.3 for harm, mode in zip(fresh.harm, fresh.mode, strict=True) if mode)
    assert 0.15 < found.bound.space.share < 0.45
    assert sum(one.space.harmful for one in found.modes) == found.bound.space.harmful


@pytest.mark.parametrize("seed", [0, 1])
def test_it_depends_on_rows_and_seed_alone(made, seed):
    pipeline, rows, found = made
    again = triage(pipeline, rows, algorithm="random", seed=seed, keep=6)
    assert (again.record == found.record) == (seed == 0)
    assert again.record.modes[0].count == found.record.modes[0].count


def test_modes_do_not_depend_on_the_order_of_rows(made):
    pipeline, rows, found = made
    order = np.random.default_rng(5).permutation(len(rows.id))
    mixed = triage(pipeline, rows.take(order), algorithm="random", seed=0, keep=6)
    assert mixed.record == found.record
    assert order[list(mixed.exports)].tolist() == list(found.exports)


def test_a_driver_without_failures_exports_nothing_and_has_a_bound(space, world, fixed):
    pipeline = world(space, lambda v, fix: 0.25 * v["ego_speed"] / 8.9, fixed)
    rows = pipeline.rows(200)
    found = triage(pipeline, rows, algorithm="sobol", seed=0, keep=10)
    assert found.exports == ()
    assert found.record.modes == ()
    assert found.record.neighbourhoods == ()
    assert found.record.bound.space.high == pytest.approx(1.0 - 0.025 ** (1 / 200))
    assert found.record.bound.least[0].evaluation == int(np.argmax(rows.metrics[:, 0]))
    approve(headline(found.record), "200")


def test_implausible_and_failed_rows_are_no_failures(made):
    pipeline, rows, found = made
    findings = replace(rows.findings, implausible=np.full(600, "others collide", object))
    none = triage(pipeline, replace(rows, findings=findings), algorithm="pso", seed=0, keep=5)
    assert none.exports == ()
    assert none.record.bound.implausible == 600
    status = np.where(np.arange(600) == found.exports[0], 20, 0)
    fewer = triage(pipeline, replace(rows, status=status), algorithm="random", seed=0, keep=6)
    assert found.exports[0] not in fewer.exports
    assert fewer.record.bound.failed == 1


def test_in_another_simulator_modes_are_found_and_nothing_is_tested(made, monkeypatch):
    pipeline, rows, _ = made
    monkeypatch.setattr(pipeline, "tries", False, raising=False)
    monkeypatch.setattr(pipeline, "try_all", None)
    found = triage(pipeline, rows, algorithm="pso", seed=0, keep=6)
    assert [one.conflict_type for one in found.record.modes] == TYPES
    assert [one.robustness for one in found.record.modes] == [None, None]
    assert found.record.neighbours == 0
    assert "embedded" in found.record.untested
    assert found.record.bound.space.share is None
    assert len(found.exports) == 6


def test_without_causes_robustness_is_known_all_the_same(made, monkeypatch):
    pipeline, rows, _ = made
    monkeypatch.setattr(pipeline, "seeks_causes", False, raising=False)
    found = triage(pipeline, rows, algorithm="random", seed=0, keep=3).record
    assert not any(one.tested for one in found.modes)
    assert all(one.robustness is not None for one in found.modes)
    assert all(not one.fixes for one in found.neighbourhoods)


def test_many_harmful_rows_are_placed_by_the_nearest(made):
    pipeline, rows, found = made
    effort = replace(FULL, placed=10)
    few = triage(pipeline, rows, algorithm="random", seed=0, keep=6, effort=effort)
    assert [one.place for one in few.record.modes] == [one.place for one in found.record.modes]
    assert [one.count for one in few.record.modes] == [one.count for one in found.record.modes]


def test_one_event_in_several_weathers_is_exported_once(every, world, fixed):
    """Harm and motion follow from one parameter that takes few values: so many events there are."""

    def harm(v, fix):
        return np.where(v["lanes_per_direction"] >= 2.0, 0.7, 0.0)

    pipeline = world(every, harm, fixed, seen=("lanes_per_direction",))
    rows = pipeline.rows(300)
    found = triage(pipeline, rows, algorithm="random", seed=0, keep=10)
    lanes = pipeline.values(rows.X)["lanes_per_direction"]
    kept = lanes[list(found.exports)].tolist()
    assert len(kept) == len(set(kept)) == len(set(lanes[lanes >= 2.0].tolist()))


def test_rules_of_a_mode_are_counted(space, world, fixed):
    def rule(v):
        return np.where(v["bv_speed"] >= 1.0, "rear distance", "cut in")

    pipeline = world(space, lambda v, fix: np.where(v["ego_speed"] >= 7.9, 0.7, 0), rule=rule)
    rows = pipeline.rows(400)
    (mode,) = triage(pipeline, rows, algorithm="random", seed=0, keep=2).record.modes
    bad = rows.findings.rule[rows.critical]
    assert mode.rules == tuple(
        (one, int((bad == one).sum())) for one in ("rear distance", "cut in")
    )
    assert mode.rule == "rear distance"
    assert "; or " in mode.title


def test_a_range_that_begins_at_0_is_not_said_to_end_there():
    """A share of 0 % and a time of 0 s cannot be exceeded: to widen the range is no advice."""
    space = load("crossroads-s4").space()
    X = space.decode(np.random.default_rng(0).random((400, space.n_var)))
    column = space.names.index("precipitation")
    X[:, column] = np.repeat([0.0, 50.0], 200)
    fails = X[:, column] == 0.0
    found = influences(space, X, fails, np.ones(400, dtype=bool))
    (rain,) = [influence for influence in found if influence.name == "precipitation"]
    assert (rain.distance, rain.at_low, rain.failures) == (1.0, 0, 200)


def test_it_says_which_parameters_matter_and_where_failures_end_with_the_range(space, world):
    """Harm from 80 % of ego_speed on: its distance is 1, and 1/8 of the failures are at its end."""
    pipeline = world(space, lambda v, fix: np.where(v["ego_speed"] >= 8.1, 0.7, 0.0))
    rows = pipeline.rows(2000)
    record = triage(pipeline, rows, algorithm="random", seed=0, keep=1, effort=NONE).record
    (first, *others) = record.influences
    assert (first.name, first.distance) == ("ego_speed", 1.0)
    assert others == []
    assert first.failures == record.bound.harmful
    assert first.at_low == 0
    assert first.at_high / first.failures == pytest.approx(0.125, abs=0.04)
    assert in_words(record.influences) == "ego_speed (1.00)"
    assert ends_in_words(record.influences) == []
    many = first.model_copy(update={"at_high": 622, "failures": 717})
    assert ends_in_words([many]) == ["622 of 717 failures lie at the upper end of ego_speed"]


def counted(pipeline, monkeypatch, effort):
    rows = pipeline.rows(600)
    simulated, try_all = [], pipeline.try_all
    monkeypatch.setattr(
        pipeline,
        "try_all",
        lambda X, *rest, **named: [simulated.append(len(X)), try_all(X, *rest, **named)][1],
    )
    record = triage(pipeline, rows, algorithm="pso", seed=0, keep=2, effort=effort).record
    monkeypatch.undo()
    return record, sum(simulated)


def test_a_short_triage_finds_the_same_modes_by_fewer_simulations(made, monkeypatch):
    full, of_full = counted(made[0], monkeypatch, FULL)
    short, of_short = counted(made[0], monkeypatch, SHORT)
    assert of_short < 0.5 * of_full
    assert {one.conflict_type for one in short.modes} == {one.conflict_type for one in full.modes}
    assert all(one.robustness is not None and one.minimal for one in short.modes)
    assert (short.sampled, short.fresh, short.untested) == (0, None, "")


def test_no_triage_finds_modes_and_simulates_nothing(made, monkeypatch):
    none, simulated = counted(made[0], monkeypatch, NONE)
    assert simulated == 0
    assert [one.conflict_type for one in none.modes] == TYPES
    assert all(one.robustness is None and one.minimal is None for one in none.modes)
    approve(none.untested, "--triage")


def test_no_room_to_export_still_shows_the_modes(made):
    pipeline, rows, found = made
    none = triage(pipeline, rows, algorithm="random", seed=0, keep=0)
    assert none.exports == ()
    assert [one.title for one in none.record.modes] == [one.title for one in found.record.modes]
    assert all(one.tested for one in none.record.modes)
