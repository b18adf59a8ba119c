"""The taxonomy of operational design domains, and what of it a scenario states.

The attributes, and the limits of rain, illumination, cloudiness and roundabouts, are those of
ISO 34503:2023 (before it BSI PAS 1883:2020); wind is Beaufort's scale, to which both refer. Limits
of the number of lanes, of speeds, curves and widths are ours, for the taxonomy has none.

Each attribute has its evidence: a fact of a scenario (`bridgegen.jobs.dashboard.scenery`), or a
band of a quantity, whose evaluations are counted one by one. An attribute without evidence is not
expressible: no scenario of BridgeGen can state it, so that no search can cover it.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import inf

SOURCE = "ISO 34503:2023, BSI PAS 1883:2020"


@dataclass(frozen=True)
class Quantity:
    """A quantity of which evaluations are counted in bands.

    Attributes:
        unit: of the limits.
        upper: of each band, ascending; a value on a limit belongs to the lower band.
    """

    unit: str
    upper: tuple[float, ...]


QUANTITIES = {
    "rain": Quantity("mm/h", (0.0, 2.5, 7.6, 50.0, inf)),
    "visual_range": Quantity("m", (1000.0, 5000.0, inf)),
    "illuminance": Quantity("lx", (1.0, 2000.0, inf)),
    "cloud": Quantity("okta", (1.5, 2.5, 4.5, 7.5, inf)),
    "wind": Quantity("m/s", (0.2, 1.5, 3.3, 5.4, 7.9, 10.7, 13.8, 17.1, inf)),
    "wetness": Quantity("%", (0.0, 60.0, inf)),
    "grade": Quantity("1", (-1e-9, 1e-9, inf)),
    "lanes": Quantity("count", (1.0, 2.0, inf)),
    "lane_width": Quantity("m", (3.0, 3.5, inf)),
    "speed_limit": Quantity("km/h", (30.0, 50.0, 100.0, 130.0, inf)),
    "curve_radius": Quantity("m", (100.0, 300.0, 1000.0, 5000.0, inf)),
    "roundabout_diameter": Quantity("m", (28.0, 36.0, 100.0, inf)),
    "ego_speed": Quantity("km/h", (10.0, 30.0, 60.0, 100.0, 130.0, inf)),
}
"""Quantities of the operational design domain by name."""


@dataclass(frozen=True)
class Attribute:
    """A leaf of the taxonomy.

    Attributes:
        path: from the top to its name.
        fact: of scenarios that have it; "" for none.
        band: a quantity, and the number of its band; None for none.
        note: what a reader has to know of it.
    """

    path: tuple[str, ...]
    fact: str = ""
    band: tuple[str, int] | None = None
    note: str = ""

    @property
    def expressible(self) -> bool:
        """Whether a scenario can state it."""
        return bool(self.fact) or self.band is not None


_BY_FUNCTION = " # a scenario says town, rural or motorway, not the road's function"
_OF_MAPS = " # only in OpenDRIVE maps, of which it is not read"

_GROUPS: Mapping[str, Mapping[str, str]] = {
    "Scenery / Zone": {
        "geo-fenced areas": "",
        "school zones": "",
        "traffic management zones": "",
        "interference zones": "",
        "regions or states": "",
    },
    "Scenery / Drivable area / Type": {
        "motorways": "motorway",
        "primary and radial roads": _BY_FUNCTION,
        "distributor roads": _BY_FUNCTION,
        "minor roads": _BY_FUNCTION,
        "town roads, of any function": "town # BridgeGen's own class of roads",
        "rural roads, of any function": "rural # BridgeGen's own class of roads",
        "slip roads": "slip road",
        "parking spaces": "",
        "shared spaces": "",
    },
    "Scenery / Drivable area / Horizontal plane": {
        "straight": "curve_radius:4 # no bend below 5 km",
        "curves of 1 to 5 km": "curve_radius:3",
        "curves of 300 to 1000 m": "curve_radius:2",
        "curves of 100 to 300 m": "curve_radius:1",
        "curves up to 100 m": "curve_radius:0",
    },
    "Scenery / Drivable area / Transverse plane": {
        "undivided": "undivided",
        "divided": "divided",
        "pavements": "pavement",
        "barriers on edges": "",
        "superelevation": _OF_MAPS,
    },
    "Scenery / Drivable area / Longitudinal plane": {
        "up-slope": "grade:2",
        "down-slope": "grade:0",
        "level": "grade:1",
    },
    "Scenery / Drivable area / Lanes": {
        "one in the direction of travel": "lanes:0",
        "two": "lanes:1",
        "three or more": "lanes:2",
        "width up to 3 m": "lane_width:0",
        "width 3 to 3.5 m": "lane_width:1",
        "width above 3.5 m": "lane_width:2",
        "traffic lanes": "traffic lane",
        "emergency lanes": "shoulder",
        "bus lanes": "",
        "cycle lanes": "",
        "tram lanes": "",
        "right-hand traffic": "right-hand traffic",
        "left-hand traffic": "left-hand traffic",
    },
    "Scenery / Drivable area / Lane marking": {
        "clear": "marked # all lines are clear",
        "blurred": "",
        "none": "",
        "temporary": "",
    },
    "Scenery / Drivable area / Speed limit": {
        "up to 30 km/h": "speed_limit:0",
        "30 to 50 km/h": "speed_limit:1",
        "50 to 100 km/h": "speed_limit:2",
        "100 to 130 km/h": "speed_limit:3",
        "above 130 km/h": "speed_limit:4",
    },
    "Scenery / Drivable area / Signs": {
        "regulatory": "regulatory sign",
        "traffic lights": "traffic lights",
        "warning": "warning sign",
        "information": "",
    },
    "Scenery / Drivable area / Edge and shoulder": {
        "line markers": "marked",
        "paved shoulder": "shoulder",
        "grass shoulder": "",
        "solid barriers": "",
        "snowbanks": "",
    },
    "Scenery / Drivable area / Surface": {
        "dry": "wetness:0",
        "wet": "wetness:1",
        "standing water": "wetness:2 # wetness above 60 %",
        "icy": "",
        "flooded": "",
        "snow": "",
        "contamination": " # only as an effect of your own, which does not say what it is",
        "type of surface": "",
        "cracks, potholes, ruts, swells": "",
        "speed bumps": "",
    },
    "Scenery / Junctions / Roundabout": {
        "mini, up to 28 m": "roundabout_diameter:0",
        "compact, 28 to 36 m": "roundabout_diameter:1",
        "normal, 36 to 100 m": "roundabout_diameter:2",
        "large, above 100 m": "roundabout_diameter:3",
        "double": "",
        "signalised": "",
    },
    "Scenery / Junctions / Intersection": {
        "T-junction": "t-junction",
        "Y-junction": "",
        "crossroads": "crossroads",
        "staggered": "",
        "grade-separated": "",
        "with traffic lights": "traffic lights",
        "without traffic lights": "junction without lights",
    },
    "Scenery / Special structures": {
        "pedestrian crossings": "crosswalk",
        "bridges": _OF_MAPS,
        "tunnels": _OF_MAPS,
        "rail crossings": "",
        "toll plazas": "",
        "automatic access control": "",
    },
    "Scenery / Fixed road structures": {
        "buildings": " # an obstacle with a body of its own may stand for one",
        "street lights": "",
        "street furniture": "",
        "vegetation": "",
    },
    "Scenery / Temporary structures": {
        "road works": "road works",
        "road signage": "road works",
        "construction site detours": "",
        "refuse collection": "",
    },
    "Environmental conditions / Weather / Rainfall": {
        "none": "rain:0",
        "light, up to 2.5 mm/h": "rain:1",
        "moderate, 2.5 to 7.6 mm/h": "rain:2",
        "heavy, 7.6 to 50 mm/h": "rain:3",
        "violent, 50 to 100 mm/h": " # rain ends at 50 mm/h",
        "cloudburst, above 100 mm/h": " # rain ends at 50 mm/h",
    },
    "Environmental conditions / Weather / Wind": {
        "calm": "wind:0 # wind is stated; nothing in the simulator depends on it",
        "light air": "wind:1",
        "light breeze": "wind:2",
        "gentle breeze": "wind:3",
        "moderate breeze": "wind:4",
        "fresh breeze": "wind:5",
        "strong breeze": "wind:6",
        "near gale": "wind:7",
        "gale": "wind:8",
        "strong gale and above": " # wind ends at 20 m/s",
    },
    "Environmental conditions / Weather / Other": {
        "snowfall": " # only in OpenSCENARIO files, whose weather is not read",
        "ambient air temperature": "",
    },
    "Environmental conditions / Particulates": {
        "none": "visual_range:2 # visual range above 5 km",
        "haze or mist, 1 to 5 km": "visual_range:1",
        "fog, up to 1 km": "visual_range:0",
        "sand and dust": "",
        "smoke and pollution": "",
        "volcanic ash": "",
        "water spray": "",
    },
    "Environmental conditions / Illumination": {
        "day, above 2000 lx": "illuminance:2 # by the height of the sun, without clouds",
        "low ambient light, 1 to 2000 lx": "illuminance:1",
        "night, up to 1 lx": "illuminance:0 # the sun is below the horizon",
        "artificial light": "",
    },
    "Environmental conditions / Illumination / Cloudiness": {
        "clear": "cloud:0",
        "few clouds": "cloud:1",
        "scattered clouds": "cloud:2",
        "broken clouds": "cloud:3",
        "overcast": "cloud:4",
    },
    "Environmental conditions / Connectivity": {
        "communication": "",
        "satellite positioning": "",
        "local positioning": "",
    },
    "Dynamic elements / Traffic agents / Type": {
        "cars and vans": "participant:car",
        "trucks": "participant:truck",
        "buses": "participant:bus",
        "trams": "participant:tram",
        "motorcycles": "participant:motorcycle",
        "bicycles": "participant:bicycle",
        "e-scooters": "participant:e-scooter",
        "pedestrians": "participant:pedestrian",
        "animals": "participant:animal",
        "horse riders": "",
    },
    "Dynamic elements / Traffic agents / Special vehicles": {
        "emergency vehicles": "participant:emergency",
        "work vehicles": "",
    },
    "Dynamic elements / Traffic agents / Traffic": {
        "density": "",
        "volume and flow rate": "",
        "queues": "jam # BridgeGen's own",
    },
    "Dynamic elements / Subject vehicle / Speed at the start": {
        "up to 10 km/h": "ego_speed:0",
        "10 to 30 km/h": "ego_speed:1",
        "30 to 60 km/h": "ego_speed:2",
        "60 to 100 km/h": "ego_speed:3",
        "100 to 130 km/h": "ego_speed:4",
        "above 130 km/h": "ego_speed:5",
    },
}
"""Attributes by group, each with its evidence: a fact, ``quantity:band``, or nothing; ``#
note``."""


def _read(groups: Mapping[str, Mapping[str, str]]) -> Iterator[Attribute]:
    for group, names in groups.items():
        for name, text in names.items():
            evidence, _, note = (part.strip() for part in text.partition("#"))
            quantity, _, number = evidence.rpartition(":")
            path = (*group.split(" / "), name)
            if quantity in QUANTITIES:
                yield Attribute(path, band=(quantity, int(number)), note=note)
            else:
                yield Attribute(path, fact=evidence, note=note)


TAXONOMY = tuple(_read(_GROUPS))
"""All attributes, in the taxonomy's order."""
