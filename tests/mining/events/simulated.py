"""Traffic that the embedded simulator drives by the scenarios of the catalogue, as a recording."""

from dataclasses import replace
from functools import lru_cache

import numpy as np

from bridgegen.mining.lanes.find import Located
from bridgegen.mining.lanes.fit import fit_of
from bridgegen.mining.lanes.placing import place
from bridgegen.mining.lanes.road_map import lanes_of_map
from bridgegen.odd.others import with_others
from bridgegen.odd.reader import load
from bridgegen.options import PipelineOptions
from bridgegen.pipeline import Pipeline
from bridgegen.recordings.clean import clean
from bridgegen.recordings.lights import RecordedLight, changes_of
from bridgegen.recordings.table import Facts, build
from bridgegen.suite.rows import rows_of

STEP = 0.01
"""So that events begin when their conditions hold [s]."""
LIGHTS = ("off", "red", "red and yellow", "yellow", "green")
APART = 100.0
"""Between the beginnings of two rows [s]."""


@lru_cache
def simulated(name, count, ego, seed=1):
    """Return a scenario, its parameters ``(N,)`` by name, its rollouts and the lanes.

    The road is that of the defaults, and the others are scripted.
    """
    scenario = replace(with_others(load(name), "scripted"), time_step=STEP)
    space = scenario.space(["temporary", "participants"])
    pipeline = Pipeline(scenario, space, PipelineOptions(ego=ego))
    X = rows_of(scenario, space, count - 1, seed).X
    rollout = pipeline.rollout(X)
    assert (rollout.status == 0).all()
    lanes = lanes_of_map(pipeline.concrete(X[0]).roads, name)
    return scenario, dict(zip(space.names, X.T, strict=True)), rollout, lanes


def recorded(rollout, rows, noise=0.0, dropped=0.0, step=0.05, seed=0):
    """Return rows of a rollout as one recording, row i from i · `APART` on; noise in positions."""
    rng = np.random.default_rng(seed)
    every = round(step / rollout.time_step)
    ids, names, columns, kinds, boxes = [], [], [], [], []
    for row in rows:
        for e, name in enumerate(rollout.names):
            k = np.arange(0, rollout.n_steps[row], every)
            if rollout.present.size:
                k = k[rollout.present[row, e, k]]
            if dropped:
                k = k[rng.random(len(k)) >= dropped]
            x, y, h = (one[row, e, k] for one in (rollout.x, rollout.y, rollout.h))
            length, width, ahead = rollout.box[e]
            columns.append(np.array([
                row * APART + k * rollout.time_step,
                x + ahead * np.cos(h) + rng.normal(0.0, noise, len(k)),
                y + ahead * np.sin(h) + rng.normal(0.0, noise, len(k)), h,
            ]))  # fmt: skip
            ids.append(np.full(len(k), len(names)))
            names.append(f"{row} {name}")
            kinds.append(rollout.kinds[e])
            boxes.append((length, width))
    time, x, y, heading = np.concatenate(columns, axis=1)
    found = {"time": time, "x": x, "y": y, "heading": heading}
    length, width = np.array(boxes).T
    facts = Facts("simulated", "none", "simulated", step, "a plane", lights=lights(rollout, rows))
    return build(facts, np.concatenate(ids), found, lambda i: f"state {i}", names=names,
                 kind=np.array(kinds), length=length, width=width)  # fmt: skip


def lights(rollout, rows):
    """The lights of a recording of these rows, each with its stop line."""
    found = {}
    for line, light in enumerate(rollout.stop_lights.tolist()):
        x, y, h = rollout.stop_lines[rows[0], line]
        times, words = [], []
        for row in rows:
            k = np.arange(rollout.n_steps[row])
            times.append(row * APART + k * rollout.time_step)
            words += [LIGHTS[state] for state in rollout.lights[row, light, k].tolist()]
        path = np.array([[x, y], [x + np.cos(h), y + np.sin(h)]])
        name = rollout.light_names[light]
        found[name] = RecordedLight(changes_of(np.concatenate(times).tolist(), words), name, path)
    return found


def located(traffic, lanes, time_step=0.05):
    """Return cleaned traffic, and where it is."""
    cleaned = clean(traffic, time_step).traffic
    placed = place(cleaned, lanes)
    return cleaned, Located(lanes, placed, fit_of(cleaned, placed, lanes))
