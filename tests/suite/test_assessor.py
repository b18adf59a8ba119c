"""An assessor's key: what it draws, whom it unmasks, and that nobody alters what it sealed."""

import json
import shlex
import sys
from collections import Counter
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.approval import approve, refuses
from tests.campaign.braking import write_pair

from bridgegen.base.errors import FileFormatError, InputError, Interrupted, StorageError
from bridgegen.cli import main
from bridgegen.engine.options import CommonOptions
from bridgegen.jobs.suite import sealed as module
from bridgegen.jobs.suite.drawn import BESIDE, BOUND, INSIDE, OUTSIDE, Draw, drawn
from bridgegen.jobs.suite.entries import find_entries
from bridgegen.jobs.suite.evaluate import Job, pipeline_of, rows_of_job
from bridgegen.jobs.suite.replay import replay
from bridgegen.jobs.suite.rows import rows_of
from bridgegen.jobs.suite.sealed import Sealed, commit, hash_of, verify
from bridgegen.jobs.suite.suite import FILE as RESULTS
from bridgegen.jobs.suite.suite import SEALED, evaluate_suite
from bridgegen.scenario.language.kinds import FLOAT
from bridgegen.scenario.language.reader import load
from bridgegen.simulation.choice import EMBEDDED

pytestmark = pytest.mark.thorough

PLANTED = Path(__file__).with_name("planted.py")
SEEDS, NUMBER = 20, 100
"""Of a key that draws 100, 80 lie in the ranges: a fifth of the 500 that are allowed."""

secrets = st.integers(0, 2**256 - 1).map("{:064x}".format)
scenarios = st.sampled_from(["cut-in", "jam-tail-in-fog", "ncap-aeb/ccrs", "r157/cut-in"])


def drawn_of(name, draw):
    """Return a scenario's space, what is drawn of it, and the kind of each row."""
    scenario = load(name)
    space = scenario.space()
    found = drawn(scenario, space, draw, scenario.fingerprint)
    return scenario, space, found.X, np.array(found.strata)


@given(name=scenarios, secret=secrets)
def test_what_is_drawn_lies_where_it_says(name, secret):
    scenario, space, X, strata = drawn_of(name, Draw(secret, 100))
    assert Counter(strata.tolist()) == {INSIDE: 40, BOUND: 20, BESIDE: 20}
    assert not space.violations(X)
    U = space.encode(X[strata == BOUND])
    widths = [len({*column}) > 1 for column in space.encode(X[strata == INSIDE]).T]
    assert all(widths)  # every parameter varies
    at_end = np.isclose(U, 0.0, atol=1e-9) | np.isclose(U, 1.0, atol=1e-9)
    for each in space.variables:  # of a prior, the end of a range is a part of the cube, too
        ends, x = space.parameters[each], X[strata == BOUND, space.index(each)]
        at_end |= (np.isclose(x, ends.low) | np.isclose(x, ends.high))[:, np.newaxis]
    apart = [bool(level) for level in space.levels]  # whole numbers: an end is a part of the cube
    assert (at_end.any(axis=1) | any(apart)).all()
    published = rows_of(scenario, space, 100, 0).X
    moved = [space.index(name) for name in space.variables if space.parameters[name].kind == FLOAT]
    for row in X[strata == BESIDE]:
        steps = np.abs(published[:, moved] - row[moved])
        nearest = steps[steps.max(axis=1).argmin()]
        assert (nearest > 0.0).all()
        assert (nearest <= 0.5).all()


@given(name=scenarios, secret=secrets)
def test_outside_one_parameter_is_beyond_its_range_and_rules_are_kept(name, secret):
    _, space, X, strata = drawn_of(name, Draw(secret, 100, outside=True))
    assert strata.tolist() == [OUTSIDE] * 20
    for row in X:
        values = dict(zip(space.names, row, strict=True))
        beyond = [
            (parameter, max(parameter.low - values[name], values[name] - parameter.high))
            for name, parameter in space.parameters.items()
            if not parameter.low <= values[name] <= parameter.high
        ]
        ((parameter, by),) = beyond
        assert by <= 0.02 * (parameter.high - parameter.low) + 1e-9
        assert parameter.low < 0.0 or values[parameter.name] >= 0.0
        broken = space.violations(row[np.newaxis])  # its own range at most, and no other rule
        assert {one.parameter for one in broken} <= {parameter.name}
        assert len(broken) <= 1


def test_a_draw_depends_on_the_secret_and_the_scenario_alone():
    def rows(secret, digest="d"):
        scenario = load("cut-in")
        return drawn(scenario, scenario.space(), Draw(secret, 50), digest).X.tobytes()

    assert rows("a") == rows("a")
    assert len({rows("a"), rows("b"), rows("a", "other")}) == 3


