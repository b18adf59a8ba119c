from dataclasses import replace

import numpy as np
import pytest
from tests.approval import approve

from bridgegen.scenario.language.reader import load
from bridgegen.search.triage.conditions import INSIDE, Conditions, sentence
from bridgegen.search.triage.effort import FULL
from bridgegen.search.triage.minimal import Minimiser
from bridgegen.search.triage.modes import Key
from bridgegen.search.triage.moves import nearest, ranges, searched
from bridgegen.search.triage.neighbours import RADIUS
from bridgegen.search.triage.record import Condition, Probes

WAY = Key("contact", "front-to-rear striking", "ego", "truck", "")


def planted(v, fix):
    return np.where((v["ego_speed"] >= 7.9) & (v["bv_start"] <= 8.5), 0.7, 0.0)


def minimal(pipeline, x, way=WAY):
    (found,) = Minimiser(pipeline, 0).find(x[np.newaxis], [way], ["minimal-01"])
    return found


@pytest.fixture(scope="module")
def far(space):
    return space.row({"ego_speed": 8.8, "bv_start": 7.2, "bv_speed": 3.0, "bv_trigger_time": 8.0})


def test_only_what_is_needed_differs_from_nominal(space, world, far):
    found = minimal(world(space, planted), far)
    assert [one.name for one in found.conditions] == ["ego_speed", "bv_start"]
    assert [one.sign for one in found.conditions] == [">=", "<="]
    x, nominal = np.array(found.x), space.row({})
    differ = [n for n, a, b in zip(space.names, x, nominal, strict=True) if a != b]
    assert set(differ) & {*space.variables} == {"ego_speed", "bv_start"}
    # To a step of 2.5 % of the range: 0.1 m/s of 4 m/s, 0.45 m of 18 m.
    speed, start = found.conditions
    assert 7.9 <= speed.limit < 7.9 + 0.1
    assert 8.5 - 0.45 < start.limit <= 8.5
    approve(found.sentence, "ego_speed", "bv_start")
    assert found.inside == Probes(rows=INSIDE, harmful=INSIDE)
    assert all(one.outside.rows > 20 and not one.outside.harmful for one in found.conditions)


def test_one_step_further_removes_the_harm_and_the_limit_does_not(space, world, far):
    pipeline = world(space, planted)
    found = minimal(pipeline, far)
    assert found.conditions
    for one in found.conditions:
        k = space.variables.index(one.name)
        way = np.sign(one.nominal - one.value)
        wish = np.tile(searched(space, np.array([found.x])), (2, 1))
        wish[:, k] = one.limit, one.limit + way * one.step
        assert one.step == pytest.approx(RADIUS * ranges(space)[k])
        assert pipeline.try_all(nearest(space, wish)).harmful.tolist() == [True, False]


def test_it_is_robust_where_harm_allows(space, world, far):
    found = minimal(world(space, planted), far)
    assert found.robustness >= 0.5
    assert not found.knife_edge
    assert not space.violations(np.array([found.x]))


def test_a_knife_s_edge_cannot_be_made_robust_and_says_so(space, world):
    def sliver(v, fix):
        return np.where(np.abs(v["ego_speed"] - 8.0) <= 0.01, 0.7, 0.0)

    found = minimal(world(space, sliver), space.row({"ego_speed": 8.0, "bv_speed": 3.0}))
    assert found.knife_edge
    assert [one.name for one in found.conditions] == ["ego_speed"]


def test_harm_everywhere_needs_nothing(space, world, far):
    found = minimal(world(space, lambda v, fix: np.full(len(v["ego_speed"]), 0.7)), far)
    assert found.conditions == ()
    approve(found.sentence)
    assert (np.array(found.x) == space.row({})).all()


def test_it_stays_in_its_mode(space, world, far):
    """Below 8.4 m/s the conflict is another one: that is another failure, yet a failure."""

    def label(v):
        return np.where(v["ego_speed"] >= 8.4, "front-to-rear striking", "crossing")

    pipeline = world(space, planted, label=label)
    found = minimal(pipeline, far)
    assert dict(zip(space.names, found.x, strict=True))["ego_speed"] >= 8.4
    (speed,) = [one for one in found.conditions if one.name == "ego_speed"]
    assert 7.9 <= speed.limit < 7.9 + 0.1  # what is needed to fail, in whatever way
    assert minimal(pipeline, far, WAY._replace(conflict_type="crossing")) is None


def test_what_only_the_mode_needs_is_an_example(space, world, far):
    """With nominal bv_speed the driver fails all the same, in another mode: it is not needed."""

    def label(v):
        return np.where(v["bv_speed"] >= 2.0, "front-to-rear striking", "crossing")

    found = minimal(world(space, planted, label=label), far)
    of = {one.name: one for one in found.conditions}
    assert not of["bv_speed"].confirmed
    assert of["ego_speed"].confirmed
    assert of["bv_start"].confirmed
    approve(found.sentence, "bv_speed", "ego_speed")


