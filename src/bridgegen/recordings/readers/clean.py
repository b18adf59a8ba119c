"""Cleaning: cuts, gaps, smoothing, what is missing, one time step; and an account of all of it."""

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.base.errors import FileFormatError, InputError
from bridgegen.drivers.kinds import BICYCLE, CAR, MOTORCYCLE, PEDESTRIAN, TRUCK
from bridgegen.recordings import TIME_STEP
from bridgegen.recordings.readers import quality as plausibility
from bridgegen.recordings.readers import smoothing
from bridgegen.recordings.readers import smoothing as cuts
from bridgegen.recordings.readers.quality import Quality, Rule
from bridgegen.recordings.readers.states import headings, usual_box, velocities
from bridgegen.recordings.readers.table import UNKNOWN_KIND, RecordedTraffic, kind_in_words, wrap

LEAST_STEP, MOST_STEP = 0.01, 1.0  # s
SAME = 1e-6  # s
COLUMNS = ("time", "x", "y", "heading", "vx", "vy", "acceleration")

TWO_WHEELER = (2.6, 1.1)
"""Largest length and width of a two-wheeler, and in ``PERSON`` of a person on foot [m]."""
PERSON = (1.2, 1.2)
FASTEST_BICYCLE = 10.0  # m/s
SHORTEST_TRUCK = 7.0  # m


@dataclass(frozen=True)
class Cleaned:
    """A cleaned recording.

    Attributes:
        traffic: complete but for lanes, at one time step, all participants at the same instants
            (multiples of the time step).
        quality: what was found and done.
        kinds: of the recorded participants, of which one may have become several tracks, or none.
    """

    traffic: RecordedTraffic
    quality: Quality
    kinds: Int


@dataclass
class _Track:
    """One participant's states, or a piece; of a spline, velocities are the slopes of its path."""

    columns: dict[str, Float]
    lane: npt.NDArray[np.int32]
    is_spline: bool = False

    def __len__(self) -> int:
        return len(self.lane)

    def take(self, at: Int | slice | Bool) -> "_Track":
        return _Track({key: value[at] for key, value in self.columns.items()}, self.lane[at])


def check_time_step(time_step: float) -> None:
    """Refuse a time step out of range.

    Raises:
        InputError: it is.
    """
    if not LEAST_STEP <= time_step <= MOST_STEP:
        raise InputError(
            f"{LEAST_STEP:g} <= time_step <= {MOST_STEP:g} [s] must hold, got {time_step:g}"
        )


def clean(traffic: RecordedTraffic, time_step: float = TIME_STEP) -> Cleaned:
    """Clean a recording.

    Args:
        traffic: as it was read.
        time_step: of the result [s].

    Raises:
        InputError: a time step out of range.
        FileFormatError: units or frames that are not plausible, or nothing is left.
    """
    check_time_step(time_step)
    # Units first: each later rule has thresholds in metres and seconds.
    plausibility.check(traffic)
    quality = Quality()
    kind = _kinds(traffic, quality)
    length, width = _boxes(traffic, kind, quality)
    suspects = set(cuts.suspects(traffic.time, traffic.x, traffic.y, traffic.first).tolist())
    at_jumps = _Cuts(traffic, quality)
    pieces: list[_Track] = []
    owner: list[int] = []
    names: list[str] = []
    for p, states in enumerate(traffic.states()):
        whole = _Track(
            {key: getattr(traffic, key)[states] for key in COLUMNS}, traffic.lane[states]
        )
        number = 0
        for piece in _pieces(traffic, p, whole, p in suspects, at_jumps, quality):
            done = _complete(traffic, p, piece, time_step, quality)
            if done is None:
                continue
            number += 1
            pieces.append(done)
            owner.append(p)
            # A track that is cut becomes several participants: whether they are one body is what is
            # not known.
            names.append(traffic.names[p] if number == 1 else f"{traffic.names[p]}#{number}")
    at_jumps.report()
    if not pieces:
        raise FileFormatError(f"{traffic.facts.source}: no track has two states at least")
    of = np.array(owner)
    columns = {key: np.concatenate([piece.columns.pop(key) for piece in pieces]) for key in COLUMNS}
    source = traffic.facts.source
    return Cleaned(
        RecordedTraffic(
            facts=replace(traffic.facts, time_step=time_step),
            names=tuple(names),
            kind=kind[of],
            length=length[of],
            width=width[of],
            first=np.cumsum([0, *(len(piece) for piece in pieces)]),
            lane=np.concatenate([piece.lane for piece in pieces]),
            where=lambda _: source,
            **columns,
        ),
        quality,
        kind,
    )


