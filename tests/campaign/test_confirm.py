"""A run's scenarios in another simulator: the embedded one stands in for it, disturbed."""

import json
import re
import shutil
import threading
from dataclasses import replace

import numpy as np
import pytest
from tests.approval import approve, refuses

import bridgegen as bg
from bridgegen.base.errors import FileFormatError, InputError, Interrupted
from bridgegen.jobs.search.confirm import confirm
from bridgegen.jobs.search.settings import Settings
from bridgegen.results.store import Store
from bridgegen.simulation import choice
from bridgegen.simulation.choice import SimulatorChoice

pytestmark = pytest.mark.thorough


class Double:
    """The embedded simulator, whose rollouts are given to somebody first."""

    rows_at_once = runs_at_once = 1

    def __init__(self, embedded, disturb):
        self.embedded, self._disturb = embedded, disturb

    def __getattr__(self, name):
        return getattr(self.embedded, name)

    def run(self, roads, rows, values, **more):
        return self._disturb(self.embedded.run(roads, rows, values, **more))


@pytest.fixture
def double(monkeypatch):
    """Register a double; return what sets how it disturbs, and counts the rows it ran."""

    class Hands:
        ran = 0
        disturb = staticmethod(lambda rollout: rollout)

        def run(self, rollout):
            self.ran += rollout.shape[0]
            return self.disturb(rollout)

    hands = Hands()

    def make(embedded, storyboard, settings, access):
        return Double(embedded, hands.run)

    kind = choice.Kind("double", "Ours, disturbed.", make, settings={"noise": "none [m]"})
    monkeypatch.setitem(choice.SIMULATORS, "double", kind)
    return hands


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    place = tmp_path_factory.mktemp("runs") / "s4"
    bg.run_search(
        "crossroads-s4", algorithm="pso", budget=150, ego="route-follower", keep=4, causes=False,
        seed=4, triage="short", objective="paper", out=place,
    )  # fmt: skip
    return place


@pytest.fixture
def folder(finished, tmp_path):
    """The run without a report, which would take most of the time."""
    away = shutil.ignore_patterns("report.html")
    return shutil.copytree(finished, tmp_path / "s4", ignore=away)


def elsewhere(**settings):
    return SimulatorChoice("double", settings)


def shifted(by, *, entity=1, after=0):
    def disturb(rollout):
        x = rollout.x.copy()
        x[:, entity, after:] += by
        return replace(rollout, x=x)

    return disturb


def record_of(folder):
    return json.loads((folder / "confirmation-double.json").read_text("utf-8"))


def test_the_same_simulator_confirms_everything_and_nobody_parts(folder, double):
    found = confirm(folder, elsewhere())
    kept = bg.Run(folder).exported()
    assert [(one.name, one.evaluation) for one in found.scenarios] == [
        (one.name, one.evaluation) for one in kept
    ]
    with Store.open(folder) as store:
        rows, names = store.read(), list(store.metrics)
    for one in found.scenarios:
        assert one.confirmed is True
        assert one.differences.partings == one.differences.events == one.tracks == ()
        assert (one.change.d_min, one.change.v_d, one.change.F) == (0.0, 0.0, (0.0,))
        measured = rows.metrics[one.evaluation]
        assert one.here.d_min == one.there.d_min == measured[names.index("d_min")]
        assert tuple(rows.F[one.evaluation]) == one.here.F
        hit = measured[names.index("n_collision")] > 0
        assert (one.here.contact is not None) == hit
    assert (found.summary.share, double.ran) == (1.0, 4)
    assert json.loads(found.record.model_dump_json()) == record_of(folder)


def test_what_is_elsewhere_there_is_found(folder, double):
    """The other car 60 m ahead from instant 40 on: 2 s."""
    double.disturb = shifted(60.0, after=40)
    found = confirm(folder, elsewhere())
    for one in found.scenarios:
        first = one.differences.partings[0]
        assert (one.confirmed, first.entity, first.time) == (False, "bv", pytest.approx(2.0))
        assert first.gap == pytest.approx(60.0)
        assert one.there.d_min > 2.0
        approve(one.explanation, "d_min")
        assert one.differences.closest.time >= 2.0
        approve(one.explanation, "2.00 s")
        assert "deviating since" not in one.explanation
        (track,) = one.tracks
        assert (track.entity, track.first) == ("bv", 40)
    assert (found.summary.confirmed, found.summary.lost) == (0, 4)


