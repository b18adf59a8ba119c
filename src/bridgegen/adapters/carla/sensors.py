"""A camera and a LiDAR on the ego: what they record, and what the user's detector makes of it."""

import csv
import math
import queue
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bridgegen.adapters.carla import frame
from bridgegen.adapters.carla.settings import TIME_STEP
from bridgegen.adapters.carla.stage import Stage
from bridgegen.adapters.carla.view import View, overlap
from bridgegen.base.arrays import Bool, Float
from bridgegen.drivers import kinds as column
from bridgegen.drivers.detector import Checked, Detector, Frame, checked
from bridgegen.drivers.driver_process import DriverError
from bridgegen.drivers.kinds import NAMES
from bridgegen.simulation.embedded.co_simulation import CoSimulation
from bridgegen.simulation.embedded.program import Program

if TYPE_CHECKING:
    import carla

# --- From a detector's boxes to the rows of a rollout's detections: whose is which ---


NEAR = 4.0
"""Largest distance between the centres of a box and of whom it stands for [m]: nuScenes' widest."""

ALIKE = 0.3
"""Intersection over union that a box in the image has at least with the one that it stands for."""


@dataclass(frozen=True)
class Truth:
    """The states of all entities at an instant.

    Attributes:
        states: ``(E, 4)``, see `CoSimulation.states`.
        present: ``(E,)``.
        box: ``(E, 3)``, see `Rollout.box`.
        models: ``(E, 3)`` length, width, height [m] of what is to be seen of them.
    """

    states: Float
    present: Bool
    box: Float
    models: Float

    def middle(self, e: int) -> tuple[float, float]:
        """Return the middle of an entity's box in the world [m]."""
        x, y, h = self.states[e, :3].tolist()
        ahead = float(self.box[e, 2])
        return x + ahead * math.cos(h), y + ahead * math.sin(h)

    def seen(self, e: int) -> Float:
        """Return what is to be seen of an entity, ``(7,)``, in the ego's frame; see `Boxes`."""
        x, y = self.middle(e)
        ego_x, ego_y, ego_h = self.states[0, :3].tolist()
        cos, sin = math.cos(ego_h), math.sin(ego_h)
        dx, dy = x - ego_x, y - ego_y
        length, width, height = self.models[e].tolist()
        turn = math.remainder(float(self.states[e, 2]) - ego_h, 2.0 * math.pi)
        return np.array(
            [dx * cos + dy * sin, dy * cos - dx * sin, 0.5 * height, length, width, height, turn]
        )

    def to_world(self, x: float, y: float) -> tuple[float, float]:
        """Return a point of the ego's frame in the world."""
        ego_x, ego_y, ego_h = self.states[0, :3].tolist()
        cos, sin = math.cos(ego_h), math.sin(ego_h)
        return ego_x + x * cos - y * sin, ego_y + x * sin + y * cos


def matched(answer: Checked, truth: Truth, view: View) -> Float:
    """Return the rows of an instant's detections ``(E, 8)``, see `bridgegen.drivers.kinds`.

    In order of confidence, each detection is assigned to an entity that is still free. Detections
    without an entity have no row: they are not counted.
    """
    n_entities = len(truth.states)
    rows = np.zeros((n_entities, column.DETECTION))
    free = [e for e in range(1, n_entities) if truth.present[e]]
    outlines = {e: view.outline(truth.seen(e)) for e in free}
    # Stable, so that detections of equal confidence are matched in the detector's order, at each
    # run.
    for i in np.argsort(-answer.confidence, kind="stable").tolist():
        if answer.boxes is not None:
            x, y = truth.to_world(float(answer.boxes[i, 0]), float(answer.boxes[i, 1]))
            found = _nearest(truth, free, x, y)
            length, width = answer.boxes[i, 3:5].tolist()
            h = float(truth.states[0, 2] + answer.boxes[i, 6])
        else:
            assert answer.pixels is not None
            found = _most_alike(outlines, free, answer.pixels[i])
            place = None if found is None else _placed(truth, found, view, answer.pixels[i])
            if found is None or place is None:
                continue
            x, y = place
            length, width = truth.box[found, :2].tolist()
            h = float(truth.states[found, 2])
        if found is None:
            continue
        free.remove(found)
        rows[found] = (
            column.CAMERA,
            x,
            y,
            h,
            length,
            width,
            answer.confidence[i],
            answer.kinds[i],
        )
    return rows


