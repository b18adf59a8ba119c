"""The current operational domain of a row, and that it lies in the ODD by another reader."""

from pathlib import Path

import numpy as np
import pytest
import yaml

from bridgegen.scenario.language.reader import load
from bridgegen.scenario.odd.bounding import bounded
from bridgegen.scenario.odd.domain import cod
from bridgegen.scenario.odd.reader import read_odd

ODD = Path(__file__).with_name("my_odd.yaml")
BOUND = bounded(load("cut-in"), read_odd(ODD))


def _rows(scenario, count):
    space = scenario.space()
    # corners, too: values on the ODD's limits must be inside after they were written
    U = np.concatenate([np.ones((1, space.n_var)), np.zeros((1, space.n_var))])
    U = np.concatenate([U, np.random.default_rng(0).random((count, space.n_var))])
    return [space.values(x) for x in space.decode(U)]


def _values(text):
    return {key.partition(";")[0]: value for key, value in yaml.safe_load(text)["COD"][0].items()}


def test_a_row_is_stated_by_the_laws_of_the_weather_and_the_names_of_the_odd():
    row = _rows(BOUND, 0)[0] | {"precipitation": 50.0, "fog_density": 30.0}
    values = _values(cod(BOUND.odd, row, "0001.xosc"))
    assert values["rainfall_rate"] == pytest.approx(0.1 * 500**0.5)
    assert values["visibility"] == pytest.approx(10_000 / 200**0.3)
    assert values["operational_speed"] == pytest.approx(3.6 * row["ego_speed"])
    assert values["rain_level"] == "light"  # as the ODD's taxonomy defines it
    assert values["agent_type"] == "cars"
    assert values["drivable_area_type"] == "motorway"
    assert (values["t_junction"], values["number_of_lanes"]) == (False, 2)


def test_a_row_outside_says_so():
    row = _rows(BOUND, 0)[0] | {"precipitation": 100.0}
    assert "# outside the ODD" in cod(BOUND.odd, row, "0001.xosc")


def test_openodd_py_reads_it_and_finds_each_row_inside(tmp_path):
    openodd = pytest.importorskip("openodd")
    units = {
        "number_of_lanes": "count",
        "lane_width": "m",
        "rainfall_rate": "mm/h",
        "wind_speed": "m/s",
        "visibility": "m",
        "operational_speed": "km/h",
    }
    backend = openodd.Backend(probes={k: (lambda _: None, unit) for k, unit in units.items()})
    # openodd-py takes no unquoted expression, and no second group, which the standard's examples
    # have.
    second = "      OR:\n        agent_type: [cars, trucks]\n        emergency_vehicle: true\n"
    text = ODD.read_text(encoding="utf-8").replace("> 10 m/s", '"> 10 m/s"')
    text = text.replace(second, "      agent_type: [cars, trucks]\n")
    (tmp_path / "odd.yaml").write_text(
        text.replace("is_signed_off: unknown", "rain_level: unknown")
    )
    (tmp_path / "taxonomy.yaml").write_bytes((ODD.parent / "taxonomy.yaml").read_bytes())
    peer = openodd.load_openodd(
        tmp_path / "odd.yaml", bindings={name: {"probe": name} for name in units}, backend=backend
    )
    for row in _rows(BOUND, 30):
        found = cod(BOUND.odd, row, "0001.xosc")
        assert "# inside the ODD" in found
        values = _values(found)
        sample = {each.name: values.get(each.name.rpartition(".")[2]) for each in peer.attributes}
        verdict = peer.evaluate(peer.complete(sample))
        assert verdict.inside, (verdict, values)
    (tmp_path / "cod.yaml").write_text(found, encoding="utf-8")
    names = {each.name for each in openodd.load_openodd(tmp_path / "cod.yaml").attributes}
    assert names == set(values) - {"TEMPORAL_EXTENT", "SPATIAL_EXTENT"}
