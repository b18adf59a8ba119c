from dataclasses import replace

import numpy as np
import pytest

from bridgegen.search.triage.conditions import INSIDE, sentence
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
    assert found.sentence == (
        f"fails if ego_speed ≥ {speed.limit:.4g} m/s and bv_start ≤ {start.limit:.4g} m, "
        "other parameters at default"
    )
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
    assert found.sentence == "fails already with all parameters at their defaults"
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
    assert found.sentence.startswith("with bv_speed = 2")
    assert ", for example, fails if ego_speed ≥ " in found.sentence


def test_harm_that_ends_again_has_two_bounds(space, world):
    def band(v, fix):
        return np.where((v["ego_speed"] >= 7.9) & (v["ego_speed"] <= 8.45), 0.7, 0.0)

    found = minimal(world(space, band), space.row({"ego_speed": 8.2}))
    (speed,) = found.conditions
    assert 7.9 <= speed.limit < 7.95
    assert 8.4 < speed.until <= 8.45
    assert speed.confirmed
    assert found.sentence == (
        f"fails if ego_speed from {speed.limit:.4g} to {speed.until:.4g} m/s, "
        "other parameters at default"
    )


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


def test_without_simulations_left_all_are_examples(space, world, far):
    pipeline = world(space, planted)
    few = Minimiser(pipeline, 0, replace(FULL, probes=30))
    (found,) = few.find(far[np.newaxis], [WAY], ["minimal-01"])
    assert found.conditions
    assert not any(one.confirmed for one in found.conditions)
    assert found.sentence.startswith("fails, for example, with ")


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
    X = every.decode(np.random.default_rng(3).random((400, every.n_var)))
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
    assert sentence([one]) == "fails if delay ≤ 1 s, other parameters at default"
    assert sentence([other]) == "fails, for example, with gap = 1 s, other parameters at default"
    assert sentence([one, other]) == (
        "with gap = 1 s, for example, fails if delay ≤ 1 s, other parameters at default"
    )