class _Cuts:
    """The jumps of all tracks, of which two that exchange places are one swap of ids."""

    def __init__(self, traffic: RecordedTraffic, quality: Quality) -> None:
        self.traffic, self.quality = traffic, quality
        self.found: dict[float, list[tuple[int, int]]] = defaultdict(list)

    def add(self, p: int, state: int) -> None:
        """Note that participant p jumps after a state, numbered within the recording."""
        self.found[round(float(self.traffic.time[state + 1]), 3)].append((p, state))

    def report(self) -> None:
        """Say of each cut whether it is a swap."""
        for time, jumps in self.found.items():
            for p, state in jumps:
                partner = next(
                    (q for q, other in jumps if q != p and self._exchange(state, other)), None
                )
                example = f"{self.traffic.names[p]} at {time:g} s"
                if partner is None:
                    self.quality.note(Rule.JUMP, p, 1, example)
                else:
                    example += f", with {self.traffic.names[partner]}"
                    self.quality.note(Rule.SWAP, p, 1, example)

    def _exchange(self, a: int, b: int) -> bool:
        """Whether each comes nearer to where the other was than to where it was itself."""
        x, y = self.traffic.x, self.traffic.y

        def far(i: int, j: int) -> float:
            return float(np.hypot(x[i] - x[j], y[i] - y[j]))

        return far(a + 1, b) < far(a + 1, a) and far(b + 1, a) < far(b + 1, b)


def _pieces(
    traffic: RecordedTraffic,
    p: int,
    track: _Track,
    suspect: bool,
    at_jumps: _Cuts,
    quality: Quality,
) -> Iterator[_Track]:
    """Yield the pieces of a track between cuts, without the states that are off its path."""
    name, begin = traffic.names[p], int(traffic.first[p])
    step = traffic.facts.time_step
    time = track.columns["time"]
    kept = np.arange(len(track))
    cut: set[int] = set()
    if suspect and len(track) > 2:
        jumps = cuts.jumps(time, track.columns["x"], track.columns["y"])
        for state in jumps.after.tolist():
            at_jumps.add(p, begin + state)
            cut.add(state)
        for state in jumps.off.tolist():
            quality.note(Rule.OUTLIER, p, 1, f"{name} at {time[state]:g} s")
        kept = np.delete(kept, jumps.off)
    at, bridged = cuts.gaps(time[kept], step)
    for i, bridges in zip(at.tolist(), bridged.tolist(), strict=True):
        span = time[kept[i + 1]] - time[kept[i]]
        if any(kept[i] <= state < kept[i + 1] for state in cut):
            continue
        example = f"{name} at {time[kept[i]]:g} s, {span:.3g} s long"
        quality.note(Rule.GAP_BRIDGED if bridges else Rule.GAP_CUT, p, 1, example)
        if not bridges:
            cut.add(int(kept[i]))
    ends = np.searchsorted(kept, sorted(cut), side="right").tolist()
    for first, last in zip([0, *ends], [*ends, len(kept)], strict=True):
        if last > first:
            yield track.take(kept[first:last]) if len(kept) < len(track) or cut else track


