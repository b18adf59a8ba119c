import numpy as np

from bridgegen.pages import payload
from bridgegen.pages.data import Column, Evaluations
from bridgegen.pages.sections import batches_payload


def test_a_long_run_is_thinned_evenly_and_keeps_the_kept(monkeypatch):
    monkeypatch.setattr(payload, "ROWS", 50)
    n = 1000
    evaluations = Evaluations(
        iteration=np.arange(n) // 40,
        parameters=(Column("p", "m", np.arange(n, dtype=float), searched=True),),
        metrics=(Column("d_min", "m", np.ones(n)), Column("v_d", "m/s", np.ones(n))),
        objectives=(),
        critical=np.arange(n) % 3 == 0,
        status=np.where(np.arange(n) % 100 == 0, 1, 0),
    )
    rows = payload._rows(evaluations, payload._shown(evaluations, [501, 502]))
    found = np.array(rows["evaluation"])
    assert (rows["n"], rows["n_failed"]) == (1000, 10)
    assert {501, 502} <= set(rows["evaluation"])
    assert 45 <= len(found) <= 52
    assert np.diff(found).max() <= 42
    assert rows["columns"][0]["values"] == found.tolist()
    assert not (found % 100 == 0).any()
    assert len(batches_payload(evaluations)["share"]) == 25
