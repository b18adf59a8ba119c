"""Near misses on the page of recordings, and as a table."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from shlex import quote

from bridgegen.base.units import percent
from bridgegen.jobs.mine.mine import CRITICAL, Mined, Summary
from bridgegen.pages.moving import SMALL, moving_picture
from bridgegen.pages.templates import counted
from bridgegen.recordings.conflicts.find import RecordedConflict, order
from bridgegen.recordings.replays.write import Replay

HEAD = (
    "recording", "file", "ego", "other", "time_s", "conflict", "type", "responsible", "ttc_s",
    "needed_mps2", "v_ego_mps", "v_other_mps", "harm", "doubt", "sentence", "scenario",
    "position_off_m", "speed_off_mps",
)  # fmt: skip
TRUSTED = 0.02
"""Share of vehicles whose boxes touch another's up to which a recording's near misses count."""
PLAYED = 12
"""Number of events that play on the page."""
LISTED = 20
"""Number of further ones in its table."""


def rows(mined: Mined) -> Iterator[list[object]]:
    """Yield a row for each conflict, under `HEAD`."""
    written = {id(item.event.event): item for item in mined.replays}
    for recording in mined.recordings:
        for each in recording.conflicts:
            found, replay = each.found, written.get(id(each))
            yield [
                recording.facts.name,
                recording.facts.source,
                recording.names[each.ego],
                recording.names[each.other],
                f"{each.instant * mined.time_step:.2f}",
                found.conflict,
                found.type,
                found.responsible,
                f"{found.ttc:.3f}",
                f"{found.needed_deceleration:.2f}",
                f"{found.v_ego:.2f}",
                f"{found.v_other:.2f}",
                f"{found.harm:.3f}",
                each.doubt,
                found.sentence,
                f"{CRITICAL}/{replay.scenario.name}" if replay else "",
                f"{replay.off:.4f}" if replay else "",
                f"{replay.too_fast:.3f}" if replay else "",
            ]


def in_words(summary: Summary) -> str:
    """Return how many conflicts a recording has, and whether to trust them."""
    near = [each for each in summary.conflicts if not each.is_contact]
    doubtful = sum(each.doubt != "" for each in near)
    touching = {p for each in summary.conflicts if each.is_contact for p in (each.ego, each.other)}
    text = counted(len(near), "near miss")
    if doubtful:
        text += f", {doubtful:,} of them with motion that could not happen"
    if touching:
        share = len(touching) / max(summary.tracks, 1)
        text += f"; boxes of {len(touching):,} participants ({percent(share)}) touch"
        if share > TRUSTED:
            text += ": unless these are accidents, boxes or positions are wrong, near misses too"
    return text


def gallery(mined: Mined) -> list[dict[str, object]]:
    """Return what the page plays: the most severe events that are written."""
    return [_shown(mined, replay) for replay in mined.replays[:PLAYED]]


def _shown(mined: Mined, replay: Replay) -> dict[str, object]:
    event, found = replay.event, replay.event.event.found
    paths = (replay.scenario.with_suffix(end) for end in (".xosc", ".xodr", ".owl"))
    summary = _of(mined, event.event)
    text = f"The{sentence(summary, event.event, mined.time_step)[3:]}."
    facts = [
        found.sentence,
        f"not simulated: {replay.problem}"
        if replay.problem
        else f"simulated here, all participants are within {max(replay.off, 0.001):.3f} m of where "
        f"they were recorded, and within {max(replay.too_fast, 0.01):.2f} m/s of their speed",
    ]
    return {
        "id": replay.scenario.stem,
        "tag": "boxes touch" if event.event.is_contact else "near miss",
        "is_contact": event.event.is_contact,
        "doubt": event.event.doubt,
        "sentence": text,
        "picture": moving_picture(
            event.motion, 1, event.when, text, size=SMALL, lines=summary.lanes.borders
        ),
        "command": f"bridgegen simulate {quote(str(replay.scenario))}",
        "facts": facts,
        "files": [(f"{CRITICAL}/{path.name}", path.name) for path in paths if path.exists()],
    }


def _of(mined: Mined, event: RecordedConflict) -> Summary:
    """Return the recording that an event is in."""
    return next(
        recording
        for recording in mined.recordings
        if any(each is event for each in recording.conflicts)
    )


def sentence(summary: Summary, event: RecordedConflict, time_step: float) -> str:
    """Return who met whom, how, how near, when, and in which file."""
    found = event.found
    ego, other = (f"{summary.kinds[p]} {summary.names[p]}" for p in (event.ego, event.other))
    how = f" ({found.type})" if found.type else ""
    near = (
        f"touched the {other}{how} at {found.closing_normal:.1f} m/s closing speed"
        if event.is_contact
        else f"came within {found.ttc:.2f} s of the {other}{how} and needed "
        f"{found.needed_deceleration:.1f} m/s² to stop short"
    )
    where = Path(summary.facts.source).name
    return f"the {ego} {near}, {event.instant * time_step:.1f} s into {where}"


def ranked(mined: Mined) -> list[tuple[Summary, RecordedConflict]]:
    """Return the conflicts of all recordings, the most severe first, as they are written."""
    every = [(each, one) for each in mined.recordings for one in each.conflicts]
    return sorted(every, key=lambda pair: order(pair[1]))


def other_rows(mined: Mined) -> list[list[object]]:
    """Return the page's table of those that are not played, the most severe first."""
    played = {id(item.event.event) for item in mined.replays[:PLAYED]}
    return [
        [
            ("boxes touch" if event.is_contact else "near miss", event.doubt),
            f"{summary.names[event.ego]} and {summary.names[event.other]}",
            event.found.type,
            f"{event.found.ttc:.2f} s",
            f"{event.found.needed_deceleration:.1f} m/s²",
            f"{event.instant * mined.time_step:.1f} s",
            Path(summary.facts.source).name,
        ]
        for summary, event in ranked(mined)
        if id(event) not in played
    ]


def screen_rows(mined: Mined) -> Iterator[tuple[str, str, str, str, float, float, str]]:
    """Yield what the terminal shows of the events that are written."""
    for replay in mined.replays:
        found = replay.event.event.found
        yield (
            replay.scenario.name,
            replay.event.recording,
            " and ".join(replay.event.names),
            found.type,
            round(found.ttc, 2),
            round(found.needed_deceleration, 1),
            found.responsible,
        )


def conflicts_as_json(summary: Summary, time_step: float) -> list[dict[str, object]]:
    """Return a recording's conflicts as plain data."""
    return [_as_json(summary, each, time_step) for each in summary.conflicts]


def _as_json(summary: Summary, each: RecordedConflict, time_step: float) -> dict[str, object]:
    return {
        "ego": summary.names[each.ego],
        "other": summary.names[each.other],
        "time": each.instant * time_step,
        "doubt": each.doubt or None,
        **each.found.to_dict(),
    }


def recordings_in_words(mined: Mined) -> Sequence[tuple[str, str]]:
    """Return the names of the recordings with conflicts, each with these in words."""
    return [(each.facts.name, in_words(each)) for each in mined.recordings if each.conflicts]
