"""A server of AlpaSim's egodriver contract, written from it, with Google's Protocol Buffers."""

from concurrent import futures

import grpc
from tests.google_messages import classes

# NVlabs/alpasim, src/grpc/alpasim_grpc/v0/common.proto and egodriver.proto; carla_driver.proto of
# carla-driver-interface: name, type (of a message: its name) and number of each field.
CONTRACT = {
    "Empty": "",
    "Vec3": "x float 1, y float 2, z float 3",
    "Quat": "w float 1, x float 2, y float 3, z float 4",
    "Pose": "vec Vec3 1, quat Quat 2",
    "PoseAtTime": "pose Pose 1, timestamp_us fixed64 2",
    "Trajectory": "poses PoseAtTime* 1",
    "DynamicState": "angular_velocity Vec3 1, linear_velocity Vec3 2, linear_acceleration Vec3 3, "
    "angular_acceleration Vec3 4",
    "VersionId": "version_id string 1, git_hash string 2",
    "Camera": "logical_id string 4",
    "Vehicle": "available_cameras Camera* 3",
    "Spec": "vehicle Vehicle 1",
    "DriveSessionRequest": "session_uuid string 1, random_seed fixed64 2, rollout_spec Spec 5",
    "DriveSessionCloseRequest": "session_uuid string 1",
    "RolloutEgoTrajectory": "session_uuid string 1, trajectory Trajectory 3, "
    "dynamic_states DynamicState* 5",
    "Route": "waypoints Vec3* 1, timestamp_us fixed64 2",
    "RouteRequest": "session_uuid string 1, route Route 3",
    "DriveRequest": "session_uuid string 1, time_now_us fixed64 3, time_query_us fixed64 4, "
    "renderer_data bytes 5",
    "DriveResponse": "trajectory Trajectory 2, debug_info Debug 3, terminate_session bool 4",
    "Debug": "unstructured_debug_info bytes 1, sampled_trajectories Trajectory* 2",
    "AABB": "size_x float 1, size_y float 2, size_z float 3",
    "Actor": "track_id string 1, type_id string 2, pose_local_to_aabb Pose 3, aabb AABB 4, "
    "dynamic_state DynamicState 5",
    "CarlaRendererData": "snapshot_timestamp_us fixed64 1, ego_traffic_light int32 5, "
    "ego_traffic_light_distance_m float 6, speed_limit_mps float 7, actors Actor* 8",
}
SERVICE = "egodriver.EgodriverService"
REQUESTS = {
    "get_version": "Empty",
    "start_session": "DriveSessionRequest",
    "submit_egomotion_observation": "RolloutEgoTrajectory",
    "submit_route": "RouteRequest",
    "drive": "DriveRequest",
    "close_session": "DriveSessionCloseRequest",
}


M = classes(CONTRACT)


def plan(request, egomotion, speed=5.0, n=20, step=0.1):
    """Straight ahead at a constant speed, from the pose that it was told."""
    answer, first = M["DriveResponse"](), egomotion.trajectory.poses[-1]
    w, z = first.pose.quat.w, first.pose.quat.z
    for k in range(n + 1):
        one = answer.trajectory.poses.add(timestamp_us=request.time_now_us + round(1e6 * k * step))
        one.pose.CopyFrom(first.pose)
        one.pose.vec.x += (w * w - z * z) * k * step * speed
        one.pose.vec.y += 2.0 * w * z * k * step * speed
    answer.debug_info.unstructured_debug_info = b"\x80\x04}."
    return answer


class Server:
    """Answers as the contract says; ``answers`` by method replace what it answers.

    An answer is a message, bytes, or a function of the request and gRPC's context.
    """

    def __init__(self, extension=False, port=0, **answers):
        self.calls, self.answers, self.extension = [], answers, extension
        self.egomotion = None
        self.grpc = grpc.server(futures.ThreadPoolExecutor(2))
        handlers = {
            name: grpc.unary_unary_rpc_method_handler(self.answering(name, M[kind]))
            for name, kind in REQUESTS.items()
        }
        self.grpc.add_generic_rpc_handlers(
            (grpc.method_handlers_generic_handler(SERVICE, handlers),)
        )
        self.port = self.grpc.add_insecure_port(f"127.0.0.1:{port}")
        self.grpc.start()

    @property
    def spec(self):
        return f"egodriver://127.0.0.1:{self.port}"

    def answering(self, name, kind):
        def answer(data, context):
            request = kind.FromString(data)
            self.calls.append((name, request))
            if name == "submit_egomotion_observation":
                self.egomotion = request
            if name == "get_version" and self.extension:
                context.send_initial_metadata((("carla-driver-interface-contract", "2"),))
            found = self.answers.get(name)
            if callable(found):
                found = found(request, context)
            if found is None:
                found = M["Empty"]()
                if name == "get_version":
                    found = M["VersionId"](version_id="straight-1.0")
                if name == "drive":
                    found = plan(request, self.egomotion)
            return found if isinstance(found, bytes) else found.SerializeToString()

        return answer

    def named(self, name):
        return [request for called, request in self.calls if called == name]

    def close(self):
        self.grpc.stop(None).wait()
