"""OpenSCENARIO DSL: what a file says happens, at the times and places that it names, or is refused.

The expected numbers are worked by hand; distances are between reference points.
"""

from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from tests.approval import approve, refuses

from bridgegen.base.errors import BridgeGenError, FileFormatError, InputError, UnsupportedError
from bridgegen.engine.options import CommonOptions
from bridgegen.jobs.search.model import simulate_scenario
from bridgegen.jobs.search.validate import notes_on, validate_file
from bridgegen.scenario.language.dsl.names import Names
from bridgegen.scenario.language.dsl.parser import parse
from bridgegen.scenario.language.dsl.story import read_dsl
from bridgegen.scenario.language.reader import load
from bridgegen.scenario.language.starter import start_scenario
from bridgegen.simulation.choice import EMBEDDED

EXAMPLE = Path(__file__).parents[2] / "docs" / "examples" / "cut-in-and-slow.osc"

HEAD = """
import osc.standard.all
scenario top:
    ego: vehicle
    b: vehicle
    x: speed
    FIELD
    do serial:
        p: parallel(duration: 6s):
            ego.drive() with:
                speed(36kph)
                lane(2, at: start)
            b.drive() with:
                DRIVE
        NEXT
"""


def written(path: Path, drive="speed(36kph)", field="event e", then="emit e") -> Path:
    text = HEAD.replace("DRIVE", drive).replace("FIELD", field).replace("NEXT", then)
    path.write_text(text, "utf-8")
    return path


@pytest.fixture
def file(tmp_path):
    return tmp_path / "top.osc"


def test_what_the_example_says_happens():
    result = simulate_scenario(EXAMPLE, CommonOptions(), EMBEDDED)
    ego, npc = (result.rollout.names.index(name) for name in ("ego", "npc"))
    x, y, v = (getattr(result.rollout, key)[0] for key in ("x", "y", "v"))
    ahead, aside = x[npc] - x[ego], y[npc] - y[ego]
    # At the defaults: 20 m behind, beside it, on the left; 10 s later 21 m ahead.
    assert (ahead[0], aside[0] > 3.0) == (pytest.approx(-20.0), True)
    assert ahead[200] == pytest.approx(21.0, abs=0.1)
    # 4 s later on the ego's lane; 5 s later at the speed that the file names: 60 km/h.
    assert aside[280] == pytest.approx(0.0, abs=0.05)
    assert v[npc, -1] == pytest.approx(60 / 3.6, abs=0.01)
    assert set(v[ego].round(6)) == {25.0}


@given(
    speed=st.floats(5.0, 30.0), behind=st.floats(6.0, 60.0), ahead=st.floats(0.0, 60.0),
    time=st.floats(2.0, 30.0),
)  # fmt: skip
def test_a_place_at_the_end_makes_the_speed(tmp_path_factory, speed, behind, ahead, time):
    file = written(
        tmp_path_factory.getbasetemp() / "place.osc",
        f"position({behind:.6f}m, behind: ego, at: start)\n"
        f"                position({ahead:.6f}m, ahead_of: ego, at: end)\n"
        "                lane(left_of: ego, at: start)",
    )
    text = file.read_text("utf-8").replace("36kph", f"{speed:.6f}mps")
    file.write_text(text.replace("6s", f"{time:.6f}s"), "utf-8")
    people = read_dsl(file).data["participants"]
    assert people["b"]["speed"] == pytest.approx(speed + (behind + ahead) / time, abs=1e-4)
    gap = people["ego"]["start"]["distance"] - people["b"]["start"]["distance"]
    assert gap == pytest.approx(behind, abs=1e-5)


def test_ranges_and_constraints_are_parameters_and_bounds():
    scenario = load(EXAMPLE)
    ranges = {
        name: (round(each.low, 3), round(each.high, 3), round(each.default, 3))
        for name, each in scenario.parameters.items()
        if each.axis == "participants"
    }
    assert ranges["cruise"] == (22.222, 30.556, 25.0)
    assert ranges["slow"][:2] == (11.111, 22.222)
    assert ranges["npc_get_ahead_distance"] == (15.0, 25.0, 20.0)
    (bound,) = [each for each in scenario.bounds if each.target == "slow"]
    assert bound.hi.source == "(cruise - 5.555555556)"
    approve(notes_on(EXAMPLE), "slow")


def test_a_member_of_one_of_happens_where_it_is_chosen(file):
    written(
        file,
        then="""choice: one_of(duration: 4s):
            fast: b.drive() with:
                speed(72kph, at: end)
            aside: b.drive() with:
                change_lane(1, side: left)""",
    )
    scenario = load(file)
    assert scenario.parameters["choice_of"].kind.names == ("fast", "aside")
    times = [each.value.source for each in scenario.derived if each.name.endswith("_time")]
    assert times == [
        "(6.0 if choice_of == fast else 100000.0)",
        "(6.0 if choice_of == aside else 100000.0)",
    ]


def test_a_condition_ends_a_phase(file):
    written(
        file,
        "speed(36kph)\n                position(30m, ahead_of: ego, at: start)\n"
        "                until ego.time_headway(reference: b) < 2s",
        then="""q: b.drive(duration: 3s) with:
            speed(18kph, at: end)
        r: b.drive(duration: 3s) with:
            change_lane(side: left)""",
    )
    events = read_dsl(file).data["events"]
    headway = {"kind": "headway", "of": "ego", "to": "b", "value": 2.0}
    assert events["b_q"]["when"] == [headway, {"kind": "time", "value": 6.0}]
    assert events["b_r"]["when"] == [{"kind": "began", "event": "b_q", "value": 3.0}]
    assert events["b_r"]["lane_change"] == {"lanes": 1, "time": 3.0}


