"""Packs that are tables of clauses: rows and their scenarios, what rows change, bad tables."""

import numpy as np
import pytest
from tests.approval import refuses

from bridgegen.base.errors import ScenarioError, UnknownNameError
from bridgegen.engine.pipeline import Pipeline
from bridgegen.openx.convert import scenario_of
from bridgegen.scenario.language.plain_yaml import read_plain_yaml
from bridgegen.scenario.language.reader import entry_names, load, names, pack_names, pack_tables
from bridgegen.scenario.language.tables import read_table
from bridgegen.scenario.typology import typologies

HEAD = "pack: mine\nsource: a standard\nknown: read in full\nprefix: MINE\n"
KNOWN = {*names(), *pack_names()}


def table(text: str, head: str = HEAD):
    return read_table(read_plain_yaml((head + text).encode(), "mine.yaml"), KNOWN.__contains__)


def columns(scenario, rows: int = 64):
    space = scenario.space()
    X = space.decode(np.random.default_rng(0).random((rows, space.n_var)))
    return {name: X[:, space.index(name)] for name in space.names}


@pytest.mark.parametrize("pack", list(pack_tables()))
def test_each_clause_has_text_source_and_a_scenario_or_the_reason_why_none(pack):
    made = pack_tables()[pack]
    assert len(made.file.source) > 20
    assert len(made.file.known) > 20
    without = {id for id, text, why in made.unanswered if text and why}
    stated = {}
    for entry in made.entries:
        scenario = load(f"{pack}/{entry}")
        assert scenario.name == f"{pack}-{entry}"
        assert all(clause.collisions for clause in scenario.clauses)
        stated |= {clause.id: clause.text for clause in scenario.clauses}
    assert not stated.keys() & without
    assert stated.keys() | without == {f"{made.file.prefix}-{row}" for row in made.rows}
    assert all(stated.values())


def test_the_disturbances_are_those_of_the_typology_as_it_is_now():
    kinds, made = typologies()["iso-34502"], pack_tables()["iso34502"]
    answered = {clause.id for entry in made.entries for clause in load(f"iso34502/{entry}").clauses}
    assert answered == {f"ISO34502-{kind.id}" for kind in kinds.covered}
    assert {id for id, *_ in made.unanswered} == {f"ISO34502-{kind.id}" for kind in kinds.uncovered}


def test_rows_without_changes_share_their_scenario_as_it_is():
    scenario, plain = load("un-ads/cut-in"), load("cut-in")
    assert len(scenario.clauses) == 3
    assert scenario.parameters == plain.parameters
    assert scenario.fingerprint != plain.fingerprint  # a suite runs it again


def test_a_row_holds_parameters_and_defaults_follow():
    rain = load("un-ads/lead-brakes-E-rain")
    found = columns(rain)
    # "from moderate on" of the row; clouds come with rain by the weather's own constraints.
    assert 40 <= found["precipitation"].min() <= found["precipitation"].max() <= 90
    assert (found["cloudiness"] >= found["precipitation"] - 0.02).all()
    assert rain.parameters["cloudiness"].default >= 40
    made = table(
        "rows:\n  truck:\n    text: A truck stands\n    scenarios: [r157/stationary-vehicle]\n"
        "    given: {stationary_type: truck, ego_speed: 90 km/h}\n"
    )
    held = made.applied("stationary-vehicle-truck", load("r157/stationary-vehicle"))
    assert set(columns(held)["stationary_type"]) == {2.0}  # car, motorcycle, truck
    assert set(columns(held)["ego_speed"]) == {25.0}


@pytest.mark.parametrize(
    ("entry", "plain", "name", "by"),
    [
        # Euro NCAP's calculator: "+5 km/h", "-5 km/h"; "+3 km/h", "-2 km/h"; "-2 m/s²", "+2 m/s²".
        ("ccfhos-speed-vehicles", "ccfhos", "target_speed", (-5 / 3.6, 5 / 3.6)),
        ("ccftap-speed-vehicles", "ccftap", "target_speed", (-5 / 3.6, 5 / 3.6)),
        ("cpna-speed-pedestrians", "cpna", "target_speed", (-2 / 3.6, 3 / 3.6)),
        ("ccrb-acceleration", "ccrb", "deceleration", (-2.0, 2.0)),
        ("ccrb-position-headway", "ccrb", "time_gap", (-0.5, 0.5)),
    ],
)
def test_a_row_moves_the_standard_cells(entry, plain, name, by):
    before, after = load(f"ncap-aeb/{plain}"), load(f"ncap-robustness/{entry}")
    cells = [grid for grid in before.matrix if grid.label.startswith("2026 standard")]
    default = before.parameters[name].default
    expected = [
        value + step
        for step in by
        for grid in cells
        for value in grid.columns().get(name, np.full(len(grid), default))
    ]
    found = np.concatenate([grid.columns()[name] for grid in after.matrix])
    np.testing.assert_allclose(found, expected, rtol=1e-12)
    assert after.parameters[name].low <= found.min() <= found.max() <= after.parameters[name].high
    assert {grid.score for grid in after.matrix} == {""}


