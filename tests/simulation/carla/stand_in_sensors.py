"""Sensors of the stand-in."""

import math

import carla
import numpy as np

from .stand_in_actors import Sensor, Vehicle, Walker, copied, vector


class SensorData:
    """See `carla.SensorData`."""

    def __init__(self, sensor, **said):
        machine = sensor._machine
        self.frame, self.timestamp = machine.frame, 0.05 * machine.frame
        self.transform = mounted(sensor)
        for name, value in said.items():
            setattr(self, name, value)


def mounted(sensor):
    """Return where a sensor is in the world."""
    base, own = sensor.parent.transform, copied(sensor.transform)
    return carla.Transform(
        base.transform(own.location),  # in its place
        carla.Rotation(pitch=own.rotation.pitch, yaw=base.rotation.yaw + own.rotation.yaw),
    )


class CollisionSensor(Sensor):
    """Tells at every tick of a contact, as CARLA does."""

    def data(self):
        from .stand_in import shape

        here = self.parent.transform.location
        near = [
            one
            for one in self._machine.actors.values()
            if isinstance(one, Vehicle | Walker)
            and one is not self.parent
            and here.distance(one.transform.location) < 20.0
            and abs(one.transform.location.z - here.z) < 3.0
        ]
        return [
            SensorData(self, actor=self.parent, other_actor=one, normal_impulse=vector(100.0))
            for one in near
            if shape(self.parent).intersects(shape(one))
        ]


class LaneInvasionSensor(Sensor):
    """Tells when the middle of the body is over another lane."""

    lane = None

    def data(self):
        here = self._machine.map.get_waypoint(self.parent.transform.location)
        lane = None if here is None or here.is_junction else (here.road_id, here.lane_id)
        before, self.lane = self.lane, lane
        if before is None or lane is None or before[0] != lane[0] or before == lane:
            return []
        return [SensorData(self, actor=self.parent, crossed_lane_markings=[here.left_lane_marking])]


class Camera(Sensor):
    """Paints the boxes of others that are ahead, as red rectangles on grey, with no occlusion."""

    def data(self):
        width, height = (int(self.attributes[f"image_size_{axis}"]) for axis in "xy")
        focal = width / (2.0 * math.tan(math.radians(float(self.attributes["fov"])) / 2.0))
        pixels = np.full((height, width, 4), 128, np.uint8)
        pose = mounted(self)
        inverse = np.array(pose.get_inverse_matrix())
        for one in self._machine.actors.values():
            if not isinstance(one, Vehicle | Walker) or one is self.parent:
                continue
            corners = [
                inverse @ [corner.x, corner.y, corner.z, 1.0]
                for corner in one.bounding_box.get_world_vertices(one.transform)
            ]
            if min(corner[0] for corner in corners) < 0.5:
                continue
            u = [width / 2 + focal * corner[1] / corner[0] for corner in corners]
            v = [height / 2 - focal * corner[2] / corner[0] for corner in corners]
            left, right = (int(np.clip(round(edge), 0, width)) for edge in (min(u), max(u)))
            top, bottom = (int(np.clip(round(edge), 0, height)) for edge in (min(v), max(v)))
            pixels[top:bottom, left:right, :3] = (0, 0, 255)  # blue, green, red
        return [Image(self, pixels, float(self.attributes["fov"]))]


class Image(SensorData):
    """See `carla.Image`."""

    def __init__(self, sensor, pixels, fov):
        super().__init__(sensor, fov=fov, height=pixels.shape[0], width=pixels.shape[1])
        self.raw_data = pixels.tobytes()

    def save_to_disk(self, path, color_converter=None):
        with open(path, "wb") as file:
            file.write(self.raw_data)


class Lidar(Sensor):
    """Sees the corners of the bodies of others."""

    def data(self):
        inverse = np.array(mounted(self).get_inverse_matrix())
        points = [
            [*(inverse @ [corner.x, corner.y, corner.z, 1.0])[:3], 1.0]
            for one in self._machine.actors.values()
            if isinstance(one, Vehicle | Walker) and one is not self.parent
            for corner in one.bounding_box.get_world_vertices(one.transform)
        ]
        return [LidarMeasurement(self, np.array(points, np.float32).reshape(-1, 4))]


class LidarMeasurement(SensorData):
    """See `carla.LidarMeasurement`."""

    def __init__(self, sensor, points):
        super().__init__(sensor, channels=32, raw_data=points.tobytes())

    def save_to_disk(self, path):
        with open(path, "wb") as file:
            file.write(self.raw_data)


CLASSES = {
    "sensor.other.collision": CollisionSensor,
    "sensor.other.lane_invasion": LaneInvasionSensor,
    "sensor.camera.rgb": Camera,
    "sensor.lidar.ray_cast": Lidar,
}
