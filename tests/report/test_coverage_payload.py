"""Coverage as the page gets it, against the arrays that it comes from."""

import json
from dataclasses import replace
from itertools import combinations, pairwise

import numpy as np
import pytest

from bridgegen.base.errors import ScenarioError
from bridgegen.pages import build as build_module
from bridgegen.pages.payload import payload
from bridgegen.pages.sections import IMPOSSIBLE, coverage_payload
from bridgegen.scenario.language.coverage import CoverageMap, coverage_map
from bridgegen.scenario.language.reader import load


@pytest.fixture(scope="module")
def found(report) -> CoverageMap:
    return report.coverage


def test_it_is_json_and_part_of_the_page(report, found):
    sent = payload(report)["coverage"]
    assert sent == json.loads(json.dumps(coverage_payload(found), allow_nan=False))
    assert (sent["evaluations"], sent["critical"]) == (120, found.total.critical)
    assert sent["sample"] == found.total.sample
    assert payload(replace(report, coverage=None))["coverage"] is None


def test_parameters_come_axis_by_axis(found):
    turned = replace(
        found.total, parameters=found.total.parameters[::2] + found.total.parameters[1::2]
    )
    for total in (found.total, turned):
        sent = coverage_payload(CoverageMap(total, ()))["parameters"]
        axes = [one["axis"] for one in sent]
        assert sum(a != b for a, b in pairwise(axes)) == len(set(axes)) - 1
        assert {one["name"] for one in sent} == {one.name for one in total.parameters}


def test_bins_keep_their_counts_and_edges(found):
    sent = {one["name"]: one for one in coverage_payload(found)["parameters"]}
    for one in found.total.parameters:
        want = np.where(one.feasible, one.evaluated, IMPOSSIBLE)
        assert sent[one.name]["evaluated"] == want.tolist()
        assert sent[one.name]["critical"] == one.critical.tolist()
        assert sent[one.name]["edges"] == pytest.approx(one.edges, rel=1e-5)
        assert (sent[one.name]["unit"], sent[one.name]["integer"]) == (one.unit, one.integer)


def test_every_pair_is_there_once_and_right_way_round(found):
    """Also where grouping by axis turns a pair round."""
    backwards = replace(found.total, parameters=found.total.parameters[::-1])
    for total in (found.total, backwards):
        sent = coverage_payload(CoverageMap(total, found.pairs))
        names = [one["name"] for one in sent["parameters"]]
        sizes = [len(one["evaluated"]) for one in sent["parameters"]]
        assert sorted(map(tuple, (one["of"] for one in sent["pairs"]))) == list(
            combinations(range(len(names)), 2)
        )
        for one, pair in zip(sent["pairs"], found.pairs, strict=True):
            x, y = one["of"]
            assert {names[x], names[y]} == {pair.first, pair.second}
            shape = (sizes[x], sizes[y])
            evaluated = np.reshape(one["cells"]["evaluated"], shape)
            critical = np.reshape(one["cells"]["critical"], shape)
            if names[x] != pair.first:
                evaluated, critical = evaluated.T, critical.T
            assert np.array_equal(evaluated, np.where(pair.feasible, pair.evaluated, IMPOSSIBLE))
            assert np.array_equal(critical, pair.critical)
            assert one["feasible"] == pair.ways.feasible == (evaluated != IMPOSSIBLE).sum()


def test_what_is_too_large_to_draw_keeps_its_figures(found):
    pair = replace(found.pairs[0], evaluated=None, critical=None, feasible=None)
    sent = coverage_payload(CoverageMap(found.total, (pair,)))["pairs"][0]
    assert sent["cells"] is None
    assert sent["evaluated"] == pair.ways.evaluated


class _Pipeline:
    def __init__(self, space):
        self.space = space


class _Rows:
    def __init__(self, X, critical, status):
        self.X, self.critical, self.status = X, critical, status


@pytest.fixture(scope="module")
def s4():
    return load("crossroads-s4").space()


def rows_of(space, n=200):
    X = space.decode(np.random.default_rng(3).random((n, space.n_var)))
    return _Rows(X, np.arange(n) % 3 == 0, np.where(np.arange(n) % 4 == 0, 1, 0))


def test_a_run_of_ten_thousand_stays_small(s4):
    found = build_module._coverage(_Pipeline(s4), rows_of(s4, 10_000))
    assert len(json.dumps(coverage_payload(found))) < 50_000


def test_failed_rows_cover_nothing(s4):
    rows = rows_of(s4)
    ok = rows.status == 0
    found = build_module._coverage(_Pipeline(s4), rows).total
    assert (found.evaluations, found.critical) == (150, (rows.critical & ok).sum())
    assert [one.strength for one in found.ways] == [1, 2, 3]


def test_triples_are_left_out_where_they_take_long(s4, monkeypatch):
    monkeypatch.setattr(build_module, "TRIPLES", 1)
    found = build_module._coverage(_Pipeline(s4), rows_of(s4)).total
    assert [one.strength for one in found.ways] == [1, 2]


def test_a_space_that_cannot_be_sampled_still_has_a_report(s4, monkeypatch):
    rows = rows_of(s4)

    def refuse(U):
        if len(U):
            raise ScenarioError("no value")

    monkeypatch.setattr(s4, "decode", refuse)
    found = build_module._coverage(_Pipeline(s4), rows)
    assert found.total.sample == 0
    assert found.total.ways[0].feasible == found.total.ways[0].evaluated > 0
    ok = rows.status == 0
    assert found.total.ways == coverage_map(s4, rows.X[ok], rows.critical[ok], sample=0).total.ways