def _nearest(truth: Truth, free: list[int], x: float, y: float) -> int | None:
    distances = [(math.dist(truth.middle(e), (x, y)), e) for e in free]
    nearest = min(distances, default=(math.inf, 0))
    return nearest[1] if nearest[0] <= NEAR else None


def _most_alike(outlines: dict[int, Float | None], free: list[int], pixels: Float) -> int | None:
    likeness = [
        (overlap(outline, pixels), -e) for e in free if (outline := outlines[e]) is not None
    ]
    most = max(likeness, default=(0.0, 0))
    return -most[1] if most[0] >= ALIKE else None


def _placed(truth: Truth, e: int, view: View, pixels: Float) -> tuple[float, float] | None:
    """Return where a box in the image puts the middle of an entity [m].

    That is as far from the truth as the foot of the box is from the true one's; None, where either
    does not stand on the road in the image.
    """
    outline = view.outline(truth.seen(e))
    assert outline is not None
    # Both feet by the same projection: a perfect box has no error then, whatever the shape of the
    # body. Placing by the foot alone would be half a car's length off.
    mine, theirs = view.foot(pixels), view.foot(outline)
    if mine is None or theirs is None:
        return None
    x, y = truth.seen(e)[:2].tolist()
    return truth.to_world(x + mine[0] - theirs[0], y + mine[1] - theirs[1])


WIDTH, HEIGHT, FIELD_OF_VIEW = 800, 600, 90.0  # pixels, degrees
ABOVE = 0.3
"""Height of the camera and the LiDAR above the ego's roof [m]."""

LATE = 2.0
"""Time that a frame may take to arrive after the tick that it is of [s]."""