def test_a_failed_row_is_not_run_and_never_confirmed(folder, double):
    def disturb(rollout):
        if double.ran != 2:
            return rollout
        return replace(
            rollout, status=np.full(1, 4, np.int8), messages={0: "no <b>road</b>\x1b[0m"}
        )

    double.disturb = disturb
    found = confirm(folder, elsewhere())
    failed = found.scenarios[1]
    assert (failed.confirmed, failed.there, failed.differences) == (None, None, None)
    assert failed.failure == "a position that is not on the road network: no <b>road</b> [0m"
    s = found.summary
    assert (s.scenarios, s.ran, s.confirmed, s.not_run) == (4, 3, 3, 1)
    assert double.ran == 4
    again = confirm(folder, elsewhere())  # what failed is tried once more, and nothing else
    assert (double.ran, again.ran, again.summary.confirmed) == (5, 1, 4)


def test_a_row_that_is_refused_does_not_take_others_with_it(folder, double, monkeypatch):
    monkeypatch.setattr(Double, "rows_at_once", 64)

    alone = []

    def disturb(rollout):
        alone.extend([1] * (rollout.shape[0] == 1))
        if rollout.shape[0] > 1 or len(alone) == 3:
            raise InputError("this road is not for me")
        return rollout

    double.disturb = disturb
    found = confirm(folder, elsewhere())
    assert [one.failure for one in found.scenarios] == ["", "", "this road is not for me", ""]
    assert found.summary.confirmed == 3


def test_rows_are_the_most_critical_ones_and_earlier_ones_are_kept(folder, double):
    confirm(folder, elsewhere())
    found = confirm(folder, elsewhere(), rows=20)
    with Store.open(folder) as store:
        rows = store.read()
    best = np.flatnonzero(rows.critical)[np.argsort(rows.F[rows.critical, 0], kind="stable")]
    assert [one.evaluation for one in found.scenarios] == best[:20].tolist()
    kept = {one.evaluation: one.name for one in bg.Run(folder).exported()}
    assert [one.name for one in found.scenarios] == [kept.get(k) for k in best[:20]]
    new = len([k for k in best[:20] if k not in kept])
    assert (found.ran, double.ran) == (new, 4 + new)
    assert len(found.record.scenarios) == len({*best[:20], *kept})
    places = {k: place for place, k in enumerate(best.tolist())}
    order = [places[one.evaluation] for one in found.record.scenarios]
    assert order == sorted(order)
    every = confirm(folder, elsewhere(), rows=10_000)
    assert len(every.scenarios) == int(rows.critical.sum())


def test_again_forgets(folder, double):
    confirm(folder, elsewhere(), rows=6)
    double.disturb = shifted(60.0)
    assert confirm(folder, elsewhere()).summary.lost < 4  # those that are known are not run
    found = confirm(folder, elsewhere(), again=True)
    assert (found.summary.lost, len(found.record.scenarios)) == (4, 4)


def test_ctrl_c_keeps_what_is_done_and_the_rest_follows(folder, double):
    undisturbed = confirm(folder, elsewhere(), rows=9)
    (folder / "confirmation-double.json").unlink()
    double.ran = 0

    def disturb(rollout):
        if double.ran == 4:
            raise KeyboardInterrupt
        return rollout

    double.disturb = disturb
    seen = []
    with pytest.raises(Interrupted) as stop:
        confirm(folder, elsewhere(), rows=9, progress=lambda done, *_: seen.append(done))
    approve(str(stop.value), "scenarios", folder, "--simulator")
    assert (seen, len(record_of(folder)["scenarios"])) == ([1, 2, 3], 3)
    double.ran, double.disturb = 100, lambda rollout: rollout
    found = confirm(folder, elsewhere(), rows=9)
    assert (found.ran, double.ran) == (6, 106)
    assert found.record == undisturbed.record


def test_what_is_killed_keeps_what_it_had_written(folder, double, monkeypatch):
    """A process that ends without a word: nothing after the last whole file is there."""
    monkeypatch.setattr("bridgegen.jobs.search.confirm.SECONDS", 0.0)
    written = threading.Event()

    def disturb(rollout):
        if double.ran == 3:
            written.set()
            shutil.copy(folder / "confirmation-double.json", folder / "then.json")
        return rollout

    double.disturb = disturb
    confirm(folder, elsewhere())
    assert written.is_set()
    shutil.move(folder / "then.json", folder / "confirmation-double.json")
    double.ran = 0
    assert (confirm(folder, elsewhere()).ran, double.ran) == (2, 2)


def test_other_settings_are_not_mixed(folder, double):
    confirm(folder, elsewhere(noise=1))
    with refuses(InputError, "noise", "--again"):
        confirm(folder, elsewhere(noise=2))
    confirm(folder, elsewhere(noise=2), again=True)


