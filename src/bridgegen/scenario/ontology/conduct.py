"""Rules of layers 1 to 4 in every scenario: where things and participants may be, how fast.

Each is one query per scenario, however many participants it has.
"""

from collections.abc import Iterator

from bridgegen.base.physics import DRY_FRICTION, GRAVITY, GRIP, MOST_LATERAL
from bridgegen.scenario.language.expression import parse
from bridgegen.scenario.language.kinds import TOLERANCE
from bridgegen.scenario.language.rules import STRAIGHT
from bridgegen.scenario.ontology.rule import Rule, about, called, is_a, shown, slack, with_unit
from bridgegen.scenario.ontology.sparql import binds, literal
from bridgegen.scenario.ontology.templates import OPPOSITE

_PAPER = "BridgeGen paper, Section III-B"
_SLACK = literal(TOLERANCE)
_GRIP, _MOST = literal(GRIP), literal(MOST_LATERAL)
_PARTICIPANT = "$this bg:has_participant ?value ."
_DOES = "(bg:has_init_action|^bg:has_who/bg:has_what)"
_ROUTE = "bg:has_route/(bg:has_start|bg:has_destination)"
_PLACES = (
    f"({_ROUTE}|{_DOES}/(bg:has_position|bg:has_trajectory/bg:has_vertex/bg:has_position|{_ROUTE}))"
)
_ROAD = "^(bg:has_lane|bg:has_strip)"
_WEATHERS = "(bg:has_weather|bg:has_event/bg:has_what/bg:has_weather)"


def conduct_rules() -> Iterator[Rule]:
    """Yield the rules."""
    yield from _places()
    yield from _pedestrians()
    yield from _vehicles()
    yield from _speeds()
    yield from _bends()
    yield from _closed_roads()
    yield from _temporary_changes()
    yield from _conflicts()


# -- where -----------------------------------------------------------------------------------------


def _places() -> Iterator[Rule]:
    yield Rule(
        "on-its-road",
        "",
        "Scenario",
        "must lie on the road of its lane ({?lane}), got {?got}",
        None,
        "",
        f"SELECT $this ?value ({called('?on')} AS ?lane) ({shown('?at')} AS ?got) WHERE {{ "
        f"$this a bg:Scenario . ?on {_ROAD} ?road ; ^bg:on_lane ?value . "
        "?value bg:has_distance ?at . ?road bg:has_length ?length . "
        "OPTIONAL { ?nearer bg:has_continuation+ ?road ; bg:has_length ?before } } "
        "GROUP BY $this ?value ?on ?at ?length HAVING("
        f"xsd:double(?at) < SUM(COALESCE(?before, 0.0e0)) - {_SLACK} || "
        f"xsd:double(?at) > SUM(COALESCE(?before, 0.0e0)) + xsd:double(?length) + {_SLACK})",
        "has_distance",
        True,
        ("LanePosition",),
    )


