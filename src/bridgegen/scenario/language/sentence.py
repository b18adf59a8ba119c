"""A sentence in controlled English, read as a scenario of the catalogue and what is said of it.

The phrases are data, ``scenario/phrases.yaml``. A sentence is understood if phrases of one scenario
cover all of its words but those that the file ignores, in one way; the rest is refused by name.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from importlib import resources
from typing import Any, NamedTuple

from bridgegen.base.errors import InputError, UnknownNameError
from bridgegen.base.units import in_unit
from bridgegen.scenario.language.parameters import Parameter
from bridgegen.scenario.language.plain_yaml import read_plain_yaml
from bridgegen.scenario.language.reader import load, names
from bridgegen.scenario.language.scenario import LogicalScenario
from bridgegen.scenario.language.story import Participant
from bridgegen.scenario.named_models import MODELS
from bridgegen.scenario.participants import PARTICIPANTS

MAX_LENGTH = 400
_MOST_READINGS = 20
_TOKEN = re.compile(
    r"\d[\d.]*,\d[\d.,]*|(?<![\w.])[-+]\d+(?:\.\d+)?|\d+(?:\.\d+)?"
    r"|m/s(?:²|2|\^2)|[^\W\d_]+/[^\W\d_]+|[^\W\d_]+(?:'s)?|\S"
)
_NUMBER = r"[-+]?\d+(?:\.\d+)?"
_LEAST = "at least|no less than|more than|over|above"
_MOST = "at most|up to|no more than|less than|under|below"


class Range(NamedTuple):
    """Values that are said of a parameter, in its unit; None: as far as the catalogue has it."""

    low: float | None
    high: float | None

    def within(self, parameter: Parameter) -> tuple[float, float]:
        """Return both ends, in a parameter's range.

        Raises:
            InputError: the parameter has not all that is said.
        """
        least, most = parameter.low, parameter.high
        low, high = (
            end if said is None else said for end, said in zip((least, most), self, strict=True)
        )
        if None in self:  # at least so much, at most so much: also of a range within
            low, high = max(low, least), min(high, most)
        if not least <= low <= high <= most:
            unit, got = parameter.unit, f"{low:g}" if low == high else f"{low:g} to {high:g}"
            raise InputError(f"{parameter.name} [{unit}] is {least:g} to {most:g}, got {got}")
        return low, high


class Given(NamedTuple):
    """A key of a scenario file, the value that a sentence gives it, and the words that do."""

    key: str
    value: Any
    said: str


class Sentence(NamedTuple):
    """A sentence, the scenario that it says, what it gives by key, and whether traffic is left."""

    text: str
    scenario: LogicalScenario
    given: Mapping[str, Given]
    is_left: bool


class _Pattern(NamedTuple):
    regex: "re.Pattern[str]"  # its groups: WHAT__NAME, a kind, count or quantity of something
    sets: Sequence[tuple[str, Any]] = ()
    event: bool = False


class _Match(NamedTuple):
    first: int
    last: int  # the word after it
    event: bool
    given: tuple[Given, ...]


_Reading = tuple[_Match, ...]


@cache
def vocabulary() -> dict[str, Any]:
    """Return the phrases that sentences are read by: the contents of ``phrases.yaml``."""
    data = resources.files("bridgegen.scenario").joinpath("phrases.yaml").read_bytes()
    found = read_plain_yaml(data, "phrases.yaml").data
    assert isinstance(found, dict)
    return found


def read_sentence(text: str, like: str | None = None) -> Sentence:
    """Read a sentence.

    Args:
        text: it.
        like: a scenario of the catalogue that it is about; by default it says so itself.

    Raises:
        InputError: it is too long, is not understood to its last word, says more than one thing,
            or a value that the scenario does not have.
        UnknownNameError: no such scenario.
    """
    text = " ".join(text.split())
    if len(text) > MAX_LENGTH:
        raise InputError(f"a sentence has {MAX_LENGTH} characters at most, got {len(text)}")
    if like is not None and like not in names():
        raise UnknownNameError("scenario", like, names())
    words, complete, partly = _Words(text), [], {}
    for name in (like,) if like else _candidates(words):
        scenario = load(name)
        matches = [
            match for pattern in _patterns(scenario) for match in words.matches(pattern, scenario)
        ]
        readings = _readings(matches, len(words.words), needs_event=like is None)
        if len(readings) > 1:
            meant = [_meaning(reading) for reading in readings]
            ways = frozenset().union(*meant) - meant[0].intersection(*meant)
            told = " or ".join(sorted(f"{key}: {value}" for key, value in ways))
            raise InputError(f"'{text}' has two meanings in {name}: {told}")
        complete += [(scenario, reading) for reading in readings]
        partly[name] = words.left_by(matches)
    if len(complete) > 1:
        choice = "; ".join(f"{one.name} ({one.title})" for one, _ in complete)
        raise InputError(f"'{text}' may be: {choice}. Say more, or which one by --like")
    if complete:
        scenario, reading = complete[0]
        return Sentence(text, scenario, _once(reading), words.is_left)
    if partly:
        least = min(partly.values())
        of = ", ".join(name for name, left in partly.items() if left == least)
        raise InputError(f"not understood: {least[1] or 'how its phrases fit together'} (of {of})")
    known = {*re.findall(r"[^\W\d_]+", repr(vocabulary()))}
    new = [word for word in words.words if not {*re.findall(r"[^\W\d_]+", word)} <= known]
    raise InputError(
        f"'{text}' says no event of the catalogue that is understood, such as 'a car cuts in'; "
        f"unknown words: {', '.join(new) or 'none'}"
    )


def _candidates(words: "_Words") -> Iterator[str]:
    """Yield the scenarios of which a sentence says an event, whoever takes part in it."""
    anybody = rf"(?:{'|'.join(vocabulary()['kinds'])})(?: (?:at|doing) \S*\d.*?)?"
    for name, given in vocabulary()["scenarios"].items():
        events = (re.sub(r"\{\w+\}", lambda _: anybody, _plain(text)) for text in given["events"])
        if any(True for text in events for _ in words.matches(_Pattern(re.compile(text)))):
            yield name


class _Words:
    """The words of a sentence, as patterns know them, and where each stands in it."""

    def __init__(self, text: str) -> None:
        # Each character stays one, so that places in it are places in the text.
        lower = "".join(one.lower() if len(one.lower()) == 1 else one for one in text)
        plain = re.sub(r"(?<=[^\W\d_])-(?=[^\W\d_])", " ", lower.replace("’", "'"))
        ignored = {*vocabulary()["ignored"], ",", ".", ";", ":"}
        found = [item for item in _TOKEN.finditer(plain) if item[0] not in ignored]
        self.text, self.spans = text, [item.span() for item in found]
        self.words = ["-" if item[0] in "–—" else item[0] for item in found]
        # Scenario files are written for traffic on the right: on the left, all is in the mirror.
        left = (one for one in _countries() if ("traffic", "left") in one.sets)
        country = next((match for one in left for match in self.matches(one)), None)
        self.is_left, other = country is not None, {"left": "right", "right": "left"}
        if country is not None:
            kept = range(country.first, country.last)
            self.words = [
                word if at in kept else other.get(word, word) for at, word in enumerate(self.words)
            ]

    def said(self, first: int, last: int) -> str:
        """Return the words from one to before another, as the sentence has them."""
        return self.text[self.spans[first][0] : self.spans[last - 1][1]]

    def matches(
        self, pattern: _Pattern, scenario: LogicalScenario | None = None
    ) -> Iterator[_Match]:
        """Yield where a pattern matches, each length that it can have."""
        for first in range(len(self.words)):
            longest = pattern.regex.match(" ".join(self.words[first:]))
            count = longest[0].count(" ") + 1 if longest and longest[0] else 0
            for last in range(first + count, first, -1):
                found = pattern.regex.fullmatch(" ".join(self.words[first:last]))
                if found is None:
                    continue
                whole = self.said(first, last)
                given = [Given(key, value, whole) for key, value in pattern.sets]
                for group, text in found.groupdict().items():
                    what, _, name = group.partition("__")
                    if text is None or scenario is None:
                        continue
                    start, end = (first + found[0].count(" ", 0, at) for at in found.span(group))
                    part = self.said(start, end + 1) if pattern.event else whole
                    if what == "count":
                        given.append(Given("roads.lanes", vocabulary()["counts"][text], part))
                    elif what != "kind":
                        value = _range(text, scenario.parameters[name].unit)
                        given.append(Given(f"parameters.{name}", value, part))
                    elif kind := vocabulary()["kinds"][text]:
                        key = f"participants.{name}.{'model' if kind in MODELS else 'type'}"
                        given.append(Given(key, kind, part))
                yield _Match(first, last, pattern.event, tuple(given))

    def left_by(self, matches: Sequence[_Match]) -> tuple[int, str]:
        """Return how many words the longest matches leave, with one event at most, and which."""
        free, event = {*range(len(self.words))}, False
        for item in sorted(matches, key=lambda item: (not item.event, item.first - item.last)):
            if free.issuperset(range(item.first, item.last)) and not (item.event and event):
                free -= {*range(item.first, item.last)}
                event |= item.event
        marks = "".join("x" if at in free else "." for at in range(len(self.words)))
        runs = [f"'{self.said(*at.span())}'" for at in re.finditer("x+", marks)]
        return len(free), ", ".join(runs)


def _plain(text: str) -> str:
    """Return a phrase without words in capitals, as it ends with a word."""
    for _ in range(3):
        text = re.sub(r"\b[A-Z]{2,}\b", lambda at: f"(?:{vocabulary()['words'][at[0]]})", text)
    return rf"(?:{text})(?!\S)"


def _patterns(scenario: LogicalScenario) -> Iterator[_Pattern]:
    """Yield all that can be said of a scenario."""
    known, like = vocabulary(), (("like", scenario.name),)
    given = known["scenarios"][scenario.name]
    people = {item.name: _participant(scenario, item) for item in scenario.participants}

    def pattern(
        text: str, sets: Sequence[tuple[str, Any]] = (), of: str = "", event: bool = False
    ) -> _Pattern:
        fill = {"": _quantity(scenario.parameters[of])} if of else {}
        if "{n}" in text:
            can = given.get("lanes", [scenario.roads.knobs["lanes"]])
            spoken = [word for word, number in known["counts"].items() if number in can]
            fill["n"] = f"(?P<count__>{'|'.join(spoken)})"
        text = re.sub(r"\{(\w*)\}", lambda at: (people | fill)[at[1]], _plain(text))
        return _Pattern(re.compile(text), sets, event)

    yield from (pattern(text, like, event=True) for text in given["events"])
    for text in (*given.get("also", ()), *known["ego"].get(given.get("ego", ""), ())):
        yield pattern(text, like)
        if text.startswith("EGO") and scenario.ego.speed in scenario.parameters:
            yield pattern(text + " at {}", like, str(scenario.ego.speed))
    for name, values in given.get("values", {}).items():
        for value, texts in values.items():
            for text in texts if isinstance(texts, list) else [texts]:
                yield pattern(text, ((f"parameters.{name}", value),))
    for name, texts in given.get("quantities", {}).items():
        yield from (pattern(text, (), name) for text in texts)
    for name, parameter in scenario.parameters.items():
        spoken = name.replace("_", " ")
        for value in parameter.kind.names:
            text = f"{spoken} {value.replace('_', ' ')}"
            yield pattern(text, ((f"parameters.{name}", value),))
        if not parameter.kind.names:
            yield pattern(f"{spoken}( at)? {{}}", (), name)
        for text, (low, high) in known["weather"].get(name, {}).items():
            yield pattern(text, ((f"parameters.{name}", Range(low, high)),))
    for item in scenario.participants:
        yield pattern(f"{item.name.replace('_', ' ')} {{{item.name}}}")
        if item.speed in scenario.parameters:
            spoken = "EGO" if item.name == "ego" else f"{{{item.name}}}"
            yield pattern(f"{spoken}( DRIVES)?( at)? {{}}", (), str(item.speed))
    yield from _countries()
    roads = scenario.roads
    facts = {
        "roads.road_type": "motorway" if roads.template == "merge" else roads.road_type,
        "template": roads.template,
        "roads.signals": f"{roads.template} {roads.signals}",
        "roads.segments": f"{roads.template} {'bend' if roads.segments[1:] else 'straight'}",
    }  # as the road is already
    for key, fact in facts.items():
        value = fact.split(" ")[-1]
        yield from (pattern(text, ((key, value),)) for text in known["roads"].get(fact, ()))
    if not roads.knobs.get("lanes_against", 1):
        yield from (pattern(text) for text in known["lanes"])


def _countries() -> Iterator[_Pattern]:
    for text, values in vocabulary()["countries"].items():
        yield _Pattern(re.compile(_plain(text)), tuple(values.items()))


def _participant(scenario: LogicalScenario, item: Participant) -> str:
    """Return what may be said for a participant: its kind and its speed."""
    words = []
    for word, kind in vocabulary()["kinds"].items():
        if item.type_by or item.own_body or item.model or item.siren:
            fits = kind == (item.model or item.type)
        else:
            of = MODELS[kind].type if kind in MODELS else kind or "car"
            fits = PARTICIPANTS[of].seen_as.conduct == item.conduct
        words += [word] * fits
    text = f"(?P<kind__{item.name}>{'|'.join(words) or '(?!)'})"
    speed = scenario.parameters.get(str(item.speed))
    return text if speed is None else f"{text}(?: (?:at|doing) {_quantity(speed, item.name)})?"


def _quantity(parameter: Parameter, of: str = "") -> str:
    symbols = sorted(
        map(re.escape, vocabulary()["units"].get(parameter.unit, ())), key=len, reverse=True
    )
    one = _NUMBER + (f" (?:{'|'.join(symbols)})" if symbols else "")
    first = rf"(?:{one}|{_NUMBER})"
    form = (
        f"(?:{_LEAST}|{_MOST}) {one}|between {first} {one}|(?:from )?{first} (?:to|-) {one}|{one}"
    )
    return f"(?P<value{of}__{parameter.name}>{form})"


def _range(text: str, unit: str) -> Range:
    """Return the values that a quantity's words give, in a unit."""
    symbols = vocabulary()["units"].get(unit, {})
    ends = re.findall(rf"({_NUMBER})((?: (?!to\b|-)[^\s\d+-]\S*)*)", text)
    last = symbols.get(ends[-1][1].strip(), "")
    said = [(number, symbols.get(words.strip(), last)) for number, words in ends]
    values = [in_unit(f"{number} {of}", unit) if of else float(number) for number, of in said]
    if re.match(_LEAST, text):
        return Range(values[0], None)
    return Range(None, values[0]) if re.match(_MOST, text) else Range(values[0], values[-1])


