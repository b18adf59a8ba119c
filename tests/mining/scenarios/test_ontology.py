"""Statistics of mined scenarios, as the ontology has them and as the events are."""

import numpy as np
import pytest
import rdflib
from tests.mining.scenarios.planted import approaches, met, sought
from tests.mining.scenarios.test_mined import SLOWER

from bridgegen.recordings.scenarios import mined
from bridgegen.recordings.scenarios.files import mined_individuals
from bridgegen.recordings.scenarios.mined import mined_scenario
from bridgegen.scenario.ontology.check import check
from bridgegen.scenario.ontology.files import load, save
from bridgegen.scenario.ontology.vocabulary import BG


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(mined, "REPLICATES", 20)
        one, found = sought(SLOWER), approaches(60)
        events, table = met(one, found, tmp_path_factory.mktemp("events"))
        return mined_scenario(one, events, [found], table, 0.05), events


def statistics(path):
    """Name, unit and estimate of each statistic, by a parser of another project."""
    graph = rdflib.Graph().parse(data=path.read_bytes(), format="xml")
    (scenario,) = graph.subjects(rdflib.RDF.type, rdflib.URIRef(BG + "MinedScenario"))
    found = {}
    for node in graph.objects(scenario, rdflib.URIRef(BG + "has_statistic")):
        name, unit, value = (
            next(graph.objects(node, rdflib.URIRef(BG + term))).toPython()
            for term in ("has_name", "has_measured_unit", "has_estimate")
        )
        found[name] = (unit, value)
    return found


def test_the_file_has_the_statistics_of_the_events(tmp_path, made):
    one, events = made
    path = tmp_path / "mined.owl"
    save(mined_individuals([one]), path)
    found = statistics(path)
    gap = events.rows["gap"]
    assert found["gap, mean"] == ("m", pytest.approx(gap.mean(), rel=1e-9))
    assert found["gap, 95% quantile"] == ("m", pytest.approx(np.quantile(gap, 0.95), rel=1e-9))
    assert found["gap, low"][1] <= gap.min()
    assert found["encounters"] == ("count", 60.0)
    assert found["encounters per h"] == ("1/h", pytest.approx(60.0 / found["hours"][1]))
    low, high = (found[f"encounters per h, {end} %"][1] for end in ("2.5", "97.5"))
    assert low < found["encounters per h"][1] < high


def test_the_command_validates_it(cli, tmp_path, made):
    path = tmp_path / "mined.owl"
    save(mined_individuals([made[0]]), path)
    code, text, _ = cli("validate", path)
    assert (code, "valid" in text) == (0, True)
    text = path.read_text(encoding="utf-8")
    begin = text.index("<bg:has_measured_unit", text.index("mined#slower-lead-mined"))
    end = text.index("</bg:has_measured_unit>", begin) + len("</bg:has_measured_unit>")
    path.write_text(text[:begin] + text[end:], encoding="utf-8")
    code, _, err = cli("validate", path)
    assert code == 2
    assert "has_measured_unit" in err


def test_it_keeps_the_rules_of_the_ontology_and_breaking_one_shows(tmp_path, made):
    one, _ = made
    path = tmp_path / "mined.owl"
    save(mined_individuals([one]), path, include_tbox=False)
    assert check(load(path)) == []
    text = path.read_text(encoding="utf-8")
    begin = text.index("<bg:has_estimate")
    end = text.index("</bg:has_estimate>") + len("</bg:has_estimate>")
    path.write_text(text[:begin] + text[end:], encoding="utf-8")
    assert any("has_estimate" in str(each) for each in check(load(path)))