def test_harm_that_ends_again_has_two_bounds(space, world):
    def band(v, fix):
        return np.where((v["ego_speed"] >= 7.9) & (v["ego_speed"] <= 8.45), 0.7, 0.0)

    found = minimal(world(space, band), space.row({"ego_speed": 8.2}))
    (speed,) = found.conditions
    assert 7.9 <= speed.limit < 7.95
    assert 8.4 < speed.until <= 8.45
    assert speed.confirmed
    approve(found.sentence, "ego_speed")


def test_a_slanted_region_is_not_said_to_be_a_box(space, world):
    """The sum decides: no box about the scenario is harmful throughout and harmless outside."""

    def slanted(v, fix):
        total = (v["ego_speed"] - 6.9) / 2.0 + (v["bv_speed"] - 1.8) / 1.8
        return np.where(total >= 1.2, 0.7, 0.0)

    pipeline = world(space, slanted)
    found = minimal(pipeline, space.row({"ego_speed": 8.7, "bv_speed": 3.4}))
    confirmed = [one for one in found.conditions if one.confirmed]
    assert {one.name for one in found.conditions} == {"ego_speed", "bv_speed"}
    assert len(confirmed) < 2
    assert "for example" in found.sentence


def stated(space, world, harm, x, needed, noise_key=1):
    """The conditions of a scenario that is taken as minimal, whether it is or not."""
    pipeline, steps = world(space, harm), RADIUS * ranges(space)
    columns = [space.variables.index(name) for name in needed]
    found, inside, _ = Conditions(pipeline, x, x, steps, noise_key, 0, 500).find(columns)
    return {one.name: one for one in found}, inside


def test_an_end_that_a_constraint_sets_is_stated(every, world):
    """Wind of 30 % lets fog be 61.75 %, all of it harmful; of 20 % 84.25 %, most of it harmless."""

    def harm(v, fix):
        dense = (v["fog_density"] >= 50.0) & (v["fog_density"] <= 62.0)
        return np.where(dense & (v["wind_intensity"] >= 20.0), 0.7, 0.0)

    x = every.row({"fog_density": 55.0, "wind_intensity": 30.0})
    found, inside = stated(every, world, harm, x, ["fog_density"])
    fog = found["fog_density"]
    assert fog.confirmed
    assert 50.0 <= fog.limit < 50.5
    assert 61.0 <= fog.until <= 61.75
    assert fog.needs.startswith(f"from {fog.limit:.4g} to {fog.until:.4g} % (fog, ")
    assert inside == Probes(rows=INSIDE, harmful=INSIDE)


def test_probes_inside_meet_all_conditions_when_constraints_are_kept(every, world):
    """Wind of 13 % or more limits fog: what it moves out of the conditions is no probe."""

    def harm(v, fix):
        inside = (v["fog_density"] >= 50.0) & (v["wind_intensity"] >= 20.0)
        return np.where(inside, 0.7, 0.0)

    pipeline = world(every, harm)
    x = every.row({"fog_density": 55.0, "wind_intensity": 21.0})
    columns = [every.variables.index(name) for name in ("fog_density", "wind_intensity")]
    steps = RADIUS * ranges(every)
    found, inside, _ = Conditions(pipeline, x, x, steps, 1, 0, 500).find(columns)
    assert [one.confirmed for one in found] == [True, True]
    assert inside == Probes(rows=INSIDE, harmful=INSIDE)
    assert 55.0 < found[0].until < 100.0  # 82 % with wind of 21 %
    for one in found:
        values = pipeline.asked[-1][0][:, every.index(one.name)]
        assert (values >= one.limit - 1e-6).all()
        assert (values <= one.until + 1e-6).all()


def test_a_harmless_corner_makes_an_example(space, world):
    """A corner of one in sixteen hundred is harmless: no random probe meets it."""

    def cut(v, fix):
        inside = (v["ego_speed"] >= 7.9) & (v["bv_start"] <= 8.5)
        fast = v["ego_speed"] > high[0] - 0.02 * (high[0] - 7.9)
        near = v["bv_start"] < low[1] + 0.02 * (8.5 - low[1])
        return np.where(inside & ~(fast & near), 0.7, 0.0)

    pair = [space.parameters[name] for name in ("ego_speed", "bv_start")]
    low, high = [one.low for one in pair], [one.high for one in pair]
    x = space.row({"ego_speed": 8.0, "bv_start": 8.4})
    found, _ = stated(space, world, cut, x, ["ego_speed", "bv_start"])
    assert sum(one.confirmed for one in found.values()) == 1
    found, _ = stated(space, world, planted, x, ["ego_speed", "bv_start"])
    assert all(one.confirmed for one in found.values())


