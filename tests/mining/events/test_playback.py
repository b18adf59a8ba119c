"""The closest events of each kind are shown, under the names that the table has."""

from collections import Counter

import numpy as np
from tests.mining.events.test_find import LEFT, RIGHT, T, change, placed

from bridgegen.recordings.events.find import find_events, named
from bridgegen.recordings.events.playback import MOST_OTHERS, SHOWN, caption, closest
from bridgegen.recordings.excerpt import clock_of


def played(recordings):
    kept, counts, every = [], Counter(), []
    for traffic, located in recordings:
        events = find_events(traffic, located)
        kept = closest(kept, traffic, clock_of(traffic), events, counts)
        counts.update({one.kind.name: len(one) for one in events.kinds})
        every.append(events)
    return kept, every


def test_the_closest_events_of_all_recordings_are_shown():
    ahead = [40.0, 70.0, 30.0, 55.0, 90.0]
    recordings = [
        placed((20.0 * T, RIGHT), (x + 20.0 * T, change(4.0, 4.0, LEFT, RIGHT))) for x in ahead
    ]
    kept, every = played(recordings)
    names = [one.name for one in kept if one.kind == "cut-in"]
    assert names == ["cut-in-3", "cut-in-1", "cut-in-4"]
    assert len(names) == SHOWN
    gaps = {
        name: events.quantities["crossing_gap"][i] / events.quantities["ego_speed"][i]
        for _, events, called in named(every) if events.kind.name == "cut-in"
        for i, name in enumerate(called)
    }  # fmt: skip
    assert names == sorted(gaps, key=gaps.get)[:SHOWN]
    assert all(one.name in caption(one) for one in kept)


def test_a_picture_has_the_ego_the_other_of_the_event_and_some_more():
    crowd = [(x + 20.0 * T, LEFT) for x in np.arange(-60.0, 160.0, 8.0) if abs(x - 40.0) > 7.0]
    kept, _ = played([placed(
        (20.0 * T, RIGHT), (40.0 + 20.0 * T, change(4.0, 4.0, LEFT, RIGHT)), *crowd,
    )])  # fmt: skip
    one = next(one for one in kept if one.kind == "cut-in" and one.ego == "0")
    assert one.motion.names[:2] == ("0", "1")
    assert len(one.motion.names) == MOST_OTHERS + 1
    assert abs(one.when - 2.0) < 0.1  # from 2 s before it
    assert abs(one.seconds - 2.0) < 0.1