def _pedestrians() -> Iterator[Rule]:
    why = "Pedestrians walk on sidewalks, and cross roads on crosswalks, unless there is a reason."
    source = f"{_PAPER} (pedestrians walk on crosswalks only)"
    walker = (
        f"{_PARTICIPANT} {is_a('?value', 'Pedestrian')} "
        "FILTER NOT EXISTS { ?value bg:has_reason_off_crosswalk ?reason }"
    )
    crosswalk = (
        f"?crosswalk bg:on_road ?road ; bg:has_distance ?middle ; bg:has_width ?wide . "
        f"{is_a('?crosswalk', 'Crosswalk')} BIND(0.5e0 * ?wide + {_SLACK} AS ?reach)"
    )
    yield about(
        "walks-on-sidewalk",
        "Scenario",
        "on_lane",
        "must be a sidewalk, or a lane where a crosswalk is, got {?got} at {?where} m",
        why,
        source,
        f"SELECT DISTINCT $this ?value ({called('?lane')} AS ?got) ({shown('?at')} AS ?where) "
        f"WHERE {{ {walker} ?value {_PLACES} ?place . "
        "?place bg:on_lane ?lane ; bg:has_distance ?at . "
        "OPTIONAL { ?place bg:has_lateral_offset ?aside } OPTIONAL { ?lane bg:has_width ?width } "
        "BIND(ABS(COALESCE(?aside, 0.0e0)) <= 0.5e0 * COALESCE(?width, 0.0e0) + "
        f"{_SLACK} AS ?within) "
        f"FILTER(!(?within && EXISTS {{ {is_a('?lane', 'Sidewalk')} }})) "
        f"OPTIONAL {{ ?lane {_ROAD} ?road . {crosswalk} "
        "FILTER(ABS(?at - ?middle) <= ?reach) } FILTER(!BOUND(?crosswalk)) }",
        ("Pedestrian",),
    )
    yield about(
        "crosses-on-crosswalk",
        "Scenario",
        "has_trajectory",
        "must cross within a crosswalk, got {?got} at {?where} m to {?other} at {?there} m",
        why,
        source,
        f"SELECT DISTINCT $this ?value ({called('?lane')} AS ?got) ({shown('?at')} AS ?where) "
        f"({called('?lane_2')} AS ?other) ({shown('?at_2')} AS ?there) WHERE {{ "
        f"{walker} ?value {_DOES}/bg:has_trajectory ?way . ?way bg:has_vertex ?one, ?two . "
        "?one bg:has_index ?index . ?two bg:has_index ?next . FILTER(?next = ?index + 1) "
        "?one bg:has_position ?place . ?place bg:on_lane ?lane ; bg:has_distance ?at . "
        "?two bg:has_position ?place_2 . ?place_2 bg:on_lane ?lane_2 ; bg:has_distance ?at_2 . "
        f"FILTER(!(?lane = ?lane_2 && EXISTS {{ {is_a('?lane', 'Sidewalk')} }})) "
        f"OPTIONAL {{ ?lane {_ROAD} ?road . ?lane_2 {_ROAD} ?road . {crosswalk} "
        "FILTER(ABS(?at - ?middle) <= ?reach && ABS(?at_2 - ?middle) <= ?reach) } "
        "FILTER(!BOUND(?crosswalk)) }",
        ("Pedestrian", "has_trajectory"),
    )


def _vehicles() -> Iterator[Rule]:
    source = f"{_PAPER} (vehicles on drivable lanes only)"
    vehicle = f"{_PARTICIPANT} {is_a('?value', 'Vehicle')}"
    leaves = (
        "$this bg:has_event ?event . ?event bg:has_who ?value ; bg:has_what ?change . "
        f"{is_a('?change', 'LaneChangeAction')} "
        "FILTER NOT EXISTS { ?value bg:has_init_action/bg:has_target_speed ?at_once . "
        "FILTER(?at_once > 0) }"
    )
    moves = f"?value {_DOES}/bg:has_target_speed ?speed . FILTER(?speed > 0)"
    own_way = (
        "FILTER NOT EXISTS { ?value bg:has_init_action/bg:has_trajectory ?own . "
        "?own bg:has_spline_order ?order ; bg:has_vertex/bg:has_position ?place }"
    )
    yield about(
        "on-drivable-lane",
        "Scenario",
        "on_lane",
        "must be a lane to drive on (or a shoulder to stand on, or to pull out from), got {?got}",
        "Vehicles keep to the lanes that are made for them; a shoulder is for stopping.",
        source,
        f"SELECT DISTINCT $this ?value ({called('?lane')} AS ?got) WHERE {{ {vehicle} "
        f"?value {_PLACES} ?place . ?place bg:on_lane ?lane . "
        f"FILTER NOT EXISTS {{ {is_a('?lane', 'Lane')} }} {own_way} "
        f"OPTIONAL {{ {moves} }} OPTIONAL {{ {leaves} }} "
        "FILTER((BOUND(?speed) && !BOUND(?change)) || "
        f"NOT EXISTS {{ {is_a('?lane', 'Shoulder')} }}) }}",
        ("Vehicle",),
    )
    yield about(
        "within-lane",
        "Scenario",
        "has_lateral_offset",
        "must keep it on its lane ({?lane}), ±{?half}, got {?got}",
        "Vehicles keep to the lanes that are made for them.",
        source,
        f"SELECT DISTINCT $this ?value ({called('?on')} AS ?lane) ({shown('?aside')} AS ?got) "
        f"({shown('0.5e0 * ?width')} AS ?half) WHERE {{ {vehicle} ?value {_PLACES} ?place . "
        "?place bg:has_lateral_offset ?aside ; bg:on_lane ?on . ?on bg:has_width ?width . "
        f"FILTER(ABS(?aside) > 0.5e0 * ?width + {_SLACK}) {own_way} }}",
        ("Vehicle", "has_lateral_offset"),
    )
    yield about(
        "faces-its-way",
        "Scenario",
        "has_relative_heading",
        "must be 0 or 180 deg while it moves, and -180 to 180 deg otherwise, got {?got}",
        "A vehicle that moves goes where it looks: along its lane, or against its traffic.",
        "ours",
        f"SELECT DISTINCT $this ?value ({shown('?turned')} AS ?got) WHERE {{ {vehicle} "
        f"?value {_PLACES}/bg:has_relative_heading ?turned . OPTIONAL {{ {moves} }} "
        "FILTER(ABS(?turned) > 180 || "
        f"(BOUND(?speed) && ?turned != 0 && ABS(ABS(?turned) - 180) > {_SLACK})) }}",
        ("Vehicle", "has_relative_heading"),
    )


