"""Real tests in ``measured.csv``: their area metric, its verdict, and what is refused."""

import json
import runpy

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import wasserstein_distance
from tests.approval import refuses

import bridgegen as bg
from bridgegen.base.errors import FileFormatError
from bridgegen.jobs.credibility import recompute_real
from bridgegen.jobs.credibility.measured import COLUMNS, FEWEST, RealTest, area, compare
from bridgegen.jobs.safety_case.numbers import Numbers
from bridgegen.jobs.search.exported import exported_scenarios
from bridgegen.results.store import Recorded, Store

pytestmark = pytest.mark.thorough

NUMBERS = st.floats(-1e6, 1e6)


@given(
    st.integers(1, 30).flatmap(
        lambda n: st.tuples(*[st.lists(NUMBERS, min_size=n, max_size=n)] * 2)
    )
)
@settings(max_examples=60, deadline=None)
def test_the_area_is_the_distance_of_wasserstein(pair):
    expected = wasserstein_distance(*pair)
    assert area(*pair) == pytest.approx(expected, rel=1e-9, abs=1e-6)


def test_the_area_is_that_between_the_steps():
    """By hand: from 1 to 2 one of two is below, from 2 to 4 both against one."""
    assert area([1.0, 2.0], [2.0, 4.0]) == pytest.approx(0.5 * 1.0 + 0.5 * 2.0)


def write(folder, *rows: str) -> None:
    folder.mkdir(exist_ok=True)
    text = "\n".join(["# mine", ",".join(COLUMNS), *rows, ""])
    (folder / "measured.csv").write_text(text, "utf-8")


def recorded(run, metric: str, row: int) -> float:
    with Store.open(run) as store:
        return float(Recorded(store).metrics[row, store.metrics.index(metric)])


def item(found, id: str):
    return next(one for one in found.dossier.items if one.id == id)


@pytest.fixture
def out(project):
    return project / "out"


def test_verdicts_and_figures_are_those_of_the_files(project, out, recomputed):
    first = exported_scenarios(project / "hangs")[0]
    d = recorded(project / "hangs", "d_min", first.evaluation)
    v = recorded(project / "clean", "v_d", 4)
    write(
        out,
        # a spreadsheet writes 1 for 0001
        *(
            f"hangs,{name},d_min,m,{d + off!r},0.1,0.5,"
            for name, off in (("0001", 0.2), ("1", 0.4))
        ),
        *(f"clean,evaluation 5,v_d,m/s,{v + 3.0 + 0.1 * k!r},,2.5," for k in range(FEWEST)),
        *(f"clean,evaluation {k},v_d,m/s,{v!r},,,many" for k in range(1, 7)),
        f"hangs,0001,v_d,m/s,{recorded(project / 'hangs', 'v_d', first.evaluation)!r},2.0,1.5,",
    )
    before = (out / "measured.csv").read_bytes()
    found = bg.export_credibility([project], out=out)
    assert (out / "measured.csv").read_bytes() == before
    numbers = {one.id: one.value for one in found.dossier.numbers}
    assert numbers["all.area:1"] == pytest.approx(0.3)
    assert numbers["all.area_low:1"] == pytest.approx(0.2)  # two tests: the uncertainty alone
    assert numbers["all.area_high:1"] == pytest.approx(0.4)
    assert numbers["all.area:2"] == pytest.approx(3.25)
    assert 3.0 <= numbers["all.area_low:2"] < 3.25 < numbers["all.area_high:2"] <= 3.5
    sim = [recorded(project / "clean", "v_d", k) for k in range(6)]
    assert numbers["all.area:3"] == pytest.approx(wasserstein_distance([v] * 6, sim))
    verdicts = [one.verdict for one in found.dossier.comparisons]
    assert verdicts == ["accepted", "not accepted", "no threshold", "not decided"]
    assert item(found, "8.3").status == "partly"
    assert item(found, "8.3").claim.text.startswith("15 tests in 4 comparisons: 1 within")
    assert found.dossier.figures["refused"] == 1
    assert found.shown()[0].startswith("Simulation and real tests differ by more than is accepted")
    assert any(one.file.endswith("measured.csv") for one in found.dossier.evidence)
    page = found.page.read_text("utf-8")
    assert page.count("not accepted") >= 1
    assert recomputed(out) == (0, [], "")


def test_enough_tests_within_the_threshold_fill_the_item(project, out, recomputed):
    v = recorded(project / "clean", "v_d", 4)
    write(out, *[f"clean,evaluation 5,v_d,m/s,{v + 0.1 * k!r},,2.5," for k in range(FEWEST)])
    found = bg.export_credibility([project], out=out)
    assert item(found, "8.3").status == "filled"
    assert recomputed(out)[0] == 0


