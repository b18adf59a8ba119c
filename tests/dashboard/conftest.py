"""A project that is made once: two runs, a suite of two drivers, a map, and damaged folders."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import bridgegen as bg
from bridgegen.jobs.dashboard.results import Driver, Failure, Judged, ModeKey, Result
from bridgegen.jobs.suite.suite import evaluate_suite
from bridgegen.scenario.language.criteria import Criterion

R_12 = "R-12: always(gap to bv > 2 m)"


@pytest.fixture(scope="session")
def project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return its folder; tests must not change it."""
    folder = tmp_path_factory.mktemp("dashboard") / "project"
    for ego, options in (("route-follower", {"criteria": [R_12]}), ("reference", {})):
        out = folder / "runs" / ego
        bg.run_search(
            "cut-in",
            ego=ego,
            algorithm="random",
            budget=40,
            keep=1,
            triage="short",
            out=out,
            **options,
        )
    evaluate_suite(
        ["cut-in", "left-across-path"],
        egos=["route-follower", "reference"],
        samples=6,
        workers=1,
        out=folder / "suites" / "change",
    )
    damaged = folder / "damaged <b>"
    damaged.mkdir()
    (damaged / "run.sqlite").write_bytes(b"no database")
    half = folder / "maps" / "half"
    half.mkdir(parents=True)
    (half / "map.json").write_text(json.dumps({"scenario": "cut-in"}), "utf-8")
    return folder


@pytest.fixture
def result() -> Callable[..., Result]:
    """Return a function that makes results."""

    def make(
        scenario: str = "cut-in",
        version: str = "1.0",
        time: float = 0.0,
        *,
        name: str = "stack",
        modes: tuple[str, ...] = (),
        judged: tuple[tuple[str, int, int], ...] = (),
        **more: Any,
    ) -> Result:
        label = f"{name}-{version}" if version else name
        failures = tuple(
            Failure(ModeKey(scenario, name, "contact", one), f"collides ({one})", 3, 0.01)
            for one in modes
        )
        met = tuple(
            Judged(Criterion(one, "min(ego.v) > 0"), ok, bad, 0, -1.0 if bad else 1.0, "1")
            for one, ok, bad in judged
        )
        given: dict[str, Any] = {
            "kind": "run", "source": f"runs/{scenario}-{label}", "page": "", "evaluations": 10,
            "failed": 0, "lost": 0, "finished": True,
        }  # fmt: skip
        return Result(
            time=time, scenario=scenario, driver=Driver(name, version, label), failures=failures,
            judged=met, **(given | more),
        )  # fmt: skip

    return make
