"""The evaluations of runs as Parquet files."""

import importlib.util
import json

import numpy as np
import pytest
from tests.approval import refuses

from bridgegen.base.errors import InputError, StorageError
from bridgegen.jobs.search import run_search
from bridgegen.jobs.search.table import CHUNK, RUN, WEIGHT, write_tables
from bridgegen.results.store import Store

missing = importlib.util.find_spec("pyarrow") is None
pytestmark = [
    pytest.mark.parquet,
    pytest.mark.skipif(missing, reason="the extra 'parquet' is missing"),
]


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    home = tmp_path_factory.mktemp("runs")
    for name, seed in (("one", 0), ("other", 1)):
        run_search(
            "crossroads-s2", algorithm="random", budget=400, seed=seed, ego="route-follower",
            out=home / name, deliver=False,
        )  # fmt: skip
    return [home / "one", home / "other"]


def read(path):
    parquet = pytest.importorskip("pyarrow.parquet")
    return parquet.read_table(path)


def test_a_run_s_table_is_its_store_to_the_bit(runs, tmp_path):
    (path,) = write_tables(runs[:1], tmp_path)
    table = read(path)
    with Store.open(runs[0]) as store:
        rows, columns, settings = store.read(), store.columns, store.settings
    assert table.num_rows == len(rows)
    for names, values in (
        (columns.X, rows.X),
        (columns.metrics, rows.metrics),
        (columns.F, rows.F),
    ):
        for name, column in zip(names, values.T, strict=True):
            np.testing.assert_array_equal(table[name].to_numpy(), column, name)
    np.testing.assert_array_equal(table["critical"].to_numpy(), rows.critical)
    np.testing.assert_array_equal(table["status"].to_numpy(), rows.status)
    assert set(table["cause"].to_pylist()) - {None} <= {"planning", "unavoidable"}
    assert {name: table[name][0].as_py() for name in RUN} == {
        "run": "one", "scenario": "crossroads-s2", "algorithm": "random", "seed": 0,
        "ego": "route-follower", "simulator": "embedded",
    }  # fmt: skip
    assert set(table[WEIGHT].to_pylist()) == {1.0}
    made = json.loads(table.schema.metadata[b"bridgegen"])
    assert made["settings"] == json.loads(json.dumps(dict(settings)))


def test_a_folder_of_them_is_one_table(runs, tmp_path):
    dataset = pytest.importorskip("pyarrow.dataset")
    write_tables(runs, tmp_path)
    whole = dataset.dataset(tmp_path).to_table()
    assert whole.num_rows == 800
    assert sorted(set(whole["seed"].to_pylist())) == [0, 1]


def test_a_sample_keeps_what_is_critical_and_stands_for_the_rest(runs, tmp_path):
    (path,) = write_tables(runs[:1], tmp_path / "whole")
    whole = read(path)
    (path,) = write_tables(runs[:1], tmp_path / "some", sample=0.25)
    some = read(path)
    ids = whole["id"].to_numpy()[whole["critical"].to_numpy()]
    assert {*ids} <= {*some["id"].to_numpy()}
    others = some[WEIGHT].to_numpy()[~some["critical"].to_numpy()]
    assert {*others} == {4.0}
    # Five standard deviations of a binomial distribution.
    n = 400 - len(ids)
    assert abs(len(others) - n / 4) < 5 * np.sqrt(n * 3 / 16)
    again = read(write_tables(runs[:1], tmp_path / "some", sample=0.25)[0])
    assert again.equals(some)
    more = read(write_tables(runs[:1], tmp_path / "more", sample=0.5)[0])
    assert {*some["id"].to_numpy()} <= {*more["id"].to_numpy()}


def test_rows_are_written_a_part_at_a_time(runs, tmp_path, monkeypatch):
    assert CHUNK > 400
    (path,) = write_tables(runs[:1], tmp_path / "a")
    monkeypatch.setattr("bridgegen.jobs.search.table.CHUNK", 37)
    (parts,) = write_tables(runs[:1], tmp_path / "b")
    assert read(parts).combine_chunks().equals(read(path).combine_chunks())


@pytest.mark.parametrize("share", [0.0, -1.0, 1.1, float("nan")])
def test_a_share_is_one(runs, tmp_path, share):
    with refuses(InputError):
        write_tables(runs, tmp_path, sample=share)


def test_runs_of_one_name_are_refused(runs, tmp_path):
    with refuses(InputError):
        write_tables([runs[0], runs[0]], tmp_path)


def test_what_is_no_run_is_told(tmp_path):
    with pytest.raises(StorageError, match="nowhere"):
        write_tables([tmp_path / "nowhere"], tmp_path / "out")


def test_nothing_half_written_stays(runs, tmp_path):
    (tmp_path / "one.parquet").mkdir()
    with refuses(StorageError):
        write_tables(runs[:1], tmp_path)
    assert [one.name for one in tmp_path.iterdir()] == ["one.parquet"]
