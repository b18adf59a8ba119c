"""Texts, and numbers in places that are constants: each value is a storyboard of its own."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from tests.approval import approve, refuses

import bridgegen as bg
from bridgegen.base.errors import FileFormatError
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.jobs.search import SearchCallbacks
from bridgegen.openx.file_scenario import load_file_scenario
from bridgegen.pages.playbacks import nominal_playback
from bridgegen.results.store import Store

from .braking import deterministic, limits, scenario_text, stochastic, value_sets, write_pair

_BODY = """<Vehicle name="{name}" vehicleCategory="{kind}">
<BoundingBox><Center x="{ahead}" y="0" z="0.75"/>
<Dimensions width="2.0" length="{length}" height="1.5"/></BoundingBox>
<Performance maxSpeed="60" maxAcceleration="5" maxDeceleration="9"/>
<Axles><FrontAxle maxSteering="0.6" wheelDiameter="0.6" trackWidth="1.6" positionX="2.8"
positionZ="0.3"/><RearAxle maxSteering="0" wheelDiameter="0.6" trackWidth="1.6" positionX="0"
positionZ="0.3"/></Axles><Properties/></Vehicle>"""

_CATALOGUE = """<?xml version="1.0"?><OpenSCENARIO><FileHeader revMajor="1" revMinor="2"
date="2025-01-01T00:00:00" description="bodies" author="test"/><Catalog name="Bodies">{}{}</Catalog>
</OpenSCENARIO>"""

LENGTHS = {"small": 4.0, "long": 12.0}


def text() -> str:
    """Return the braking scenario with a lead vehicle from a catalogue, by a parameter."""
    whole = scenario_text().replace(
        "<CatalogLocations/>",
        '<CatalogLocations><VehicleCatalog><Directory path="bodies"/></VehicleCatalog>'
        "</CatalogLocations>",
    )
    whole = whole.replace(
        "</ParameterDeclarations>",
        '<ParameterDeclaration name="Model" parameterType="string" value="small"/>'
        "</ParameterDeclarations>",
    )
    lead = re.search(r'<ScenarioObject name="Lead">(.*?)</ScenarioObject>', whole, re.DOTALL)
    reference = '<CatalogReference catalogName="Bodies" entryName="$Model"/>'
    return whole.replace(lead[0], lead[0].replace(lead[1], reference))


def write(folder: Path, body: str) -> tuple[Path, Path]:
    made = (_BODY.format(name=n, kind=k, length=LENGTHS[n], ahead=0.35 * LENGTHS[n])
            for n, k in (("small", "car"), ("long", "truck")))  # fmt: skip
    (folder / "bodies").mkdir(parents=True, exist_ok=True)
    (folder / "bodies" / "bodies.xosc").write_text(_CATALOGUE.format(*made), "utf-8")
    return write_pair(folder, body, text=text())


def pipeline_of(folder: Path, body: str, **options) -> Pipeline:
    scenario = load_file_scenario(*write(folder, body))
    made = Pipeline(scenario, scenario.space(), PipelineOptions(**options))
    made.choose_objective()
    return made


def models(*names: str) -> tuple[str, str]:
    elements = "".join(f'<Element value="{name}"/>' for name in names)
    return "Model", f"<DistributionSet>{elements}</DistributionSet>"


GAPS = ("Gap", f'<DistributionRange stepWidth="0.25">{limits(5, 40)}</DistributionRange>')
STOPS = ("StopAfter", f'<DistributionRange stepWidth="1">{limits(7, 12)}</DistributionRange>')


@pytest.fixture(scope="module")
def both(tmp_path_factory) -> Pipeline:
    body = deterministic(models("small", "long"), STOPS, GAPS)
    return pipeline_of(tmp_path_factory.mktemp("both"), body)


def sample(pipeline: Pipeline, n: int) -> np.ndarray:
    U = np.random.default_rng(3).random((n, pipeline.space.n_var))
    return pipeline.space.decode(U)


def test_each_row_is_what_its_own_storyboard_gives(both, tmp_path):
    X = sample(both, 40)
    assert both.space.variables == ("Gap", "StopAfter", "Model")
    found = both.evaluate(X)
    assert (found.status == 0).all()
    names = both.scenario.texts["Model"]
    for i in range(0, 40, 5):
        values = both.space.values(X[i])
        model, stop = names[int(values["Model"])], values["StopAfter"]
        folder = tmp_path / f"{i}"
        alone = pipeline_of(
            folder,
            deterministic(
                models(model), GAPS,
                ("StopAfter", f'<DistributionSet><Element value="{stop:.0f}"/></DistributionSet>'),
            ),
        )  # fmt: skip
        row = alone.space.row({"Gap": values["Gap"]})[np.newaxis]
        assert not next(iter(alone.runner.by_variant(row)))[1].source.variants
        assert found.metrics[i].tobytes() == alone.evaluate(row).metrics[0].tobytes()


def test_a_longer_lead_is_hit_earlier(both):
    """Hand-worked: both leads brake alike, and the tail of one is 1.2 m further back.

    The reference point is 0.35 of the length behind the middle: 4 m: tail 2 − 1.4 = 0.6 m behind
    it, 12 m: 6 − 4.2 = 1.8 m.
    """
    X = np.array([both.space.row({"Gap": 20.0, "Model": float(k)}) for k in (0, 1)])
    parts = {
        both.scenario.texts["Model"][int(X[at[0], both.space.index("Model")])]: one.run(X[at])
        for at, one in both.runner.by_variant(X)
    }
    small, long = parts["small"], parts["long"]
    assert small.distance[0, 1, 0] - long.distance[0, 1, 0] == pytest.approx(1.2, abs=1e-9)
    assert both.runner.kinds == {"Ego": "car", "Lead": "car or truck"}
    with refuses(ValueError):
        both.rollout(X)


def test_a_search_plays_and_exports_each_with_its_own_body(tmp_path):
    scenario, ranges = write(tmp_path, deterministic(models("small", "long"), GAPS))
    run = bg.run_search(
        scenario, distribution=ranges, algorithm="random", budget=60, keep=8, triage="short",
        out=tmp_path / "run",
        ego="route-follower",
    )  # fmt: skip
    seen = set()
    for path in run.scenarios:
        facts = json.loads(path.with_suffix(".json").read_text("utf-8"))
        model = facts["parameters"]["Model"]["value"]
        seen.add(model)
        said = re.search(r'name="Lead".*?length="([0-9.]+)"', path.read_text("utf-8"), re.DOTALL)
        assert float(said[1]) == LENGTHS[model]
        again = bg.simulate_file(path).metrics
        with Store.open(run.folder) as store:
            found = store.read().metrics[facts["row"]].tolist()
            kept = dict(zip(store.metrics, found, strict=True))
        assert {name: again[name] for name in kept} == kept
    assert seen == set(LENGTHS)


def test_workers_and_batches_change_nothing(both):
    X = sample(both, 30)
    whole = both.evaluate(X)
    for i in range(0, 30, 7):
        assert both.evaluate(X[i : i + 1]).metrics[0].tobytes() == whole.metrics[i].tobytes()
    order = np.random.default_rng(0).permutation(30)
    assert both.evaluate(X[order]).metrics.tobytes() == whole.metrics[order].tobytes()


def test_values_that_make_no_scenario_cost_their_rows_alone(tmp_path):
    made = pipeline_of(tmp_path, deterministic(
        ("StopAfter", '<DistributionSet><Element value="90000000"/><Element value="9"/>'
         "</DistributionSet>"), GAPS,
    ))  # fmt: skip
    X = np.array([made.space.row({"Gap": 20.0, "StopAfter": stop}) for stop in (9.0, 9e7)])
    found = made.evaluate(X)
    assert found.status.tolist() == [0, 9]
    assert "90000000" in found.messages[1] or "9e+07" in found.messages[1], found.messages
    trials = made.try_all(X)
    assert trials.ok.tolist() == [True, False]


def test_texts_of_value_sets_come_together(tmp_path):
    made = pipeline_of(tmp_path, value_sets(
        {"Model": "small", "Gap": 10}, {"Model": "long", "Gap": 20}, {"Model": "long", "Gap": 30},
    ))  # fmt: skip
    assert made.scenario.variant_names == ("Model",)
    assert len(made.scenario.variants) == 2
    X = sample(made, 12)
    lengths = {(20.0, 12.0), (10.0, 4.0), (30.0, 12.0)}
    found = set()
    for x in X:
        body = made.runner.concrete(x).storyboard.entities.scenario_objects[0].entity_object
        found.add((made.space.values(x)["Gap"], body.bounding_box.dimensions.length))
    assert found == lengths


def test_a_text_that_makes_no_scenario_is_refused_with_its_value(tmp_path):
    with refuses(FileFormatError, "huge"):
        pipeline_of(tmp_path, deterministic(models("small", "huge")))


def test_too_many_combinations_are_refused(tmp_path):
    many = value_sets(*({"Model": f"m{k}"} for k in range(300)))
    with refuses(FileFormatError, "200", "300"):
        pipeline_of(tmp_path, many)


def test_an_end_that_the_constraint_excludes_is_left_out_with_a_note(tmp_path):
    whole = text().replace(
        'name="Gap" parameterType="double" value="30"/>',
        'name="Gap" parameterType="double" value="30"><ConstraintGroup>'
        '<ValueConstraint rule="greaterThan" value="5"/></ConstraintGroup></ParameterDeclaration>',
    )
    write(tmp_path, deterministic(GAPS))
    scenario, ranges = write_pair(tmp_path, deterministic(GAPS), text=whole)
    found = load_file_scenario(scenario, ranges)
    assert found.parameters["Gap"].low == 5.25
    approve(found.notes[0], "greaterThan")
    body = stochastic(("Gap", f"<UniformDistribution>{limits(5, 40)}</UniformDistribution>"))
    scenario, ranges = write_pair(tmp_path, body, text=whole)
    assert 5.0 < load_file_scenario(scenario, ranges).parameters["Gap"].low < 5.0 + 1e-12
    said: list[str] = []
    scenario, ranges = write_pair(tmp_path, deterministic(GAPS), text=whole)
    bg.run_search(
        scenario, distribution=ranges, algorithm="random", budget=12, keep=0,
        triage="short", out=tmp_path / "run", callbacks=SearchCallbacks(warning=said.append),
    )  # fmt: skip
    assert any("without that end" in one for one in said)


LIMIT = (
    '<ConstraintGroup><ValueConstraint rule="lessOrEqual" value="${$EgoSpeed - 8}"/>'
    "</ConstraintGroup></ParameterDeclaration>"
)


@pytest.mark.parametrize(
    ("speed", "braking"),
    [
        ('<DistributionSet><Element value="10"/><Element value="16"/></DistributionSet>',
         '<DistributionSet><Element value="1"/><Element value="7"/></DistributionSet>'),
        (f'<DistributionRange stepWidth="2">{limits(6, 20)}</DistributionRange>',
         f'<DistributionRange stepWidth="1">{limits(1, 8)}</DistributionRange>'),
    ],
)  # fmt: skip
def test_a_constraint_that_a_row_breaks_costs_that_row(tmp_path, speed, braking):
    """Deceleration <= EgoSpeed - 8: what is drawn from sets does not heed it."""
    whole = text().replace(
        'name="Deceleration" parameterType="double" value="6"/>',
        f'name="Deceleration" parameterType="double" value="6">{LIMIT}',
    )
    write(tmp_path, deterministic(GAPS))
    body = deterministic(("EgoSpeed", speed), ("Deceleration", braking))
    scenario = load_file_scenario(*write_pair(tmp_path, body, text=whole))
    assert any("Deceleration <= " in one for one in scenario.notes), scenario.notes
    made = Pipeline(scenario, scenario.space())
    made.choose_objective()
    X = sample(made, 60)
    found = made.evaluate(X)
    ego, brakes = (X[:, made.space.index(name)] for name in ("EgoSpeed", "Deceleration"))
    wrong = brakes > ego - 8.0
    assert 5 < wrong.sum() < 55
    assert found.status.tolist() == np.where(wrong, 9, 0).tolist()
    assert all("must hold" in found.messages[i] for i in np.flatnonzero(wrong).tolist())
    assert (made.try_all(X).ok == ~wrong).all()


def test_a_playback_shows_the_row_s_own_body(both):
    shown = nominal_playback(both, "nominal")
    (lead,) = (one for one in shown.entities if one.name == "Lead")
    assert (lead.length, lead.type) == (4.0, "car")
