"""What rows cover of an operational design domain."""

from pathlib import Path

import numpy as np
import pytest

from bridgegen.scenario.language.reader import load
from bridgegen.scenario.odd.bounding import bounded
from bridgegen.scenario.odd.coverage import odd_coverage
from bridgegen.scenario.odd.reader import read_odd

ODD = Path(__file__).with_name("my_odd.yaml")


def _covered(odd, scenario, rows, critical):
    found = odd_coverage(odd)
    bound = bounded(load(scenario), odd)
    space = bound.space()
    X = np.array([space.row(row) for row in rows])
    found.add(bound.odd, dict(zip(space.names, X.T, strict=True)), np.array(critical))
    return found, {each.name: each for each in found.attributes}


def test_bins_values_and_limits_are_those_of_the_odd():
    at = {each.name: each for each in odd_coverage(read_odd(ODD)).attributes}
    assert at["operational_speed"].edges == pytest.approx([0, 18, 36, 54, 72, 90])
    assert at["operational_speed"].limits == (90.0,)
    # rain above 10 mm/h is excluded; 2 mm/h is a limit inside
    assert at["rainfall_rate"].edges[-1] == 10.0
    assert at["rainfall_rate"].limits == (2.0, 10.0)
    assert at["rain_level"].labels == ("none", "light")
    assert at["number_of_lanes"].labels == ("2", "3", "4")
    assert at["visibility"].edges[0] == 200.0
    assert at["drivable_area_type"].labels == ("motorway",)
    assert at["drivable_area_type"].problem == "no scenario states primary_road"
    assert at["connectivity_bandwidth"].problem == "no scenario states it"


def test_rows_are_counted_by_bin_value_and_failure():
    rows = [{"ego_speed": 16.0}, {"ego_speed": 24.0}, {"ego_speed": 24.9, "precipitation": 50.0}]
    found, at = _covered(read_odd(ODD), "cut-in", rows, [False, True, False])
    assert (found.evaluations, found.failures) == (3, 1)
    assert at["operational_speed"].evaluations == [0, 0, 0, 1, 2]
    assert at["operational_speed"].failures == [0, 0, 0, 0, 1]
    assert at["operational_speed"].tested == 1  # 89.64 of 90 km/h: 0.4 % of the range
    assert at["rain_level"].evaluations == [2, 1]
    assert at["rain_level"].failures == [1, 0]
    assert at["agent_type"].untried == ("trucks", "pedestrians")
    assert at["emergency_vehicle"].untried == ("true",)


def test_pairs_are_those_that_the_odd_does_not_exclude(tmp_path):
    (tmp_path / "odd.yaml").write_text(
        "ODD:\n  one:\n    EXCLUDE_AND:\n"
        '      operational_speed: "> 108 km/h"\n      rainfall_rate: "> 20 mm/h"\n'
    )
    odd = read_odd(tmp_path / "odd.yaml")
    found, at = _covered(odd, "cut-in", [{"ego_speed": 16.0}, {"ego_speed": 31.0}], [False] * 2)
    # 216 km/h and 50 mm/h in five bins each: centres above 108 are 2.5 bins (the middle one's is
    # not above), above 20 mm/h three bins.
    assert at["operational_speed"].edges[-1] == 216.0
    assert found.pair_counts == (2, 25 - 2 * 3)


def test_counts_of_several_scenarios_add_up():
    odd = read_odd(ODD)
    found = odd_coverage(odd)
    for name in ("cut-in", "cut-out"):
        bound = bounded(load(name), odd)
        space = bound.space()
        X = space.decode(np.random.default_rng(0).random((50, space.n_var)))
        found.add(bound.odd, dict(zip(space.names, X.T, strict=True)), np.zeros(50, np.bool_))
    at = {each.name: each for each in found.attributes}
    assert found.evaluations == 100
    assert dict(zip(at["agent_type"].labels, at["agent_type"].evaluations, strict=True)) == {
        "cars": 100,
        "trucks": 0,
        "pedestrians": 0,
    }