def _meaning(reading: _Reading) -> frozenset[tuple[str, Any]]:
    return frozenset((item.key, item.value) for match in reading for item in match.given)


def _readings(matches: Sequence[_Match], count: int, *, needs_event: bool) -> list[_Reading]:
    """Return the readings that cover all words by the fewest matches, one of each meaning."""
    # By how many words are behind, and whether an event is.
    best: dict[tuple[int, bool], list[_Reading]] = {(0, False): [()]}
    for item in sorted(matches, key=lambda item: item.first):
        for event in (False, True):
            for reading in best.get((item.first, event), ()):
                if item.event and event:
                    continue
                others = best.setdefault((item.last, event or item.event), [])
                new = (*reading, item)
                if others and len(new) < len(others[0]):
                    others.clear()
                if not others or (
                    len(new) == len(others[0])
                    and len(others) < _MOST_READINGS
                    and _meaning(new) not in map(_meaning, others)
                ):
                    others.append(new)
    found = best.get((count, True), [])
    return found if needs_event or not count else found or best.get((count, False), [])


def _once(reading: _Reading) -> dict[str, Given]:
    """Return what is given by key.

    Raises:
        InputError: a key is given two values.
    """
    given: dict[str, Given] = {}
    for item in (item for match in reading for item in match.given):
        first = given.setdefault(item.key, item)
        if first.value != item.value:
            raise InputError(f"{item.key} is said twice: '{first.said}', '{item.said}'")
        if first.said != item.said:
            given[item.key] = first._replace(said=f"{first.said}; {item.said}")
    return given
