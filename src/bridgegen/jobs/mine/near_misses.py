"""Near misses on the page of recordings, and as a table."""

from collections.abc import Iterator, Sequence

from bridgegen.base.units import percent
from bridgegen.jobs.mine.mine import CRITICAL, Mined, Summary
from bridgegen.pages.moving import moving_picture
from bridgegen.pages.templates import counted
from bridgegen.recordings.conflicts.find import RecordedConflict
from bridgegen.recordings.replays.write import Replay

HEAD = (
    "recording", "file", "ego", "other", "time_s", "conflict", "type", "responsible", "ttc_s",
    "needed_mps2", "v_ego_mps", "v_other_mps", "harm", "doubt", "sentence", "scenario",
    "position_off_m", "speed_off_mps",
)  # fmt: skip
TRUSTED = 0.02
"""Share of vehicles whose boxes touch another's up to which a recording's near misses count."""


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


def shown(replay: Replay) -> dict[str, object]:
    """Return what the page shows of an event that is written."""
    event, found = replay.event, replay.event.event.found
    ego, other = event.names
    paths = (replay.scenario.with_suffix(end) for end in (".xosc", ".xodr", ".owl"))
    facts = [
        f"the ego is {ego}, the other {other}, of {event.recording}",
        f"responsible: {found.responsible or 'unknown'}; {found.type}",
        f"time to collision {found.ttc:.2f} s, {found.needed_deceleration:.1f} m/s² needed",
        f"not simulated: {replay.problem}"
        if replay.problem
        else f"simulated here, all participants are within {max(replay.off, 0.001):.3f} m of where "
        f"they were recorded, and within {max(replay.too_fast, 0.01):.2f} m/s of their speed",
    ]
    return {
        "id": replay.scenario.stem,
        "sentence": found.sentence,
        "picture": moving_picture(event.motion, 1, event.when, found.sentence),
        "facts": [*facts, f"doubtful: {event.event.doubt}"] if event.event.doubt else facts,
        "files": [(f"{CRITICAL}/{path.name}", path.name) for path in paths if path.exists()],
    }


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
    """Return each recording's name and its conflicts in words."""
    return [(recording.facts.name, in_words(recording)) for recording in mined.recordings]
