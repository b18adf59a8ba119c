"""A suite of matrices: packs by name, editions, collisions avoided and mitigated, points."""

from dataclasses import replace

import pytest
from tests.approval import approve, refuses
from tests.suite.test_page import unpacked

from bridgegen.base.errors import InputError
from bridgegen.cli.verdict.of_suite import SuiteCriteria, figures_of
from bridgegen.jobs.suite.entries import find_entries, of_edition
from bridgegen.jobs.suite.page import command_of
from bridgegen.jobs.suite.page_payload import payload
from bridgegen.jobs.suite.replay import replay
from bridgegen.jobs.suite.results import EntryResult, GridResult, RowResult
from bridgegen.jobs.suite.sentences import colour_of, outcomes, points, points_of
from bridgegen.jobs.suite.suite import evaluate_suite
from bridgegen.scenario.language.reader import pack_names


def test_the_name_of_a_pack_stands_for_its_scenarios():
    found = {one.scenario for one in find_entries(["r157", "cut-in"])}
    assert found == {"cut-in", *(name for name in pack_names() if name.startswith("r157/"))}
    (one,) = find_entries(["r157/cut-in"])
    assert (one.name, one.scenario) == ("cut-in", "r157/cut-in")
    with refuses(InputError):
        find_entries(["r15"])


def test_scenarios_without_an_edition_are_left_out():
    entries = find_entries(["ncap-aeb/cmrs", "ncap-aeb/ccrs", "r157/cut-in"])
    assert {one.name for one in of_edition(entries, "2023")} == {"ccrs", "cut-in"}
    assert of_edition(entries, None) == of_edition(entries, "none") == entries
    with pytest.raises(InputError, match="edition '2024'; editions: 2023, 2026"):
        of_edition(entries, "2024")
    with pytest.raises(InputError, match=r"edition '2024'$"):
        of_edition(find_entries(["cut-in"]), "2024")


@pytest.fixture(scope="module")
def turn(tmp_path_factory):
    """The matrix of 2023 of one scenario, by a driver that brakes and one that does not."""
    return evaluate_suite(
        ["ncap-aeb/ccfhos"], egos=["route-follower", "reference"], matrix="2023",
        out=tmp_path_factory.mktemp("suite") / "out", workers=1,
    )  # fmt: skip


def test_the_matrix_is_run_and_its_impacts_are_told(turn):
    blind, braking = turn.results
    assert blind.parameters == ["matrix", "ego_speed", "target_speed", "location"]
    assert [row.x[0] for row in blind.rows] == ["2023", "2023"]
    assert [row.x[1] for row in blind.rows] == pytest.approx([50 / 3.6, 70 / 3.6])
    assert [row.outcome for row in blind.rows] == ["not avoided", "not avoided"]
    assert [row.relative_impact_speed for row in blind.rows] == pytest.approx(
        [100 / 3.6, 140 / 3.6]
    )  # head-on: the sum of both
    assert [row.speed_reduction for row in blind.rows] == pytest.approx([0.0, 0.0], abs=1e-9)
    for row in braking.rows:
        assert row.impact_speed + row.speed_reduction == pytest.approx(row.x[1])
    assert blind.outcomes() == {"avoided": 0, "mitigated": 0, "not avoided": 2}
    figures = figures_of(replace(turn, results=(blind,)))
    assert figures["not_avoided"] == 2
    assert figures["worst_impact"] == pytest.approx(70 / 3.6)


def test_junit_and_the_page_tell_outcomes(turn, tmp_path):
    SuiteCriteria.read((), tmp_path / "j.xml").judge(turn)
    text = (tmp_path / "j.xml").read_text("utf-8")
    assert 'name="not_avoided" value="2"' in text
    approve(text, "19.4 m/s")
    found = payload(turn, {}, {})["suite"]
    assert found["outcomes"][0] == [
        "Collisions: 2 of 2 (100 %), 0 of them after slowing down; impact 16.7 m/s on average, "
        "19.4 m/s at most"
    ]
    assert found["entries"][0]["results"][0]["hits"] == [0, 2]
    details = unpacked(found["details"][0])["results"][0]
    assert details["outcome"] == "nn"
    assert sorted(details["impact"]) == pytest.approx([50 / 3.6, 70 / 3.6], abs=1e-4)


