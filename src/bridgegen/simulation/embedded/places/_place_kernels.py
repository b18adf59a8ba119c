"""Placing entities: the pose of a position, and the path that continues from there.

A way that is not planned yet is asked for: ``state.wanted`` names the route and the node where it
begins, the row ends, and is run again from its start when it is there.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.compiled import kernel, run_kernel_at
from bridgegen.drivers._path_kernels import pose, project
from bridgegen.simulation.embedded._codes import (
    ABSOLUTE,
    ACROSS,
    ALONG,
    BY_LANE,
    BY_LANES,
    BY_OBJECT,
    BY_ROAD,
    BY_TRAJECTORY,
    BY_WORLD,
    HEADING,
    IN_WORLD,
    LANES_LEFT,
    ON_LANE,
    PLACE_KIND,
    WHOSE,
)
from bridgegen.simulation.embedded._memory_kernels import (
    NO_PLACE,
    NOT_THERE,
    STATUS,
    STOPS,
    UNPLANNED,
)
from bridgegen.simulation.embedded._motion_kernels import nearest, shifted
from bridgegen.simulation.embedded.places._lane_kernels import (
    LANE,
    LEAVE,
    NODE,
    S_LEAVE,
    T_LEAVE,
    TRAFFIC,
    WAY,
    S,
    T,
    along,
    beside,
    facing,
    find_lane,
    find_node,
    nearest_lane,
    span_at,
    station_of,
    turned,
    walk,
)

LANES, GROUND = -1, -2
"""Codes that are asked for instead of a node: the lanes of the road network, and the places of all
of them."""


@kernel
def ask(route, node, state):
    """End the row: it needs a way that is not planned yet."""
    state.wanted[0], state.wanted[1] = route, node
    state.ending[STATUS], state.ending[STOPS] = UNPLANNED, 1


@kernel
def fail(status, state):
    """End the row with a status, unless it has one."""
    if state.ending[STATUS] == 0:
        state.ending[STATUS] = status
    state.ending[STOPS] = 1


@kernel
def end_lateral(e, state):
    """End the action that moves an entity across its path, if any."""
    if state.lateral_action[e] >= 0:
        state.action_ended[state.lateral_action[e]] = True
    if state.waits[e] >= 0:
        state.action_ended[state.waits[e]] = True
    state.lateral_action[e] = state.to[e] = state.waits[e] = -1


@kernel
def end_follow(e, state):
    """End the action that leads an entity along a trajectory, if any."""
    if state.follow_action[e] >= 0:
        state.action_ended[state.follow_action[e]] = True
    state.follow_action[e] = state.follow[e] = -1
    state.laid_count[e] = 0
    state.tail_first[e] = False


@kernel
def way_along(e, step, passed, state):
    """Return how far a step [m] leads an entity on along its trajectory, so far along it [m].

    Who reverses where it begins follows it tail first; who reverses later goes back along it.
    """
    # Settled where it begins, as Vector's Euro NCAP files mean it: a nose must not jump where a
    # speed changes its sign.
    state.tail_first[e] |= step < 0.0 and passed <= 0.0
    return -step if state.tail_first[e] else step


@kernel
def way_from(route, node, roads, state):
    """Return the path that begins with a node and follows a route, or goes straight on.

    -1: it is asked for, and the row ends.
    """
    path = roads.ways[route, node] if roads.ways.shape[1] else -1
    # Straight on then, on the lane whose end differs least in heading. The standard leaves the way
    # open; esmini draws it.
    if path == -2 and route > 0:  # the route cannot be reached: no route
        route = 0
        path = roads.ways[0, node]
    # What rows will need cannot be planned beforehand: events come in any order, and entities
    # change lanes and teleport anywhere. On Town05 a way of 1 km takes 8 to 25 ms.
    if path == -1:
        ask(route, node, state)
    elif path == -2:
        fail(NO_PLACE, state)
    return path


@kernel
def way_ahead(e, roads, state):
    """Return the path that an entity would take from its lane on if it were placed there now.

    Its own may end where lanes fork. -1: it is on no lane, or the path is asked for.
    """
    node, _, _ = node_under(e, roads, state)
    if node < 0:
        return -1
    path = roads.ways[state.route[e], node]
    if path == -1:
        ask(state.route[e], node, state)
    return path if path != -2 else state.on[e]


@kernel
def node_under(e, roads, state):
    """Return (node, s, t) of an entity's place on its path; node -1 if it is on no lane."""
    p = state.on[e]
    if p < 0 or roads.span_counts[p] == 0:
        return -1, 0.0, 0.0
    spans, station = roads.spans[p], state.station[e]
    i = span_at(spans, roads.span_counts[p], station)
    node = int(spans[i, NODE])
    t = along(spans, i, station, T, T_LEAVE) + roads.nodes[node, WAY] * state.aside[e]
    return node, along(spans, i, station, S, S_LEAVE), t


