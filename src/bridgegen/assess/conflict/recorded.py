"""A recording from elsewhere: its metrics and its conflicts."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bridgegen.assess.conflict.analysis import Conflicts, analyse
from bridgegen.assess.conflict.quantities import MEASURED, evaluate, require
from bridgegen.assess.metrics import METRICS, existing
from bridgegen.assess.metrics.metric import Need
from bridgegen.simulation.recording import boxes_of, kinds_of, read_recording
from bridgegen.simulation.rollout import Rollout

NO_MAP = (
    "the recording has no map: traffic lights, signs, priorities and crosswalks are not known, "
    "so right before left is assumed where paths cross"
)
"""The basis of responsibility without a map."""
NO_KINDS = "the recording does not say what the participants are: all are taken as cars"
NO_OFFSET = (
    "the recording has no offset from the lane: a change of course is judged by the motion alone"
)


@dataclass(frozen=True)
class Measured:
    """The metrics and conflicts of a recording.

    Attributes:
        rollout: the motion, N = 1, the ego first.
        metrics: by name, in the metric's unit; the quantities of the conflict analysis too.
        notes: what the recording lacks, and what was assumed instead.
        conflicts: the conflict analysis, N = 1.
        assumptions: of the analysis, for what the recording lacks.
    """

    rollout: Rollout
    metrics: Mapping[str, float]
    notes: tuple[str, ...]
    conflicts: Conflicts
    assumptions: tuple[str, ...]

    @property
    def seconds(self) -> float:
        """Time from the first to the last instant [s]."""
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
        boxes: an OpenSCENARIO file whose entities' boxes replace the recording's; it also defines
            the entities' kinds.
        metrics: names; by default all that a recording allows.
        time_step: [s] to resample at; the recording's own steps by default.

    Raises:
        FileFormatError: an invalid file, with the lines.
        UnknownNameError: no such entity or metric.
        InputError: a metric that a recording does not allow, or unequal time steps.
    """
    sizes = boxes_of(boxes) if boxes is not None else None
    recording = read_recording(path, ego=ego, boxes=sizes, time_step=time_step)
    rollout = recording.rollout
    if boxes is not None:
        kinds = kinds_of(boxes)
        rollout = replace(rollout, kinds=np.array([kinds[name] for name in rollout.names]))
    held: tuple[Need, ...] = ("offset",) if recording.has_offset else ()
    names = (*existing(tuple(METRICS), held), *MEASURED)
    if metrics:
        names = require(metrics, held, f"the recording {path}")
    values = evaluate(rollout, names)[0]
    found = dict(zip(names, values.tolist(), strict=True))
    assumed = [NO_MAP]
    if boxes is None:
        assumed.append(NO_KINDS)
    if not recording.has_offset:
        assumed.append(NO_OFFSET)
    return Measured(rollout, found, recording.notes, analyse(rollout), tuple(assumed))