class Eyes:
    """Follows one row with a camera and a LiDAR.

    Frames arrive asynchronously; the number of a frame gives its instant, so that results do not
    depend on the time of arrival.

    Args:
        stage: with the ego, to which the sensors are attached.
        program: the compiled storyboard.
        joint: the scenario, for the truth.
        period: between two frames [s].
        detector: of the user, or None.
        folder: new, for what is recorded; None: nothing is.
    """

    def __init__(
        self,
        stage: Stage,
        program: Program,
        joint: CoSimulation,
        *,
        period: float,
        detector: Detector | None,
        folder: Path | None,
    ) -> None:
        import carla

        self._program, self._joint, self._detector, self._folder = program, joint, detector, folder
        self._ticks, self._first, self._last, self._seen_at = round(period / TIME_STEP), 0, 0, -1
        extents = [body.box.extent for body in stage.bodies]
        self._models = 2.0 * np.array([(extent.x, extent.y, extent.z) for extent in extents])
        ego = stage.bodies[0]
        height = 2.0 * ego.box.extent.z + ABOVE
        above_origin = height - ego.box.extent.z + ego.box.location.z
        mount = carla.Transform(carla.Location(x=ego.box.location.x, z=above_origin))
        place = (ego.centre, 0.0, height)
        self.view = View(WIDTH, HEIGHT, math.radians(FIELD_OF_VIEW), place)
        self._images: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self._scans: queue.SimpleQueue[Any] = queue.SimpleQueue()
        # Images and points arrive on other threads, some time after the tick that they are of. The
        # number of a frame says which instant it shows; waiting for them at each tick would make
        # every tick as slow as the slowest sensor.
        self._held: dict[int, list[Any]] = {}
        stage.attach(
            "sensor.camera.rgb",
            mount,
            image_size_x=WIDTH,
            image_size_y=HEIGHT,
            fov=FIELD_OF_VIEW,
            sensor_tick=period,
        ).listen(self._images.put)
        stage.attach(
            "sensor.lidar.ray_cast",
            mount,
            range=100,
            channels=32,
            points_per_second=500_000,
            rotation_frequency=1.0 / period,
            sensor_tick=period,
        ).listen(self._scans.put)
        shape = (len(program.names), joint.n_steps, column.DETECTION)
        self.detections: Float = np.zeros(shape)
        self.detections[1:, :, column.SEEN_BY] = column.NO_FRAME
        self._boxes: list[tuple[object, ...]] = []

    def begin(self, first: int) -> None:
        """See `RowObserver`."""
        self._first = first
        if self._detector is not None:
            self._ask(self._detector.reset)

    def reached(self, k: int, snapshot: "carla.WorldSnapshot") -> None:
        """See `RowObserver`: look at what has arrived."""
        self._last = snapshot.frame
        self._take()

    def finish(self) -> None:
        """Wait for the last frames; write down what they show.

        Raises:
            DriverError: the detector failed.
        """
        while self._seen_at + self._ticks <= self._last:
            if not self._take(wait=LATE):
                break
        for number in sorted(self._held):
            self._look(number, *self._held.pop(number))
        if self._folder is not None:
            self._folder.mkdir(parents=True, exist_ok=True)
            with (self._folder / "boxes.csv").open("w", newline="") as file:
                writer = csv.writer(file)
                writer.writerow(
                    ("frame", "time", "entity", "kind", "left", "top", "right", "bottom",
                     "x", "y", "z", "length", "width", "height", "heading")
                )  # fmt: skip
                writer.writerows(self._boxes)

    def _take(self, wait: float = 0.0) -> bool:
        """Take what has arrived; look at frames that are complete. Say whether anything had."""
        some = False
        for i, arrived in enumerate((self._images, self._scans)):
            while True:
                try:
                    data = arrived.get(timeout=wait) if wait else arrived.get_nowait()
                except queue.Empty:
                    break
                some, wait = True, 0.0
                self._held.setdefault(data.frame, [None, None])[i] = data
        for number in sorted(self._held):
            if None not in self._held[number]:
                self._look(number, *self._held.pop(number))
        return some

    def _look(self, number: int, image: Any, scan: Any) -> None:
        """Record one frame, and have the detector look at it."""
        self._seen_at = max(self._seen_at, number)
        k = number - self._first
        if image is None or not 0 <= k < self._joint.n_steps:
            return  # of when the ego settled
        truth = Truth(
            self._joint.states(k), self._joint.present(k), self._program.box, self._models
        )
        if self._folder is not None:
            self._record(k, image, scan, truth)
        if self._detector is None:
            return
        points = np.zeros((0, 4), np.float32)
        if scan is not None:
            raw = np.frombuffer(scan.raw_data, np.float32).reshape(-1, 4)
            points = frame.points(raw, self.view.place)
        pixels = np.frombuffer(image.raw_data, np.uint8).reshape(image.height, image.width, 4)
        seen = Frame(
            time=k * TIME_STEP,
            image=np.ascontiguousarray(pixels[:, :, 2::-1]),
            intrinsics=self.view.intrinsics,
            camera=np.array(self.view.place),
            points=points,
        )
        answer = self._ask(self._detector.detect, seen)
        try:
            boxes = checked(answer)
        except (ValueError, TypeError) as error:
            raise DriverError("answered nonsense", f"the detector: {error}") from None
        self.detections[:, k] = matched(boxes, truth, self.view)

    def _record(self, k: int, image: Any, scan: Any, truth: Truth) -> None:
        assert self._folder is not None
        for kind, data, ending in (("camera", image, "png"), ("lidar", scan, "ply")):
            if data is not None:
                (self._folder / kind).mkdir(parents=True, exist_ok=True)
                data.save_to_disk(str(self._folder / kind / f"{k:06}.{ending}"))
        for e in range(1, len(self._program.names)):
            if truth.present[e]:
                box = truth.seen(e)
                outline = self.view.outline(box)
                edges = ("", "", "", "") if outline is None else outline.round(2).tolist()
                kind = NAMES[int(self._program.kinds[e])]
                name = self._program.names[e]
                self._boxes.append(
                    (k, round(k * TIME_STEP, 6), name, kind, *edges, *box.round(4).tolist())
                )

    @staticmethod
    def _ask(call: Any, *arguments: Any) -> Any:
        try:
            return call(*arguments)
        # The detector is a user's own: whatever it raises costs the row, and not the search.
        except Exception as error:
            message = f"the detector: {type(error).__name__}: {error}"
            raise DriverError("raised", message) from error
