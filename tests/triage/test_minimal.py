import numpy as np
import pytest

from bridgegen.triage.minimal import Minimiser, sentence
from bridgegen.triage.modes import Key
from bridgegen.triage.moves import nearest, ranges, searched
from bridgegen.triage.neighbours import RADIUS
from bridgegen.triage.record import Condition

WAY = Key("contact", "front-to-rear striking", "ego", "rear distance", "truck", "")


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
        f"needs ego_speed >= {speed.limit:.3g} m/s and bv_start <= {start.limit:.3g} m; "
        "all else nominal"
    )


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
    assert found.sentence == "the nominal scenario itself"
    assert (np.array(found.x) == space.row({})).all()


def test_it_stays_in_its_mode(space, world, far):
    """Below 8.4 m/s another rule decides: that is another failure."""

    def label(v):
        return np.where(v["ego_speed"] >= 8.4, "rear distance", "cut in")

    found = minimal(world(space, planted, label=label), far)
    (speed,) = [one for one in found.conditions if one.name == "ego_speed"]
    assert 8.4 <= speed.limit < 8.4 + 0.1
    assert minimal(world(space, planted, label=label), far, WAY._replace(rule="cut in")) is None


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


@pytest.mark.parametrize(("limit", "said"), [(4.19e-9, "0"), (-1e-5, "0"), (0.25, "0.25")])
def test_what_is_next_to_nothing_is_said_as_0(limit, said):
    one = Condition(
        name="delay", unit="s", sign="<=", limit=limit, step=0.1, value=limit, nominal=3.0
    )
    assert sentence([one]) == f"needs delay <= {said} s; all else nominal"