# -- how fast --------------------------------------------------------------------------------------


def _speeds() -> Iterator[Rule]:
    yield about(
        "speed-limit",
        "Scenario",
        "has_target_speed",
        "must be {?limit} at most, as road and weather allow, got {?got}",
        "Nobody drives faster than the road allows, less in rain, in fog and by night.",
        f"{_PAPER} (road and weather constrain participants); has_speed_limit of the road, "
        "speed_factor of the weather",
        f"SELECT DISTINCT $this ?value ({shown('?speed')} AS ?got) ({shown('?most')} AS ?limit) "
        f"WHERE {{ {{ SELECT $this ?value (MAX(?allowed) AS ?road_limit) WHERE {{ {_PARTICIPANT} "
        f"{is_a('?value', 'Vehicle')} ?value {_PLACES}/bg:on_lane/{_ROAD}/bg:has_speed_limit "
        "?allowed } GROUP BY $this ?value } "
        "OPTIONAL { SELECT $this (MIN(?share) AS ?factor) WHERE { "
        "$this bg:has_parameter_declaration ?parameter . ?parameter bg:has_name ?name . "
        'FILTER(STRENDS(?name, "speed_factor")) '
        "?bearer bg:has_parameter ?parameter ; bg:has_value ?share } GROUP BY $this } "
        "BIND(xsd:double(?road_limit) * COALESCE(xsd:double(?factor), 1.0e0) AS ?most) "
        f"?value {_DOES}/bg:has_target_speed ?speed . FILTER(?speed > {slack('?most', 1)}) "
        "FILTER NOT EXISTS { ?value bg:has_reason_to_exceed ?reason } }",
        ("Vehicle", "has_speed_limit"),
    )
    yield about(
        "body-speed",
        "Scenario",
        "has_target_speed",
        "must be {?limit} at most, the most that it can do, got {?got}",
        "Nobody is faster than they can.",
        "has_max_speed of the participant",
        f"SELECT DISTINCT $this ?value ({shown('?speed')} AS ?got) ({shown('?most')} AS ?limit) "
        f"WHERE {{ {_PARTICIPANT} ?value bg:has_max_speed ?most ; "
        f"{_DOES}/bg:has_target_speed ?speed . FILTER(?speed > {slack('?most', 1)}) }}",
        ("has_max_speed",),
    )


