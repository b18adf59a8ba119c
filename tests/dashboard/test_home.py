"""A project as an app: what its home page shows, what is served, and what a click writes."""

import http.client
import json
import os
import re
import shutil
from hashlib import sha256
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.approval import approve, refuses

from bridgegen.base.errors import StorageError
from bridgegen.jobs.dashboard.home import Home
from bridgegen.jobs.suite.page import write_suite_page
from bridgegen.jobs.suite.suite import read_suite
from bridgegen.jobs.view.server import LOOPBACK, MAX_BODY, Server, answer
from bridgegen.pages.page import scripted
from bridgegen.results.failures import (
    FILE,
    ChangedError,
    Failure,
    read_failures,
    write_failures,
)

HOSTILE = '<img src=x onerror="window.hit=1">'


@pytest.fixture
def copy(project, tmp_path) -> Path:
    made = shutil.copytree(project, tmp_path / "project")
    write_suite_page(read_suite(made / "suites" / "change"), ())
    return made


@pytest.fixture
def home(copy) -> Home:
    return Home(copy)


def data_of(page: bytes) -> dict[str, Any]:
    """Return what a page holds for its script."""
    (text,) = re.findall(rb'<script type="application/json" id="data">(.*?)</script>', page, re.S)
    return json.loads(text)


def digests(folder: Path) -> dict[str, str]:
    """Return what each file of a folder holds, but for the logs that SQLite makes for a reader."""
    return {
        path.relative_to(folder).as_posix(): sha256(path.read_bytes()).hexdigest()
        for path in folder.rglob("*")
        if path.is_file() and not path.name.endswith(("-shm", "-wal"))
    }


def asked(home: Home, **changed: Any) -> dict[str, Any]:
    """Return what the page would send for the first failure mode."""
    modes = data_of(home.page())["edits"]["modes"]
    mode, shown = next((id, one) for id, one in modes.items() if not one["by"])
    was = [shown["status"], shown["comment"]]
    return {"mode": mode, "status": "known", "comment": "seen on A7", "was": was} | changed


class Tags(HTMLParser):
    def __init__(self, page: bytes) -> None:
        super().__init__()
        self.found: list[str] = []
        self.links: list[str] = []
        self.feed(page.decode())

    def handle_starttag(self, tag, attrs) -> None:
        self.found.append(tag)
        self.links += [value for name, value in attrs if name == "href"]


# ---- what is shown ----


def test_home_says_what_the_dashboard_says_and_leads_to_every_result(home):
    page = home.page()
    dashboard = answer(home, "/p/").body
    (verdict,) = re.findall(rb'<div class="banner.*?</div>', page, re.S)
    assert verdict in dashboard
    found = data_of(page)
    assert {run["path"] for run in found["runs"]} == {
        "runs/route-follower", "runs/reference", "damaged <b>"
    }  # fmt: skip
    links = Tags(page).links
    assert "p/" in links
    assert "p/suites/change/suite.html" in links
    for link in links:
        if link.startswith("p/"):
            assert answer(home, f"/{link.partition('#')[0]}").status in (200, 302), link


def test_every_id_that_its_script_asks_for_exists(home):
    for page, entry in ((home.page(), "runs.js"), (answer(home, "/p/").body, "status.js")):
        wanted = set(re.findall(r'\$\("([\w-]+)"\)', scripted(entry)[0]))
        assert wanted
        assert wanted <= set(re.findall(r'id="([\w-]+)"', page.decode()))


def test_the_logo_of_each_page_leads_home(home, copy):
    number = next(run["number"] for run in home.facts() if run["path"] == "runs/reference")
    report = (copy / "runs/reference/report.html").read_bytes()
    (copy / "own").mkdir()
    (copy / "own" / "a.html").write_bytes(report)  # a page whose run is not beside it
    for path, up in (
        ("/p/", "../"),
        ("/p/suites/change/suite.html", "../../../"),
        ("/p/own/a.html", "../../"),
        (f"/run/{number}/", "../../"),
        ("/pair?first=0&second=1", "./"),
    ):
        body = answer(home, path).body
        assert f'<a class="brand" href="{up}" target="_top">'.encode() in body, path
    assert b'class="brand" href' not in report


