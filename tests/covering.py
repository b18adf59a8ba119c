"""The scenarios of the catalogue that together say all that scenarios say.

A law of the code (files read back, mirrors mirror) needs each word of the language once; what is
said of a scenario itself (its ranges, its traffic) needs each scenario.
"""

from collections.abc import Iterator
from functools import cache
from importlib.resources import files
from typing import Any

import yaml

from bridgegen.scenario.language.reader import names

NAMED = {"participants", "events", "places", "jams", "road_works", "ghosts", "legs"}
"""Keys below which names are free."""
WORDS = {
    *("driver", "indicate", "kind", "lane", "others", "road_type", "rules", "shape", "sign"),
    *("template", "traffic", "type", "way"),
}
"""Keys whose values are words of the language."""
OF_STORY = {
    *("template", "roads", "traffic", "rules", "others", "participants", "events", "jams"),
    *("road_works", "ghosts", "odd", "criteria", "include"),
}
"""Keys of a scenario that say what is simulated, but for numbers."""


def words(value: Any, path: tuple[str, ...] = ()) -> Iterator[tuple[str, ...]]:
    """Yield what a scenario says: its keys, whether their values vary, the language's words."""
    if isinstance(value, dict):
        for key, part in value.items():
            yield from words(part, (*path, "*" if path and path[-1] in NAMED else str(key)))
    elif isinstance(value, list):
        for part in value:
            yield from words(part, path)
    else:
        is_word = path[-1] in WORDS
        yield (*path, value if is_word else "parameter") if isinstance(value, str) else path


@cache
def covering() -> tuple[str, ...]:
    """Return a small set of scenarios, in the catalogue's order: the greediest choice of each."""
    folder = files("bridgegen.scenario.catalogue")
    said = {}
    for name in names():
        keys = yaml.safe_load((folder / f"{name}.yaml").read_text("utf-8"))
        said[name] = set(words({key: keys[key] for key in OF_STORY & keys.keys()}))
    left = set().union(*said.values())
    chosen = set()
    while left:
        best = max(names(), key=lambda name: len(said[name] & left))
        chosen.add(best)
        left -= said[best]
    return tuple(name for name in names() if name in chosen)
