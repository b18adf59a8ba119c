"""Scenario files by path: what is read, and every mistake with its file and line."""

import re
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from tests.approval import approve, refuses

from bridgegen.base.errors import FileFormatError, InputError, ScenarioError, UnknownNameError
from bridgegen.scenario.language.objectives import PAPERS
from bridgegen.scenario.language.parameters import Axis
from bridgegen.scenario.language.reader import load
from bridgegen.scenario.language.story import Change, SpeedChange
from bridgegen.scenario.language.thresholds import Thresholds


@pytest.fixture
def write(tmp_path):
    def write(text, name="mine.yaml"):
        path = tmp_path / name
        path.write_text(text, "utf-8")
        return path

    return write


@pytest.fixture
def refuse(write):
    """Load a file that must be refused, and return its problems without the folder."""

    def refuse(text, error=ScenarioError):
        path = write(text)
        with pytest.raises(error) as caught:
            load(path)
        return [problem.replace(str(path), "mine.yaml") for problem in caught.value.problems]

    return refuse


def test_a_users_file_by_path(write, s4_text):
    path = write(s4_text)
    assert load(str(path)) == load("crossroads-s4")
    assert load(path).place == str(path)
    assert load(path).fingerprint == load("crossroads-s4").fingerprint


def test_a_users_fragment_and_extension_axis(write, s4_text):
    write(
        "fragment: tyres\n"
        "description: Worn tyres.\n"
        "parameters:\n"
        "  tread:\n"
        "    {axis: extension, unit: m, low: 0.0016, high: 0.008, default: 0.008,\n"
        "     description: Depth of tread., source: StVZO 36}\n"
        "derived:\n"
        "  grip: {axis: extension, unit: '1', value: 'friction*min(1, tread/0.004)',\n"
        "    why: Worn tyres slip., source: ours, description: Grip.}\n",
        "tyres.yaml",
    )
    text = s4_text.replace("encounter]", "encounter, tyres.yaml]")
    text = text.replace("axes: [participants, weather]", "axes: [extension]")
    scenario = load(write(text))
    space = scenario.space()
    assert space.variables == ("tread",)
    assert scenario.axes == (Axis.EXTENSION,)
    values = space.values(space.decode([[0.0]])[0])
    assert values["grip"] == pytest.approx(0.4)
    assert scenario.parameters["tread"].place.endswith("tyres.yaml, line 4")


def test_entropy_weights_and_own_thresholds(write, papers_text):
    text = papers_text.replace("weights: fixed", "weights: entropy")
    text = text.replace("scale: raw", "scale: standardised")
    text = re.sub(r", weight: [0-9.]+", "", text).replace("d_min_below: 2.0", "d_min_below: 1.5")
    objective = load(write(text)).objective
    assert (objective.weights, objective.scale) == ("entropy", "standardised")
    assert [term.weight for term in objective.terms] == [None, None]
    assert objective.critical == Thresholds(d_min_below=1.5)
    assert (objective.rule, objective.gated) == ("thresholds", True)
    assert load(write(papers_text)).objective == replace(PAPERS, gated=True)


def test_all_mistakes_of_a_file_and_its_fragment_at_once(refuse, write, s4_text):
    write(
        "fragment: own\n"
        "description: x\n"
        "parameters:\n"
        "  a: {axis: extension, unit: m, low: 9, high: 1, default: 1, description: d, source: s}\n"
        "  b: {axis: extension, unit: m, low: 0, high: 1, default: 1, description: d, source: s}\n"
        "bounds:\n"
        "  - {target: b, lo: a + precipitaton, why: w, source: s}\n"
        "  - {target: wetness, hi: b, why: w, source: s}\n"
        "  - {target: c, hi: b, why: w, source: s}\n"
        "  - {target: b, hi: 'b; 1', why: w, source: s}\n"
        "  - {target: b, hi: b, why: w, sorce: s}\n"
        "derived:\n"
        "  d: {axis: extension, unit: m, value: e, why: w, source: s, description: d}\n"
        "  e: {axis: extension, unit: m, value: d, why: w, source: s, description: d}\n",
        "own.yaml",
    )
    text = s4_text.replace("encounter]", "encounter, own.yaml]")
    text = text.replace("rate: 3.0", "rate: 0.0").replace("title:", "titel:")
    problems = "\n".join(refuse(text))
    for part in (
        "the file must have the key 'title' (mine.yaml, line 1)",
        "unknown key 'titel'; did you mean 'title'? (mine.yaml, line 2)",
        "bounds.4 must have the key 'source'",
        "unknown key 'sorce' in bounds.4; did you mean 'source'?",
        "low <= high must hold for a [m], got low=9.0, high=1.0",
        "cannot read the formula 'b; 1': ';' is no part of a formula",
        "events.bv_sets_off.rate [m/s²] must be greater than 0 and finite, got 0.0",
        "unknown name 'precipitaton' in 'b >= a + precipitaton'; did you mean 'precipitation'?",
        "limits 'wetness', which follows from 'wetness = ",
        "the bound 'c <= b' limits the unknown parameter 'c'",
        "constraints must not form a cycle, got ",
    ):
        assert part in problems
    assert len(problems.splitlines()) == 11
    assert problems.count("own.yaml, line ") == 9  # the cycle has two


def test_rules_that_only_show_in_values(refuse, s4_text):
    extra = """
bounds:
  - {target: bv_speed, hi: 1.7 + 0*ego_speed, why: w, source: s}
"""
    (problem,) = refuse(s4_text + extra)
    approve(problem, "bv_speed", "ego_speed", "mine.yaml")
    (problem,) = refuse(s4_text + extra.replace("1.7", "ego_speed - 5"))
    approve(problem, "bv_speed", "ego_speed")
    assert re.search(r"\(mine.yaml, line \d+\)", problem)