def test_a_run_s_report_is_the_one_that_grows_unless_it_cannot_be_made(home, copy):
    number = next(run["number"] for run in home.facts() if run["path"] == "runs/reference")
    found = answer(home, "/p/runs/reference/report.html")
    assert (found.status, found.headers["Location"]) == (302, f"../../../run/{number}/")
    (copy / "damaged <b>" / "report.html").write_bytes(
        (copy / "runs/reference/report.html").read_bytes()
    )
    found = answer(home, "/p/damaged%20%3Cb%3E/report.html")
    assert found.status == 200
    assert "sandbox" in found.headers["Content-Security-Policy"]


def test_a_folder_with_pages_alone_is_a_project_and_one_with_nothing_is_none(copy, tmp_path):
    alone = tmp_path / "alone"
    (alone / "x").mkdir(parents=True)
    with refuses(StorageError):
        Home(alone)
    shutil.copy(copy / "suites/change/suite.html", alone / "x")
    page = Home(alone).page()
    assert b"x/suite.html" in page
    assert b"Failing now" not in page


def test_results_are_read_again_only_if_their_files_change(home, copy, monkeypatch):
    home.page()
    monkeypatch.setattr("bridgegen.jobs.dashboard.home.read_project", None)
    home.page()
    write_failures(read_failures(copy), {})
    os.utime(copy / "runs/reference/triage.json", (1, 1))
    with pytest.raises(TypeError):
        home.page()


def test_hostile_names_titles_and_comments_are_text(copy):
    folder = copy / "runs" / HOSTILE.replace("/", "")
    (copy / "runs" / "reference").rename(folder)
    made = copy / "other" / "page.html"
    made.parent.mkdir()
    text = (copy / "suites/change/suite.html").read_text("utf-8")
    title = f"{HOSTILE}</script><script>window.hit=1</script>"
    escaped = title.replace("&", "&amp;").replace("<", "&lt;")
    text = re.sub(r'(<h1 id="title">).*?(</h1>)', lambda m: m[1] + escaped + m[2], text)
    made.write_text(text, "utf-8")
    home = Home(copy)
    wanted = asked(home, comment=title)
    assert home.decide(wanted)[0] == 200
    for page in (
        home.page(),
        answer(home, "/p/").body,
        answer(home, "/pair?first=0&second=1").body,
    ):
        tags = Tags(page)
        assert "img" not in tags.found
        assert page.count(b"</script>") == tags.found.count("script")
    assert data_of(home.page())["edits"]["modes"][wanted["mode"]]["comment"] == title


# ---- what is served from the disk ----


@pytest.mark.parametrize(
    "path",
    [
        "/p/../../etc/passwd", "/p/%2e%2e/secret.json", "/p//etc/passwd",
        "/p/runs/../../secret.json",
        "/p/.git/x.json", "/p/runs/reference/run.sqlite", "/p/link/secret.json", "/p/link.json",
        "/p/foreign.html", "/p/..%5csecret.json", "/p/a%00.json", "/p/suites", "/p/runs/",
    ],
)  # fmt: skip
def test_nothing_leads_out_of_the_project(copy, tmp_path, path):
    (tmp_path / "secret.json").write_text("{}")
    (copy / "link").symlink_to(tmp_path)
    (copy / "link.json").symlink_to(tmp_path / "secret.json")
    (copy / "foreign.html").write_text("<script>1</script>")
    (copy / ".git").mkdir()
    (copy / ".git" / "x.json").write_text("{}")
    assert answer(Home(copy), path).status == 404


def test_files_of_the_project_are_saved_and_have_no_origin(home, copy):
    found = answer(home, "/p/runs/route-follower/critical/0001.xosc")
    assert found.body == (copy / "runs/route-follower/critical/0001.xosc").read_bytes()
    assert found.headers["Content-Disposition"] == "attachment"
    for path in ("/p/runs/route-follower/critical/0001.xosc", "/p/suites/change/suite.html"):
        policy = answer(home, path).headers["Content-Security-Policy"]
        assert policy.startswith("sandbox allow-scripts")
        assert "allow-same-origin" not in policy
        assert "connect-src 'none'" in policy


