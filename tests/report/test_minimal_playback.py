"""The simplest form of a failure in the page is what the triage and the exported file have."""

import pytest

import bridgegen as bg
from bridgegen.jobs.search.restored import pipeline_of
from bridgegen.pages.playbacks import minimal_playbacks


def test_it_is_the_exported_scenario(tmp_path):
    run = bg.run_search("pedestrian-behind-parked", budget=80, keep=2, ego="route-follower",
                        out=tmp_path / "run")  # fmt: skip
    mode = next(one for one in run.modes if one.minimal is not None)
    pipeline = pipeline_of(run, "open")
    (played,) = minimal_playbacks(pipeline, [("m", mode.shown, (), mode.minimal)])
    exported = bg.simulate_file(run.folder / "critical" / f"{mode.minimal.name}.xosc")
    assert played.metrics["harm"] == pytest.approx(mode.minimal.harm)
    assert exported.metrics["harm"] == played.metrics["harm"]
    assert played.conflict.summary.conflict == mode.conflict
    assert played.conflict.summary.type == mode.conflict_type