def test_a_set_of_numbers_stands_for_the_range_that_it_spans(folder):
    (entry,) = find_entries([folder / "varied_distribution.xosc"])
    job = Job(entry, "reference", CommonOptions(), EMBEDDED, 0, 0, draw=Draw("a", 50))
    pipeline = pipeline_of(job)
    X, names = rows_of_job(job, pipeline), pipeline.space.names
    speed, gap = X[:, names.index("EgoSpeed")], X[:, names.index("Gap")]
    assert speed.min() >= 8.0
    assert speed.max() <= 14.0
    assert len({*speed} - {8.0, 10.0, 14.0}) > 20  # published are these three
    assert (gap >= 2.0 * speed - 1e-2).all()  # a constraint of the file


def test_where_nothing_varies_nothing_is_drawn(tmp_path):
    scenario, _ = write_pair(tmp_path)
    (entry,) = find_entries([scenario])
    job = Job(entry, "reference", CommonOptions(), EMBEDDED, 0, 0, draw=Draw("a", 50))
    with refuses(InputError, "varies"):
        rows_of_job(job, pipeline_of(job))


@pytest.mark.parametrize("name", ["careful", "knows_the_grid", "fails_beside_it"])
def test_planted_drivers_are_unmasked_with_every_key(name):
    (entry,) = find_entries(["cut-in"])
    options = CommonOptions(ideal=("perception",))  # it measures the gap to the centimetre
    job = Job(entry, f"{PLANTED}:{name}", options, EMBEDDED, 100, 0)
    pipeline = pipeline_of(job)
    published = pipeline.evaluate(rows_of_job(job, pipeline))
    assert not published.critical.any()  # perfect on all 101 that anyone knows
    assert not published.status.any()
    draws = [Draw(sha256(str(seed).encode()).hexdigest(), NUMBER) for seed in range(SEEDS)]
    found = [drawn(pipeline.scenario, pipeline.space, draw, entry.digest).X for draw in draws]
    critical = pipeline.evaluate(np.concatenate(found)).critical
    failed = [part.sum() for part in np.split(critical, SEEDS)]
    unmasked = sum(count > 0 for count in failed)
    assert unmasked == (0 if name == "careful" else SEEDS), failed


# --- The whole way: commit, run, seal, verify, re-test ---