def test_a_page_that_never_ends_is_read_in_no_time(copy):
    (copy / "other").mkdir()
    head = '<meta name="generator" content="BridgeGen risk">'
    text = head + '<div class="banner x" role="status"><p>' * 6000 + '<span class="brand">' * 90_000
    (copy / "other" / "long.html").write_text(text)
    home = Home(copy)
    assert answer(home, "/p/other/long.html").status == 200
    assert b"long.html" in home.page()


@pytest.fixture(scope="module")
def read_only(project) -> Home:
    return Home(project)


@given(st.text())
def test_no_path_breaks_it(read_only, path):
    assert answer(read_only, f"/p/{path}").status in (200, 302, 404, 500)


# ---- what a click writes ----


def test_a_status_and_a_comment_are_written_into_the_one_file_and_nowhere_else(home, copy):
    before = digests(copy)
    wanted = asked(home)
    assert home.decide(wanted) == (200, {})
    block = read_failures(copy).failures[wanted["mode"]]
    assert (block.status, block.comment) == ("known", "seen on A7")
    after = digests(copy)
    assert {name for name in after if before.get(name) != after[name]} == {FILE}
    assert data_of(home.page())["edits"]["modes"][wanted["mode"]]["status"] == "known"
    assert b"known" in answer(home, "/p/").body


def test_what_people_wrote_stays(home, copy):
    wanted = asked(home)
    assert home.decide(wanted)[0] == 200
    path = copy / FILE
    text = path.read_text().replace(
        "failures:\n", "# ours\nfailures:\n  fm-mine: # keep\n    comment: mine\n"
    )
    path.write_text(text)
    again = asked(home, mode=wanted["mode"], was=["known", "seen on A7"], status="accepted")
    assert home.decide(again)[0] == 200
    now = path.read_text()
    assert "# ours" in now
    assert "fm-mine: # keep" in now
    assert read_failures(copy).failures[wanted["mode"]].status == "accepted"


def test_of_two_editors_the_second_is_told_and_loses_nothing(home, copy):
    first, second = asked(home), asked(home, status="accepted", comment="no")
    assert home.decide(first)[0] == 200
    before = (copy / FILE).read_bytes()
    status, told = home.decide(second)
    assert status == 409
    approve(told["error"][0], "known", "seen on A7", "load the page again")
    assert (copy / FILE).read_bytes() == before


def test_another_mode_is_no_conflict(home, copy):
    modes = [id for id, one in data_of(home.page())["edits"]["modes"].items() if not one["by"]][:2]
    for mode in modes:
        assert home.decide(asked(home, mode=mode))[0] == 200
    assert {*modes} <= read_failures(copy).failures.keys()


def test_a_file_that_changed_after_it_was_read_is_not_overwritten(copy):
    file = read_failures(copy)
    write_failures(file, {"fm-a": Failure(comment="first")})
    with refuses(ChangedError, FILE):
        write_failures(file, {"fm-b": Failure(comment="second")})
    assert [*read_failures(copy).failures] == ["fm-a"]


def test_a_link_in_place_of_the_file_is_not_followed(copy, tmp_path):
    (tmp_path / "theirs.yaml").write_text("failures:\n")
    home = Home(copy)
    wanted = asked(home)
    (copy / FILE).symlink_to(tmp_path / "theirs.yaml")
    with refuses(StorageError, FILE):
        home.decide(wanted)
    assert (tmp_path / "theirs.yaml").read_text() == "failures:\n"


@pytest.mark.parametrize(
    ("changed", "status"),
    [
        ({"status": "false alarm"}, 400), ({"comment": "x" * 2001}, 400), ({"comment": 3}, 400),
        ({"mode": "../../x"}, 404), ({"more": 1}, 400), ({"was": ["new"]}, 400),
        ({"was": None}, 400),
    ],
)  # fmt: skip
def test_what_is_no_status_is_refused(home, copy, changed, status):
    code, told = home.decide(asked(home, **changed))
    assert code == status
    assert told["error"]
    assert not (copy / FILE).exists()


@pytest.fixture(scope="module")
def edited(project, tmp_path_factory) -> Home:
    return Home(shutil.copytree(project, tmp_path_factory.mktemp("edited") / "project"))