def test_a_parameter_without_effect_is_refused(refuse, s4_text):
    entry = "{axis: AXIS, unit: m/s, low: 1, high: 2, default: 1, description: d, source: s}"
    extra = f"  ego_sped: {entry}\n  windd: {entry}\n  free: {entry}\n"
    for axis in ("participants", "weather", "extension"):
        extra = extra.replace("AXIS", axis, 1)
    problems = refuse(s4_text.replace("\nparameters:\n", "\nparameters:\n" + extra))
    assert [problem.split(" (")[0] for problem in problems] == [
        "nothing in mine.yaml uses ego_sped [m/s] of the axis participants",
        "nothing in mine.yaml uses windd [m/s] of the axis weather",
    ]


def test_a_rate_must_stay_above_zero(refuse, write, s4_text):
    entry = (
        "{axis: participants, unit: m/s², low: 0, high: 4, default: 3, description: d, source: s}"
    )
    text = s4_text.replace("rate: 3.0", "rate: bv_rate")
    text = re.sub("    jerk: .*\\n", "", text)
    text = text.replace("\nparameters:\n", f"\nparameters:\n  bv_rate: {entry}\n")
    (problem,) = refuse(text)
    approve(problem, "bv_rate", "bv_sets_off")
    (action,) = load(write(text.replace("low: 0,", "low: 0.1,"))).events[0].actions
    assert action == SpeedChange("bv_speed", Change(rate="bv_rate"))


def test_what_road_and_weather_need_has_its_axis_unit_and_kind(write, refuse, s4_text):
    import bridgegen.scenario.catalogue as catalogue

    folder = Path(catalogue.__file__).parent
    own = (folder / "crossroads.yaml").read_text("utf-8")
    own = own.replace("    kind: integer\n", "").replace("unit: m\n", "unit: s\n", 1)
    write(own, "own.yaml")
    problems = refuse(s4_text.replace("[crossroads,", "[own.yaml,"))
    assert [problem.split(" (")[0] for problem in problems] == [
        "lane_width needs a parameter in m, 'lane_width' is in s",
        "lanes_per_direction needs a parameter of kind integer, 'lanes_per_direction' is not one",
    ]


def test_a_wrong_fragment_does_not_make_everything_unknown(refuse, s4_text):
    problems = refuse(s4_text.replace("weather, encounter", "weather, own.yaml"))
    assert [problem.split(":")[0] for problem in problems] == ["no such file"]


@pytest.mark.parametrize(
    "change",
    [
        lambda text: text.split("participants:\n")[0] + "participants: {}\n",
        lambda text: text.replace("  bv:\n", "  ego2:\n").replace("  ego:\n", "  me:\n"),
    ],
)
def test_an_ego_is_needed(refuse, s4_text, change):
    approve(refuse(change(s4_text)), "ego")


def test_an_ego_alone_is_refused(refuse, s4_text):
    text = re.sub(r"  bv:\n.*\nevents:", "\nevents:", s4_text, flags=re.DOTALL)
    approve(refuse(text), "besides")


@pytest.mark.parametrize("text", ["", "3", "- a\n- b", "just text", "null"])
def test_not_a_mapping(refuse, text):
    (problem,) = refuse(text)
    approve(problem, "mapping")


@pytest.mark.parametrize("key", ["parameters", "bounds", "derived", "participants", "include"])
@pytest.mark.parametrize("value", ["3", "[1]", "{a: 1}", "text"])
def test_sections_of_the_wrong_shape(refuse, s4_text, key, value):
    text = re.sub(rf"^{key}:.*\n((  .*)?\n)*", "", s4_text, flags=re.MULTILINE)
    problems = refuse(f"{text}\n{key}: {value}\n")
    assert any(problem.startswith(key) for problem in problems)


def test_files_that_cannot_be_read(tmp_path, write):
    for path in (tmp_path / "no.yaml", tmp_path, "/dev/zero", str(tmp_path / "no.yaml")):
        with refuses(FileFormatError):
            load(path)
    with refuses(FileFormatError, "1048576"):
        load(write("#" * (2**20 + 1)))
    with refuses(FileFormatError, "line 1"):
        load(write("a: 1\na: 2"))


def test_a_name_without_a_path_is_a_name_of_the_catalogue():
    with refuses(UnknownNameError, "mine", "bus-pulls-out"):
        load("mine")


@given(st.data())
@settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_any_damage_is_one_clear_error_or_a_scenario(write, s4_text, data):
    lines = s4_text.splitlines()
    number = data.draw(st.integers(0, len(lines) - 1))
    damage = st.sampled_from(["drop", "twice", "indent", "cut", "number", "list", "null"])
    line = lines[number]
    lines[number : number + 1] = {
        "drop": [],
        "twice": [line, line],
        "indent": ["  " + line],
        "cut": [line[: len(line) // 2]],
        "number": [line.split(":")[0] + ": 7"],
        "list": [line.split(":")[0] + ": [x]"],
        "null": [line.split(":")[0] + ":"],
    }[data.draw(damage)]
    path = write("\n".join(lines))
    try:
        problems = [load(path).place]
    except InputError as error:
        problems = list(error.problems)
    # A fragment's bound is to blame where the scenario no longer declares what it limits.
    places = (str(path), "encounter.yaml, line ")
    assert all(any(place in problem for place in places) for problem in problems)


def test_an_exposure_is_no_scenario():
    with pytest.raises(ScenarioError) as error:
        load(Path(__file__).parents[2] / "docs/examples/cut-in-exposure.yaml")
    (problem,) = error.value.problems
    approve(problem, "cut-in", "cut-in-exposure.yaml", "line 3")