def test_a_driver_under_test_decides_itself(file):
    written(file, then="q: ego.drive(duration: 3s) with:\n            change_lane(side: left)")
    lanes = {}
    for driver in (None, "route-follower"):
        result = simulate_scenario(file, CommonOptions(ego=driver), EMBEDDED)
        y = result.rollout.y[0, result.rollout.names.index("ego")]
        lanes[driver] = round(float(y[-1] - y[0]), 2)
    assert lanes == {None: 3.75, "route-follower": 0.0}


def test_a_copy_in_yaml_is_the_same_scenario(tmp_path):
    copy, original = load(start_scenario("mine", like=str(EXAMPLE), folder=tmp_path)), load(EXAMPLE)
    assert copy.name == "mine"
    assert copy.story == original.story
    assert copy.roads == original.roads
    assert copy.parameters.keys() == original.parameters.keys()


@pytest.mark.parametrize(
    ("drive", "named"),
    [
        ("follow_trajectory()", "follow_trajectory"),
        ("speed(3)", "m/s"),
        ("speed([30kph..20kph])", "8.33333"),
        ("speed(x)", "'x'"),
        ("lane(right_of: b)", "itself"),
        ("lane(9)", "lane 9"),
        ("lateral(1m, side: x)", "lateral"),
        ("change_lane(lane_changes: [1..2])", "side"),
        ("position(900km, ahead_of: ego, at: end)", "10,000 m"),
        ("position(90m, behind: ego, at: end)", "backwards"),
        ("until @x", "comparison"),
        ("keep(speed > 3kph)", "keep()"),
    ],
)
def test_what_is_outside_is_refused_by_line(file, drive, named):
    with refuses(InputError, named):
        load(written(file, f"{drive}"))


def test_what_else_is_outside(file):
    with refuses(UnsupportedError, "on"):
        load(written(file, field="on @e:\n        call f()"))
    with refuses(UnsupportedError, "keep()"):
        load(written(file, "speed(x)", field="keep(x != 3kph)"))
    with refuses(UnsupportedError, "0 s"):
        load(written(file, then="wait elapsed(-3s)"))
    with refuses(InputError, "'q'"):
        load(written(file, then="q.drive()"))
    with refuses(FileFormatError, "bytes"):
        parse(b" " * (2**20 + 1), "x.osc")
    with refuses(FileFormatError, "deep"):
        parse(b"scenario a:\n    keep(" + b"(" * 5000 + b")" * 5000 + b")\n", "x.osc")
    with refuses(FileFormatError, "chain"):
        parse(b"scenario a:\n    keep(1" + b"+1" * 5000 + b")\n", "x.osc")
    with refuses(FileFormatError, "digits"):
        parse(b"scenario a:\n    keep(0x" + b"f" * 5000 + b")\n", "x.osc")
    with refuses(FileFormatError, "comment"):
        parse(b"/* " * 100_000, "x.osc")
    calls = (f"scenario s{k}:\n    do serial:\n" + f"        s{k + 1}()\n" * 10 for k in range(9))
    file.write_text("".join(calls) + "scenario s9:\n    do ego.drive(duration: 1s)\n", "utf-8")
    with refuses(UnsupportedError, "phases"):
        load(file)
    with refuses(FileFormatError, "indentation"):
        parse(b"scenario a:\n        event b\n    event c\n", "x.osc")


NAMES = [
    ("actor a\nactor a\n", 2),
    ("enum c: [red]\nactor a:\n    p: c = c!blue\n", 3),
    ("enum c: [red = 1, blue = 5]\n", 1),
    ("struct s:\n    p: unknown_type\n", 2),
    ("unit mile of way is SI(m: 1)\n", 1),
    ("type way is SI(m: 1, m: 2)\n", 1),
    ("actor a:\n    p: float\n    keep(p > 3|foot/s|)\n", 3),
    ("extend a:\n    p: float\n", 1),
    ("scenario a.b\n", 1),
    ("struct s:\n    p: float\nactor a:\n    q: s\n    keep(q.r > 3)\n", 5),
    ("actor a:\n    var q: float\n    keep(q > 3)\n", 3),
    ("actor a\nscenario s:\n    event e\n    event e\n", 4),
    ("scenario s:\n    do serial:\n        l: drive()\n        l: drive()\n", 4),
    ('import "../elsewhere.osc"\n', 1),
]


@pytest.mark.parametrize(("text", "line"), NAMES, ids=[text.split("\n")[0] for text, _ in NAMES])
def test_names_are_checked_with_their_line(file, text, line):
    file.write_text(text, "utf-8")
    with refuses(InputError, f"line {line}"):
        Names(file).stop()


def test_declarations_alone_are_valid_and_nothing_to_search(file):
    file.write_text("actor a\ntype speed is SI(m: 1, s: -1)\nunit v of speed is SI(m: 1)\n")
    warnings: list[str] = []
    assert validate_file(file, warnings=warnings) == []
    approve(warnings, "nothing to run")
    (file.parent / "other.osc").write_text("import top.osc\nactor b inherits a\n", "utf-8")
    assert Names(file.parent / "other.osc").problems == []


WORDS = sorted(
    {*EXAMPLE.read_text("utf-8").split(), "1e999", "[", "until", "0x", "until ego.speed"}
)


@given(st.data())
@example(None)
def test_no_file_is_a_fault(tmp_path_factory, data):
    file = tmp_path_factory.getbasetemp() / "any.osc"
    words = EXAMPLE.read_text("utf-8").split(" ")
    for _ in range(0 if data is None else data.draw(st.integers(1, 4))):
        words[data.draw(st.integers(0, len(words) - 1))] = data.draw(st.sampled_from(WORDS))
    file.write_text(" ".join(words), "utf-8")
    with suppress(BridgeGenError):
        read_dsl(file)
