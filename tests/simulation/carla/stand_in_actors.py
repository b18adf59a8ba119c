"""Actors of the stand-in: they advance by simple physics, and are as strict as CARLA's."""

import math

import carla
import numpy as np

DEAD = (
    "trying to operate on a destroyed actor; an actor's function was called, but the actor is "
    "already destroyed."
)
GRAVITY, DRY = 9.81, 3.5
THROTTLE, BRAKE, ROLLING, LAG = 4.2, 8.0, 0.15, 0.1
FEATURES = {  # length, width, height, x of the box's centre, wheelbase [m], lock [deg]
    "vehicle.lincoln.mkz_2017": (4.90, 2.13, 1.51, 0.02, 2.85, 70.0),
    "vehicle.tesla.model3": (4.79, 2.16, 1.49, 0.01, 3.00, 70.0),
    "vehicle.carlamotors.carlacola": (5.20, 2.61, 2.47, 0.11, 2.90, 70.0),
    "vehicle.mitsubishi.fusorosa": (10.27, 3.94, 4.25, 0.30, 5.6, 60.0),
    "vehicle.kawasaki.ninja": (2.03, 0.80, 1.50, 0.05, 1.39, 50.0),
    "vehicle.bh.crossbike": (1.49, 0.86, 1.80, 0.0, 1.02, 50.0),
}
PROPS = {"static.prop.streetbarrier": (1.2, 0.4, 1.1), "static.prop.warningconstruction": (1, 1, 1)}
SENSORS = {
    "sensor.other.collision": {},
    "sensor.other.lane_invasion": {},
    "sensor.camera.rgb": {
        "image_size_x": "800", "image_size_y": "600", "fov": "90", "sensor_tick": "0",
    },
    "sensor.lidar.ray_cast": {
        "channels": "32", "range": "10", "points_per_second": "56000", "rotation_frequency": "10",
        "upper_fov": "10", "lower_fov": "-30", "sensor_tick": "0",
    },
}  # fmt: skip


def vector(x=0.0, y=0.0, z=0.0):
    return carla.Vector3D(x=x, y=y, z=z)


class ActorAttribute:
    """See `carla.ActorAttribute`."""

    def __init__(self, id, value="", recommended=()):
        self.id, self.value, self.recommended_values = id, value, list(recommended)
        self.is_modifiable = True

    def as_str(self):
        return self.value


class ActorBlueprint:
    """See `carla.ActorBlueprint`."""

    def __init__(self, id, maker, attributes):
        self.id, self._maker = id, maker
        self._attributes = {one.id: one for one in attributes}

    def __iter__(self):
        return iter(self._attributes.values())

    def __len__(self):
        return len(self._attributes)

    def has_attribute(self, id):
        return id in self._attributes

    def get_attribute(self, id):
        return self._attributes[id]

    def set_attribute(self, id, value):
        if not isinstance(value, str):
            raise TypeError("set_attribute takes texts")
        if id not in self._attributes:
            raise IndexError(f"invalid attribute '{id}'")
        self._attributes[id].value = value

    def make(self, machine, transform, parent):
        said = {name: one.value for name, one in self._attributes.items()}
        return self._maker(machine, self.id, said, transform, parent)


def blueprints():
    """Return all that there are, fresh."""
    colours = ActorAttribute("color", "", ["17,37,103", "160,30,10"])
    found = [
        ActorBlueprint(one, Vehicle, [ActorAttribute("role_name", "autopilot"), colours])
        for one in FEATURES
    ]
    found += [
        ActorBlueprint(
            f"walker.pedestrian.{number:04}", Walker,
            [ActorAttribute("role_name", "pedestrian"), ActorAttribute("is_invincible", "false")],
        )
        for number in (1, 2, 10)
    ]  # fmt: skip
    found += [ActorBlueprint(one, Prop, [ActorAttribute("role_name", "prop")]) for one in PROPS]
    for one, defaults in SENSORS.items():
        said = [ActorAttribute(name, value) for name, value in defaults.items()]
        made = _sensor_class(one)
        found.append(ActorBlueprint(one, made, [ActorAttribute("role_name", "front"), *said]))
    return found


def _sensor_class(kind):
    from . import stand_in_sensors

    return stand_in_sensors.CLASSES[kind]


