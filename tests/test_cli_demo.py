"""The demonstration: a search that finds failures, and its page."""

import webbrowser

import pytest
from tests.approval import approve

import bridgegen as bg
from bridgegen.cli import demo


@pytest.mark.thorough
def test_it_finds_failures_and_opens_the_page(cli, tmp_path, monkeypatch):
    opened = []
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(demo, "BUDGET", 120)
    monkeypatch.setattr(webbrowser, "open", lambda url: bool(opened.append(url)))
    code, out, err = cli("demo")
    assert code == 0
    run = bg.Run(tmp_path / "runs/demo")
    assert run.modes
    assert opened == [run.report.as_uri()]
    approve(err, "browser")
    assert "Report: runs/demo/report.html" in out
    monkeypatch.setattr(demo, "BUDGET", 60)
    code, out, err = cli("demo", "--no-open")
    assert (code, err, len(opened)) == (0, "", 1)
    assert (tmp_path / "runs/demo-2/report.html").is_file()
