"""A participant's course (timed poses) as individuals."""

import math

import numpy as np
import pyoxigraph as ox

from bridgegen.base.arrays import Float
from bridgegen.scenario.ontology.builder import Builder

DIGITS = 9
"""Decimals of a course's metres and degrees: with them it is written, read and run as it was."""


def rounded(course: Float) -> Float:
    """Return a course that its individuals, and the files made of them, give back to the last bit.

    Args:
        course: ``(V, 4)``: time [s], x, y [m], heading [rad].
    """
    degrees = np.round(np.degrees(course[:, 3]), DIGITS).tolist()
    headings = [math.radians(one) for one in degrees]  # as the files' reader does
    times, places = np.round(course[:, 0], DIGITS), np.round(course[:, 1:3], DIGITS)
    return np.column_stack((times, places, headings)) + 0.0


def add_course(builder: Builder, name: str, course: Float) -> ox.NamedNode:
    """Add the event by which a participant follows a course from the start on.

    Args:
        builder: where to.
        name: of the participant.
        course: ``(V, 4)``: time [s], x, y [m], heading [rad], rounded.
    """
    put = builder.put
    event = builder.node(f"{name}_course", "StoryboardEvent")
    put(event, "has_name", f"{name}_course")
    put(event, "has_who", builder.iri(name))
    action = builder.node(f"{name}_course_action", "FollowTrajectoryAction")
    put(event, "has_what", action)
    trajectory = builder.node(f"{name}_course_path", "Trajectory")
    put(action, "has_trajectory", trajectory)
    put(trajectory, "has_name", f"{name}_course_path")
    for number, (time, x, y, h) in enumerate(course.tolist(), start=1):
        vertex = builder.node(f"{name}_course_vertex_{number}", "Vertex")
        put(trajectory, "has_vertex", vertex)
        put(vertex, "has_index", number)
        put(vertex, "has_time", time)
        place = builder.node(f"{name}_course_point_{number}", "WorldPosition")
        put(vertex, "has_position", place)
        put(place, "has_world_x", x)
        put(place, "has_world_y", y)
        put(place, "has_world_yaw", round(math.degrees(h), DIGITS))
    begin = builder.node(f"{name}_course_trigger", "Trigger")
    condition = builder.node(f"{name}_course_start", "SimulationTimeCondition")
    put(condition, "has_value", 0.0)
    put(begin, "has_condition", condition)
    put(event, "has_when", begin)
    return event