class Actor:
    """See `carla.Actor`."""

    def __init__(self, machine, type_id, attributes, transform, parent=None):
        self._machine, self.type_id, self.attributes = machine, type_id, attributes
        self.transform, self.velocity, self.parent = copied(transform), vector(), parent
        self.id, self.physics = 0, True
        self.bounding_box = carla.BoundingBox(carla.Location(), vector(0.1, 0.1, 0.1))

    @property
    def is_alive(self):
        return self.id in self._machine.actors

    def _rpc(self, name):
        self._machine.rpc(name)
        if not self.is_alive:
            raise RuntimeError(DEAD)

    def get_transform(self):
        return copied(self.transform)

    def get_velocity(self):
        return self.velocity

    def get_location(self):
        return self.get_transform().location

    def set_transform(self, transform):
        self._rpc("set_transform")
        self.transform = copied(transform)

    def set_target_velocity(self, velocity):
        self._rpc("set_target_velocity")
        self.velocity = velocity

    def set_simulate_physics(self, enabled=True):
        self._rpc("set_simulate_physics")
        self.physics = enabled

    def destroy(self):
        self._rpc("destroy")
        for one in list(self._machine.actors.values()):
            if one.parent is self:
                del self._machine.actors[one.id]
        del self._machine.actors[self.id]
        return True

    def step(self, dt):
        """Let time pass."""


class Prop(Actor):
    """What stands where it is put."""

    def __init__(self, machine, type_id, attributes, transform, parent=None):
        super().__init__(machine, type_id, attributes, transform, parent)
        length, width, height = PROPS[type_id]
        self.bounding_box = carla.BoundingBox(
            carla.Location(z=height / 2), vector(length / 2, width / 2, height / 2)
        )


class Walker(Actor):
    """See `carla.Walker`; its origin is its middle."""

    def __init__(self, machine, type_id, attributes, transform, parent=None):
        super().__init__(machine, type_id, attributes, transform, parent)
        self.bounding_box = carla.BoundingBox(carla.Location(), vector(0.19, 0.19, 0.93))

    def walk_to(self, transform, speed):
        """As the server does on ApplyWalkerState: the transform is that of the feet."""
        self._rpc("set_walker_state")
        self.transform = copied(transform)
        self.transform.location.z += self.bounding_box.extent.z
        forward = transform.get_forward_vector()
        self.velocity = vector(forward.x * speed, forward.y * speed)


class Vehicle(Actor):
    """See `carla.Vehicle`: a bicycle with a lagging engine, brakes, and tyres that slip."""

    def __init__(self, machine, type_id, attributes, transform, parent=None):
        super().__init__(machine, type_id, attributes, transform, parent)
        length, width, height, ahead, self.wheelbase, self.lock = FEATURES[type_id]
        self.bounding_box = carla.BoundingBox(
            carla.Location(x=ahead, z=height / 2), vector(length / 2, width / 2, height / 2)
        )
        self.control, self.autopilot_port = carla.VehicleControl(), None
        self.friction, self.force, self.steer = [DRY] * 4, 0.0, 0.0

    def apply_control(self, control):
        self._rpc("apply_control")
        assert isinstance(control, carla.VehicleControl)
        assert 0.0 <= control.throttle <= 1.0
        assert 0.0 <= control.brake <= 1.0
        assert -1.0 <= control.steer <= 1.0
        self.control = control

    def get_control(self):
        return self.control

    def set_autopilot(self, enabled=True, tm_port=8000):
        self._rpc("set_autopilot")
        manager = self._machine.managers[tm_port]
        manager.vehicles = [one for one in manager.vehicles if one is not self]
        if enabled:
            manager.vehicles.append(self)

    def get_physics_control(self):
        self._rpc("get_physics_control")
        wheels = []
        for i, friction in enumerate(self.friction):
            wheel = carla.WheelPhysicsControl(tire_friction=friction)
            wheel.max_steer_angle = self.lock if i < 2 else 0.0
            ahead, aside = (0.5 if i < 2 else -0.5) * self.wheelbase, 0.8 if i % 2 else -0.8
            place = self.transform.transform(carla.Location(x=ahead, y=aside))
            wheel.position = vector(100.0 * place.x, 100.0 * place.y, 30.0)
            wheels.append(wheel)
        control = carla.VehiclePhysicsControl()
        control.wheels = wheels
        control.steering_curve = [
            carla.Vector2D(x=0.0, y=1.0), carla.Vector2D(x=20.0, y=0.9),
            carla.Vector2D(x=60.0, y=0.8), carla.Vector2D(x=120.0, y=0.7),
        ]  # fmt: skip
        return control

    def apply_physics_control(self, physics_control):
        self._rpc("apply_physics_control")
        self.friction = [one.tire_friction for one in physics_control.wheels]

    def step(self, dt):
        if not self.physics:
            return
        for _ in range(5):
            self._substep(dt / 5)

    def _substep(self, dt):
        yaw = math.radians(self.transform.rotation.yaw)
        v = self.velocity.x * math.cos(yaw) + self.velocity.y * math.sin(yaw)
        grip = GRAVITY * min(self.friction) / DRY
        control = self.control
        wanted = control.throttle * THROTTLE * (1.0 - v / 60.0) - control.brake * BRAKE
        self.force += (wanted - self.force) * dt / LAG
        slows = ROLLING + 0.0004 * v * v if v > 0.0 else 0.0
        a = float(np.clip(self.force - slows, -grip, grip))
        if control.hand_brake:
            a = min(a, -BRAKE)
        after = max(v + a * dt, 0.0)
        share = np.interp(3.6 * v, [0, 20, 60, 120], [1, 0.9, 0.8, 0.7])
        self.steer += (control.steer - self.steer) * dt / 0.05
        curvature = math.tan(math.radians(self.lock) * share * self.steer) / self.wheelbase
        if v > 1.0:
            curvature = float(np.clip(curvature, -grip / v**2, grip / v**2))
        way, half = 0.5 * (v + after) * dt, 0.5 * self.wheelbase
        at = self.transform.location
        rear = (at.x - half * math.cos(yaw), at.y - half * math.sin(yaw))
        turned = yaw + curvature * way
        middle = yaw + 0.5 * curvature * way
        rear = (rear[0] + way * math.cos(middle), rear[1] + way * math.sin(middle))
        self.transform = carla.Transform(
            carla.Location(
                x=rear[0] + half * math.cos(turned), y=rear[1] + half * math.sin(turned), z=at.z
            ),
            carla.Rotation(yaw=math.degrees(turned)),
        )
        self.velocity = vector(after * math.cos(turned), after * math.sin(turned))


