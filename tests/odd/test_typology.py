"""Typologies of crashes: their figures, and whether scenarios do what they are said to."""

import numpy as np
import pytest

from bridgegen.assess.conflict.types import ConflictType
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.scenario.language.reader import load, names
from bridgegen.scenario.typology import CrashType, most_harmful, shares, total_of, typologies

ALL = [(typology.name, kind) for typology in typologies().values() for kind in typology.types]
CLAIMED = sorted({name for _, kind in ALL for name in kind.scenarios})


def test_the_numbers_of_types_are_the_published_ones():
    found = {name: len(typology.types) for name, typology in typologies().items()}
    assert (found["nhtsa-37"], found["iso-34502"]) == (37, 24)
    for typology in typologies().values():
        assert len({kind.id for kind in typology.types}) == len(typology.types)
        assert len({kind.name for kind in typology.types}) == len(typology.types)
        # A figure without a source, or without how it is known, is none.
        assert typology.source
        assert typology.known


@pytest.mark.parametrize("quantity", ["percent", "harm"])
def test_shares_are_no_more_than_the_whole(quantity):
    for typology in typologies().values():
        some = [getattr(kind, quantity) for kind in typology.types]
        # Published shares are rounded to 0.01 or 0.1 %.
        assert sum(value or 0.0 for value in some) <= 100.0 + 0.005 * len(some)
        assert all(value is None or 0.0 < value < 100.0 for value in some)


def test_nhtsa_s_types_are_all_crashes():
    assert total_of(typologies()["nhtsa-37"].types) == pytest.approx(100.0, abs=0.05)


def test_every_scenario_that_is_named_ships_and_every_conflict_exists():
    labels = {kind.label for kind in ConflictType if kind}
    for _, kind in ALL:
        assert set(kind.scenarios) <= set(names())
        assert set(kind.conflicts) <= labels
        # Without conflicts no failure would count, with them but no scenario neither.
        assert bool(kind.scenarios) == bool(kind.conflicts)
        assert all(kind.scenarios.values())


@pytest.mark.thorough
@pytest.mark.parametrize("name", CLAIMED)
def test_a_scenario_has_conflicts_of_the_types_that_claim_it(name):
    """A driver that ignores traffic crashes in random rows in the way that each type is about."""
    scenario = load(name)
    # Who perceives nothing meets no ghosts; and who brakes for one violates a rule before a crash.
    ego, kinds = "route-follower", ["contact", "near miss"]
    if scenario.story.ghosts:
        ego, kinds = "reference", [*kinds, "violation"]
    pipeline = Pipeline(scenario, scenario.space(), PipelineOptions(ego=ego))
    pipeline.choose_objective()
    X = pipeline.space.decode(np.random.default_rng(0).random((300, pipeline.space.n_var)))
    found = pipeline.evaluate(X).findings
    occurs = set(found.conflict_type[np.isin(found.conflict, kinds)])
    for typology, kind in ALL:
        if name in kind.scenarios:
            assert occurs & set(kind.conflicts), (typology, kind.name)


def test_what_is_not_known_is_no_share():
    known, other = CrashType("1", "a", percent=2.0), CrashType("2", "b")
    assert total_of([known, other]) is None
    assert shares([known, other]) == ""
    assert shares([known]) == ", with 2 % of the crashes"
    assert shares([CrashType("3", "c", 2.0, 30.0)]).endswith(
        "2 % of the crashes and 30 % of the harm"
    )


def test_harm_comes_before_frequency():
    some = [CrashType("1", "a", 9.0), CrashType("2", "b", 1.0, 5.0), CrashType("3", "c", 2.0)]
    assert [kind.id for kind in most_harmful(some)] == ["2", "1", "3"]
