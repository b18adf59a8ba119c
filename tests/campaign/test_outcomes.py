"""What a rollout brings about goes into the ontology that is handed over, and nowhere else."""

import json

import numpy as np
import pyoxigraph as ox
import pytest

import bridgegen as bg
from bridgegen.assess.cause import CAUSES
from bridgegen.assess.conflict.analysis import CONTACT, NEAR_MISS, analyse
from bridgegen.assess.conflict.outcomes import with_outcomes
from bridgegen.assess.conflict.summary import summarise
from bridgegen.assess.conflict.types import ConflictType, Responsible
from bridgegen.base.errors import InputError
from bridgegen.engine.pipeline import Pipeline
from bridgegen.jobs.search.scenario_files import write_scenario
from bridgegen.openx.convert import convert_file, import_file
from bridgegen.openx.file_scenario import load_file_scenario
from bridgegen.openx.on_map import on_map
from bridgegen.openx.opendrive.from_owl import opendrive_from_owl
from bridgegen.openx.opendrive.road_map import load_map
from bridgegen.openx.opendrive.write import to_xml as road_xml
from bridgegen.openx.openscenario.from_owl import openscenario_from_owl
from bridgegen.openx.openscenario.from_owl.notes import FINDINGS
from bridgegen.openx.openscenario.read import read
from bridgegen.openx.openscenario.write import to_xml
from bridgegen.scenario.language.reader import load
from bridgegen.scenario.language.roads import usual
from bridgegen.scenario.ontology.check import check
from bridgegen.scenario.ontology.files import from_bytes, to_bytes
from bridgegen.scenario.ontology.files import load as load_owl
from bridgegen.scenario.ontology.graph import Individuals
from bridgegen.scenario.ontology.individuals import build_static
from bridgegen.scenario.ontology.questions import ask
from bridgegen.scenario.ontology.reasoner import reason, require
from bridgegen.scenario.ontology.vocabulary import bg as tbox_property
from bridgegen.scenario.ontology.vocabulary import local_name, tbox


def records(individuals):
    answer = ask(individuals, "outcomes")
    return [dict(zip(answer.columns, row, strict=True)) for row in answer.rows]


def test_a_search_hands_over_its_accidents(tmp_path):
    run = bg.run_search("crossroads-s4", budget=200, keep=3, triage="none", out=tmp_path / "run")
    crashes = 0
    for path in run.scenarios:
        individuals = load_owl(path.with_suffix(".owl"))
        result = bg.simulate_file(path)
        told = [one for one in records(individuals) if one["kind"] == "traffic accident"]
        assert len(told) == result.metrics["n_collision"]
        distance = result.rollout.distance[0, 1]
        for one in told:
            crashes += 1
            assert (one["kind"], one["participants"]) == ("traffic accident", "bv, ego")
            step = round(one["time_s"] / result.rollout.time_step)
            assert distance[step] == 0.0 < distance[step - 1]
            for entity in (0, 1):  # the place is in both boxes
                x, y, h = (a[0, entity, step] for a in
                           (result.rollout.x, result.rollout.y, result.rollout.h))  # fmt: skip
                length, width, ahead = result.rollout.box[entity]
                dx, dy = one["x_m"] - x, one["y_m"] - y
                along = np.cos(h) * dx + np.sin(h) * dy - ahead
                aside = np.cos(h) * dy - np.sin(h) * dx
                assert abs(along) <= length / 2 + 1e-6
                assert abs(aside) <= width / 2 + 1e-6
        assert check(individuals, load("crossroads-s4")) == []
        converted, problems = convert_file(path.with_suffix(".owl"), tmp_path / "again")
        assert problems == []
        assert converted[1].read_bytes() == path.read_bytes()
    assert crashes


@pytest.fixture(scope="module")
def jam():
    """A truck that comes to a stand closely behind a jam of two, and stays there."""
    scenario = load("jam-tail-in-fog")
    pipeline = Pipeline(scenario, scenario.space())
    return pipeline


