"""A user's own detector: it gets a frame and returns boxes.

A detector is a class without arguments:

    class MyDetector:
        def reset(self): ...
        def detect(self, frame): return Boxes(kinds, confidence, pixels=pixels)

``reset`` comes before the first frame of every scenario, ``detect`` once per frame. It looks at
rendered frames, so it needs a simulator that renders (``--simulator carla --detector …``). Its
boxes are measured (iou, e_position, map); the ego's driver does not get them.

The ego's frame: x ahead, y to the left, z up [m] from its reference point, the rear axle's centre
on the ground.
"""

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from bridgegen.base.arrays import Float, Int
from bridgegen.base.errors import InputError
from bridgegen.base.plugins import class_of
from bridgegen.drivers.kinds import NAMES


@dataclass(frozen=True)
class Frame:
    """One instant of one scenario, as the sensors record it.

    Attributes:
        time: since the scenario's start [s].
        image: ``(H, W, 3)`` uint8, red, green, blue.
        intrinsics: ``(3, 3)`` float64, from the camera's frame (x right, y down, z ahead) to
            pixels.
        camera: ``(3,)`` float64 [m], where the camera is in the ego's frame; it looks ahead, level.
        points: ``(P, 4)`` float32, a LiDAR's: x, y, z [m] in the ego's frame, intensity 0 to 1.
    """

    time: float
    image: npt.NDArray[np.uint8]
    intrinsics: Float
    camera: Float
    points: npt.NDArray[np.float32]


@dataclass(frozen=True)
class Boxes:
    """A detector's result for a frame: n objects, as boxes in space or in the image.

    Attributes:
        kinds: ``(n,)``, their classes, see ``bridgegen.drivers.kinds``.
        confidence: ``(n,)``, 0 to 1.
        boxes: ``(n, 7)``: x, y, z of the middle [m], length, width, height [m], heading [rad], in
            the ego's frame; or None.
        pixels: ``(n, 4)``: left, top, right, bottom [pixels]; or None. A box of the image is
            placed by its lower edge, which stands on a level road; its size and heading are
            taken from the truth, so that IoU then measures the position alone.
    """

    kinds: npt.ArrayLike
    confidence: npt.ArrayLike
    boxes: npt.ArrayLike | None = None
    pixels: npt.ArrayLike | None = None


class Detector(Protocol):
    """A detector of one scenario at a time."""

    def reset(self) -> None:
        """Begin a scenario; discard the state of earlier ones."""

    def detect(self, frame: Frame) -> Boxes | Any:
        """Return the boxes of one frame."""


@dataclass(frozen=True)
class Checked:
    """A detector's valid result.

    Attributes:
        kinds: ``(n,)`` int64.
        confidence: ``(n,)`` float64.
        boxes: ``(n, 7)`` float64, or None.
        pixels: ``(n, 4)`` float64, or None; one of the two.
    """

    kinds: Int
    confidence: Float
    boxes: Float | None
    pixels: Float | None


def load(spec: str) -> Detector:
    """Return a detector.

    Args:
        spec: ``package.module:Class`` or ``file.py:Class``.

    Raises:
        InputError: there is no such detector, or it lacks a method.
    """
    found = class_of(spec, "--detector")
    lacking = [name for name in ("reset", "detect") if not callable(getattr(found, name, None))]
    if lacking:
        raise InputError(
            f"--detector: {found.__name__} must have the methods reset and detect, "
            f"lacks {', '.join(lacking)}"
        )
    detector: Detector = found()
    return detector


def checked(answer: Any) -> Checked:
    """Return a detector's result as arrays.

    Raises:
        ValueError: wrong type or shape, not finite, or out of range.
    """
    if not isinstance(answer, Boxes):
        raise ValueError(f"detect must return Boxes, got {type(answer).__name__}")
    kinds = np.asarray(answer.kinds, dtype=np.int64).reshape(-1)
    n = len(kinds)
    confidence = np.asarray(answer.confidence, dtype=np.float64).reshape(-1)
    if (answer.boxes is None) == (answer.pixels is None):
        raise ValueError("Boxes must have boxes or pixels, and not both")
    arrays: dict[str, Float] = {"confidence": confidence}
    shapes: dict[str, tuple[int, ...]] = {"confidence": (n,)}
    for name, width in (("boxes", 7), ("pixels", 4)):
        if (given := getattr(answer, name)) is not None:
            arrays[name] = np.asarray(given, dtype=np.float64).reshape(-1, width)
            shapes[name] = (n, width)
    for name, array in arrays.items():
        if array.shape != shapes[name]:
            raise ValueError(f"{name} must have shape {shapes[name]}, got {array.shape}")
        if not np.isfinite(array).all():
            raise ValueError(f"{name} must be finite")
    if n and not (kinds.min() >= 0 and kinds.max() < len(NAMES)):
        raise ValueError(f"kinds must be in 0 to {len(NAMES) - 1}")
    if n and not (confidence.min() >= 0.0 and confidence.max() <= 1.0):
        raise ValueError("confidence must be in 0 to 1")
    boxes = arrays.get("boxes")
    if boxes is not None and n and boxes[:, 3:6].min() <= 0.0:
        raise ValueError("length, width and height must be > 0")
    return Checked(kinds, confidence, boxes, arrays.get("pixels"))