def _bends() -> Iterator[Rule]:
    """Yield the rules of a bend: v² <= μ·g·R, and what drivers do unless there is a reason.

    The ego's driver is under test, so not of the ego.
    """
    start = f"?value bg:has_init_action/bg:has_position/bg:on_lane ?lane . ?lane {_ROAD} ?road ."
    yield _bend(
        "bend-of-road",
        f"{start} ?road bg:has_segment/(bg:has_start_curvature|bg:has_end_curvature) ?bent . "
        "BIND(ABS(xsd:double(?bent)) AS ?sharp)",
        ("Vehicle", "GeometrySegment"),
    )
    yield _bend(
        "bend-of-ring",
        f"?value bg:has_route ?route . {start} ?crossing bg:has_leg ?road ; bg:has_radius ?radius "
        f". {is_a('?crossing', 'Roundabout')} BIND(1.0e0 / xsd:double(?radius) AS ?sharp)",
        ("Vehicle", "Roundabout"),
    )
    # as in odd.rules.bend: the tangent points of two legs are half the junction from its centre
    turn = "xsd:double(?heading_out - ?heading_in) - 180.0e0"
    yield _bend(
        "bend-of-junction",
        f"{start} ?crossing bg:has_leg ?road, ?exit ; bg:has_size ?size . "
        f"?value bg:has_route/bg:has_destination/bg:on_lane/{_ROAD} ?exit . "
        "?road bg:has_heading ?heading_in . ?exit bg:has_heading ?heading_out . "
        "?lane bg:has_lane_id ?rank ; bg:has_width ?width . "
        f"BIND({turn} - 360.0e0 * ROUND(({turn}) / 360.0e0) AS ?turn) "
        f"FILTER(ABS(?turn) >= {literal(STRAIGHT)}) "
        "BIND(ABS(?turn) AS ?x_turn_x) "
        f"{binds(parse('0.5 * cos(pi * turn / 360) / sin(pi * turn / 360)'), 'half')} "
        "BIND(?half * ?size + IF(?turn > 0.0e0, 1.0e0, -1.0e0) * (ABS(?rank) - 0.5e0) * ?width "
        "AS ?arc) BIND(1.0e0 / IF(?arc < 2.0e0, 2.0e0, ?arc) AS ?sharp)",
        ("Vehicle", "has_size"),
    )


def _bend(key: str, curvature: str, needs: tuple[str, ...]) -> Rule:
    """Return the rule for a curvature [1/m], which the pattern leaves in ``?sharp``."""
    grip = f"({_GRIP} * COALESCE(MIN(?friction), 1.0e0))"
    least = f"IF({grip} < {_MOST} || COUNT(?reason) > 0, {grip}, {_MOST})"
    slower = "(?speed - (1.0e0 + ?speed) * " + _SLACK + ")"
    return about(
        key,
        "Scenario",
        "has_target_speed",
        f"must keep v² <= {DRY_FRICTION}·{GRAVITY}·friction·R in a bend of R = {{?radius}} m with "
        f"friction = {{?mu}}, and v² <= {MOST_LATERAL}·R unless it has a reason to exceed, got "
        "{?got}",
        "A vehicle drives through a bend no faster than drivers do, and than the tyres hold.",
        f"{_PAPER} (the road constrains participants' speed and path); {DRY_FRICTION} on a dry "
        f"road, Wong, Theory of Ground Vehicles, table 1.3; {MOST_LATERAL} m/s², Mitschke and "
        "Wallentowitz, Dynamik der Kraftfahrzeuge",
        f"SELECT $this ?value ({shown('MAX(?speed)')} AS ?got) "
        f"({shown('1.0e0 / MAX(?sharp)')} AS ?radius) "
        f"({shown('COALESCE(MIN(?friction), 1.0e0)')} AS ?mu) "
        f"WHERE {{ {_PARTICIPANT} {is_a('?value', 'Vehicle')} "
        f'FILTER NOT EXISTS {{ ?value bg:has_name "ego" }} '
        f'FILTER NOT EXISTS {{ ?value bg:has_controller/bg:has_driver "ego" }} {curvature} '
        f"?value {_DOES}/bg:has_target_speed ?speed . "
        f"OPTIONAL {{ $this {_WEATHERS}/bg:has_road_state/bg:has_friction ?friction }} "
        "OPTIONAL { ?value bg:has_reason_to_exceed ?reason } } "
        f"GROUP BY $this ?value HAVING(MAX({slower} * {slower}) * MAX(?sharp) > {least})",
        needs,
    )


def _closed_roads() -> Iterator[Rule]:
    for name, path in (("fog_density", "bg:has_fog"), ("precipitation", "bg:has_rain")):
        yield about(
            f"closed-by-{name}",
            "Scenario",
            "",
            f"must not be on {{?road}}, closed above {with_unit(f'has_{name}')} {{?limit}}, "
            "got {?got}",
            "The road is closed in such weather.",
            f"{_PAPER} (heavy fog or rain restricts roads); closes_above_{name} of the road",
            f"SELECT DISTINCT $this ?value ({called('?place')} AS ?road) "
            f"({shown('?most')} AS ?limit) ({shown('?much')} AS ?got) WHERE {{ "
            f"?place bg:closes_above_{name} ?most . $this {_WEATHERS}/{path}/bg:has_{name} ?much . "
            f"FILTER(?much > {slack('?most', 1)}) {_PARTICIPANT} "
            f"?value {_PLACES}/bg:on_lane/{_ROAD} ?place }}",
            (f"closes_above_{name}",),
        )