@given(st.text(max_size=300))
def test_any_comment_is_kept_as_one_line(edited, comment):
    wanted = asked(edited, comment=comment)
    assert edited.decide(wanted)[0] == 200
    kept = read_failures(edited.folder).failures[wanted["mode"]].comment
    assert "\n" not in kept
    assert kept == "" or kept.isprintable()


def test_a_mode_that_a_suite_keeps_is_decided_there(home, copy, monkeypatch):
    wanted = asked(home)
    found = home._dashboard()
    mode = next(one for one in found.modes if one.key.id == wanted["mode"])
    kept = copy / "suites" / FILE
    write_failures(read_failures(kept.parent), {mode.key.id: Failure(status="accepted")})
    by = data_of(home.page())["edits"]["modes"][wanted["mode"]]["by"]
    assert by.startswith(f"suites/{FILE}")
    before = digests(copy)
    status, told = home.decide(wanted)
    assert status == 403
    assert "suites/" in told["error"][0]
    assert digests(copy) == before


# ---- who may write ----


@pytest.fixture
def served(home):
    server = Server(home)
    server.start()
    yield server
    server.shutdown()
    server.server_close()


def post(server: Server, body: bytes, path: str = "/status", **headers: str | None) -> int:
    """Send as a page of ours would, with some headers changed or, if None, left out."""
    name = f"{LOOPBACK}:{server.server_address[1]}"
    sent: dict[str, str | None] = {
        "Host": name, "Origin": f"http://{name}", "Content-Type": "application/json",
        "Content-Length": str(len(body)), "Sec-Fetch-Site": "same-origin",
    }  # fmt: skip
    sent |= {key.replace("_", "-"): value for key, value in headers.items()}
    connection = http.client.HTTPConnection(LOOPBACK, server.server_address[1], timeout=20)
    connection.putrequest("POST", f"/{server.token}{path}", skip_host=True)
    for key, value in sent.items():
        if value is not None:
            connection.putheader(key, value)
    connection.endheaders(body)
    status = connection.getresponse().status
    connection.close()
    return status


def test_a_page_of_ours_writes(served, home, copy):
    assert post(served, json.dumps(asked(home)).encode()) == 200
    assert (copy / FILE).is_file()


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({"Host": "evil.example"}, 421),
        ({"Origin": "http://evil.example"}, 403),
        ({"Origin": "null"}, 403),
        ({"Origin": None}, 403),
        ({"Sec_Fetch_Site": "cross-site"}, 403),
        ({"Sec_Fetch_Site": "cross-site", "Sec_Fetch_Dest": "document"}, 403),
        ({"Content_Type": "text/plain"}, 415),
        ({"Content_Type": "application/x-www-form-urlencoded"}, 415),
        ({"Content_Length": None}, 411),
        ({"Content_Length": "-1"}, 411),
        ({"Content_Length": str(MAX_BODY + 1)}, 413),
        ({"Transfer_Encoding": "chunked"}, 411),
    ],
)
def test_nobody_else_does(served, home, copy, headers, status):
    if headers.get("Sec_Fetch_Dest"):
        headers = {**headers, "Origin": "http://evil.example"}
    assert post(served, json.dumps(asked(home)).encode(), **headers) == status
    assert not (copy / FILE).exists()


@pytest.mark.parametrize("body", [b"", b"[]", b"{", b"3", b"\xff", b"[" * 5000])
def test_what_is_no_object_is_refused(served, copy, body):
    assert post(served, body) == 400
    assert not (copy / FILE).exists()


def test_nothing_is_written_without_the_token_or_elsewhere(served, home, copy):
    body = json.dumps(asked(home)).encode()
    assert post(served, body, "/p/status") == 501
    connection = http.client.HTTPConnection(LOOPBACK, served.server_address[1], timeout=20)
    connection.request("POST", f"/{'x' * 32}/status", body, {"Content-Type": "application/json"})
    assert connection.getresponse().status == 403
    connection.close()
    assert not (copy / FILE).exists()


# ---- in a browser ----


@pytest.fixture
def opened(browser, served):
    page = browser.new_page(viewport={"width": 1440, "height": 900})
    page.complaints = []
    page.on("pageerror", lambda error: page.complaints.append(str(error)))
    page.on("console", lambda m: page.complaints.append(m.text) if m.type == "error" else None)
    page.goto(served.url)
    yield page
    page.close()