def hit(speed: float, to: float, other: float = 0.0) -> RowResult:
    """A row that hits at ``to`` km/h after ``speed`` km/h what drives ``other`` km/h ahead."""
    return RowResult(
        x=["2026"], collisions=1.0, impact_speed=to / 3.6, relative_impact_speed=(to - other) / 3.6,
        speed_reduction=(speed - to) / 3.6,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("row", "outcome"),
    [
        (RowResult(), "avoided"),
        (hit(50, 0), "avoided"),  # it stands: the other walks into it
        (hit(50, 0.1), "avoided"),  # as far as speeds are measured
        (hit(50, 0.2), "mitigated"),
        (hit(50, 48.9), "mitigated"),
        (hit(50, 49.1), "not avoided"),  # within the tolerance of the test speed
        (hit(50, 60), "not avoided"),
        (RowResult(problem="it diverges"), None),
    ],
)
def test_an_outcome_is_by_the_speed_at_the_impact(row, outcome):
    assert row.outcome == outcome


@pytest.mark.parametrize(
    ("speed", "relative", "colour"),
    [
        # Crash Avoidance, Frontal Collisions, 1.1, 4.2.4: the example of CMRs at 60 km/h
        (60, 1, "yellow"), (60, 10, "yellow"), (60, 10.1, "orange"), (60, 20, "orange"),
        (60, 20.1, "brown"), (60, 30, "brown"), (60, 30.1, "red"),
        # Euro NCAP's rating calculator of 2026
        (50, 10, "yellow"), (40, 10, "orange"), (40, 20, "brown"), (40, 21, "red"),
        (30, 10, "brown"), (30, 11, "red"), (20, 5, "red"), (10, 5, "red"),
    ],
)  # fmt: skip
def test_relative_impact_speeds_have_the_protocol_s_colours(speed, relative, colour):
    assert colour_of(hit(speed, relative), "relative impact speed") == colour


def test_other_scores_have_other_colours():
    assert colour_of(RowResult(), "relative impact speed") == "green"
    assert [colour_of(hit(50, to), "speed reduction") for to in (41, 40, 31, 30, 29)] == [
        "red", "red", "orange", "orange", "green",
    ]  # fmt: skip
    stands = hit(20, 0)
    assert colour_of(stands, "impact speed") == "green"
    assert colour_of(stands, "avoidance") == "red"  # it stands in the way of the other
    assert colour_of(hit(20, 1), "impact speed") == "red"
    assert colour_of(RowResult(), "avoidance") == "green"
    assert colour_of(RowResult(), "") is None
    assert colour_of(RowResult(problem="it diverges"), "avoidance") is None


def result(*rows: RowResult, graded: bool = True) -> EntryResult:
    grid = GridResult(
        label="2026", edition="2026", score="relative impact speed", points=2.0, graded=graded
    )
    return EntryResult(
        entry="a", ego="", digest="", scenario="a", parameters=["matrix"], units=["1"],
        grids=[grid], rows=list(rows),
    )  # fmt: skip


def test_points_are_the_mean_of_sub_scores():
    rows = (RowResult(x=["2026"]), hit(60, 5), hit(60, 50), RowResult(x=["2026"], problem="lost"))
    (graded,) = points_of([result(*rows)])
    assert (graded.reached, graded.most) == (2.0 * (1.0 + 0.75) / 4, 2.0)
    (ungraded,) = points_of([result(*rows, graded=False)])
    assert ungraded.reached == 2.0 * 2 / 4  # yellow counts fully
    approve(points([result(*rows)]), "0.88", "2.00")
    assert points([result(*rows).model_copy(update={"grids": []})]) == ""


def test_a_suite_without_collisions_tells_none():
    assert outcomes([result(RowResult(), RowResult())]) == ""
    some = outcomes([result(RowResult(), hit(36, 18), RowResult(problem="lost"))])
    approve(some, "50 %", "5.0 m/s")


def test_the_page_s_command_runs_the_same_row(turn):
    row = turn.results[0].worst
    command = command_of(turn.folder, turn.jobs[0], turn.results[0])
    approve(command, turn.folder, "--ego")
    made = replay(turn.folder, "ccfhos", row + 1, ego="route-follower")
    assert made.result.rows[0] == turn.results[0].rows[row]