# -- temporary changes -----------------------------------------------------------------------------


def _temporary_changes() -> Iterator[Rule]:
    yield about(
        "works-element",
        "Scenario",
        "has_position",
        "must be on the lane that is closed ({?lane}) or beside the lanes, got {?got} with "
        "has_lateral_offset {?off} m",
        "What secures road works stands on the closed lane or beside the road, not in the traffic.",
        "RSA 21, lane closures",
        f"SELECT $this ?value ({called('?closed')} AS ?lane) ({called('?on')} AS ?got) "
        f"({shown('?aside')} AS ?off) WHERE {{ $this bg:has_event ?works . "
        "?works bg:closes_lane ?closed ; bg:has_element ?value . ?value bg:has_position ?place . "
        "?place bg:on_lane ?on . ?on bg:has_width ?width ; bg:has_lane_id ?id . "
        "OPTIONAL { ?place bg:has_lateral_offset ?offset } "
        "BIND(COALESCE(?offset, 0.0e0) AS ?aside) "
        "OPTIONAL { ?road bg:has_lane ?closed ; bg:has_lane|bg:has_strip ?on ; "
        "bg:has_lane|bg:has_strip ?other . ?other bg:has_width ?wide ; bg:has_lane_id ?rank . "
        "FILTER(?rank * ?id > 0) } "
        "BIND(IF(ABS(?rank) <= ABS(?id), ?wide, 0.0e0) AS ?inner) "
        "BIND(IF(EXISTS { ?road bg:has_lane ?other }, ?wide, 0.0e0) AS ?driven) } "
        "GROUP BY $this ?value ?closed ?on ?aside ?width HAVING("
        f"!((?on = ?closed && ABS(?aside) <= 0.5e0 * ?width + {_SLACK}) || "
        "COALESCE(SUM(?inner) - 0.5e0 * ?width - ?aside >= SUM(?driven) && SUM(?wide) > 0.0e0, "
        "false)))",
        ("RoadWorks",),
    )
    jam = f"$this bg:has_event ?jam . {is_a('?jam', 'TrafficJam')} ?jam bg:has_who ?value ."
    place = "?value bg:has_init_action/bg:has_position ?place . ?place bg:on_lane"
    why, source = "A jam is a row of vehicles that stand on one lane.", "ours"
    yield about(
        "jam-on-its-lane",
        "Scenario",
        "on_lane",
        "must be that of its jam, {?lane}, got {?got}",
        why,
        source,
        f"SELECT DISTINCT $this ?value ({called('?at')} AS ?lane) ({called('?on')} AS ?got) "
        f"WHERE {{ {jam} ?jam bg:on_lane ?at . {place} ?on . FILTER(?on != ?at) }}",
        ("TrafficJam",),
    )
    yield about(
        "jam-stands",
        "Scenario",
        "has_target_speed",
        "must be 0 at the start, in a jam, got {?got}",
        why,
        source,
        f"SELECT DISTINCT $this ?value ({shown('?speed')} AS ?got) WHERE {{ {jam} "
        "?value bg:has_init_action/bg:has_target_speed ?speed . FILTER(?speed > 0) }",
        ("TrafficJam",),
    )
    body = "bg:has_center_ahead ?ahead{0} ; bg:has_box_length ?length{0}"
    yield about(
        "jam-in-a-row",
        "Scenario",
        "has_distance",
        "must leave room between the vehicles of a jam, got {?got} m to {?other}",
        why,
        source,
        f"SELECT DISTINCT $this ?value ({shown('?gap')} AS ?got) ({called('?who')} AS ?other) "
        f"WHERE {{ {jam} ?jam bg:has_who ?who . FILTER(STR(?value) < STR(?who)) "
        f"{place} ?on ; bg:has_distance ?at . ?who bg:has_init_action/bg:has_position ?place_2 . "
        "?place_2 bg:on_lane ?on ; bg:has_distance ?at_2 . ?on bg:has_direction ?way . "
        f"?value {body.format('')} . ?who {body.format('_2')} . "
        'BIND(IF(?way IN ("in", "backward"), -1.0e0, 1.0e0) AS ?sign) '
        "BIND(ABS(?at + ?sign * ?ahead - ?at_2 - ?sign * ?ahead_2) "
        "- 0.5e0 * (?length + ?length_2) AS ?gap) "
        f"FILTER(?gap < -{_SLACK}) }}",
        ("TrafficJam",),
    )