def _complete(
    traffic: RecordedTraffic, p: int, track: _Track, time_step: float, quality: Quality
) -> _Track | None:
    """Return a piece with all that is missing, at the time step; None if it is too short."""
    name = traffic.names[p]
    columns = track.columns
    n, begin = len(track), columns["time"][0]
    # Instants are multiples of the time step from 0 on, the same for all participants, so that
    # distances of two need no interpolation. Nothing is extrapolated beyond a track's ends.
    low = int(np.ceil((begin - SAME) / time_step))
    high = int(np.floor((columns["time"][-1] + SAME) / time_step))
    if n < 2 or high <= low:
        count = "1 state" if n == 1 else f"{n} states"
        quality.note(Rule.SHORT, p, n, f"{name} at {begin:g} s, {count}")
        return None
    track = _smoothed(traffic, p, track, quality)
    columns, n = track.columns, len(track)
    time, vx, vy = (columns[key] for key in ("time", "vx", "vy"))
    missing = ~(np.isfinite(vx) & np.isfinite(vy))
    if missing.any():
        quality.note(Rule.VELOCITY, p, int(missing.sum()), name)
        of_positions = velocities(time, columns["x"], columns["y"])
        vx, vy = (
            np.where(missing, new, old) for new, old in zip(of_positions, (vx, vy), strict=True)
        )
    heading = columns["heading"]
    missing = ~np.isfinite(heading)
    if missing.any():
        of_motion, known = headings(vx, vy)
        quality.note(Rule.HEADING if known else Rule.NO_HEADING, p, int(missing.sum()), name)
        heading = np.where(missing, of_motion, heading)
    heading = np.unwrap(heading)
    acceleration = columns["acceleration"]
    missing = ~np.isfinite(acceleration)
    if missing.any():
        quality.note(Rule.ACCELERATION, p, int(missing.sum()), name)
        along = vx * np.cos(heading) + vy * np.sin(heading)
        acceleration = np.where(missing, np.gradient(along, time), acceleration)
    at = time_step * np.arange(low, high + 1, dtype=np.float64)
    # A recording that has these instants already keeps its numbers bit for bit.
    if len(at) == n and np.abs(at - time).max() <= SAME:
        done = {
            "x": columns["x"],
            "y": columns["y"],
            "vx": vx,
            "vy": vy,
            "heading": heading,
            "acceleration": acceleration,
        }
        lane = track.lane
    else:
        quality.note(Rule.RESAMPLED, p, n, f"{name}, {n} states become {len(at)}")
        within = np.clip(at, time[0], time[-1])
        done = {
            "x": smoothing.hermite(within, time, columns["x"], vx),
            "y": smoothing.hermite(within, time, columns["y"], vy),
            **{
                speed: smoothing.hermite_slopes(within, time, columns[place], slopes)
                if track.is_spline
                else np.interp(within, time, slopes)
                for place, speed, slopes in (("x", "vx", vx), ("y", "vy", vy))
            },
            "heading": smoothing.hermite(within, time, heading, smoothing.slopes(time, heading)),
            "acceleration": np.interp(within, time, acceleration),
        }
        lane = track.lane[np.searchsorted(time, within + SAME, side="right") - 1]
    return _Track({"time": at, **done, "heading": wrap(done["heading"])}, lane)


