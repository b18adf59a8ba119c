"""What is served of a run is the run, also while it grows; and the command that serves it."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import urllib.request
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.approval import approve, refuses

from bridgegen.base.errors import InputError, StorageError
from bridgegen.cli import main
from bridgegen.jobs.search import Run
from bridgegen.jobs.search.report import rewrite_report
from bridgegen.jobs.view.run_view import RunView
from bridgegen.pages.payload import ROWS
from bridgegen.results.store import Store


@pytest.fixture(scope="module")
def view(finished):
    return RunView(finished)


def data_of(page: bytes) -> dict:
    (text,) = re.findall(rb'<script type="application/json" id="data">(.*?)</script>', page, re.S)
    return json.loads(text)


def test_the_page_is_the_report_and_may_ask_its_server(view, finished):
    page = view.page()
    told, written = data_of(page), data_of((finished / "report.html").read_bytes())
    assert (told.pop("live"), written.pop("live")) == (True, False)
    # What the server gives when it is asked, the report holds itself.
    held = written.pop("packed")["evaluations"] + [one["evaluation"] for one in written["kept"]]
    assert sorted(held) == written["rows"]["evaluation"]  # of so short a run all
    minimal = {f"critical/{path.name}" for path in (finished / "critical").glob("minimal-*")}
    of_kept = {f for one in written["kept"] for f in one["files"]}
    assert set(written.pop("files")["names"]) == of_kept | minimal
    assert all(view.file(name) for name in minimal)
    assert (told.pop("packed")["evaluations"], told.pop("files")["names"]) == ([], [])
    assert told == written
    assert b"connect-src 'self'" in page
    assert b"connect-src 'none'" in (finished / "report.html").read_bytes()


def test_the_digest_of_the_results_is_theirs(view, growing):
    told = dict(data_of(view.page())["summary"]["provenance"])["Results, SHA-256"].split()[0]
    growing.grow(120)
    with Store.open(growing.folder) as store:
        rows = store.read()
    assert rows.digest() == told  # recorded in another batch, at another time
    X = rows.X.copy()
    X[7, 1] = np.nextafter(X[7, 1], 1.0)
    assert replace(rows, X=X).digest() != told


def test_any_evaluation_has_its_motion(view, finished):
    kept = data_of(view.page())["kept"]
    with Store.open(finished) as store:
        rows = store.read()
    others = [i for i in range(len(rows)) if i not in {one["evaluation"] for one in kept}]
    told = view.motion(others[7])
    assert told["playback"]["evaluation"] == others[7]
    assert told["playback"]["files"] == []
    shown = told["playback"]["metrics"]["d_min"]
    assert shown == rows.metrics[others[7], view._pipeline.metrics.index("d_min")]
    json.dumps(told, allow_nan=False)
    # Of one that was handed over it is what the page holds, to the last digit.
    again = view.motion(kept[0]["evaluation"])["playback"]
    assert {k: v for k, v in again.items() if k not in ("rank", "road")} == {
        k: v for k, v in kept[0].items() if k not in ("rank", "road")
    }


def test_what_is_no_evaluation_has_none(view):
    view.page()  # which reads the rows; no other test need have been here before
    assert view.motion(len(view._rows)) is None
    with refuses(InputError, "120", "121"):
        view.fragment(121)
    with pytest.raises(InputError, match="got 0"):
        view.fragment(0)
    assert view.fragment(120) == "#evaluation-120"


def test_only_files_that_were_handed_over_are_given(view, finished):
    assert view.file("critical/0001.xosc") == (finished / "critical/0001.xosc").read_bytes()
    for name in ("run.sqlite", "report.html", "critical", "critical/../run.sqlite", "", "/etc"):
        assert view.file(name) is None
    assert view.file("regions.json") is None  # there is none
    (finished / "critical" / "notes.txt").write_text("mine")
    assert view.file("critical/notes.txt") is None


def test_news_are_the_rows_that_the_page_lacks(growing):
    growing.grow(70)
    view = RunView(growing.folder)
    assert data_of(view.page())["rows"]["n"] == 70
    assert view.news(70) == {"finished": False, "kept": 0, "elsewhere": 0}
    growing.grow(30)
    told, rows = view.news(70), growing.rows
    assert told["rows"]["evaluation"] == list(range(70, 100))
    assert (told["rows"]["n"], told["whole"], told["finished"]) == (100, False, False)
    assert told["rows"]["critical"] == rows.critical[70:100].astype(int).tolist()
    assert told["rows"]["cause"] is None or len(told["rows"]["cause"]) == 30
    assert sum(told["sections"]["causes"]["counts"]) == 100
    ranks = np.array(told["rows"]["rank"])
    assert len(ranks) == 100
    order = np.flatnonzero(ranks)[np.argsort(ranks[ranks > 0])]
    collisions, severity = (
        rows.metrics[:100, view._pipeline.metrics.index(name)]
        for name in ("n_collision", "severity")
    )
    best_first = np.lexsort((rows.F[:100, 0], -severity, collisions <= 0))
    assert order.tolist() == [i for i in best_first if rows.critical[i]]
    x = next(one for one in told["rows"]["columns"] if one["name"] == "ego_speed")["values"]
    column = view._pipeline.space.names.index("ego_speed")
    assert x == pytest.approx(rows.X[70:100, column], rel=1e-4)
    json.dumps(told, allow_nan=False)
    growing.grow(20)
    growing.end()
    assert view.news(120) == {"finished": True, "kept": 2, "elsewhere": 0}
    assert view.motion(119)["playback"]["evaluation"] == 119


def test_a_run_with_no_row_yet_can_be_looked_at(growing):
    view = RunView(growing.folder)
    assert data_of(view.page())["rows"]["n"] == 0
    growing.grow(5)
    assert len(view.news(0)["rows"]["evaluation"]) == 5


def test_a_long_run_comes_thinned_as_a_whole(growing, monkeypatch):
    monkeypatch.setattr("bridgegen.pages.payload.ROWS", 50)
    assert ROWS == 20_000
    growing.grow(120)
    told = RunView(growing.folder).news(100)
    assert told["whole"]
    assert 45 <= len(told["rows"]["evaluation"]) <= 50


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["{nowhere}"], "there is no such folder"),
        (["{run}", "--port", "70000"], "0 <= port <= 65535 must hold, got 70000"),
        (["{run}", "--evaluation", "500"], "1 <= evaluation <= 120 must hold"),
        (["{run}", "--ego", "mine.py:Mine"], "ego"),
    ],
)
def test_every_mistake_is_one_clear_error(finished, tmp_path, monkeypatch, capsys, words, message):
    words = [word.format(run=finished, nowhere=tmp_path / "nowhere") for word in words]
    monkeypatch.setattr(sys, "argv", ["bridgegen", "open", "--no-browser", *words])
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 2
    error = capsys.readouterr().err
    assert message in error
    assert "Traceback" not in error


def test_what_was_handed_over_must_be_readable(growing):
    growing.grow(5)
    (growing.folder / "critical").mkdir()
    (growing.folder / "critical" / "0001.json").write_text('{"evaluation": "one"}')
    with refuses(StorageError, "0001.json"):
        RunView(growing.folder).page()


def test_the_command_serves_until_ctrl_c(finished):
    code = "import sys; from bridgegen.cli import main; sys.exit(main())"
    command = [sys.executable, "-c", code, "open", str(finished), "--no-browser"]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    server = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment
    )
    try:
        url = server.stdout.readline().split()[0]
        assert re.fullmatch(r"http://127\.0\.0\.1:\d+/[-\w]{32,}/", url)
        with urllib.request.urlopen(f"{url}news?after=120", timeout=60) as reply:
            assert json.load(reply) == {"finished": True, "kept": 2, "elsewhere": 0}
        server.send_signal(signal.SIGINT)
        out, error = server.communicate(timeout=60)
    finally:
        server.kill()
    assert (server.returncode, error) == (0, "")
    approve(out.strip(), "longer")


def test_the_browser_is_opened_at_the_evaluation(finished, monkeypatch, capsys):
    opened = []

    def interrupted(url):
        page = Path(url.removeprefix("file://"))
        opened.append((url, page.read_text("utf-8"), page.parent.stat().st_mode))
        raise KeyboardInterrupt

    words = ["bridgegen", "open", str(finished), "--evaluation", "17"]
    monkeypatch.setattr(sys, "argv", words)
    monkeypatch.setattr("webbrowser.open", interrupted)
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 0
    ((page, text, mode),) = opened
    (there,) = set(re.findall(r"http://127\.0\.0\.1:\d+/[-\w]{32,}/#evaluation-17", text))
    out = capsys.readouterr().out
    assert there in out
    approve(out, "longer")
    # Every user of this machine can read a browser's command line, but not this page.
    assert page.startswith("file://")
    assert mode & 0o077 == 0
    assert not Path(page.removeprefix("file://")).exists()


def test_links_that_lead_out_of_the_run_are_not_followed(finished, tmp_path):
    """A stranger's run must not serve this machine's files, nor pack them into a report."""
    folder, secret = tmp_path / "theirs", tmp_path / "secret"
    shutil.copytree(finished, folder)
    secret.write_text("mine")
    for name in ("critical/0001.xosc", "critical/minimal-01.xosc", "regions.json"):
        (folder / name).unlink(missing_ok=True)
        (folder / name).symlink_to(secret)
        with refuses(StorageError, name):
            RunView(folder).file(name)
    view, refused = RunView(folder), r"0001\.xosc: is a link to a place outside"
    with pytest.raises(StorageError, match=refused):
        rewrite_report(Run(folder), view._pipeline, print)
    (folder / "critical/0002.xosc").unlink()
    (folder / "critical/0002.xosc").symlink_to("0001.owl")  # inside: their own files
    assert RunView(folder).file("critical/0002.xosc") == RunView(folder).file("critical/0001.owl")