# -- accidents and near misses ---------------------------------------------------------------------


def _conflicts() -> Iterator[Rule]:
    outcome = "$this bg:has_outcome ?value ."
    yield about(
        "severity-is-a-probability",
        "Scenario",
        "has_severity",
        "must be a probability, 0 to 1, got {?got}",
        "Severity is the probability of a MAIS3+ injury.",
        "ours",
        f"SELECT DISTINCT $this ?value ({shown('?severity')} AS ?got) WHERE {{ "
        "$this a bg:Scenario . { BIND($this AS ?value) } UNION { $this bg:has_outcome ?value } "
        "?value bg:has_severity ?severity . FILTER(?severity < 0 || ?severity > 1) }",
        ("has_severity",),
    )
    yield about(
        "responsible-takes-part",
        "Scenario",
        "has_responsible",
        "must be one of its participants, got {?got}",
        "Only a participant of an accident or a near miss can be responsible for it.",
        "ours",
        f"SELECT DISTINCT $this ?value ({called('?who')} AS ?got) WHERE {{ {outcome} "
        "?value bg:has_responsible ?who . FILTER NOT EXISTS { ?value bg:has_who ?who } }",
        ("has_responsible",),
    )


# --- Rules of layers 1 and 2 in every scenario: where lights, signs and markings may be ---
# Each is one query per road network, however many lights it has. Places are stated along the road
# (``has_distance``); those of an imported map (``has_s``) are the map's affair.


FARTHEST_BESIDE = 5.0
"""Largest distance from the road's edge of what stands beside it to belong to this road [m]; ours
(signs stand 0.5 to 1.5 m from it, RSA 21)."""

_OURS = "FILTER NOT EXISTS { ?value bg:has_s ?s }"
"""SPARQL filter that leaves places on an imported map to the map."""


def placement_rules() -> Iterator[Rule]:
    """Yield the rules."""
    yield from _lights()
    yield from _beside_and_on_roads()
    yield from _phases()


def _lights() -> Iterator[Rule]:
    light = f"$this bg:has_facility ?value . {is_a('?value', 'TrafficLight')}"
    why = "Traffic lights give and take the right of way, so they are at intersections only."
    source = f"{_PAPER} (layer 1 constrains layer 2)"
    yield about(
        "light-at-intersection",
        "RoadNetwork",
        "on_road",
        "must be a road that meets an intersection, got {?got}",
        why,
        source,
        f'SELECT $this ?value (COALESCE({called("?road")}, "none") AS ?got) WHERE {{ {light} '
        "OPTIONAL { ?value bg:on_road ?road } FILTER(NOT EXISTS { ?value bg:has_s ?s } && "
        "(!BOUND(?road) || NOT EXISTS { ?crossing bg:has_leg ?road })) }",
        ("TrafficLight",),
    )
    yield about(
        "light-at-stop-line",
        "RoadNetwork",
        "has_distance",
        "must be that of the stop line of its lanes, got {?got}",
        "Who waits at a light waits at its stop line.",
        f"{source}; Vienna Convention on Road Signs and Signals (1968), Article 23",
        f"SELECT DISTINCT $this ?value ({shown('?at')} AS ?got) WHERE {{ {light} "
        f"?value bg:governs_lane ?lane ; bg:has_distance ?at . {_OURS} "
        "FILTER NOT EXISTS { ?line bg:marks_lane ?lane ; bg:has_distance ?there . "
        f"FILTER(ABS(?there - ?at) <= {_SLACK}) }} }}",
        ("TrafficLight",),
    )