def _smoothed(traffic: RecordedTraffic, p: int, track: _Track, quality: Quality) -> _Track:
    """Return a track without noise in its positions, to which its velocities belong.

    A track that is so already is returned as it is.
    """
    columns, step = track.columns, traffic.facts.time_step
    if step > smoothing.COARSEST:
        return track  # what looks like noise is motion
    name = traffic.names[p]
    misfit = smoothing.misfit(*(columns[key] for key in ("time", "x", "y", "vx", "vy")))
    if misfit > smoothing.MISFIT:
        quality.note(Rule.MISFIT, p, len(track), f"{name}, {misfit:.2g} m/s off")
        if len(track) < smoothing.LEAST_STATES:
            # Too short to smooth: positions decide where velocities disagree with them, so these
            # are dropped and made of the positions.
            unknown = np.full(len(track), np.nan)
            return _Track(
                columns | dict.fromkeys(("vx", "vy", "acceleration"), unknown), track.lane
            )
    elif smoothing.scatter(columns["x"], columns["y"]) <= smoothing.NOISE:
        return track
    count = round((columns["time"][-1] - columns["time"][0]) / step) + 1
    time = np.linspace(columns["time"][0], columns["time"][-1], count)
    step = float(time[1] - time[0])
    at = {key: np.interp(time, columns["time"], columns[key]) for key in ("x", "y")}
    quality.note(Rule.SMOOTHED, p, len(track), name)
    x, y = (smoothing.smooth(at[key], step, 0) for key in ("x", "y"))
    vx, vy = (smoothing.slopes(time, values) for values in (x, y))
    ax, ay = (smoothing.smooth(at[key], step, 2) for key in ("x", "y"))
    nearest = np.searchsorted(columns["time"], time + SAME, side="right") - 1
    given = columns["heading"]
    heading = np.full(count, np.nan)
    if np.isfinite(given).all():
        # Headings are smoothed with the positions: one that jumps by 0.3 rad moves the rear axle by
        # 0.4 m, which the replay of a track would have as speed.
        turned = np.interp(time, columns["time"], np.unwrap(given))
        heading = smoothing.smooth(turned, step, 0)
    speed = np.hypot(vx, vy)
    # Of who stands, the direction of the velocity is noise.
    along = np.divide(ax * vx + ay * vy, speed, out=np.zeros(count), where=speed > 0.1)
    return _Track(
        {
            "time": time,
            "x": x,
            "y": y,
            "vx": vx,
            "vy": vy,
            "heading": heading,
            "acceleration": along,
        },
        track.lane[nearest],
        is_spline=True,
    )


def _kinds(traffic: RecordedTraffic, quality: Quality) -> Int:
    kinds = traffic.kind.copy()
    for p in np.flatnonzero(kinds == UNKNOWN_KIND).tolist():
        states = slice(int(traffic.first[p]), int(traffic.first[p + 1]))
        kinds[p] = _kind_of(traffic, p, states)
        quality.note(Rule.KIND, p, 1, f"{traffic.names[p]}: {kind_in_words(int(kinds[p]))}")
    return kinds


def _kind_of(traffic: RecordedTraffic, p: int, states: slice) -> int:
    """Return what a box may be; without one, a car."""
    length, width = float(traffic.length[p]), float(traffic.width[p])
    if length <= PERSON[0] and width <= PERSON[1]:
        return PEDESTRIAN
    if length <= TWO_WHEELER[0] and width <= TWO_WHEELER[1]:
        time, x, y = (values[states] for values in (traffic.time, traffic.x, traffic.y))
        fast = len(time) > 1 and np.quantile(np.hypot(*velocities(time, x, y)), 0.9)
        return MOTORCYCLE if fast > FASTEST_BICYCLE else BICYCLE
    return TRUCK if length >= SHORTEST_TRUCK else CAR


def _boxes(traffic: RecordedTraffic, kind: Int, quality: Quality) -> tuple[Float, Float]:
    length, width = traffic.length.copy(), traffic.width.copy()
    for p in np.flatnonzero(~(np.isfinite(length) & np.isfinite(width))).tolist():
        usual = usual_box(int(kind[p]))
        length[p] = usual[0] if np.isnan(length[p]) else length[p]
        width[p] = usual[1] if np.isnan(width[p]) else width[p]
        example = f"{traffic.names[p]}: {kind_in_words(int(kind[p]))}, "
        quality.note(Rule.BOX, p, 1, f"{example}{length[p]:g} m × {width[p]:g} m")
    return length, width
