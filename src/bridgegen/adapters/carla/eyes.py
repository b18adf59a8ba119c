"""A camera and a LiDAR on the ego: what they record, and what the user's detector makes of it."""

import csv
import math
import queue
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bridgegen.adapters.carla import frame
from bridgegen.adapters.carla.matching import Truth, matched
from bridgegen.adapters.carla.settings import TIME_STEP
from bridgegen.adapters.carla.stage import Stage
from bridgegen.adapters.carla.view import View
from bridgegen.base.arrays import Float
from bridgegen.drivers import kinds as column
from bridgegen.drivers.detector import Detector, Frame, checked
from bridgegen.drivers.driver_process import DriverError
from bridgegen.drivers.kinds import NAMES
from bridgegen.simulation.embedded.co_simulation import CoSimulation
from bridgegen.simulation.embedded.program import Program

if TYPE_CHECKING:
    import carla

WIDTH, HEIGHT, FIELD_OF_VIEW = 800, 600, 90.0  # pixels, degrees
ABOVE = 0.3
"""The camera and the LiDAR are so far above the ego's roof [m]."""

LATE = 2.0
"""Seconds that a frame may take to arrive after the tick that it is of."""


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
        self._models = 2.0 * np.array([(one.x, one.y, one.z) for one in extents])
        ego = stage.bodies[0]
        height = 2.0 * ego.box.extent.z + ABOVE
        above_origin = height - ego.box.extent.z + ego.box.location.z
        mount = carla.Transform(carla.Location(x=ego.box.location.x, z=above_origin))
        place = (ego.centre, 0.0, height)
        self.view = View(WIDTH, HEIGHT, math.radians(FIELD_OF_VIEW), place)
        self._images: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self._scans: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self._held: dict[int, list[Any]] = {}
        stage.attach(
            "sensor.camera.rgb", mount, image_size_x=WIDTH, image_size_y=HEIGHT,
            fov=FIELD_OF_VIEW, sensor_tick=period,
        ).listen(self._images.put)  # fmt: skip
        stage.attach(
            "sensor.lidar.ray_cast", mount, range=100, channels=32, points_per_second=500_000,
            rotation_frequency=1.0 / period, sensor_tick=period,
        ).listen(self._scans.put)  # fmt: skip
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
        except Exception as error:
            message = f"the detector: {type(error).__name__}: {error}"
            raise DriverError("raised", message) from error