def test_a_declared_jam_is_no_outcome_unless_somebody_joins(jam):
    x = jam.space.row({})
    individuals, roads = jam.runner.concrete(x).individuals, jam.runner.concrete(x).roads
    rollout = jam.rollout(x[np.newaxis])
    names = rollout.names
    members = [k for k, name in enumerate(names) if name.startswith("jam_")]
    others = [k for k in range(len(names)) if k not in members]
    for states in (rollout.x, rollout.y):  # far away from all
        states[0, others] += 1000.0 * (1 + np.arange(len(others)))[:, None]
    assert records(with_outcomes(individuals, rollout, roads)) == []
    tail, truck = names.index("jam_1"), names.index("truck")
    rollout.x[0, truck] = rollout.x[0, tail] - 16.0
    rollout.y[0, truck] = rollout.y[0, tail]
    rollout.h[0, truck] = rollout.h[0, tail]
    rollout.v[0, truck] = 0.0
    together = with_outcomes(individuals, rollout, roads)
    (queue,) = records(together)
    assert queue["kind"] == "traffic jam"
    assert queue["participants"] == "jam_1, jam_2, jam_3, jam_4, jam_5, jam_6, truck"
    assert queue["lane"] == "leg_main_out_2"
    assert queue["time_s"] == 0.0
    a = rollout.x[0, truck, 0] + rollout.box[truck, 2] - rollout.box[truck, 0] / 2
    last = names.index("jam_6")
    b = rollout.x[0, last, 0] + rollout.box[last, 2] + rollout.box[last, 0] / 2
    assert queue["length_m"] == pytest.approx(b - a)
    assert check(together, jam.scenario) == []
    assert check(from_bytes(to_bytes(together)), jam.scenario) == []
    without = to_xml(openscenario_from_owl(individuals, "x.xodr"))
    assert to_xml(openscenario_from_owl(together, "x.xodr")) == without
    assert road_xml(opendrive_from_owl(together)) == road_xml(roads)


def test_a_failed_rollout_brings_about_nothing(jam):
    individuals = jam.runner.concrete(jam.space.row({})).individuals
    rollout = jam.rollout(jam.space.row({})[np.newaxis])
    rollout.status[0] = 1
    assert (
        with_outcomes(individuals, rollout, jam.runner.concrete(jam.space.row({})).roads)
        is individuals
    )


def test_outcomes_use_terms_as_declared(crashed):
    ontology = tbox()
    quads = [q for q in crashed.quads if "#outcome_" in q.subject.value]
    assert quads
    for subject, predicate, value, _ in quads:
        name = local_name(predicate)
        if name != "type":
            assert crashed.is_a(subject, ontology.domains[name]), name
            target = local_name(ontology.ranges[name])
            assert (
                value.datatype == ontology.ranges[name]
                if isinstance(value, ox.Literal)
                else crashed.is_a(value, target)
            )


@pytest.mark.reasoner
def test_outcomes_contradict_nothing(crashed):
    try:
        require()
    except InputError:
        pytest.skip("the extra 'reasoner' is not installed")
    assert reason(crashed).consistent


@pytest.fixture(scope="module")
def crashed():
    """The ego in the middle of a cone, and of the truck."""
    scenario = load("road-works")
    pipeline = Pipeline(scenario, scenario.space())
    x = pipeline.space.row({})
    concrete = pipeline.runner.concrete(x)
    rollout = pipeline.rollout(x[np.newaxis])
    ego, cone, truck = (rollout.names.index(one) for one in ("ego", "works_cone_5", "truck"))
    for states in (rollout.x, rollout.y, rollout.h):
        states[0, ego] = states[0, truck] = states[0, cone]
    return with_outcomes(concrete.individuals, rollout, concrete.roads)


def test_hitting_a_cone_is_an_accident_of_one(crashed):
    told = {one["participants"] for one in records(crashed)}
    assert {"ego", "truck", "ego, truck"} <= told
    assert check(crashed, load("road-works")) == []


def test_the_speed_limit_of_a_map_bounds_speeds(tmp_path):
    """Else a search on a slower map would find scenarios that no file may hold."""
    slow = usual("crossroads", speed_limit=8.0)
    path = tmp_path / "slow.xodr"
    path.write_bytes(road_xml(opendrive_from_owl(build_static({}, slow))))
    scenario = on_map(load("crossroads-s4"), load_map(path))
    space = scenario.space()
    X = space.decode(np.random.default_rng(3).random((500, space.n_var)))
    speeds = X[:, space.index("ego_speed")]
    assert (speeds <= 8.0 * X[:, space.index("speed_factor")] + 1e-9).all()
    assert speeds.max() > 7.0
    run = bg.run_search(
        "crossroads-s4", road_map=path, budget=150, keep=2, triage="none", out=tmp_path / "run"
    )
    assert run.scenarios