def test_the_command_says_it_in_a_table_and_in_a_line(folder, double, cli, monkeypatch):
    monkeypatch.setenv("COLUMNS", "200")
    moves = shifted(60.0, after=40)
    double.disturb = lambda rollout: moves(rollout) if double.ran == 2 else rollout
    code, out, err = cli("confirm", folder, "--simulator", "double")
    assert (code, err.strip()) == (0, "")
    approve(out, "crossroads-s4", "route-follower")
    assert re.search(r"^0001 +critical ", out, re.M)
    assert re.search(r"^0002 +NOT .* → .* 2\.00 +bv *$", out, re.M)
    approve(out, "d_min", "0002", "95", "30")
    code, out, _ = cli("confirm", folder, "--simulator", "double", "--json")
    facts = json.loads(out)
    assert (code, facts["summary"]["confirmed"], facts["summary"]["lost"]) == (0, 3, 1)
    assert [one["confirmed"] for one in facts["scenarios"]] == [True, False, True, True]
    assert double.ran == 4  # nothing was missing the second time


def test_a_build_can_fail_for_it(folder, double, cli, tmp_path):
    moves = shifted(60.0)
    double.disturb = lambda rollout: moves(rollout) if double.ran == 2 else rollout
    words = ("confirm", folder, "--simulator", "double", "--junit", tmp_path / "j.xml")
    code, _, err = cli(*words, "--fail-if", "confirmed < 0.95")
    assert code == 3
    approve(err, "0.95", "0.75")
    text = (tmp_path / "j.xml").read_text("utf-8")
    assert text.count("<failure ") == 2  # the criterion, and the one to blame
    assert cli(*words, "--fail-if", "confirmed < 0.5")[0] == 0
    assert "<failure " not in (tmp_path / "j.xml").read_text("utf-8")


def test_ctrl_c_ends_with_the_status_for_it(folder, double, cli):
    def disturb(rollout):
        raise KeyboardInterrupt

    double.disturb = disturb
    code, out, err = cli("confirm", folder, "--simulator", "double")
    assert (code, out) == (130, "")
    approve(err, "scenarios")


def test_every_mistake_is_one_clear_error(folder, double, cli, tmp_path):
    def refused(*words):
        code, _, err = cli("confirm", *words)
        assert (code, "Traceback" in err) == (2, False), err
        return err

    there = ("--simulator", "double")
    assert "nowhere" in refused(tmp_path / "nowhere", *there)
    approve(refused(folder, "--simulator", "dubble"), "dubble")
    approve(refused(folder, "--simulator", "embedded"), "simulator")
    approve(refused(folder, *there, "--rows", 0), "rows")
    approve(refused(folder, *there, "--ego", "fsm"), "--ego", "route-follower")
    approve(refused(folder, *there, "--fail-if", "r_critic > 1"), "r_critic", "--fail-if")
    (folder / "confirmation-double.json").write_text("[]")
    approve(refused(folder, *there), "bridgegen")
    assert cli("confirm", folder, *there, "--again")[0] == 0
    shutil.rmtree(folder / "critical")
    none_exported = refused(folder, *there)
    assert f"no scenario is exported; 'bridgegen resume {folder}' finishes" in none_exported
    assert re.search(r"--rows N confirms the N most critical of its \d+ critical", none_exported)


@pytest.mark.parametrize("rows", [None, 5])
@pytest.mark.parametrize(
    ("budget", "what"),
    [(150, "search with a larger --budget, another --seed or another --algorithm"),
     (200, "'bridgegen resume {}' runs the other 50")],
)  # fmt: skip
def test_without_a_critical_evaluation_it_says_what_can_be_done(
    folder, double, monkeypatch, rows, budget, what
):
    shutil.rmtree(folder / "critical")
    read, given = Store.read, Settings.from_dict

    def calm(store):
        found = read(store)
        return replace(found, critical=np.zeros_like(found.critical))

    def larger(data, place):
        return replace(given(data, place), budget=budget)

    monkeypatch.setattr(Store, "read", calm)
    monkeypatch.setattr(Settings, "from_dict", larger)
    with pytest.raises(InputError) as refused:
        confirm(folder, elsewhere(), rows=rows)
    said = str(refused.value)
    approve(said.replace(str(folder), "{}"), "150", what)
    assert "--rows" not in said


def test_a_record_of_another_run_is_refused(folder, double):
    confirm(folder, elsewhere())
    path = folder / "confirmation-double.json"
    path.write_text(path.read_text("utf-8").replace('"row": "', '"row": "0'), "utf-8")
    with refuses(FileFormatError):
        confirm(folder, elsewhere())
    assert confirm(folder, elsewhere(), again=True).summary.confirmed == 4


