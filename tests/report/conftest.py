"""A run that never happened, but could have: a left turn into the path of a crossing car.

Besides, a scenario with something in every layer.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bridgegen.pages.data import Column, Evaluations, ReportData, RunSummary
from bridgegen.pages.page import write_report
from bridgegen.pages.playback import Entity, Outline, Playback
from bridgegen.scenario.language.coverage import CoverageMap, coverage_map
from bridgegen.scenario.language.reader import load
from bridgegen.scenario.language.scenario import LogicalScenario
from bridgegen.scenario.ontology.graph import Individuals
from bridgegen.scenario.ontology.individuals import build as build_individuals

ARM, HALF, LANE, LANES = 60.0, 13.0, 3.5, 2
CAR = {"length": 4.6, "width": 1.9, "center_ahead": 1.4}
STEP = 0.05


def crossroads() -> tuple[Outline, ...]:
    """Four legs of 60 m, two lanes of 3.5 m per direction, stop lines 26 m apart."""
    side, areas, lines = LANE * LANES, [], []
    for quarter in range(4):
        c, s = [(1, 0), (0, 1), (-1, 0), (0, -1)][quarter]
        turn = np.array([[c, s], [-s, c]], dtype=float)

        def out(points: list[list[float]], kind: str, turn: np.ndarray = turn) -> Outline:
            return Outline(kind, np.array(points) @ turn)

        far = HALF + ARM
        areas.append(out([[HALF, -side], [far, -side], [far, side], [HALF, side]], "driving"))
        lines += [out([[HALF, y], [far, y]], "edge") for y in (-side, side)]
        lines += [out([[HALF, y], [far, y]], "broken") for y in (-LANE, LANE)]
        lines.append(out([[HALF, 0.0], [far, 0.0]], "centre"))
        lines.append(out([[HALF, 0.3], [HALF, side]], "stop"))
        a = np.linspace(0.0, np.pi / 2, 13)
        r = HALF - side
        corner = np.stack([HALF - r * np.sin(a), HALF - r * np.cos(a)], axis=1)
        lines.append(Outline("edge", corner @ turn))
    ring = np.concatenate([outline.points for outline in lines if len(outline.points) == 13])
    return (Outline("junction", ring), *areas, *lines)


def left_turn(speed: float, v_b: float, start: float, trigger: float) -> dict[str, np.ndarray]:
    """Ego from north, left, to the east; the other from west straight to the east."""
    t = np.arange(401) * STEP
    radius = HALF + LANE / 2
    s = speed * t
    bend = np.clip((s - 40.0) / radius, 0.0, np.pi / 2)
    x = -LANE / 2 + radius * (1 - np.cos(bend)) + np.maximum(s - 40.0 - radius * np.pi / 2, 0.0)
    y = HALF + 40.0 - np.minimum(s, 40.0) - radius * np.sin(bend)
    dt = np.maximum(t - trigger, 0.0)
    v2 = np.minimum(3.0 * dt, v_b)
    x2 = -HALF - start + np.cumsum(v2) * STEP
    return {
        "x": np.stack([x, x2]),
        "y": np.stack([y, np.full_like(y, -LANE / 2)]),
        "h": np.stack([bend - np.pi / 2, np.zeros_like(bend)]),
        "v": np.stack([np.full_like(v2, speed), v2]),
    }


def gap(motion: dict[str, np.ndarray]) -> np.ndarray:
    """Box to box, from samples of the outlines (good to a few centimetres); 0 when inside."""
    along, across = np.linspace(-2.3, 2.3, 24), np.linspace(-0.95, 0.95, 9)
    sides = [np.stack([along, np.full(24, q)], 1) for q in (-0.95, 0.95)]
    rim = np.concatenate(sides + [np.stack([np.full(9, p), across], 1) for p in (-2.3, 2.3)])
    c, s = np.cos(motion["h"][0])[:, None], np.sin(motion["h"][0])[:, None]
    ahead = rim[:, 0] + 1.4
    px = motion["x"][0][:, None] + ahead * c - rim[:, 1] * s
    py = motion["y"][0][:, None] + ahead * s + rim[:, 1] * c
    dx = np.maximum(np.abs(px - motion["x"][1][:, None] - 1.4) - 2.3, 0.0)
    dy = np.maximum(np.abs(py - motion["y"][1][:, None]) - 0.95, 0.0)
    return np.hypot(dx, dy).min(axis=1)


LIMITS = {
    "ego_speed": ("m/s", 4.9, 8.9), "bv_speed": ("m/s", 0.5, 6.0), "bv_start": ("m", 2.0, 40.0),
    "bv_trigger_time": ("s", 0.0, 10.0), "bv_trigger_distance": ("m", 5.0, 60.0),
    "precipitation": ("%", 0.0, 100.0), "cloudiness": ("%", 0.0, 100.0),
    "fog_density": ("%", 0.0, 100.0), "sun_altitude_angle": ("deg", -90.0, 50.0),
}  # fmt: skip


def make_coverage(n: int) -> CoverageMap:
    """n random rows of a catalogue scenario, critical where the ego is fast."""
    space = load("crossroads-s4").space()
    X = space.decode(np.random.default_rng(1).random((n, space.n_var)))
    return coverage_map(space, X, X[:, space.index("ego_speed")] > 7.5, strength=2, sample=5_000)


def make_report(n: int = 1000, kept: int = 10, seed: int = 0) -> ReportData:
    """A search of n evaluations, 40 a batch, that closes in on the collision."""
    rng = np.random.default_rng(seed)
    u = rng.random((n, len(LIMITS)))
    names = list(LIMITS)
    heat = 1.0 - np.arange(n) / max(n, 2)
    target = {"ego_speed": 0.55, "bv_speed": 0.75, "bv_start": 0.16, "bv_trigger_time": 0.12}
    for name, goal in target.items():
        j = names.index(name)
        u[:, j] = np.clip(goal + (u[:, j] - goal) * (0.15 + 0.85 * heat), 0.0, 1.0)
    box = np.array([ends[1:] for ends in LIMITS.values()])
    value = dict(zip(names, (box[:, 0] + u * (box[:, 1] - box[:, 0])).T, strict=True))
    motions = [
        left_turn(value["ego_speed"][i], value["bv_speed"][i], value["bv_start"][i],
                  value["bv_trigger_time"][i]) for i in range(n)
    ]  # fmt: skip
    gaps = [gap(m) for m in motions]
    ends = [int(np.argmax(np.append((m["x"] > HALF + 45.0).any(axis=0), True))) for m in motions]
    ends = [min(k, 401) for k in ends]
    gaps = [np.where(np.arange(401) < k, g, g[k - 1]) for g, k in zip(gaps, ends, strict=True)]
    closest = np.array([g.argmin() for g in gaps])
    d_min = np.array([g.min() for g in gaps])
    v_d = np.array([m["v"][0][k] for m, k in zip(motions, closest, strict=True)])
    hits = (d_min <= 0.0).astype(float)
    ttc = np.where(d_min < 6.0, 0.2 * d_min, np.inf)
    critical = (hits > 0) | ((d_min < 2.0) & (v_d >= 1.0))
    fitness = 0.8297 * d_min - 0.1703 * v_d * 3.6
    order = np.argsort(fitness, kind="stable")[:kept]
    wetness = value["precipitation"] * 0.8
    parameters = tuple(
        Column(name, unit, value[name], low=low, high=high, searched=True)
        for name, (unit, low, high) in LIMITS.items()
    )
    parameters += (
        Column("wetness", "%", wetness, "water on the road"),
        Column("friction", "1", np.where(wetness < 40, 1 - wetness / 200, 0.6)),
        Column("lane_width", "m", np.full(n, LANE), low=2.75, high=4.0),
    )
    metrics = (
        Column("d_min", "m", d_min, "smallest distance between the boxes"),
        Column("v_d", "m/s", v_d, "ego speed at that moment"),
        Column("n_collision", "count", hits),
        Column("ttc", "s", ttc, "smallest time to collision"),
        Column("l_offset", "m", np.abs(rng.normal(0, 0.1, n))),
    )
    road = crossroads()
    first = np.flatnonzero(critical)
    playbacks = tuple(
        Playback(
            name=f"{rank + 1:04d}", rank=rank + 1, evaluation=int(i),
            parameters={c.name: float(c.values[i]) for c in parameters},
            metrics={c.name: float(c.values[i]) for c in metrics},
            critical=bool(critical[i]), time_step=STEP,
            entities=(Entity("ego", **CAR), Entity("bv", **CAR)),
            **motions[i], distance=gaps[i], lanes=road, n_steps=ends[i],
            files=tuple(f"critical/{rank + 1:04d}.{end}" for end in ("xosc", "xodr", "owl")),
        )
        for rank, i in enumerate(order)
    )  # fmt: skip
    summary = RunSummary(
        scenario="crossroads-s4", title="Left turn into the path of a crossing car",
        description="The ego comes from the north and turns left; another car crosses from the "
        "west into the same exit.",
        road="generated crossroads", ego="route-follower", algorithm="pso", seed=seed, budget=n,
        n_evaluations=n, n_critical=int(critical.sum()),
        r_critic=float(critical.mean()) if n else float("nan"),
        critical_rule="a collision, or d_min below 2 m while v_d is at least 1 m/s",
        critical_distance=2.0,
        first_critical=int(first[0]) + 1 if first.size else None,
        fiftieth_critical=int(first[49]) + 1 if first.size > 49 else None,
        d_min_best=float(d_min.min()) if n else float("nan"),
        d_min_median=float(np.median(d_min)) if n else float("nan"),
        v_d_best=float(v_d.max()) if n else float("nan"),
        v_d_median=float(np.median(v_d)) if n else float("nan"),
        wall_seconds=3.41, finished=True, version="0.1.0",
        command="bridgegen search crossroads-s4 --algorithm pso --budget 1000 --seed 0 "
        "--out runs/s4",
        started="2026-11-21T09:30:00+00:00",
    )  # fmt: skip
    evaluations = Evaluations(
        iteration=np.arange(n) // 40, parameters=parameters, metrics=metrics,
        objectives=(Column("F", "", fitness, "objective, minimised"),), critical=critical,
        status=np.zeros(n, dtype=np.int64),
    )  # fmt: skip
    return ReportData(summary, evaluations, playbacks, make_coverage(n))


@pytest.fixture(scope="session")
def build() -> Callable[..., ReportData]:
    return make_report


@pytest.fixture(scope="session")
def report() -> ReportData:
    """120 evaluations in three batches, four of them kept."""
    return make_report(120, 4)


@pytest.fixture
def with_summary(report: ReportData) -> Callable[..., ReportData]:
    """The same report with some fields of its summary changed."""
    return lambda **changes: replace(report, summary=replace(report.summary, **changes))


# -- something in every layer ----------------------------------------------------------------------


@pytest.fixture(scope="session")
def layered() -> LogicalScenario:
    return load(Path(__file__).with_name("all_layers.yaml"))


@pytest.fixture(scope="session")
def values(layered) -> dict[str, float]:
    """The middle of every range that is left, in light rain, haze and at night."""
    space = layered.space()
    shares = np.full(space.n_var, 0.5)
    for name, share in {"precipitation": 0.95, "fog_density": 0.95, "sun_altitude_angle": 0.1}.items():
        shares[space.index(name)] = share
    return space.values(space.decode([shares])[0])


@pytest.fixture(scope="session")
def individuals(layered, values) -> Individuals:
    return build_individuals(layered, values, driver="route-follower")


@dataclass
class Opened:
    """A page, and whatever it complained about or asked for."""

    page: Any
    complaints: list[str] = field(default_factory=list)
    requests: list[str] = field(default_factory=list)

    def state(self) -> dict[str, Any]:
        return self.page.evaluate("bridgegen.state()")

    def scroll_through(self) -> None:
        """Bring every chart into sight, and wait until all are drawn."""
        self.page.evaluate(
            """async () => {
                 for (const chart of document.querySelectorAll(".plot, #parallel")) {
                   chart.scrollIntoView();
                   await new Promise((r) => requestAnimationFrame(() => requestAnimationFrame(r)));
                 }
               }"""
        )
        self.page.wait_for_function("bridgegen.chartsDrawn >= bridgegen.charts")


@pytest.fixture(scope="module")
def show(browser, tmp_path_factory):
    """Write a report and open it from disk."""

    def open_(data: ReportData, fragment: str = "", **context: Any) -> Opened:
        path: Path = tmp_path_factory.mktemp("report") / "report.html"
        write_report(path, data)
        context.setdefault("viewport", {"width": 1280, "height": 720})
        opened = Opened(browser.new_page(**context))
        opened.page.on(
            "console",
            lambda m: opened.complaints.append(m.text) if m.type == "error" else None,
        )
        opened.page.on("pageerror", lambda error: opened.complaints.append(str(error)))
        opened.page.on("request", lambda request: opened.requests.append(request.url))
        opened.page.goto(path.as_uri() + fragment)
        return opened

    return open_