def test_a_harmless_part_inside_makes_an_example(space, world):
    """A hole of 8 % that no corner meets: some of 40 points do, and one is enough."""

    def holed(v, fix):
        fast = (v["ego_speed"] > 8.3) & (v["ego_speed"] < 8.6)
        hole = fast & (v["bv_start"] > 7.3) & (v["bv_start"] < 7.7)
        return np.where(hole, 0.0, planted(v, fix))

    x = space.row({"ego_speed": 8.0, "bv_start": 8.4})
    for key in range(10):
        found, _ = stated(space, world, holed, x, ["ego_speed", "bv_start"], key)
        assert sum(one.confirmed for one in found.values()) < 2, key


def test_what_constraints_move_from_its_default_is_named(every, world):
    """Rain needs clouds: cloudiness is not at its default of 10 %."""
    pipeline = world(every, lambda v, fix: np.where(v["precipitation"] >= 20.0, 0.7, 0.0))
    found = minimal(pipeline, every.row({"precipitation": 60.0, "cloudiness": 90.0}))
    (rain,) = found.conditions
    value = dict(zip(every.names, found.x, strict=True))["cloudiness"]
    assert value == rain.value >= 20.0
    approve(found.sentence, "sun_altitude_angle")


def test_what_is_further_from_its_default_than_needed_is_an_example(every, world):
    def harm(v, fix):
        return np.where(v["precipitation"] >= 20.0, 0.7, 0.0)

    x = every.row({"precipitation": 25.0, "cloudiness": 60.0})
    found, _ = stated(every, world, harm, x, ["precipitation"])
    assert found["precipitation"].confirmed
    assert found["cloudiness"].needs == "= 60 %"
    assert not found["cloudiness"].confirmed


def test_what_moves_within_the_stated_region_is_named_too(every, world):
    """The sun stands at its default under thin fog, lower where the fog is dense."""
    pipeline = world(every, lambda v, fix: np.where(v["fog_density"] >= 40.0, 0.7, 0.0))
    found = minimal(pipeline, every.row({"fog_density": 60.0}))
    approve(found.sentence, "sun_altitude_angle")


def test_what_a_run_fixes_is_named(world):
    fixed = load("crossroads-s4").space(("participants",), {"bv_speed": 3.0})
    found = minimal(world(fixed, lambda v, fix: np.full(len(v["ego_speed"]), 0.7)), fixed.row({}))
    approve(found.sentence, "bv_speed", "3 m/s")


def test_of_a_driver_that_draws_random_numbers_it_says_so(space, world, far):
    pipeline = world(space, planted)
    pipeline.draws = True
    quiet, found = minimal(world(space, planted), far), minimal(pipeline, far)
    approve(found.sentence, quiet.sentence)


def test_without_simulations_left_all_are_examples(space, world, far):
    pipeline = world(space, planted)
    few = Minimiser(pipeline, 0, replace(FULL, probes=30))
    (found,) = few.find(far[np.newaxis], [WAY], ["minimal-01"])
    assert found.conditions
    assert not any(one.confirmed for one in found.conditions)
    approve(found.sentence, "example")


def test_modes_are_minimised_together_as_alone(space, world, far):
    pipeline = world(space, planted)
    X = np.stack([far, space.row({"ego_speed": 8.2, "bv_start": 7.9, "bv_speed": 0.6})])
    both = Minimiser(pipeline, 0).find(X, [WAY, WAY], ["a", "b"])
    alone = [Minimiser(pipeline, 0).find(X[[k]], [WAY], [n])[0] for k, n in enumerate("ab")]
    assert both == alone


def test_parameters_that_limit_each_other_and_whole_numbers(every, world):
    """Static, environmental and moving parameters at once; whatever comes of it is feasible."""

    def harm(v, fix):
        return np.where((v["fog_density"] >= 40.0) & (v["ego_speed"] >= 5.5), 0.7, 0.0)

    pipeline = world(every, harm)
    X = every.decode(np.random.default_rng(3).random((8000, every.n_var)))
    hits = X[pipeline.try_all(X).harmful][:5]
    assert len(hits) == 5
    for found in Minimiser(pipeline, 0).find(hits, [WAY] * 5, list("abcde")):
        assert not every.violations(np.array([found.x]))
        assert pipeline.try_all(np.array([found.x])).harmful.all()
        assert "fog_density" in [one.name for one in found.conditions]


def test_examples_stand_before_what_is_needed():
    made = {"unit": "s", "sign": "<=", "limit": 1.0, "step": 0.1, "value": 1.0, "nominal": 3.0}
    one = Condition(name="delay", needs="≤ 1 s", outside=Probes(rows=22, harmful=0), **made)
    other = Condition(name="gap", needs="= 1 s", **made)
    approve(sentence([one]), "1 s")
    approve(sentence([other]), "1 s")
    approve(sentence([one, other]), "1 s")
