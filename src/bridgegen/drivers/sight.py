"""How far the reference stack's sensors detect a car and a pedestrian, weather by weather."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from bridgegen.base import elementary
from bridgegen.base.arrays import Float
from bridgegen.base.errors import InputError
from bridgegen.drivers import _weather_columns as column
from bridgegen.drivers.kinds import CAR, PEDESTRIAN

_SIZES = {CAR: (1.8, 1.5), PEDESTRIAN: (0.5, 1.7)}  # m, width and height as seen from behind
_LOW_SUN = 10  # deg, at which glare is tabulated
_AWAY = 180.0  # deg


@dataclass(frozen=True)
class Sky:
    """A weather to look through.

    Attributes:
        visual_range: meteorological optical range [m], > 0.
        rain: [mm/h], ≥ 0.
        snow: of water [mm/h], ≥ 0.
        sun_altitude: [deg], −90 to 90; below 0 it is dusk, from −18 on night.
        off_sun: how far from the sun's azimuth one looks [deg], 0 to 180.
        cloud: share of the sky that clouds cover, 0 to 1.
    """

    visual_range: float = 10_000.0
    rain: float = 0.0
    snow: float = 0.0
    sun_altitude: float = 45.0
    off_sun: float = _AWAY
    cloud: float = 0.0

    def __post_init__(self) -> None:
        limits = {
            "visual_range": (1.0, math.inf, "m"),
            "rain": (0.0, math.inf, "mm/h"),
            "snow": (0.0, math.inf, "mm/h"),
            "sun_altitude": (-90.0, 90.0, "deg"),
            "off_sun": (0.0, 180.0, "deg"),
            "cloud": (0.0, 1.0, "1"),
        }
        for name, (low, high, unit) in limits.items():
            value = getattr(self, name)
            if not (low <= value <= high and math.isfinite(value)):
                raise InputError(f"{low:g} <= {name} <= {high:g} [{unit}] must hold, got {value}")

    def numbers(self) -> Float:
        """Return what sensors feel of it, ``(WEATHER,)``; see ``_weather_columns``."""
        from bridgegen.drivers._weather_kernels import derive, set_clear

        weather = np.zeros(column.WEATHER)
        set_clear(weather)
        weather[column.VISUAL_RANGE] = self.visual_range
        weather[column.RAIN], weather[column.SNOW] = self.rain, self.snow
        weather[column.SUN_AZIMUTH] = 0.0
        weather[column.SUN_ELEVATION] = math.radians(self.sun_altitude)
        weather[column.CLOUD] = self.cloud
        derive(weather)
        return weather


@dataclass(frozen=True)
class DetectionRange:
    """Where half of the frames detect a body that drives or stands ahead, unhidden [m].

    Attributes:
        camera: by the camera alone; up to 250 m, beyond which nobody looks.
        lidar: by the LiDAR alone.
        fused: by either.
    """

    camera: float
    lidar: float
    fused: float


def detection_range(sky: Sky, kind: int) -> DetectionRange:
    """Return how far a car or a pedestrian is detected from behind.

    Args:
        sky: the weather.
        kind: `bridgegen.drivers.kinds.CAR` or ``PEDESTRIAN``.
    """
    from bridgegen.drivers import _camera_kernels as camera
    from bridgegen.drivers import _lidar_kernels as lidar
    from bridgegen.drivers._physics_kernels import veil
    from bridgegen.drivers.kinds import LAMPS, REFLECTANCE

    weather = sky.numbers()
    width, height = _SIZES[kind]
    area = width * height
    toward = weather[column.SUN_Y] * elementary.cos(math.radians(sky.off_sun))
    dazzle = veil(weather[column.GLARE], toward)

    def by_camera(d: float) -> float:
        clear = camera.clarity(weather, d, dazzle, LAMPS[kind] / area, 1.0)
        return float(camera.detection(camera.pixels(math.sqrt(area), d, clear)))

    def by_lidar(d: float) -> float:
        echoes, _ = lidar.returns(area, REFLECTANCE[kind], weather[column.ATTENUATION], d)
        return float(lidar.detection(echoes))

    return DetectionRange(
        _half(by_camera),
        _half(by_lidar),
        _half(lambda d: 1.0 - (1.0 - by_camera(d)) * (1.0 - by_lidar(d))),
    )


def _half(probability: Callable[[float], float]) -> float:
    """Return where a probability that falls with distance is one half."""
    from bridgegen.drivers._physics_kernels import CULL

    low, high = 1.0, CULL
    for _ in range(40):
        middle = math.sqrt(low * high)
        if probability(middle) >= 0.5:
            low = middle
        else:
            high = middle
    return low


HEAD = (
    "weather",
    "car, camera",
    "car, LiDAR",
    "car, either",
    "walker, camera",
    "walker, LiDAR",
    "walker, either",
)
"""Column heads of `table`; distances in metres, a walker is a pedestrian."""


def table() -> Iterator[tuple[str | float, ...]]:
    """Yield a line per weather: clear, then each adversity alone, from weak to strong."""
    skies = [("clear day", Sky())]
    skies += [(f"fog {m} m", Sky(visual_range=m)) for m in (1000, 500, 200, 100, 50, 20)]
    skies += [(f"rain {r} mm/h", Sky(rain=r)) for r in (2, 10, 50)]
    skies += [(f"snow {s} mm/h", Sky(snow=s)) for s in (1, 3, 10)]
    skies += [(f"sun {a}°, behind", Sky(sun_altitude=a)) for a in (10, 0, -3, -6, -9, -18)]
    skies += [
        (f"sun {_LOW_SUN}°, {off}° off", Sky(sun_altitude=_LOW_SUN, off_sun=off))
        for off in (60, 40, 20, 10, 0)
    ]
    night = -30.0
    skies += [(f"night, fog {m} m", Sky(m, sun_altitude=night)) for m in (500, 200, 50)]
    for name, sky in skies:
        ranges = [detection_range(sky, kind) for kind in (CAR, PEDESTRIAN)]
        yield (
            name,
            *(
                round(d, 1)
                for range_ in ranges
                for d in (range_.camera, range_.lidar, range_.fused)
            ),
        )