def test_what_is_held_is_held_in_all_cells():
    row = "a: {text: Stops, scenarios: [ncap-aeb/ccfhos], given: {location: 50}}"
    made = table(f"matrix: 2026 standard\nrows:\n  {row}\n")
    (grid,) = made.applied("ccfhos-a", load("ncap-aeb/ccfhos")).matrix
    assert set(grid.columns()["location"]) == {50.0}
    assert len(grid) == 6  # of 18, which differ in the location by threes


def test_night_is_dark_in_all_cells():
    for grid in load("ncap-robustness/ccrs-night").matrix:
        assert set(grid.columns()["sun_altitude_angle"]) == {-30.0}


def test_what_violates_a_clause_is_what_its_scenario_asks():
    """The models of UN R157 decide where they do; a stop for what stands is no standstill."""
    kinds = {
        name: load(f"r171/{name}").clauses[0].collisions for name in pack_tables()["r171"].entries
    }
    assert kinds["cut-in"] == "preventable"
    assert kinds["stationary-vehicle-4-2-5-2-1"] == kinds["crossing-pedestrian"] == "any"
    assert kinds["following"] == kinds["road-works"] == "critical"
    for name, expected in (("r171/crossing-pedestrian", True), ("un-ads/cut-in", False)):
        scenario = load(name)
        assert Pipeline(scenario, scenario.space()).is_protocol is expected


def test_requirements_of_another_regulation_are_left_out():
    assert load("r157/following").criteria
    assert not load("r171/following").criteria
    assert [each.id for each in load("ncap-robustness/ccrs-night").criteria] == ["NCAP-AEB"]


def test_entries_have_names_everywhere():
    with refuses(UnknownNameError, "iso34502/cut-inn"):
        load("iso34502/cut-inn")
    assert "un-ads/lead-brakes-E-rain" in entry_names()
    assert not set(entry_names()) & KNOWN


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("rows:\n  a: {text: Stops, scenarios: [cut-inn]}\n", ("rows.a", "cut-inn", "line 6")),
        ("rows:\n  a: {text: Stops}\n", ("rows.a", "scenarios", "lacks")),
        ("rows:\n  a: {text: Stops, scenarios: [cut-in], lacks: it}\n", ("rows.a", "lacks")),
        ("rows:\n  a: {scenarios: [cut-in]}\n", ("text", "line 6")),
        ("rows:\n  a: {text: Stops, scenario: cut-in}\n", ("scenario", "scenarios")),
        ("rows:\n  a: {text: Stops, scenarios: cut-in}\n", ("scenarios",)),
        ("rows:\n  a b: {text: Stops, scenarios: [cut-in]}\n", ("a b",)),
        ("rows:\n  a: {text: Stops, scenarios: [cut-in, r157/cut-in]}\n", ("cut-in", "r157")),
        ("typology: iso-34503\n", ("iso-34503", "iso-34502")),
        ("rows: [cut-in]\n", ("rows",)),
    ],
)
def test_a_bad_table_is_one_clear_error(text, named):
    with refuses(ScenarioError, *named):
        table(text)


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ("given: {ego_sped: 20}", ("ego_sped", "ego_speed", "line 6")),
        ("given: {ego_speed: 20 kg}", ("ego_speed", "20 kg")),
        ("given: {ego_speed: car}", ("ego_speed", "car")),
        ("given: {ego_speed: [30, 20]}", ("ego_speed", "low <= high")),
        ("shift: {gap: [1 m]}", ("gap", "matrix")),
        ("given: {gap: 1 mm, change_time: 1 ms}", ("change_time",)),
    ],
)
def test_what_a_row_cannot_change_is_named(change, named):
    made = table(f"rows:\n  a: {{text: Stops, scenarios: [cut-in], {change}}}\n")
    with refuses(ScenarioError, *named):
        made.applied("cut-in-a", load("cut-in"))


def test_individuals_of_an_entry_find_it_again():
    scenario = load("un-ads/lead-brakes-E-rain")
    pipeline = Pipeline(scenario, scenario.space())
    found = scenario_of(pipeline.runner.concrete(scenario.space().row({})).individuals)
    assert found is not None
    assert found.name == scenario.name
