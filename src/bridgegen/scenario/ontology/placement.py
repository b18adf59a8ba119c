"""Rules of layers 1 and 2 in every scenario: where lights, signs and markings may be.

Each is one query per road network, however many lights it has. Places are stated along the road
(``has_distance``); those of an imported map (``has_s``) are the map's affair.
"""

from collections.abc import Iterator

from bridgegen.scenario.language.kinds import TOLERANCE
from bridgegen.scenario.ontology.rule import Rule, about, called, is_a, shown
from bridgegen.scenario.ontology.sparql import literal
from bridgegen.scenario.ontology.templates import OPPOSITE

FARTHEST_BESIDE = 5.0
"""How far from the road's edge what stands beside it may be [m], to be still seen as this road's;
ours (signs stand 0.5 to 1.5 m from it, RSA 21)."""

_PAPER = "BridgeGen paper, Section III-B"
_SLACK = literal(TOLERANCE)
_OURS = "FILTER NOT EXISTS { ?value bg:has_s ?s }"
"""Places on an imported map are left to it."""


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
        "light-at-intersection", "RoadNetwork", "on_road",
        "must be a road that meets an intersection, got {?got}", why, source,
        f"SELECT $this ?value (COALESCE({called('?road')}, \"none\") AS ?got) WHERE {{ {light} "
        "OPTIONAL { ?value bg:on_road ?road } FILTER(NOT EXISTS { ?value bg:has_s ?s } && "
        "(!BOUND(?road) || NOT EXISTS { ?crossing bg:has_leg ?road })) }",
        ("TrafficLight",),
    )  # fmt: skip
    yield about(
        "light-at-stop-line", "RoadNetwork", "has_distance",
        "must be that of the stop line of its lanes, got {?got}",
        "Who waits at a light waits at its stop line.",
        f"{source}; Vienna Convention on Road Signs and Signals (1968), Article 23",
        f"SELECT DISTINCT $this ?value ({shown('?at')} AS ?got) WHERE {{ {light} "
        f"?value bg:governs_lane ?lane ; bg:has_distance ?at . {_OURS} "
        "FILTER NOT EXISTS { ?line bg:marks_lane ?lane ; bg:has_distance ?there . "
        f"FILTER(ABS(?there - ?at) <= {_SLACK}) }} }}",
        ("TrafficLight",),
    )  # fmt: skip


def _beside_and_on_roads() -> Iterator[Rule]:
    source = f"{_PAPER} (signs and street lights beside the road)"
    farthest = literal(FARTHEST_BESIDE)
    yield about(
        "beside-road", "RoadNetwork", "has_t",
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
    )  # fmt: skip
    yield about(
        "along-road", "RoadNetwork", "has_distance",
        "must keep it on its road, {?low} to {?high}, got {?got}",
        "Crosswalks and stop lines lie on a road, signs and lights stand beside one.", source,
        f"SELECT DISTINCT $this ?value ({shown('?at')} AS ?got) ({shown('?half')} AS ?low) "
        f"({shown('?length - ?half')} AS ?high) WHERE {{ "
        "$this bg:has_facility|bg:has_area ?value . "
        f"?value bg:on_road ?road ; bg:has_distance ?at . {_OURS} ?road bg:has_length ?length . "
        f"OPTIONAL {{ ?value bg:has_width ?width . {is_a('?value', 'Crosswalk')} }} "
        "BIND(0.5e0 * COALESCE(?width, 0.0e0) AS ?half) "
        f"FILTER(?at < ?half - {_SLACK} || ?at > ?length - ?half + {_SLACK}) }}",
        ("on_road",),
    )  # fmt: skip
    yield about(
        "own-lanes", "RoadNetwork", "",
        "must be for lanes of its own road, got {?got}",
        "A light, a sign or a line is for those who drive past it.", source,
        f"SELECT DISTINCT $this ?value ({called('?lane')} AS ?got) WHERE {{ "
        f"$this bg:has_facility ?value . ?value bg:on_road ?road ; bg:has_distance ?at ; "
        f"bg:marks_lane|bg:governs_lane ?lane . {_OURS} "
        "FILTER NOT EXISTS { ?road bg:has_lane ?lane } }",
        ("has_facility", "on_road"),
    )  # fmt: skip


def _phases() -> Iterator[Rule]:
    phase = "$this bg:has_signal_controller ?controller . ?controller bg:has_phase ?value ."
    yield about(
        "no-conflicting-green", "RoadNetwork", "gives_green_to",
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
    )  # fmt: skip
    yield about(
        "own-lights", "RoadNetwork", "",
        "must switch lights of its controller only (has_light), got {?got}",
        "A controller switches the lights that it has.", "ASAM OpenDRIVE 1.7, controllers",
        f"SELECT DISTINCT $this ?value ({called('?light')} AS ?got) WHERE {{ {phase} "
        "?value bg:gives_green_to|bg:gives_yellow_to|bg:gives_red_yellow_to ?light . "
        "FILTER NOT EXISTS { ?controller bg:has_light ?light } }",
        ("SignalController",),
    )  # fmt: skip