@kernel
def put_on_lane(e, node, s, aside, turn, roads, state):
    """Put an entity on a lane, so far left of its centre and turned from its direction."""
    p = way_from(state.route[e], node, roads, state)
    if p < 0:
        return
    state.on[e], state.aside[e], state.turn[e] = p, aside, turn
    state.station[e] = station_of(roads.spans[p], roads.span_counts[p], node, s)


@kernel
def put_in_world(e, x, y, h, roads, state):
    """Place an entity in the world: on the lane that is there, or on none.

    An entity on no lane goes straight ahead.
    """
    put_along(e, x, y, h, h, roads, state)


@kernel
def put_along(e, x, y, h, along, roads, state):
    """Place an entity as ``put_in_world``, on a lane that leads the way of another heading."""
    if roads.ground.shape[0] == 0:
        ask(0, GROUND, state)
        return
    node = nearest_lane(roads.ground, roads.ground_nodes, x, y, along)
    if node < 0:
        state.on[e], state.station[e], state.aside[e], state.turn[e] = -1, 0.0, 0.0, 0.0
        state.line[e, 0], state.line[e, 1], state.line[e, 2] = x, y, h
        return
    p = way_from(state.route[e], node, roads, state)
    if p < 0:
        return
    path, n, ds = roads.paths[p], roads.counts[p], roads.steps[p]
    spans = roads.spans[p]
    first = 0.0
    for i in range(roads.span_counts[p]):  # the way may pass here again: its first lane counts
        if spans[i, NODE] != node:
            break
        first = spans[i, LEAVE]
    count = min(int(first / ds) + 2, n)
    station = nearest(path, max(count, 2), ds, x, y)
    station, aside = project(path, n, ds, station, x, y)
    state.on[e], state.station[e], state.aside[e] = p, station, aside
    state.turn[e] = turned(h, pose(path, n, ds, station)[2])


@kernel
def lane_place(c, plan, roads, state):
    """Return (node, s, aside) of a Lane or Road position; node -1: there is no such place.

    The node leads along the lane's traffic; that of a road position along the reference line, of a
    route position along the route.
    """
    row, spot = plan.places[c], roads.spots[c]
    s, aside = spot[2], spot[3]
    if row[PLACE_KIND] == ON_LANE:
        s, aside = state.slots[row[ALONG]], state.slots[row[ACROSS]]
    node = find_node(roads.nodes, roads.ends, int(spot[0]), int(spot[1]), s)
    if node < 0:
        return -1, 0.0, 0.0
    way = roads.nodes[node, TRAFFIC] if row[PLACE_KIND] == ON_LANE else int(spot[4])
    return facing(roads.nodes, node, way), s, aside * way


@kernel
def lane_place_by(c, plan, roads, state):
    """Return (node, s, aside) of a RelativeLane or RelativeRoad position, as ``lane_place``.

    Ahead and left are those of the road, or of the lane's traffic if the position defines that.
    """
    row = plan.places[c]
    e = row[WHOSE]
    node, s, _ = node_under(e, roads, state)
    if node < 0:
        return -1, 0.0, 0.0
    way = roads.nodes[node, TRAFFIC] if row[BY_LANE] else 1
    own = state.aside[e] if roads.nodes[node, WAY] == way else -state.aside[e]
    metres, offset = state.slots[row[ALONG]], state.slots[row[ACROSS]]
    node = facing(roads.nodes, node, way)
    node, s = walk(roads.nodes, roads.ends, node, s, metres)
    if node < 0:
        return -1, 0.0, 0.0
    if row[PLACE_KIND] == BY_ROAD:
        return node, s, own + offset
    way = roads.nodes[node, WAY]  # the road may run the other way round now
    node = find_lane(roads.nodes, node, beside(roads.nodes[node, LANE], row[LANES_LEFT] * way), way)
    if node >= 0 and roads.nodes[node, TRAFFIC] != way:
        return node ^ 1, s, -offset
    return node, s, offset


