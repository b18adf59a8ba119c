"""The metrics of a recording that somebody else made."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from bridgegen.metrics.choice import existing, require
from bridgegen.metrics.metric import Need
from bridgegen.metrics.registry import METRICS, evaluate
from bridgegen.simulation.recording import boxes_of, read_recording
from bridgegen.simulation.rollout import Rollout


@dataclass(frozen=True)
class Measured:
    """What a recording came to.

    Attributes:
        rollout: the motion, N = 1, the ego first.
        metrics: by name, in the metric's unit.
        notes: what the recording does not say, and what was taken instead.
    """

    rollout: Rollout
    metrics: Mapping[str, float]
    notes: tuple[str, ...]

    @property
    def seconds(self) -> float:
        """From the first to the last instant [s]."""
        return (self.rollout.shape[2] - 1) * self.rollout.time_step


def measure_recording(
    path: Path,
    *,
    ego: str | None = None,
    boxes: Path | None = None,
    metrics: Sequence[str] | None = None,
    time_step: float | None = None,
) -> Measured:
    """Return the metrics of a recording: a trace, another table of states, or esmini's log.

    Args:
        path: the file; see `bridgegen.simulation.recording`.
        ego: its entity under test; the one of the first line by default.
        boxes: an OpenSCENARIO file whose entities' boxes are taken, instead of the recording's.
        metrics: names; all that a recording gives rise to by default.
        time_step: [s] to resample at; the recording's own steps by default.

    Raises:
        FileFormatError: a file that is not as it must be, with the lines.
        UnknownNameError: no such entity or metric.
        InputError: a metric that a recording gives no rise to, or steps that are not equal.
    """
    sizes = boxes_of(boxes) if boxes is not None else None
    recording = read_recording(path, ego=ego, boxes=sizes, time_step=time_step)
    held: tuple[Need, ...] = ("offset",) if recording.has_offset else ()
    names = existing(tuple(METRICS), held)
    if metrics:
        names = require(metrics, held, f"the recording {path}")
    values = evaluate(recording.rollout, names)[0]
    found = dict(zip(names, values.tolist(), strict=True))
    return Measured(recording.rollout, found, recording.notes)