def test_a_run_of_another_simulator_is_confirmed_in_ours(tmp_path, double):
    """Here is where it was searched: the other car 0.9 m ahead of where ours has it."""
    double.disturb = shifted(0.9)
    place = tmp_path / "run"
    bg.run_search(
        "crossroads-s1", algorithm="random", budget=30, seed=2, ego="route-follower", keep=2,
        causes=False, triage="none", simulator=elsewhere(), out=place,
    )  # fmt: skip
    with refuses(InputError):
        bg.confirm(place, "double")
    found = bg.confirm(place, "embedded")
    assert (found.record.reference, found.record.label) == ("double", "embedded")
    for one in found.scenarios:
        first = one.differences.partings[0]
        assert (first.entity, first.time) == ("bv", 0.0)
        assert first.gap == pytest.approx(0.9)


def test_harm_counts_by_the_thresholds_whatever_its_cause(tmp_path, double):
    place = tmp_path / "run"
    bg.run_search(
        "crossroads-s3", algorithm="random", budget=200, seed=2, ego="route-follower", keep=2,
        objective="paper", cause="planning", triage="none", out=place,
    )  # fmt: skip
    found = confirm(place, elsewhere())
    assert (found.summary.scenarios, found.summary.confirmed) == (2, 2)
    with Store.open(place) as store:
        assert Settings.from_dict(store.settings, place).cause == "planning"


def test_a_run_with_several_objectives_has_a_difference_for_each(tmp_path, double):
    place = tmp_path / "run"
    bg.run_search(
        "crossroads-s2", algorithm="random", objectives="many", budget=60, seed=2, keep=2,
        objective="paper", ego="route-follower", causes=False, triage="none", out=place,
    )  # fmt: skip
    found = confirm(place, elsewhere())
    assert found.record.objectives == ("d_min", "v_d")
    assert all(one.change.F == (0.0, 0.0) for one in found.scenarios)


def test_where_nothing_ran_nothing_passes(folder, double, cli):
    double.disturb = lambda rollout: replace(rollout, status=np.full(1, 1, np.int8))
    code, out, err = cli("confirm", folder, "--simulator", "double", "--fail-if", "confirmed < 0.5")
    assert code == 3
    approve(out, "scenarios", "infinite")
    approve(err, "scenarios", "0.5")


def test_a_report_that_is_there_is_written_again(finished, tmp_path, double):
    folder = shutil.copytree(finished, tmp_path / "s4")
    double.disturb = shifted(60.0)
    found = confirm(folder, elsewhere())
    assert found.files == (folder / "confirmation-double.json", folder / "report.html")
    text = (folder / "report.html").read_text("utf-8")
    assert json.dumps(found.scenarios[0].explanation)[1:-1] in text
    (folder / "confirmation-double.json").write_text("{}")  # and nobody takes it for what it is not
    with pytest.raises(FileFormatError, match="confirmation-double"):
        bg.resume(folder)


@pytest.fixture(scope="module")
def by_criteria(tmp_path_factory):
    place = tmp_path_factory.mktemp("runs") / "judged"
    bg.run_search(
        "cut-in", budget=120, keep=3, causes=False, algorithm="ga", out=place,
        criteria=["R-12: always(gap to bv > 2 m)", "R-14: n_collision == 0"], critical="criteria",
        objective={"criterion:R-12": None}, triage="short",
    )  # fmt: skip
    return place


def test_a_run_judged_by_criteria_is_confirmed_by_them(by_criteria, tmp_path, double, cli):
    folder = shutil.copytree(by_criteria, tmp_path / "judged")
    found = confirm(folder, elsewhere())
    assert (found.summary.confirmed, found.summary.lost) == (3, 0)
    for one in found.scenarios:
        assert one.here.margins == one.there.margins
        assert one.here.margins["R-12"].value < 0.0
    double.disturb = lambda rollout: replace(rollout, y=np.add(rollout.y, [[0.0], [30.0]]))
    found = confirm(folder, elsewhere(), again=True)
    assert (found.summary.confirmed, found.summary.lost) == (0, 3)
    for one in found.scenarios:
        margins = [side.margins["R-12"].value for side in (one.here, one.there)]
        assert margins[0] < 0.0 < margins[1]
        approve(one.explanation, "12")
        assert "threshold" not in one.explanation
    assert "R-12 is met there" in (folder / "report.html").read_text("utf-8")
    code, out, err = cli("confirm", folder, "--simulator", "double")
    assert code == 0, err
    assert "R-12 [m]" in out
