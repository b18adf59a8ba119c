"""``bridgegen simulate`` of one row of a logical scenario."""

import json
import shlex

import pytest
from tests.approval import approve

import bridgegen as bg


@pytest.mark.parametrize(
    ("scenario", "options"),
    [
        ("crossroads-s2", {"ego": "reference", "ideal": ["prediction"]}),  # draws noise
        ("jam-tail-in-fog", {"critical": "thresholds", "fixed": {"fog_density": 80.0}}),
        ("r157/cut-in", {"vehicle": "single-track", "others": "scripted"}),
    ],
)
def test_a_row_of_a_run_is_simulated_again_by_its_command(cli, scenario, options, tmp_path):
    run = bg.run_search(
        scenario, budget=8, algorithm="random", triage="none", out=tmp_path / "run", **options
    )
    rows, logical = run.rows(), bg.model(scenario)
    for k in (0, 5):
        values = dict(zip(run.parameters, rows.X[k].tolist(), strict=True))
        given = [f"--fix={name}={values[name]!r}" for name in logical.parameters]
        code, out, err = cli(*shlex.split(run.settings.simulated())[1:], *given, "--json")
        assert code == 0, err
        facts = json.loads(out)
        recorded = dict(zip(run.metrics, rows.metrics[k].tolist(), strict=True))
        finite = {name: v if abs(v) < float("inf") else None for name, v in recorded.items()}
        assert {name: facts["metrics"][name] for name in finite} == finite


def test_parameters_that_are_not_given_stand_at_their_defaults(cli):
    code, out, _ = cli("simulate", "crossroads-s4", "--fix", "precipitation=50", "--json")
    facts = json.loads(out)
    assert code == 0
    found = facts["parameters"]
    assert (found["precipitation"], found["bv_speed"]) == (50.0, 1.8)
    # moved where a rule asks for it, and derived: min(5/3 * 50, 50 + 4/7 * 20)
    assert (found["cloudiness"], found["precipitation_deposits"]) == (50.0, 50 + 4 / 7 * 20)


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (["--fix", "bv_speed=200"], ["bv_speed", "200", "3.6"]),
        (["--fix", "bv_spede=2"], ["bv_spede", "bv_speed"]),
        (["--fix", "friction=1"], ["friction"]),
        (["--fix", "fog_density=90", "--fix", "wind_intensity=90"], ["fog_density", "90"]),
        (["--dt", "0.01"], ["--dt"]),
        (["--metrics", "pte"], ["pte", "tet"]),
    ],
)
def test_a_row_that_is_none_is_refused(cli, words, named):
    code, _, err = cli("simulate", "crossroads-s4", *words)
    assert code == 2
    approve(err.rstrip(), *named)


def test_options_of_logical_scenarios_are_refused_with_a_file_as_it_is(cli):
    code, _, err = cli("simulate", "no.xosc", "--objective", "paper")
    assert code == 2
    approve(err, "--objective", "no.xosc")