def test_the_cause_is_in_every_file_and_comes_back(tmp_path):
    run = bg.run_search(
        "crossroads-s3", budget=60, keep=2, algorithm="random", triage="none", out=tmp_path / "run"
    )
    frame = run.frame()
    assert len(run.scenarios) == 2
    for path in run.scenarios:
        facts = json.loads(path.with_suffix(".json").read_text("utf-8"))
        cause = facts["cause"]  # tested by neighbours, so that it may be another than the quick one
        individuals = load_owl(path.with_suffix(".owl"))
        assert facts["quick_cause"] == frame.loc[facts["row"], "cause"]
        assert cause in {one.label for one in CAUSES}
        assert individuals.text(individuals.one("Scenario"), "has_cause") == cause
        assert read(path).file_header.properties.get("cause") == cause
        assert bg.simulate_file(path).cause == cause
        assert bg.simulate_file(path, ego="fsm").cause is None  # that was another driver's
        (_, xosc), _ = convert_file(path.with_suffix(".owl"), tmp_path / "made")
        assert xosc.read_bytes() == path.read_bytes()
        again, _ = import_file(path, tmp_path / f"{path.stem}.owl")
        scenario = load_owl(again).one("Scenario")
        assert load_owl(again).text(scenario, "has_cause") == cause


def test_a_cause_that_is_none_breaks_a_rule():
    scenario = load("crossroads-s4")
    individuals = (
        Pipeline(scenario, scenario.space()).runner.concrete(scenario.space().row({})).individuals
    )
    node = individuals.one("Scenario")
    quad = ox.Quad(node, tbox_property("has_cause"), ox.Literal("luck"))
    broken = check(Individuals([*individuals.quads, quad]), scenario)
    assert ["luck" in str(one) for one in broken] == [True]
    assert "perception" in str(broken[0])


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """Scenarios in which a pedestrian steps out, and what the analysis says of each."""
    folder = tmp_path_factory.mktemp("harm") / "run"
    run = bg.run_search("pedestrian-behind-parked", budget=60, keep=4, triage="none", out=folder,
                        algorithm="random", ego="route-follower")  # fmt: skip
    assert run.scenarios
    return run.scenarios


def test_accidents_and_near_misses_have_type_responsible_and_severity(found):
    seen = set()
    for path in found:
        conflicts = bg.simulate_file(path).conflicts
        individuals = load_owl(path.with_suffix(".owl"))
        told = [one for one in records(individuals) if one["type"]]
        serious = [e for e in range(len(conflicts.names)) if conflicts.kind[0, e] >= NEAR_MISS]
        assert len(told) == len(serious)
        for e in serious:
            one = next(row for row in told if conflicts.names[e] in row["participants"])
            kind = "traffic accident" if conflicts.kind[0, e] == CONTACT else "near miss"
            assert one["kind"] == kind
            seen.add(kind)
            assert one["type"] == ConflictType(conflicts.type[0, e]).label
            assert one["responsible"] == Responsible(conflicts.responsible[0, e]).label
            if kind == "near miss":
                assert one["ttc_s"] == conflicts.ttc[0, e]
                assert one["severity"] is None
            else:
                assert one["severity"] == conflicts.severity[0, e]
                assert one["delta_v_m_s"] == conflicts.delta_v_ego[0, e]
        who = {"ego": {"ego"}, "other": {"walker", "bv", "child"}, "shared": {"ego"}, "none": set()}
        for row in (dict(zip(a.columns, r, strict=True)) for a in [ask(individuals, "responsible")]
                    for r in a.rows):  # fmt: skip
            names = set((row["responsible"] or "").split(", ")) - {""}
            assert names <= who[row["responsibility"]] or row["responsibility"] != "ego"
            assert bool(names) == (row["responsibility"] != "none")
        assert check(individuals, load("pedestrian-behind-parked")) == []
    assert seen


def test_the_conflict_is_in_every_file_and_comes_back(found, tmp_path):
    for path in found:
        facts = json.loads(path.with_suffix(".json").read_text("utf-8"))
        header = read(path).file_header.properties
        individuals = load_owl(path.with_suffix(".owl"))
        scenario = individuals.one("Scenario")
        conflict = facts["conflict"]
        assert conflict["sentence"]
        assert header.get("conflict_type") == conflict["type"]
        assert header.get("responsible") == conflict["responsible"]
        assert float(header.get("severity")) == conflict["severity"]["value"]
        assert individuals.text(scenario, "has_conflict_type") == conflict["type"]
        assert individuals.number(scenario, "has_severity") == conflict["severity"]["value"]
        (_, xosc), problems = convert_file(path.with_suffix(".owl"), tmp_path / "made")
        assert problems == []
        assert xosc.read_bytes() == path.read_bytes()
        again, _ = import_file(path, tmp_path / f"{path.stem}.owl")
        back = load_owl(again)
        for term in ("has_conflict_type", "has_responsibility"):
            assert back.text(back.one("Scenario"), term) == individuals.text(scenario, term)
        assert back.number(back.one("Scenario"), "has_severity") == conflict["severity"]["value"]


