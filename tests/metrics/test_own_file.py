"""Metrics of the user's own, as ``file.py:METRIC``."""

import shlex

import numpy as np
import pytest
from tests.approval import refuses

import bridgegen as bg
from bridgegen.assess import metrics
from bridgegen.assess.metrics import registry
from bridgegen.base.errors import InputError
from bridgegen.jobs.search import Run, resume
from bridgegen.jobs.search.campaign import SearchCallbacks
from bridgegen.jobs.search.table import write_tables

FILE = """
import numpy as np
from bridgegen.assess.metrics import Metric

def top(rollout):
    return np.where(rollout.status == 0, rollout.v[:, 0].max(axis=1) + {more}, np.nan)

METRIC = Metric("top_speed", "m/s", "largest speed of the ego", "larger", 0.0, top)
OTHER = Metric("ttc", "s", "another", "smaller", 0.0, top)
NUMBER = 3
"""
OPTIONS = {"ego": "route-follower", "algorithm": "random", "triage": "none", "keep": 0}


@pytest.fixture
def own(tmp_path):
    path = tmp_path / "met.py"
    path.write_text(FILE.format(more="0.0"), "utf-8")
    return f"{path}:METRIC"


def column(folder):
    run = Run(folder)
    return run.rows().metrics[:, list(run.metrics).index("top_speed")]


def test_a_search_records_it_and_the_page_and_the_table_show_it(own, tmp_path):
    out = tmp_path / "run"
    bg.run_search("cut-in", budget=20, metrics=[own], out=out, **OPTIONS)
    found = column(out)
    assert np.isfinite(found).all()
    assert (found > 5.0).all()
    settings = Run(out).settings
    (known,) = settings.own_metrics
    assert (settings.metrics, known["code"], known["unit"]) == ((own,), own, "m/s")
    assert shlex.join(["--metrics", own]) in settings.command(out)
    page = (out / "report.html").read_text("utf-8")
    assert "largest speed of the ego" in page
    pytest.importorskip("pyarrow")
    import pyarrow.parquet as parquet

    (path,) = write_tables([out], tmp_path / "tables")
    assert parquet.read_table(path)["top_speed"].to_pylist() == found.tolist()


def test_it_may_be_what_is_optimised_and_processes_compute_the_same(own, tmp_path):
    given = {**OPTIONS, "objective": {"top_speed": 1.0}, "metrics": [own], "budget": 24}
    bg.run_search("cut-in", out=tmp_path / "one", workers=None, **given)
    bg.run_search("cut-in", out=tmp_path / "two", workers=2, **given)
    assert column(tmp_path / "one").tobytes() == column(tmp_path / "two").tobytes()


def test_a_resumed_run_has_it_named_again_and_says_if_its_file_changed(own, tmp_path):
    out, path = tmp_path / "run", tmp_path / "met.py"
    bg.run_search("cut-in", budget=20, metrics=[own], out=out, **OPTIONS)
    path.write_text("raise SystemExit('imported unasked')", "utf-8")
    with refuses(InputError, "--metrics"):
        resume(out)
    with refuses(InputError, "--metrics"):
        resume(out, metrics=[f"{own}2"])
    said = []
    callbacks = SearchCallbacks(warning=said.append)
    path.write_text(FILE.format(more="0.0"), "utf-8")
    resume(out, metrics=[own], callbacks=callbacks)
    assert not [text for text in said if "changed" in text]
    path.write_text(FILE.format(more="1.0"), "utf-8")
    resume(out, metrics=[own], callbacks=callbacks)
    (changed,) = [text for text in said if "changed" in text]
    assert "met.py" in changed
    assert "top_speed" in changed


def test_a_run_of_somebody_else_is_read_without_its_code(own, tmp_path, cli):
    out = tmp_path / "run"
    bg.run_search("cut-in", budget=20, metrics=[own], out=out, **{**OPTIONS, "keep": 1})
    registry._NAMED.remove("top_speed")
    del metrics.METRICS["top_speed"]  # as in another process
    (tmp_path / "met.py").write_text("raise SystemExit('imported unasked')", "utf-8")
    code, _, err = cli("suite", "add", out, "--to", tmp_path / "suite")
    assert code == 0, err
    code, _, err = cli("analyse", "regions", out)
    assert (code, "--metrics" in err) == (2, True)


@pytest.mark.parametrize(
    ("name", "named"),
    [("METRC", "METRIC"), ("NUMBER", "METRIC, OTHER"), ("top", "METRIC"), ("OTHER", "ttc")],
)
def test_what_is_no_metric_of_its_own_name_is_refused(own, tmp_path, name, named):
    spec = own.replace("METRIC", name)
    with refuses(InputError, named):
        bg.run_search("cut-in", budget=3, metrics=[spec], out=tmp_path / "run", **OPTIONS)
    assert not (tmp_path / "run").exists()


def test_simulate_prints_it_and_two_of_one_name_are_refused(own, cli):
    code, out, _ = cli("simulate", "cut-in", "--metrics", f"{own},pet")
    assert (code, "top_speed" in out) == (0, True)
    with refuses(InputError, "top_speed"):
        metrics.read([own, own.replace("met.py", "../" + own.split("/")[-2] + "/met.py")])
