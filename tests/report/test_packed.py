"""What the page holds deflated: motions and files, as many as there is room for, and read again."""

import json
import zlib
from base64 import b64decode
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridgegen.pages import packed
from bridgegen.pages import payload as payloads
from bridgegen.pages.data import Column, Evaluations
from bridgegen.pages.page import report_page, write_report
from bridgegen.pages.payload import payload
from bridgegen.pages.playback_payload import playback_payload, road_payload

LIMIT = 6_000_000


def chunks(told):
    return [json.loads(zlib.decompress(b64decode(text))) for text in told["texts"]]


@pytest.fixture(scope="module")
def more(report):
    """The report with two of its kept scenarios not handed over."""
    last = [
        replace(p, name=f"evaluation {p.evaluation + 1}", rank=1, files=()) for p in report.kept[2:]
    ]
    return replace(report, kept=report.kept[:2], more=tuple(last))


def test_motions_are_as_in_the_page_s_own_data(more):
    told = payload(more)["packed"]
    (chunk,) = chunks(told)
    assert told["evaluations"] == [p.evaluation for p in more.more]
    want = [playback_payload(p, 0, None) for p in more.more]  # on the road that the page has
    for one in want:
        del one["parameters"], one["metrics"]  # of its row, which the page has
    assert chunk == {"playbacks": json.loads(json.dumps(want)), "roads": []}


def test_a_road_that_the_page_has_not_got_comes_once_a_chunk(more):
    road = more.kept[0].lanes
    moved = tuple(replace(one, points=one.points + 1.0) for one in road)
    some = [replace(more.more[0], lanes=lanes) for lanes in (moved, road, moved)]
    told = packed.packed_motions(some, {packed.road_key(more.kept[0]): 0}, 10**6, of_rows=True)
    (chunk,) = chunks(told)
    assert [one["road"] for one in chunk["playbacks"]] == [-1, 0, -1]
    assert chunk["roads"] == [road_payload(some[0])]


def test_there_is_room_for_the_first_motions_only(more):
    some = [more.more[0]] * 100
    whole = packed.packed_motions(some, {}, 10**6, of_rows=True)
    assert [len(chunk["playbacks"]) for chunk in chunks(whole)] == [40, 40, 20]
    told = packed.packed_motions(some, {}, len(whole["texts"][0]) + 10, of_rows=True)
    assert len(told["evaluations"]) == 40
    assert len(told["texts"]) == 1


def files_of(told):
    """Return the files again, from their lines."""
    lines = zlib.decompress(b64decode(told["lines"])).split(b"\n")
    runs = json.loads(zlib.decompress(b64decode(told["runs"])))
    return {
        name: b"\n".join(
            line for first, n in zip(run[::2], run[1::2], strict=True) for line in lines[first:][:n]
        )
        for name, run in zip(told["names"], runs, strict=True)
    }


@given(st.lists(st.lists(st.sampled_from([b"", b"a", b"b", b"\r", b"\xff\x00"]), min_size=1)))
def test_files_are_the_same_bytes_again(contents):
    files = {f"{k}.owl": b"\n".join(lines) for k, lines in enumerate(contents)}
    told = packed.packed_files(files)
    assert files_of(told) == files
    held = zlib.decompress(b64decode(told["lines"])).split(b"\n")
    assert len(set(held)) == len(held)  # every line once


def test_there_is_room_for_the_first_files_only(monkeypatch):
    monkeypatch.setattr(packed, "MOST_FILES", 60)
    files = {"a": b"x\n" * 100, "b": bytes(range(100)), "c": b"x\n"}
    told = packed.packed_files(files)
    assert files_of(told) == {"a": files["a"]}


def test_files_that_are_alike_take_the_room_of_one():
    rng = np.random.default_rng(0)
    lines = [rng.bytes(30).hex().encode() for _ in range(1000)]
    files = {f"{k}.owl": b"\n".join([*lines[:k], b"own %d" % k, *lines[k:]]) for k in range(10)}
    size = [len(packed.packed_files(some)["lines"]) for some in (dict([*files.items()][:1]), files)]
    assert size[1] < 1.01 * size[0]


def test_motions_that_find_no_room_are_not_asked_for(more):
    asked = []

    def endless():
        while True:
            asked.append(more.more[0])
            yield asked[-1]

    assert packed.packed_motions(endless(), {}, 1000, of_rows=True)["evaluations"] == []
    assert len(asked) == packed.CHUNK


@pytest.fixture(scope="module")
def long(report):
    """10,000 evaluations in numbers that do not compress, nearly all critical; packed full."""
    rng, n = np.random.default_rng(0), 10_000
    names = [c.name for c in report.evaluations.parameters] + [f"p{k}" for k in range(16)]
    parameters = tuple(Column(name, "m", rng.random(n) * 100.0, searched=True) for name in names)
    metrics = tuple(
        Column(name, "m", np.abs(rng.normal(2.0, 1.0, n)))
        for name in ("d_min", "v_d", "n_collision", "ttc", "l_offset", "a_change", "n_brake")
    )
    evaluations = Evaluations(
        iteration=np.arange(n) // 40, parameters=parameters, metrics=metrics,
        objectives=(Column("F", "1", rng.normal(0.0, 1.0, n)),), critical=rng.random(n) < 0.98,
        status=np.zeros(n, dtype=np.int64), cause=rng.integers(1, 5, n).astype(np.int8),
    )  # fmt: skip
    p = report.kept[0]
    noisy = [
        replace(
            p,
            name=f"evaluation {k + 1}",
            evaluation=k,
            x=p.x + rng.normal(0, 1, p.x.shape),
            v=p.v + rng.random(p.v.shape),
        )
        for k in range(300, 500)
    ]
    files = {f"critical/{k:04d}.owl": rng.bytes(100_000) for k in range(20)}
    return replace(report, evaluations=evaluations, more=tuple(noisy), files=files)