class TrafficLight(Actor):
    """See `carla.TrafficLight`."""

    def __init__(self, machine, landmark):
        super().__init__(machine, "traffic.traffic_light", {}, landmark.transform)
        self.state, self.frozen, self._landmark = carla.TrafficLightState.Red, False, landmark

    def set_state(self, state):
        self._rpc("set_state")
        assert isinstance(state, carla.TrafficLightState)
        self.state = state

    def get_state(self):
        return self.state

    def get_stop_waypoints(self):
        self._rpc("get_stop_waypoints")
        return [one for one in [self._landmark.waypoint] if one is not None]


class Sensor(Actor):
    """See `carla.Sensor`."""

    def __init__(self, machine, type_id, attributes, transform, parent=None):
        super().__init__(machine, type_id, attributes, transform, parent)
        assert parent is not None
        self.callback, self._due = None, 0.0

    def listen(self, callback):
        self._rpc("listen")
        self.callback = callback

    def stop(self):
        self._rpc("stop")
        self.callback = None

    def sense(self):
        """Tell what there is, if somebody listens and it is time."""
        self._due -= 0.05
        if self.callback is None or self._due > 1e-9:
            return
        self._due = float(self.attributes.get("sensor_tick", 0.0))
        for data in self.data():
            if self.callback is not None:
                self.callback(data)

    def data(self):
        """Return what there is to tell now."""
        return []


class TrafficManager:
    """See `carla.TrafficManager`: drives along the path, at the speed that it is told."""

    def __init__(self, machine, port):
        self._machine, self._port, self.vehicles = machine, port, []
        self.synchronous, self.seed, self.paths, self.speeds = False, None, {}, {}

    def set_synchronous_mode(self, mode_switch=True):
        self.synchronous = mode_switch

    def set_random_device_seed(self, value):
        self.seed = value

    def auto_lane_change(self, actor, enable):
        assert actor in self.vehicles

    def set_path(self, actor, path, empty_buffer=True):
        assert all(isinstance(one, carla.Location) for one in path)
        self.paths[actor.id] = [(one.x, one.y) for one in path]

    def set_desired_speed(self, actor, speed):
        self.speeds[actor.id] = speed / 3.6

    def drive(self):
        """Set the controls of the vehicles for a tick."""
        for one in self.vehicles:
            if one.id not in self._machine.actors:
                continue
            v = math.hypot(one.velocity.x, one.velocity.y)
            steer = _pursue(one, self.paths.get(one.id, []), v)
            push = 0.5 * (self.speeds.get(one.id, 8.0) - v)
            one.apply_control(
                carla.VehicleControl(
                    throttle=min(max(push, 0.0), 1.0), brake=min(max(-push, 0.0), 1.0), steer=steer
                )
            )


def _pursue(vehicle, path, v):
    """Steer for a point of a path some way ahead."""
    at = vehicle.transform
    inverse = np.array(at.get_inverse_matrix())
    reach = 4.0 + 0.3 * v
    for x, y in path:
        ahead, aside = (inverse @ [x, y, at.location.z, 1.0])[:2]
        if ahead > reach:
            curvature = 2.0 * aside / (ahead**2 + aside**2)
            angle = math.degrees(math.atan(curvature * vehicle.wheelbase))
            return float(np.clip(angle / vehicle.lock, -1.0, 1.0))
    return 0.0


def copied(transform):
    at, turn = transform.location, transform.rotation
    return carla.Transform(
        carla.Location(x=at.x, y=at.y, z=at.z),
        carla.Rotation(pitch=turn.pitch, yaw=turn.yaw, roll=turn.roll),
    )