@kernel
def world_place(c, k, plan, roads, state, record):
    """Return (x, y, heading) of a World, RelativeObject, RelativeWorld or Trajectory position.

    A trajectory may be laid through positions along others: its kernel has an address.
    """
    row = plan.places[c]
    u, w, h = state.slots[row[ALONG]], state.slots[row[ACROSS]], state.slots[row[HEADING]]
    if row[PLACE_KIND] == IN_WORLD:
        return u, w, h
    if row[PLACE_KIND] == BY_TRAJECTORY:
        run_kernel_at(plan.poses_along, (c, k, plan, roads, state, record))
        x, y, along = state.pose[0], state.pose[1], state.pose[2]
        x, y = shifted(x, y, along, w)
        return x, y, h if row[ABSOLUTE] else along + h
    e = row[WHOSE]
    x, y, own = record.x[e, k], record.y[e, k], record.h[e, k]
    if not row[ABSOLUTE]:
        h += own
    if row[PLACE_KIND] == BY_WORLD:
        return x + u, y + w, h
    ahead, aside = elementary.cos(own), elementary.sin(own)
    return x + u * ahead - w * aside, y + u * aside + w * ahead, h


@kernel
def pose_of(c, k, plan, roads, state, record):
    """Return (x, y, heading) of a position at instant k; NaN where there is no such place.

    Where entities are is looked up as of instant k, too.
    """
    kind, other = plan.places[c, PLACE_KIND], plan.places[c, WHOSE]
    if other >= 0 and not state.present[other]:
        return math.nan, math.nan, math.nan
    if kind == IN_WORLD or kind >= BY_OBJECT:
        return world_place(c, k, plan, roads, state, record)
    if roads.nodes.shape[0] == 0:
        ask(0, LANES, state)
        return math.nan, math.nan, math.nan
    if kind >= BY_LANES:
        node, s, aside = lane_place_by(c, plan, roads, state)
    else:
        node, s, aside = lane_place(c, plan, roads, state)
    if node < 0:
        return math.nan, math.nan, math.nan
    p = way_from(0, node, roads, state)
    if p < 0:
        return math.nan, math.nan, math.nan
    station = station_of(roads.spans[p], roads.span_counts[p], node, s)
    x, y, h = pose(roads.paths[p], roads.counts[p], roads.steps[p], station)
    x, y = shifted(x, y, h, aside)
    turn = state.slots[plan.places[c, HEADING]]
    return x, y, turn if plan.places[c, ABSOLUTE] else h + turn


@kernel
def place_at(number, k, plan, roads, state, record):
    """Return (x, y) of a place as it is at instant k: of a point, or, from -1 down, of a position.

    If there is no such place, the row ends.
    """
    if number >= 0:
        return roads.points[number, 0], roads.points[number, 1]
    x, y, _ = pose_of(-1 - number, k, plan, roads, state, record)
    if math.isnan(x):
        fail(NO_PLACE, state)
    return x, y


@kernel
def put(e, c, k, plan, roads, state, record):
    """Place an entity at a position as of instant k, see ``place_pose``. It keeps its route."""
    kind, other = plan.places[c, PLACE_KIND], plan.places[c, WHOSE]
    is_there = other < 0 or state.present[other]
    if not is_there and not (other == e and record.present[e, :k].any()):
        fail(NOT_THERE, state)  # an entity that reappears may refer to where it disappeared
        return
    if roads.nodes.shape[0] == 0:
        ask(0, LANES, state)
        return
    if kind == IN_WORLD or kind >= BY_OBJECT:
        x, y, h = world_place(c, k, plan, roads, state, record)
        if math.isnan(x):
            fail(NO_PLACE, state)
            return
        put_in_world(e, x, y, h, roads, state)
        return
    if kind >= BY_LANES:
        node, s, aside = lane_place_by(c, plan, roads, state)
    else:
        node, s, aside = lane_place(c, plan, roads, state)
    if node < 0:
        fail(NO_PLACE, state)
        return
    turn = state.slots[plan.places[c, HEADING]]
    if plan.places[c, ABSOLUTE]:
        p = way_from(state.route[e], node, roads, state)
        if p < 0:
            return
        station = station_of(roads.spans[p], roads.span_counts[p], node, s)
        turn -= pose(roads.paths[p], roads.counts[p], roads.steps[p], station)[2]
    turn = turned(turn, 0.0)
    # Nodes come in pairs, one for each direction of a lane: the other one differs in the last bit.
    if abs(turn) > 0.5 * math.pi:  # it faces, and goes, the other way
        node, aside, turn = node ^ 1, -aside, turned(turn, math.pi)
    put_on_lane(e, node, s, aside, turn, roads, state)


@kernel
def body_pose(e, roads, state):
    """Return (x, y, heading) of an entity by its place on its path."""
    p = state.on[e]
    if p < 0:
        h = state.line[e, 2]
        x = state.line[e, 0] + state.station[e] * elementary.cos(h)
        y = state.line[e, 1] + state.station[e] * elementary.sin(h)
    else:
        x, y, h = pose(roads.paths[p], roads.counts[p], roads.steps[p], state.station[e])
    x, y = shifted(x, y, h, state.aside[e])
    return x, y, h + state.turn[e]