def findings_of(folder, name):
    """Return what a written scenario's storyboard and individuals say of why it is critical."""
    header = read(folder / f"{name}.xosc").file_header.properties
    individuals = load_owl(folder / f"{name}.owl")
    node = individuals.one("Scenario")
    severity = header.get("severity")
    return (
        {key: header.get(key) for key in FINDINGS} | {"severity": severity and float(severity)},
        {key: individuals.optional_text(node, term) for key, term in FINDINGS.items()}
        | {"severity": individuals.optional_number(node, "has_severity")},
    )


def test_findings_of_an_earlier_run_are_replaced_or_left_out(found, tmp_path):
    """A search of an exported file says what that search found, also where it found less."""
    scenario = load_file_scenario(found[0])
    pipeline = Pipeline(scenario, scenario.space())
    x = pipeline.space.row({})
    earlier = read(found[0]).file_header.properties
    assert all(earlier.get(key) is not None for key in (*FINDINGS, "severity"))
    rollout = pipeline.rollout(x[np.newaxis])
    nothing = dict.fromkeys((*FINDINGS, "severity"))
    write_scenario(pipeline, x, tmp_path, "nothing", rollout=rollout)
    assert findings_of(tmp_path, "nothing") == (nothing, nothing)
    other = next(one for one in CAUSES if one.label != earlier.get("cause"))
    write_scenario(pipeline, x, tmp_path, "cause", other, rollout=rollout)
    cause = nothing | {"cause": other.label}
    assert findings_of(tmp_path, "cause") == (cause, cause)
    summary = summarise(analyse(rollout))
    assert summary is not None
    write_scenario(pipeline, x, tmp_path, "conflict", rollout=rollout, conflict=summary)
    conflict = nothing | {
        "conflict_type": summary.type,
        "responsible": summary.responsible,
        "severity": summary.severity,
    }
    assert findings_of(tmp_path, "conflict") == (conflict, conflict)
    for name in ("nothing", "cause", "conflict"):
        assert check(load_owl(tmp_path / f"{name}.owl")) == []


def test_outcomes_of_another_rollout_are_replaced(crashed):
    """Individuals that are read from a file may have them already."""
    scenario = load("road-works")
    pipeline = Pipeline(scenario, scenario.space())
    x = pipeline.space.row({})
    roads, rollout = pipeline.runner.concrete(x).roads, pipeline.rollout(x[np.newaxis])
    plain = with_outcomes(pipeline.runner.concrete(x).individuals, rollout, roads)
    assert records(crashed) != records(plain)
    again = with_outcomes(crashed, rollout, roads)
    assert set(again.quads) == set(plain.quads)
    rollout.status[0] = 1
    failed = with_outcomes(crashed, rollout, roads)
    assert set(failed.quads) == set(pipeline.runner.concrete(x).individuals.quads)


@pytest.mark.parametrize(
    ("name", "value", "word"),
    [
        ("has_conflict_type", ox.Literal("bump"), "bump"),
        ("has_responsibility", ox.Literal("somebody"), "somebody"),
        ("has_severity", ox.Literal(1.5), "probability"),
    ],
)
def test_wrong_findings_break_a_rule(name, value, word):
    scenario = load("crossroads-s4")
    individuals = (
        Pipeline(scenario, scenario.space()).runner.concrete(scenario.space().row({})).individuals
    )
    quad = ox.Quad(individuals.one("Scenario"), tbox_property(name), value)
    broken = check(Individuals([*individuals.quads, quad]), scenario)
    assert [word in str(one) for one in broken] == [True]


def test_only_who_takes_part_can_be_responsible(crashed):
    everybody = set(crashed.links(crashed.one("Scenario"), "has_participant"))
    accident, other = next(
        (node, next(iter(absent)))
        for node in crashed.of_class("TrafficAccident")
        if (absent := everybody - set(crashed.links(node, "has_who")))
    )
    quad = ox.Quad(accident, tbox_property("has_responsible"), other)
    broken = check(Individuals([*crashed.quads, quad]), load("road-works"))
    assert ["one of its participants" in str(one) for one in broken] == [True]