def _beside_and_on_roads() -> Iterator[Rule]:
    source = f"{_PAPER} (signs and street lights beside the road)"
    farthest = literal(FARTHEST_BESIDE)
    yield about(
        "beside-road",
        "RoadNetwork",
        "has_t",
        "must be beyond the road's edge, {?edge} m from its reference line, by "
        f"{FARTHEST_BESIDE:g} m at most, got {{?got}}",
        "What stands on the road is in the way, and what stands far from it is not seen as its.",
        source,
        f"SELECT $this ?value ({shown('?t')} AS ?got) ({shown('SUM(?wide)')} AS ?edge) WHERE {{ "
        "$this bg:has_facility ?value . "
        f"?value bg:has_t ?t ; bg:on_road ?road ; bg:has_distance ?at . {_OURS} "
        "OPTIONAL { ?road bg:has_lane|bg:has_strip ?lane . ?lane bg:has_lane_id ?id ; "
        "bg:has_width ?width . FILTER(?id * ?t > 0) } "
        "BIND(COALESCE(?width, 0.0e0) AS ?wide) } GROUP BY $this ?value ?t "
        f"HAVING(ABS(?t) <= SUM(?wide) || ABS(?t) > SUM(?wide) + {farthest})",
        ("has_t",),
    )
    yield about(
        "along-road",
        "RoadNetwork",
        "has_distance",
        "must keep it on its road, {?low} to {?high}, got {?got}",
        "Crosswalks and stop lines lie on a road, signs and lights stand beside one.",
        source,
        f"SELECT DISTINCT $this ?value ({shown('?at')} AS ?got) ({shown('?half')} AS ?low) "
        f"({shown('?length - ?half')} AS ?high) WHERE {{ "
        "$this bg:has_facility|bg:has_area ?value . "
        f"?value bg:on_road ?road ; bg:has_distance ?at . {_OURS} ?road bg:has_length ?length . "
        f"OPTIONAL {{ ?value bg:has_width ?width . {is_a('?value', 'Crosswalk')} }} "
        "BIND(0.5e0 * COALESCE(?width, 0.0e0) AS ?half) "
        f"FILTER(?at < ?half - {_SLACK} || ?at > ?length - ?half + {_SLACK}) }}",
        ("on_road",),
    )
    yield about(
        "own-lanes",
        "RoadNetwork",
        "",
        "must be for lanes of its own road, got {?got}",
        "A light, a sign or a line is for those who drive past it.",
        source,
        f"SELECT DISTINCT $this ?value ({called('?lane')} AS ?got) WHERE {{ "
        f"$this bg:has_facility ?value . ?value bg:on_road ?road ; bg:has_distance ?at ; "
        f"bg:marks_lane|bg:governs_lane ?lane . {_OURS} "
        "FILTER NOT EXISTS { ?road bg:has_lane ?lane } }",
        ("has_facility", "on_road"),
    )


def _phases() -> Iterator[Rule]:
    phase = "$this bg:has_signal_controller ?controller . ?controller bg:has_phase ?value ."
    yield about(
        "no-conflicting-green",
        "RoadNetwork",
        "gives_green_to",
        "must not let conflicting legs go at once, got {?got} and {?other}",
        "Legs that are not opposite have ways that cross.",
        "RiLSA 2015, conflicting streams never have green together; which are, ours",
        f"SELECT DISTINCT $this ?value ({called('?one')} AS ?got) ({called('?two')} AS ?other) "
        f"WHERE {{ {phase} ?value bg:gives_green_to ?one ; bg:gives_green_to|bg:gives_yellow_to "
        "?two . ?one bg:on_road/bg:has_heading ?heading . "
        "?two bg:on_road/bg:has_heading ?against . "
        "BIND(xsd:double(?heading - ?against) AS ?turn) "
        "FILTER(ABS(?turn - 180.0e0 * ROUND(?turn / 180.0e0)) >= "
        f"{literal(OPPOSITE)}) "
        "FILTER(STR(?one) < STR(?two) || NOT EXISTS { ?value bg:gives_green_to ?two }) }",
        ("SignalController",),
    )
    yield about(
        "own-lights",
        "RoadNetwork",
        "",
        "must switch lights of its controller only (has_light), got {?got}",
        "A controller switches the lights that it has.",
        "ASAM OpenDRIVE 1.7, controllers",
        f"SELECT DISTINCT $this ?value ({called('?light')} AS ?got) WHERE {{ {phase} "
        "?value bg:gives_green_to|bg:gives_yellow_to|bg:gives_red_yellow_to ?light . "
        "FILTER NOT EXISTS { ?controller bg:has_light ?light } }",
        ("SignalController",),
    )