def test_a_page_of_10_000_rows_is_not_too_large(long, monkeypatch):
    assert 0 < len(payload(long)["files"]["names"]) < 20
    size = len(report_page(long))
    assert size <= LIMIT
    # The motions that are left out for want of room would not have fit.
    monkeypatch.setattr(payloads, "SIZE_OF_ROW", (size - 400_000 - payloads.SIZE) // 9000)
    assert 0 < len(payload(long)["packed"]["evaluations"]) < len(long.more)
    assert size - 700_000 < len(report_page(long)) <= size - 400_000


def test_a_page_of_1000_rows_is_smaller_than_a_megabyte(long):
    e = long.evaluations
    first = replace(
        e, iteration=e.iteration[:1000], critical=e.critical[:1000], status=e.status[:1000],
        cause=e.cause[:1000],
        **{
            group: tuple(replace(c, values=c.values[:1000]) for c in getattr(e, group))
            for group in ("parameters", "metrics", "objectives")
        },
    )  # fmt: skip
    data = replace(long, evaluations=first)
    assert payload(data)["packed"]["evaluations"]
    assert len(report_page(data)) <= 1_000_000


@pytest.mark.browser
def test_a_page_of_10_000_rows_has_only_those_in_sight_and_plays_any_it_holds(
    browser, long, tmp_path
):
    write_report(tmp_path / "report.html", long)
    page = browser.new_page(viewport={"width": 1280, "height": 720})
    complaints = []
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.goto((tmp_path / "report.html").as_uri())
    page.wait_for_selector("#list-body tr[data-i]")
    n = int(long.evaluations.critical.sum())
    assert page.inner_text("#list-note") == f"{n:,} critical scenarios"
    for place in (0, 100_000, 10**9):
        page.evaluate(f"document.getElementById('list-scroll').scrollTop = {place}")
        page.evaluate("new Promise((r) => requestAnimationFrame(() => requestAnimationFrame(r)))")
        assert 5 < page.locator("#list-body tr[data-i]").count() < 60
    last = page.locator("#list-body tr[data-i]").last
    assert int(last.get_attribute("aria-rowindex")) >= n + 1

    p = long.more[7]
    page.evaluate(f"bridgegen.open({p.evaluation})")
    page.wait_for_function(f"bridgegen.state().scenario === '{p.name}'")
    for share in (0.1, 0.5, 0.9):
        k = round(share * (p.n_steps - 1))
        page.evaluate(f"bridgegen.seek({k})")
        drawn = page.evaluate("bridgegen.state().entities")
        assert [e["x"] for e in drawn] == pytest.approx(p.x[:, k].tolist(), abs=5.01e-4)
        assert [e["v"] for e in drawn] == pytest.approx(p.v[:, k].tolist(), abs=5.01e-4)
    assert complaints == []
    page.close()


@pytest.mark.browser
def test_files_are_saved_from_the_page_itself_or_linked(browser, more, tmp_path):
    name = more.kept[0].files[0]
    data = replace(more, files={name: "<x>≤</x>".encode() * 1000})
    write_report(tmp_path / "report.html", data)
    page = browser.new_page(accept_downloads=True)
    page.goto((tmp_path / "report.html").as_uri())
    with page.expect_download() as download:
        page.locator("#details .files a").first.click()
    assert download.value.suggested_filename == Path(name).name
    assert Path(download.value.path()).read_bytes() == data.files[name]
    other = page.locator("#details .files a").nth(1)
    assert other.get_attribute("href") == f"./{more.kept[0].files[1]}"
    page.close()


@pytest.mark.browser
def test_what_it_does_not_hold_it_names_the_command_for(browser, more, tmp_path):
    shown = replace(more, summary=replace(more.summary, view="bridgegen open 'my runs/s4'"))
    write_report(tmp_path / "report.html", shown)
    page = browser.new_page()
    page.goto((tmp_path / "report.html").as_uri())
    there = {p.evaluation for p in (*more.kept, *more.more)}
    other = next(i for i in np.flatnonzero(more.evaluations.critical).tolist() if i not in there)
    page.evaluate(f"bridgegen.open({other})")
    page.wait_for_selector("#no-motion")
    command = f"bridgegen open 'my runs/s4' --evaluation {other + 1}"
    assert page.inner_text("#no-motion-command") == command
    assert page.inner_text("#measures h3") == f"Evaluation {other + 1}"
    page.evaluate(f"bridgegen.open({more.more[0].evaluation})")
    page.wait_for_selector("#no-motion", state="hidden")
    page.close()