@pytest.fixture
def home(tmp_path, monkeypatch):
    """A folder with a key whose secret is the same each time."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(module.secrets, "token_hex", lambda n: "5a" * n)
    commit(Path("a.key"), ["cut-in"], 20)
    return tmp_path


def call(monkeypatch, text):
    monkeypatch.setattr(sys, "argv", shlex.split(f"bridgegen {text}"))
    with pytest.raises(SystemExit) as end:
        main()
    return end.value.code or 0


def assess(key="a.key", out="out", **options):
    return evaluate_suite("cut-in", egos=["route-follower"], assessor=Path(key), out=out, **options)


def resealed(path, change):
    """Alter a sealed file, and seal it again, as a forger would."""
    data = json.loads(path.read_text())
    change(data)
    data["seal"] = hash_of(Sealed.model_validate(data), "seal")
    forged = path.with_name("forged.json")
    forged.write_text(json.dumps(data))
    return forged


def test_the_whole_way_on_the_command_line(home, monkeypatch, capsys):
    assert call(monkeypatch, "suite commit cut-in --key b.key --number 20") == 0
    text = capsys.readouterr().out
    key = json.loads(Path("b.key").read_text())
    assert key["commitment"] in text
    assert key["secret"] not in text  # it is published
    assert Path("b.key").stat().st_mode & 0o077 == 0
    words = "suite cut-in --ego route-follower --assessor b.key --out suites/one --workers 1"
    assert call(monkeypatch, words) == 3
    text = capsys.readouterr().out
    approve(text, "Drawn by", "Not counted", "Worst")
    page = Path("suites/one/suite.html").read_text()
    assert "beside published " in page
    sealed = json.loads(Path("suites/one", SEALED).read_text())
    assert sealed["key"]["secret"] == key["secret"]  # revealed
    (result,), (outside,) = sealed["results"], sealed["outside"]
    assert [len(result["rows"]), len(outside["rows"])] == [16, 4]
    critical = [i for i, row in enumerate(result["rows"], 1) if row["critical"]]
    assert sorted(one["number"] for one in sealed["failures"]) == critical
    assert {one["cause"] for one in sealed["failures"]} == {"planning"}
    published = f"--published {key['commitment']} --published {sealed['seal']}"
    words = f"suite verify suites/one/sealed.json cut-in {published} --ego route-follower"
    assert call(monkeypatch, words) == 0
    approve(capsys.readouterr().out, "published", "variations", "run again")
    again = replay(Path("suites/one"), "cut-in", critical[0])  # as in any suite
    assert again.is_same
    # A re-test is judged as a suite is.
    assert call(monkeypatch, f"{words}+stop-in-lane") == 3
    assert "re-test" in capsys.readouterr().out


def test_a_suite_without_a_key_records_what_it_did_before(home):
    suite = evaluate_suite("cut-in", egos=["route-follower"], samples=1, out="plain")
    header = json.loads(Path("plain", RESULTS).read_text().splitlines()[0])
    assert not {"secret", "drawn"} & {*header["settings"]}
    assert suite.sealed is None


def test_a_key_serves_once(home):
    assess()
    for out in ("out", "elsewhere/other", None):
        with refuses(InputError, "used before"):
            assess(out=out)
    Path("copy.key").write_bytes(Path("a.key").read_bytes())
    with refuses(InputError, "used before"):
        assess("copy.key")
    with refuses(StorageError, "a.key"):  # nor is it written over
        commit(Path("a.key"), ["cut-in"], 20)


def test_a_run_that_was_stopped_is_resumed_with_its_driver_alone(home, monkeypatch):
    def stop(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr("bridgegen.jobs.suite.suite.evaluate", stop)
        with pytest.raises(Interrupted) as stopped:
            assess(workers=1)
    assert "--assessor" in str(stopped.value)
    with refuses(InputError, "used before"):
        evaluate_suite("cut-in", egos=["reference"], assessor=Path("a.key"))
    assert assess(workers=1).sealed is not None


def test_what_is_wrong_with_a_key_is_one_error(home):
    data = json.loads(Path("a.key").read_text())

    def with_key(**changes):
        Path("b.key").write_text(json.dumps(data | changes))
        return assess("b.key")

    with refuses(InputError, "published hash"):
        with_key(secret="6b" * 32)
    with refuses(FileFormatError, "secret"):
        with_key(secret="short")
    Path("b.key").write_text("not a key")
    with refuses(FileFormatError, "b.key"):
        assess("b.key")
    with refuses(InputError, "nowhere.key"):
        assess("nowhere.key")
    with refuses(InputError, "lead-brakes"):
        evaluate_suite(["cut-in", "lead-brakes"], assessor=Path("a.key"))
    with refuses(InputError, "--samples"):
        assess(samples=5)
    with refuses(InputError, "critical"):
        assess(critical="thresholds")
    with refuses(InputError, "criteria"):
        assess(criteria=[{"id": "R-1", "formula": "always(gap to bv > 2 m)"}])
    with refuses(InputError, "--number"):
        commit(Path("c.key"), ["cut-in"], 3)
    with pytest.raises(InputError):  # and none of them spends the key
        evaluate_suite("cut-in", egos=["nobody"], assessor=Path("a.key"))
    assert not Path(module.REGISTER).exists()


def test_a_sealed_file_that_was_altered_is_refused(home):
    suite = assess()
    path, none = suite.folder / SEALED, ()
    text = path.read_text()
    altered = path.with_name("altered.json")
    altered.write_text(text.replace('"critical":true', '"critical":false', 1))
    with refuses(InputError, "altered"):
        verify(altered, ["cut-in"], none, none)

    def pass_one(data):
        row = next(row for row in data["results"][0]["rows"] if row["critical"])
        row["critical"] = False

    forged = resealed(path, pass_one)
    verify(forged, ["cut-in"], none, none)  # sealed again: then only these two tell
    with refuses(InputError, "published"):
        verify(forged, ["cut-in"], [suite.sealed.seal], none)
    with refuses(InputError, "altered"):
        verify(forged, ["cut-in"], none, ["route-follower"])

    def move_one(data):
        data["results"][0]["rows"][0]["x"][1] += 1e-9

    with refuses(InputError, "altered"):
        verify(resealed(path, move_one), ["cut-in"], none, none)
    with refuses(InputError, "missing"):
        verify(resealed(path, lambda data: data["outside"].clear()), ["cut-in"], none, none)
    with refuses(InputError, "cut-out"):
        verify(path, ["cut-out"], none, none)

    def other_secret(data):
        data["key"]["secret"] = "6b" * 32

    with refuses(InputError, "published hash"):
        verify(resealed(path, other_secret), ["cut-in"], none, none)
    for hostile in ("{", '{"sealed": 1}', "[" * 5000):
        altered.write_text(hostile)
        with pytest.raises(FileFormatError):
            verify(altered, ["cut-in"], none, none)


def test_a_mended_driver_is_tested_again(home):
    old = f"{PLANTED}:knows_the_grid"
    suite = evaluate_suite(
        "cut-in", egos=[old], ideal=["perception"], assessor=Path("a.key"), workers=1
    )
    failures = suite.sealed.failures
    assert failures
    lines, fails = verify(suite.folder / SEALED, ["cut-in"], (), [f"{PLANTED}:careful"])
    assert not fails
    (head,) = [line for line in lines if line.startswith("re-test")]
    approve(head, "fixes")
    assert sum(", fixed: " in line and failures[0].title in line for line in lines)
    assert sum(", fixed: " in line for line in lines) == len(failures)
