"""One crash as one page: what it holds and leaves out; its files do the same again."""

import json
import re
import shutil
from typing import Any

import pytest
from tests.approval import approve, refuses

import bridgegen as bg
from bridgegen.base.errors import InputError, StorageError, UnknownNameError
from bridgegen.engine.simulate import simulate_file
from bridgegen.jobs.search import report
from bridgegen.jobs.search.report import MOST_SENT, write_finding_page
from bridgegen.jobs.view.run_view import RunView
from bridgegen.jobs.view.server import Server, answer


def data_of(page: bytes) -> dict[str, Any]:
    (text,) = re.findall(rb'<script type="application/json" id="data">(.*?)</script>', page, re.S)
    return json.loads(text)


@pytest.fixture(scope="module")
def sent(finished, tmp_path_factory):
    return write_finding_page(finished, "0002", tmp_path_factory.mktemp("sent") / "crash.html")


def test_it_holds_one_scenario_with_its_row_motion_and_files(sent, finished):
    assert sent.stat().st_size <= MOST_SENT
    found, whole = data_of(sent.read_bytes()), data_of((finished / "report.html").read_bytes())
    kept = next(one for one in whole["kept"] if one["name"] == "0002")
    (only,) = found["kept"]
    assert {**only, "road": 0, "picture": 0} == {**kept, "road": 0, "picture": 0}
    assert found["rows"]["evaluation"] == [kept["evaluation"]]
    assert found["packed"]["evaluations"] == []
    assert sorted(found["files"]["names"]) == [
        f"critical/0002.{kind}" for kind in ("json", "owl", "xodr", "xosc")
    ]
    # The figures are those of the whole run.
    assert found["summary"]["table"] == whole["summary"]["table"]


def test_its_head_says_what_happened_and_how_to_see_it_again(sent):
    (text,) = re.findall(r'<div class="banner fails".*?</div>', sent.read_text("utf-8"), re.S)
    said = re.sub(r"<[^>]*>", " ", text)
    approve(" ".join(said.split()))


def test_the_command_line_writes_it_here_by_name(finished, cli, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, out, _ = cli("export", str(finished), "--flavour", "page")
    assert (code, out.strip()) == (0, "s4-0001.html")
    assert [one["name"] for one in data_of((tmp_path / "s4-0001.html").read_bytes())["kept"]] == [
        "0001"
    ]


def test_what_cannot_be_sent_is_one_clear_error(finished, cli, tmp_path, monkeypatch):
    with refuses(UnknownNameError, "0099", "0001"):
        write_finding_page(finished, "0099", tmp_path / "a.html")
    with refuses(InputError, ".html"):
        write_finding_page(finished, "0001", tmp_path / "a.txt")
    (tmp_path / "other.html").write_text("theirs")
    with refuses(StorageError, "other.html"):
        write_finding_page(finished, "0001", tmp_path / "other.html")
    code, _, said = cli(
        "export", str(finished), "--flavour", "page", "--scenario", "0001", "--scenario", "0002"
    )
    assert code != 0
    approve(said, "one --scenario")
    monkeypatch.setattr(report, "MOST_SENT", 100_000)
    with refuses(InputError, "0001", "100,000", "export"):
        write_finding_page(finished, "0001", tmp_path / "a.html")
    assert [path.name for path in tmp_path.iterdir()] == ["other.html"]


def test_a_run_without_a_crash_has_none_to_send(finished, tmp_path):
    run = shutil.copytree(finished, tmp_path / "run")
    shutil.rmtree(run / "critical")
    for name in (None, "0001"):
        with refuses(InputError, "exported"):
            write_finding_page(run, name, tmp_path / "a.html")


def test_files_that_find_no_room_are_not_left_out_silently(finished, tmp_path):
    """A town's map, say: a link that leads beside the page would lead nowhere."""
    run = shutil.copytree(finished, tmp_path / "run")
    road = run / "critical" / "0001.xodr"
    noise = "\n".join(
        f"<!-- {k * 7919 % 1000003:x} {k * k * 104729 % 999983:x} -->" for k in range(60_000)
    )
    road.write_text(f"{road.read_text('utf-8')}{noise}", "utf-8")
    with refuses(InputError, "0001.xodr"):
        write_finding_page(run, "0001", tmp_path / "a.html")


def test_a_server_makes_it_without_writing(finished):
    view = RunView(finished)
    found = answer(view, "/send/0001.html")
    assert found.status == 200
    assert [one["name"] for one in data_of(found.body)["kept"]] == ["0001"]
    assert found.headers["Content-Security-Policy"].startswith("sandbox")
    for name in ("9999", "../0001", "minimal-01", ""):
        assert answer(view, f"/send/{name}.html").status == 404


@pytest.mark.browser
def test_its_files_are_saved_from_it_and_do_the_same_again(browser, sent, finished, tmp_path):
    page = browser.new_page(viewport={"width": 1440, "height": 900})
    complaints: list[str] = []
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.on("console", lambda m: complaints.append(m.text) if m.type == "error" else None)
    page.goto(sent.as_uri())
    page.wait_for_function("window.bridgegen?.state()?.scenario === '0002'")
    seen = page.locator("main > section:visible").evaluate_all("all => all.map((one) => one.id)")
    assert seen == ["scenarios", "summary", "made-of", "provenance"]
    assert page.inner_text("#summary-title") == "The search that found it"
    assert page.locator(".send").count() == 0
    for kind in ("xosc", "xodr"):
        with page.expect_download() as download:
            page.click(f".files a:has-text('.{kind}')")
        download.value.save_as(tmp_path / f"0002.{kind}")
        own = finished / "critical" / f"0002.{kind}"
        assert (tmp_path / f"0002.{kind}").read_bytes() == own.read_bytes()
    made, run = simulate_file(tmp_path / "0002.xosc"), bg.Run(finished)
    evaluation = data_of(sent.read_bytes())["kept"][0]["evaluation"]
    column = run.metrics.index("d_min")
    assert made.metrics["d_min"] == run.rows().metrics[evaluation, column]
    page.set_viewport_size({"width": 390, "height": 844})
    assert page.evaluate("document.documentElement.scrollWidth") == 390
    assert complaints == []
    page.close()


@pytest.mark.browser
def test_a_served_report_saves_it_and_one_on_disk_says_how(browser, finished, tmp_path):
    server = Server(RunView(finished))
    server.start()
    page = browser.new_page()
    page.goto(server.url)
    with page.expect_download() as download:
        page.click("text=Send this crash")
    assert re.fullmatch(r"crossroads-s4-000\d\.html", download.value.suggested_filename)
    download.value.save_as(tmp_path / "crash.html")
    assert data_of((tmp_path / "crash.html").read_bytes())["alone"]
    server.shutdown()
    server.server_close()
    page.goto((finished / "report.html").as_uri())
    page.evaluate("navigator.clipboard.writeText = async (text) => { window.copied = text; }")
    page.click("text=Send this crash")
    assert re.fullmatch(
        rf"bridgegen export {re.escape(str(finished))} --flavour page --scenario 000\d",
        page.evaluate("window.copied"),
    )
    page.close()