def test_a_value_that_the_simulation_has_not_is_compared_with_nothing():
    test = RealTest("R1", 4, "evaluation 5", "d_min", "m", 3.0, float("nan"), 0.0, 2.5)
    (found,) = compare([test], Numbers("all"))
    assert found.verdict == "no simulated value"
    alone = runpy.run_path(recompute_real.__file__)["compared"]
    assert alone([(3.0, float("nan"), 0.0, 2.5)]) == {"verdict": "no simulated value"}


@pytest.mark.parametrize("what", ["area", "verdict", "csv"])
def test_what_is_forged_is_named(project, out, recomputed, what):
    v = recorded(project / "clean", "v_d", 4)
    write(out, *[f"clean,evaluation 5,v_d,m/s,{v + 3.0!r},,2.5,"] * 2)
    found = bg.export_credibility([project], out=out)
    data = json.loads(found.file.read_text("utf-8"))
    if what == "area":
        next(one for one in data["numbers"] if one["id"] == "all.area:1")["value"] = 1.0
    elif what == "verdict":
        data["comparisons"][0]["verdict"] = "accepted"
    else:
        write(out, f"clean,evaluation 5,v_d,m/s,{v + 1.0!r},,2.5,")
    found.file.write_text(json.dumps(data), "utf-8")
    status, lines, _ = recomputed(out)
    assert status == 1
    assert any({"area": "all.area:1", "verdict": "verdict on", "csv": "SHA-256"}[what] in line
               for line in lines)  # fmt: skip


GOOD = ["clean", "evaluation 5", "v_d", "m/s", "3.0", "0.1", "1", ""]


@pytest.mark.parametrize(
    ("column", "cell"),
    [
        ("run", "elsewhere"), ("run", ""), ("scenario", "evaluation 0"), ("scenario", "0099"),
        ("scenario", "evaluation 101"), ("scenario", "../x"), ("quantity", "speed"),
        ("unit", "km/h"), ("measured", ""), ("measured", "nan"), ("measured", "3;0"),
        ("uncertainty", "-1"), ("threshold", "inf"), ("scenario", "evaluation ²"),
    ],
)  # fmt: skip
def test_a_wrong_cell_is_named_with_line_and_column(project, out, column, cell):
    row = GOOD.copy()
    row[COLUMNS.index(column)] = cell
    write(out, ",".join(GOOD), ",".join(row))
    with pytest.raises(FileFormatError) as error:
        bg.export_credibility([project], out=out)
    (problem,) = error.value.problems
    assert problem.startswith(f"{column} must be ")
    assert f"line 4, column {column}" in problem
    assert [path.name for path in out.iterdir()] == ["measured.csv"]


@pytest.mark.parametrize(
    "data",
    [
        b"a,b\n1,2\n",
        b"\xff\xfe",
        b'run,"scen\nario\n',
        "\n".join(["run"] * 3000).encode(),
        b"run,\0",
    ],
)
def test_another_file_is_one_clear_error(made, tmp_path, data):
    (tmp_path / "measured.csv").write_bytes(data)
    with refuses(FileFormatError):
        bg.export_credibility([made["clean"]], out=tmp_path)


def test_two_thresholds_of_one_comparison_are_refused(project, out):
    write(out, ",".join(GOOD), ",".join(GOOD).replace(",1,", ",2,"))
    with refuses(FileFormatError):
        bg.export_credibility([project], out=out)


def test_a_spreadsheets_semicolons_are_read(made, tmp_path, recomputed):
    write(tmp_path, ",".join(["", *GOOD[1:]]))
    path = tmp_path / "measured.csv"
    path.write_bytes(
        b"\xef\xbb\xbf" + path.read_bytes().replace(b",", b";").replace(b"\n", b"\r\n")
    )
    found = bg.export_credibility([made["clean"]], out=tmp_path)
    assert len(found.dossier.comparisons) == 1
    assert recomputed(tmp_path)[0] == 0


def test_the_interval_is_the_same_in_each_run_of_it(made, tmp_path):
    values = np.linspace(0.0, 1.0, 8)
    write(tmp_path, *[f",evaluation 5,v_d,m/s,{v!r},,1," for v in values.tolist()])
    first, again = (bg.export_credibility([made["clean"]], out=tmp_path) for _ in range(2))
    assert first.dossier.numbers == again.dossier.numbers
