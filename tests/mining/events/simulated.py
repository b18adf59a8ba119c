"""Traffic that the embedded simulator drives by the scenarios of the catalogue, as a recording."""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from tests.recordings.writers import Track

from bridgegen.drivers.kinds import NAMES
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.jobs.suite.rows import rows_of
from bridgegen.recordings.events.find import find_events
from bridgegen.recordings.lanes.find import Located, fit_of
from bridgegen.recordings.lanes.placing import place
from bridgegen.recordings.lanes.road_map import lanes_of_map
from bridgegen.recordings.readers.clean import clean
from bridgegen.recordings.readers.table import Facts, RecordedLight, build, changes_of
from bridgegen.scenario.language.adversary import with_others
from bridgegen.scenario.language.reader import load

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
    lanes = lanes_of_map(pipeline.runner.concrete(X[0]).roads, name)
    return scenario, dict(zip(space.names, X.T, strict=True)), rollout, lanes


def tracks_of(rollout, rows, noise=0.0, dropped=0.0, step=0.05, seed=0, apart=APART):
    """Return rows of a rollout as tracks, row i from i · ``apart`` on, and what they are called.

    Args:
        rollout: the simulation.
        rows: of it.
        noise: of positions, in x and in y [m].
        dropped: share of the states that are missing.
        step: between the states [s].
        seed: of the noise.
        apart: between the beginnings of two rows [s].
    """
    rng = np.random.default_rng(seed)
    every = round(step / rollout.time_step)
    tracks, called = [], []
    for number, row in enumerate(rows):
        for e, name in enumerate(rollout.names):
            k = np.arange(0, rollout.n_steps[row], every)
            if rollout.present.size:
                k = k[rollout.present[row, e, k]]
            if dropped:
                k = k[rng.random(len(k)) >= dropped]
            if not len(k):
                continue
            x, y, h, v, a = (getattr(rollout, one)[row, e] for one in "xyhva")
            length, width, ahead = rollout.box[e]
            x, y = x + ahead * np.cos(h), y + ahead * np.sin(h)
            swing = ahead * np.gradient(np.unwrap(h), rollout.time_step)
            states = np.column_stack([
                number * apart + np.arange(len(x)) * rollout.time_step, x, y, h,
                v * np.cos(h) - swing * np.sin(h), v * np.sin(h) + swing * np.cos(h), a,
            ])[k]  # fmt: skip
            states[:, 1:3] += rng.normal(0.0, noise, (len(k), 2))
            kind = NAMES[rollout.kinds[e]]
            tracks.append(Track(str(len(tracks)), kind, float(length), float(width), states))
            called.append(f"{row} {name}")
    return tracks, called


def recorded(rollout, rows, noise=0.0, dropped=0.0, step=0.05, seed=0):
    """Return rows of a rollout as one recording, without velocities; noise in positions."""
    tracks, called = tracks_of(rollout, rows, noise, dropped, step, seed)
    time, x, y, heading = np.concatenate([one.states[:, :4] for one in tracks]).T
    ids = np.repeat(np.arange(len(tracks)), [len(one.states) for one in tracks])
    facts = Facts("simulated", "none", "simulated", step, "a plane", lights=lights(rollout, rows))
    return build(
        facts, ids, {"time": time, "x": x, "y": y, "heading": heading}, lambda i: f"state {i}",
        names=called, kind=[NAMES.index(one.kind) for one in tracks],
        length=[one.length for one in tracks], width=[one.width for one in tracks],
    )  # fmt: skip


def lights(rollout, rows):
    """The lights of a recording of these rows, each with its stop line."""
    found = {}
    for line, light in enumerate(rollout.stop_lights.tolist()):
        x, y, h = rollout.stop_lines[rows[0], line]
        times, words = [], []
        for number, row in enumerate(rows):
            k = np.arange(rollout.n_steps[row])
            times.append(number * APART + k * rollout.time_step)
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


def observed(rollout, rows, lanes, noise=0.0, dropped=0.0):
    """Yield rows of a rollout as recordings, cleaned, each with where it is."""
    yield located(recorded(rollout, rows, noise, dropped), lanes)


@dataclass(frozen=True)
class RoundTrip:
    """What became of planted events.

    Attributes:
        true: ``(F,)`` per event that was found, whether it may have happened.
        found: ``(H,)`` per row in which it surely happened, whether it was found.
        planted: ``(F,)`` by parameter, of the found ones.
        mined: the same, from the events.
        ranges: width of the range by parameter.
    """

    true: np.ndarray
    found: np.ndarray
    planted: dict
    mined: dict
    ranges: dict

    @property
    def precision(self):
        return self.true.mean()

    @property
    def recall(self):
        return self.found.mean()

    def errors(self):
        """By parameter, as shares of its range; those that the event says."""
        found = {
            key: np.abs(self.mined[key] - self.planted[key]) / self.ranges[key]
            for key in self.mined
        }  # fmt: skip
        return {key: error[np.isfinite(error)] for key, error in found.items()}


def compare(scenario, P, rows, surely, maybe, recordings, other=None):
    """Return what became of a scenario's events.

    Args:
        scenario: it.
        P: ``(N,)`` by parameter, what happens in each row.
        rows: that were recorded, of N.
        surely: ``(N,)`` whether the event happens.
        maybe: ``(N,)`` whether it may be said to happen.
        recordings: cleaned, each with where it is.
        other: who meets the ego; None for anybody.
    """
    spec, row, mined = scenario.recorded, [], {}
    for traffic, where in recordings:
        found = next(
            one for one in find_events(traffic, where).kinds if one.kind.name == spec.event
        )
        called = [name.split("#")[0].split() for name in traffic.names]
        kept = spec.counts(found.quantities)
        kept &= np.array([called[e][1] == "ego" for e in found.ego], dtype=bool)
        if other is not None:
            kept &= np.array([called[e][1] == other for e in found.others["other"]], dtype=bool)
        row += [int(called[e][0]) for e in found.ego[kept]]
        for key, value in spec.values(found.quantities).items():
            mined.setdefault(key, []).append(value[kept])
    assert len(set(row)) == len(row)
    return RoundTrip(
        maybe[row], np.isin(rows[surely[rows]], row), {key: P[key][row] for key in mined},
        {key: np.concatenate(values) for key, values in mined.items()},
        {key: scenario.parameters[key].high - scenario.parameters[key].low for key in mined},
    )  # fmt: skip