@pytest.mark.browser
def test_a_click_sets_the_status_on_home_and_dashboard(opened, served, copy):
    first = opened.locator("select[data-status]").first
    mode = first.get_attribute("data-status")
    with opened.expect_navigation():
        first.select_option("accepted")
    assert read_failures(copy).failures[mode].status == "accepted"
    assert opened.input_value(f"[data-status={mode}]") == "accepted"
    assert "accepted" in opened.inner_text(".banner")
    opened.click("nav >> text=Dashboard")
    opened.wait_for_url("**/p/")
    field = opened.locator(f"[data-status={mode}] + input")
    field.fill(HOSTILE)
    with opened.expect_navigation():
        field.press("Enter")
    assert read_failures(copy).failures[mode].comment == HOSTILE
    assert field.input_value() == HOSTILE
    assert opened.evaluate("window.hit") is None
    opened.click("a.brand")
    opened.wait_for_url(served.url)
    assert opened.complaints == []


@pytest.mark.browser
def test_a_report_that_the_project_serves_sets_the_status_of_its_modes(opened, copy):
    opened.click("text=runs/route-follower")
    first = opened.locator("#modes-list select[data-status]").first
    mode = first.get_attribute("data-status")
    with opened.expect_navigation():
        first.select_option("known")
    assert read_failures(copy).failures[mode].status == "known"
    opened.click("a.brand")
    assert opened.input_value(f"[data-status={mode}]") == "known"
    assert opened.complaints == []


@pytest.mark.browser
def test_a_second_editor_is_told_in_the_page(opened, home, copy):
    first = opened.locator("select[data-status]").first
    mode = first.get_attribute("data-status")
    write_failures(read_failures(copy), {mode: Failure(status="known", comment="theirs")})
    first.select_option("fixed")
    said = opened.locator("tr", has=opened.locator(f"[data-status={mode}]")).get_by_role("alert")
    said.get_by_text("load the page again").wait_for()
    assert read_failures(copy).failures[mode].status == "known"


@pytest.mark.browser
def test_nothing_is_cut_and_the_button_for_two_runs_is_in_sight(opened):
    assert opened.evaluate("document.documentElement.scrollWidth") == 1440
    box = opened.locator("#runs").locator("..")
    assert box.evaluate("one => one.scrollWidth <= one.clientWidth")
    opened.locator("#runs tbody tr").last.scroll_into_view_if_needed()
    for k in (0, 1):
        opened.locator("#runs tbody input").nth(k).check()
    bounds = opened.locator("#compare").bounding_box()
    assert 0 <= bounds["y"] < 900
    assert opened.locator("#compare").get_attribute("href")
    opened.set_viewport_size({"width": 390, "height": 844})
    assert opened.evaluate("document.documentElement.scrollWidth") == 390


@pytest.mark.browser
def test_a_stranger_s_page_can_neither_read_nor_write(browser, served, home, copy):
    """Its script runs without an origin, even if it knows the address with its token."""
    text = (copy / "suites/change/suite.html").read_text("utf-8")
    wanted = json.dumps(asked(home)).replace("<", "\\u003c")
    attack = f"""<script>
    const at = location.href.split("/p/")[0];
    const headers = {{ "Content-Type": "application/json" }};
    const body = JSON.stringify({wanted});
    const write = fetch(at + "/status", {{ method: "POST", headers, body }});
    const plain = fetch(at + "/status", {{ method: "POST", mode: "no-cors", body: "{{}}" }});
    window.tried = Promise.allSettled([write, plain, fetch(at + "/")])
      .then((all) => all.map((one) => one.status));
    </script>"""
    text = re.sub(r'<meta http-equiv="Content-Security-Policy"[^>]*>', "", text)
    (copy / "suites" / "evil.html").write_text(text.replace("</body>", f"{attack}</body>"), "utf-8")
    page = browser.new_page()
    page.goto(f"{served.url}p/suites/evil.html")
    assert page.evaluate("window.tried") == ["rejected"] * 3
    assert page.evaluate("self.origin") == "null"
    assert not (copy / FILE).exists()
    page.click("a.brand")
    page.wait_for_url(served.url)
    page.close()
