"""A sentence in controlled English, read as a scenario of the catalogue and what is said of it.

The phrases are data, ``scenario/phrases.yaml``. A sentence is understood if phrases of one scenario
cover all of its words but those that the file ignores, in one way; the rest is refused by name.
"""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib import resources
from typing import Any, NamedTuple

from bridgegen.base.errors import InputError, UnknownNameError
from bridgegen.base.units import WRITTEN, in_unit
from bridgegen.scenario.countries import COUNTRIES
from bridgegen.scenario.language.plain_yaml import read_plain_yaml
from bridgegen.scenario.language.reader import load, names
from bridgegen.scenario.language.scenario import LogicalScenario
from bridgegen.scenario.named_models import MODELS
from bridgegen.scenario.participants import PARTICIPANTS

MAX_LENGTH = 400
_MOST_READINGS = 500
_TOKEN = re.compile(
    r"\d[\d.]*,\d[\d.,]*|(?<![\w.])[-+]\d+(?:\.\d+)?|\d+(?:\.\d+)?"
    r"|m/s(?:²|2|\^2)|[^\W\d_]+/[^\W\d_]+|[^\W\d_]+(?:['’]s)?|[^\s]"
)
_NUMBER = r"[-+]?\d+(?:\.\d+)?"
_LEAST = "at least|no less than|more than|over|above"
_MOST = "at most|up to|no more than|less than|under|below"


class Range(NamedTuple):
    """Values that a sentence gives a parameter, in its unit; None: as far as the catalogue has it.

    Attributes:
        low: smallest value.
        high: largest value.
    """

    low: float | None
    high: float | None


Sets = tuple[tuple[str, object], ...]
"""Keys of a scenario file, with the values that a phrase gives them."""


@dataclass(frozen=True)
class Phrase:
    """A part of a sentence that was understood.

    Attributes:
        said: its words.
        sets: what it gives; what the scenario is like already is among it.
        span: its first word, and the one after its last.
        event: whether it says what happens.
        parts: the words that give a key, where not all do.
    """

    said: str
    sets: Sets
    span: tuple[int, int]
    event: bool = False
    parts: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Sentence:
    """A sentence that was understood.

    Attributes:
        text: it.
        scenario: the scenario of the catalogue that it says.
        phrases: its parts, in order.
    """

    text: str
    scenario: LogicalScenario
    phrases: tuple[Phrase, ...]

    @property
    def said(self) -> dict[str, tuple[object, str]]:
        """What is said: by key its value, and the words that say so."""
        found: dict[str, tuple[object, str]] = {}
        for phrase in self.phrases:
            for key, value in phrase.sets:
                words = f'"{phrase.parts.get(key, phrase.said)}"'
                found[key] = (value, f"{found[key][1]}, {words}" if key in found else words)
        return found


class _Pattern(NamedTuple):
    regex: "re.Pattern[str]"
    sets: Sets = ()
    slots: Mapping[str, str] = {}  # the group of a quantity → the parameter that it limits
    event: bool = False


_Part = tuple[str, object, tuple[int, int]]


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
    if len(text) > MAX_LENGTH:
        raise InputError(f"a sentence has {MAX_LENGTH} characters at most, got {len(text)}")
    if like is not None and like not in names():
        raise UnknownNameError("scenario", like, names())
    words = _Words.of(text)
    complete: list[Sentence] = []
    partly: list[tuple[int, str, list[Phrase]]] = []
    for name in (like,) if like else _candidates(words):
        scenario = load(name)
        matches = [match for pattern in _patterns(scenario) for match in words.matches(pattern)]
        readings = _covers(matches, words.content, needs_event=like is None)
        if len(readings) == 1:
            complete.append(Sentence(text, scenario, readings[0]))
        elif readings:
            raise InputError(_two_meanings(name, readings))
        else:
            best = _most(matches, words.content)
            partly.append((sum(map(_length, best)), name, best))
    if not complete:
        raise InputError(*_not_understood(words, partly))
    if len(complete) > 1:
        choice = "; ".join(f"{one.scenario.name} ({one.scenario.title})" for one in complete)
        raise InputError(f"'{text}' may be: {choice}. Say more, or which one by --like")
    _refuse_contradictions(complete[0])
    return complete[0]


def _candidates(words: "_Words") -> Iterator[str]:
    """Yield the scenarios of which a sentence says an event, whoever takes part in it."""
    anybody = rf"(?:{'|'.join(vocabulary()['kinds'])})(?: (?:at|doing) \S*\d.*?)?"
    for name, given in vocabulary()["scenarios"].items():
        events = [_Pattern(_compiled(text, {}, anybody)) for text in given["events"]]
        if any(True for pattern in events for _ in words.matches(pattern, shorter=False)):
            yield name


# --- Words ---


@dataclass(frozen=True)
class _Words:
    """The words of a sentence, those that are matched as text, and where each stands in it."""

    text: str
    spans: tuple[tuple[int, int], ...]
    words: tuple[str, ...]

    @classmethod
    def of(cls, text: str) -> "_Words":
        ignored = {*vocabulary()["ignored"], ",", ".", ";", ":"}
        # Each character stays one, so that places in it are places in the text.
        lower = "".join(one.lower() if len(one.lower()) == 1 else one for one in text)
        plain = re.sub(r"(?<=[^\W\d_])-(?=[^\W\d_])", " ", lower.replace("’", "'"))
        found = [item for item in _TOKEN.finditer(plain) if item[0] not in ignored]
        spans = tuple(item.span() for item in found)
        words = tuple("-" if item[0] in "–—" else item[0] for item in found)
        return cls(text, spans, cls._mirrored(words))

    @classmethod
    def _mirrored(cls, words: tuple[str, ...]) -> tuple[str, ...]:
        """Return the words as of traffic on the right, in which scenario files are written."""
        plain = cls("", ((0, 0),) * len(words), words)
        for phrase in (match for pattern in _countries() for match in plain.matches(pattern)):
            if _is_left(phrase.sets):
                kept = range(*phrase.span)
                other = {"left": "right", "right": "left"}
                return tuple(
                    word if at in kept else other.get(word, word) for at, word in enumerate(words)
                )
        return words

    @property
    def content(self) -> int:
        """How many words there are to understand."""
        return len(self.words)

    def said(self, first: int, last: int) -> str:
        """Return the words of the sentence from one to before another, as they are written."""
        return self.text[self.spans[first][0] : self.spans[last - 1][1]]

    def matches(self, pattern: _Pattern, *, shorter: bool = True) -> Iterator[Phrase]:
        """Yield where a pattern matches, each length that it can have."""
        for first in range(self.content):
            rest = " ".join(self.words[first:])
            longest = pattern.regex.match(rest)
            if longest is None or not longest[0]:
                continue
            count = longest[0].count(" ") + 1
            for last in range(first + count, first if shorter else first + count - 1, -1):
                found = pattern.regex.fullmatch(" ".join(self.words[first:last]))
                if found is None:
                    continue
                sets, parts = [*pattern.sets], {}
                for key, value, (start, end) in _parts(pattern, found):
                    if pattern.event:
                        at = first + found[0].count(" ", 0, start)
                        parts[key] = self.said(at, at + found[0].count(" ", start, end) + 1)
                    sets.append((key, value))
                span = (first, last)
                yield Phrase(self.said(*span), tuple(sets), span, pattern.event, parts)


def _parts(pattern: _Pattern, found: "re.Match[str]") -> Iterator[_Part]:
    """Yield the keys and values that a phrase's slots give, and where in its text."""
    for group, key in pattern.slots.items():
        if (text := found[group]) is None:
            continue
        if group.startswith("kind_"):
            if kind := vocabulary()["kinds"][text]:
                yield (f"{key}.model" if kind in MODELS else f"{key}.type"), kind, found.span(group)
        elif group == "count":
            yield key, vocabulary()["numbers"].get(text) or int(text), found.span(group)
        else:
            yield key, _range(text, group.partition("__")[2]), found.span(group)


# --- Patterns ---


def _alternatives(given: object) -> list[str]:
    return [str(item) for item in given] if isinstance(given, list) else [str(given)]


def _expanded(text: str) -> str:
    """Return a pattern without words in capitals."""
    for _ in range(4):
        text = re.sub(
            r"\b[A-Z]{2,}\b", lambda found: f"(?:{vocabulary()['words'][found[0]]})", text
        )
    return text


def _compiled(text: str, groups: Mapping[str, str], otherwise: str = "") -> "re.Pattern[str]":
    """Return a pattern as a regular expression, with groups in the place of what is in braces."""
    filled = re.sub(
        r"\{([a-z_]*)\}",
        lambda found: groups.get(found[1], f"(?:{otherwise})" if otherwise else r"(?!)"),
        _expanded(text),
    )
    return re.compile(rf"(?:{filled})(?!\S)")


def _patterns(scenario: LogicalScenario) -> Iterator[_Pattern]:
    """Yield all that can be said of a scenario."""
    known = vocabulary()
    given = known["scenarios"][scenario.name]
    slots = {item.name: _slot(scenario, item.name) for item in scenario.participants}
    groups = {name: text for name, (text, _) in slots.items()}

    def pattern(text: str, sets: Sets, event: bool = False) -> _Pattern:
        regex = _compiled(text, groups)
        inside = {group: key for _, keys in slots.values() for group, key in keys.items()}
        return _Pattern(
            regex, sets, {g: key for g, key in inside.items() if g in regex.groupindex}, event
        )

    like: Sets = (("like", scenario.name),)
    for text in given["events"]:
        yield pattern(text, like, event=True)
    for text in given.get("also", ()):
        yield pattern(text, like)
    for text in known["ego"].get(given.get("ego", ""), ()):
        yield pattern(text, like)
        if scenario.ego.speed in scenario.parameters:
            yield _quantity(scenario, str(scenario.ego.speed), f"{text} at {{}}", sets=like)
    for name, values in given.get("values", {}).items():
        for value, texts in values.items():
            for text in _alternatives(texts):
                yield pattern(text, ((f"parameters.{name}", value),))
    for name, texts in given.get("quantities", {}).items():
        yield from (_quantity(scenario, name, text) for text in texts)
    for name, parameter in scenario.parameters.items():
        spoken = name.replace("_", " ")
        if not parameter.kind.names:
            yield _quantity(scenario, name, f"{spoken}( at| from)? {{}}")
        for value in parameter.kind.names:
            text = f"{spoken} {value.replace('_', ' ')}"
            yield _Pattern(_compiled(text, {}), ((f"parameters.{name}", value),))
    for item in scenario.participants:
        if item.speed in scenario.parameters:
            spoken = "EGO" if item.name == "ego" else f"{{{item.name}}}"
            text = f"{spoken}( DRIVES)?( at)? {{}}"
            yield _quantity(scenario, str(item.speed), text, slots.get(item.name))
    for name, texts in known["weather"].items():
        for text, (low, high) in texts.items() if name in scenario.parameters else ():
            yield _Pattern(_compiled(text, {}), ((f"parameters.{name}", Range(low, high)),))
    yield from _countries()
    yield from _roads(scenario)


def _roads(scenario: LogicalScenario) -> Iterator[_Pattern]:
    """Yield what can be said of the road that a scenario is on."""
    roads, known = scenario.roads, vocabulary()
    kind = "motorway" if roads.template == "merge" else roads.road_type
    facts = {kind: "roads.road_type", roads.template: "template"}
    if roads.template == "crossroads":
        facts["unsignalised" if roads.signals == "none" else "signals"] = "roads.signals"
    for fact, key in facts.items():
        value = roads.signals if key == "roads.signals" else fact
        for text in known["roads"].get(fact, ()):
            yield _Pattern(_compiled(text, {}), ((key, value),))
    if not roads.knobs.get("lanes_against") and isinstance(roads.knobs.get("lanes"), int | float):
        numbers = "|".join([*known["numbers"], r"\d"])
        for text in known["lanes"]:
            regex = _compiled(text, {"n": f"(?P<count>{numbers})"})
            yield _Pattern(regex, (), {"count": "roads.lanes"})


def _countries() -> Iterator[_Pattern]:
    for text, values in vocabulary()["countries"].items():
        yield _Pattern(_compiled(text, {}), tuple(values.items()))


def _is_left(sets: Sets) -> bool:
    return any(
        value == "left" or (key == "rules" and COUNTRIES[str(value)].traffic == "left")
        for key, value in sets
    )


def _slot(scenario: LogicalScenario, name: str) -> tuple[str, dict[str, str]]:
    """Return what may be said for a participant: its kind and its speed."""
    item = scenario.participant(name)
    words = []
    for word, kind in vocabulary()["kinds"].items():
        of_type = MODELS[kind].type if kind in MODELS else kind
        if kind is None:
            fits = item.conduct == "vehicle" and not item.siren
        elif item.type_by or item.own_body or item.model or item.siren:
            fits = kind in (item.model, "" if item.model else item.type)
        else:
            fits = PARTICIPANTS[of_type].seen_as.conduct == item.conduct
        words += [word] if fits else []
    group, key = f"kind_{name}", f"participants.{name}"
    text = rf"(?P<{group}>{'|'.join(words) or '(?!)'})"
    slots = {group: key}
    if item.speed in scenario.parameters:
        parameter = scenario.parameters[str(item.speed)]
        quantity, mark = _quantity_group(f"speed_{name}", parameter.unit)
        text += f"(?: (?:at|doing|DRIVES at) {quantity})?"
        slots[mark] = f"parameters.{parameter.name}"
    return _expanded(text), slots


def _quantity(
    scenario: LogicalScenario,
    name: str,
    text: str,
    slot: tuple[str, dict[str, str]] | None = None,
    sets: Sets = (),
) -> _Pattern:
    parameter = scenario.parameters[name]
    quantity, mark = _quantity_group("value", parameter.unit)
    regex = re.sub(r"\{\}", lambda _: quantity, _expanded(text))
    slots = {mark: f"parameters.{name}"}
    if slot is not None:
        kind = next(iter(slot[1]))
        regex = re.sub(r"\{[a-z_]+\}", lambda _: slot[0].partition("(?: ")[0], regex)
        slots |= {kind: slot[1][kind]} if f"<{kind}>" in regex else {}
    return _Pattern(re.compile(rf"(?:{regex})(?!\S)"), sets, slots)


# --- Quantities ---


def _symbols(unit: str) -> dict[str, str]:
    """Return how a unit is said: by the words, the symbol that they stand for."""
    spoken = vocabulary()["units"]
    symbols = [symbol for symbol in WRITTEN.get(unit, {}) if symbol.islower() or symbol == "%"]
    return {word: symbol for symbol in symbols for word in (symbol, *spoken.get(symbol, ()))}


def _quantity_group(name: str, unit: str) -> tuple[str, str]:
    """Return a group for a quantity in a unit, and the group's name, which tells the unit."""
    index = list(WRITTEN).index(unit) if unit in WRITTEN else -1
    mark = f"{name}__{index if index >= 0 else 'none'}"
    symbols = sorted(map(re.escape, _symbols(unit)), key=len, reverse=True)
    end = f" (?:{'|'.join(symbols)})" if symbols else ""
    one = f"{_NUMBER}(?:{end})?" if end else _NUMBER
    forms = (
        rf"(?:{_LEAST}|{_MOST}) {_NUMBER}{end}",
        rf"between {one} {_NUMBER}{end}",
        rf"(?:from )?{one} (?:to|-) {_NUMBER}{end}",
        rf"{_NUMBER}{end}",
    )
    return f"(?P<{mark}>{'|'.join(forms)})", mark


def _range(text: str, mark: str) -> Range:
    """Return the values that a quantity's words give, in the parameter's unit."""
    unit = list(WRITTEN)[int(mark)] if mark != "none" else ""
    symbols = _symbols(unit)
    ends = re.findall(rf"({_NUMBER})((?: (?!to\b|-)[^\s\d+-]\S*)*)", text)
    last = symbols.get(ends[-1][1].strip(), "")
    values = []
    for number, said in ends:
        symbol = symbols.get(said.strip(), last)
        values.append(in_unit(f"{number} {symbol}", unit) if symbol else float(number))
    if len(values) == 2:
        if values[0] > values[1]:
            raise InputError(f"low <= high must hold, got '{text}'")
        return Range(values[0], values[1])
    if re.match(_LEAST, text):
        return Range(values[0], None)
    return Range(None, values[0]) if re.match(_MOST, text) else Range(values[0], values[0])


# --- From matches to readings ---


def _length(phrase: Phrase) -> int:
    return phrase.span[1] - phrase.span[0]


def _covers(
    matches: Sequence[Phrase], count: int, *, needs_event: bool
) -> list[tuple[Phrase, ...]]:
    """Return in which ways phrases cover all words; of those with the fewest phrases."""
    starting: dict[int, list[Phrase]] = {}
    for match in matches:
        starting.setdefault(match.span[0], []).append(match)
    found: list[tuple[Phrase, ...]] = []
    open_: list[tuple[Phrase, ...]] = [()]
    while open_ and len(found) < _MOST_READINGS:
        reading = open_.pop()
        at = reading[-1].span[1] if reading else 0
        events = sum(item.event for item in reading)
        if at == count and reading:
            found += [reading] if events or not needs_event else []
            continue
        more = [item for item in starting.get(at, ()) if not (item.event and events)]
        open_ += [(*reading, item) for item in more][:_MOST_READINGS]
    fewest = min(map(len, found), default=0)
    meanings: dict[frozenset[tuple[str, object]], tuple[Phrase, ...]] = {}
    for reading in found:
        if len(reading) == fewest:
            meanings.setdefault(frozenset(pair for item in reading for pair in item.sets), reading)
    return list(meanings.values())


def _most(matches: Sequence[Phrase], count: int) -> list[Phrase]:
    """Return phrases that cover as many words as phrases can, with one event if one is said."""
    # By the number of words that are behind, and whether an event is: the most words, and how.
    best: list[dict[bool, tuple[int, list[Phrase]]]] = [{False: (0, [])}]
    for at in range(1, count + 1):
        options = [(event, *entry) for event, entry in best[at - 1].items()]
        for match in matches:
            if match.span[1] == at:
                options += [
                    (event or match.event, covered + _length(match), [*found, match])
                    for event, (covered, found) in best[match.span[0]].items()
                    if not (event and match.event)
                ]
        here: dict[bool, tuple[int, list[Phrase]]] = {}
        for event, covered, found in options:
            if event not in here or covered > here[event][0]:
                here[event] = covered, found
        best.append(here)
    return best[count].get(True, best[count].get(False, (0, [])))[1]


# --- What is refused ---


def _two_meanings(name: str, readings: Iterable[tuple[Phrase, ...]]) -> str:
    texts = [{pair: item.said for item in reading for pair in item.sets} for reading in readings]
    common = set(texts[0]).intersection(*texts[1:])
    ways = {
        f"'{said}' as {pair[0]}"
        for pairs in texts
        for pair, said in pairs.items()
        if pair not in common
    }
    return f"two meanings in {name}: {' or '.join(sorted(ways))}; name the parameter instead"


def _not_understood(words: _Words, partly: list[tuple[int, str, list[Phrase]]]) -> Iterator[str]:
    if not partly:
        known = {*re.findall(r"[^\W\d_]+(?:'s)?", repr(vocabulary())), "-"}
        new = [
            words.said(at, at + 1)
            for at, word in enumerate(words.words)
            if word.removesuffix("'s") not in known and not re.fullmatch(_NUMBER, word)
        ]
        yield (
            f"no event of the catalogue is understood in '{words.text}'; one is needed, such as 'a "
            "car cuts in', or --like SCENARIO"
            + (f"; unknown words: {', '.join(new)}" if new else "")
        )
        return
    most = max(count for count, _, _ in partly)
    best = [(name, found) for count, name, found in partly if count == most]
    name, found = best[0]
    covered = {at for item in found for at in range(*item.span)}
    runs: list[list[int]] = []
    for at in (at for at in range(words.content) if at not in covered):
        if runs and runs[-1][-1] == at - 1:
            runs[-1].append(at)
        else:
            runs.append([at])
    said = ", ".join(f"'{words.said(run[0], run[-1] + 1)}'" for run in runs)
    understood = ", ".join(f"'{item.said}'" for item in found) or "nothing"
    of = ", ".join(name for name, _ in best)
    yield f"not understood: {said} (of {of}; understood: {understood})"


def _refuse_contradictions(sentence: Sentence) -> None:
    """Refuse a sentence that gives one key two values, or a value that its parameter cannot have.

    Raises:
        InputError: all that are.
    """
    problems = []
    given: dict[str, tuple[object, str]] = {}
    parameters = sentence.scenario.parameters
    for phrase in sentence.phrases:
        for key, value in phrase.sets:
            first = given.setdefault(key, (value, phrase.said))
            if first[0] != value:
                problems.append(f"{key} is said twice, '{first[1]}' and '{phrase.said}'")
            if not isinstance(value, Range):
                continue
            parameter = parameters[key.removeprefix("parameters.")]
            low, high = parameter.low, parameter.high
            both = value.low is not None and value.high is not None
            ends = [end for end in value if end is not None]
            outside = any(not low <= end <= high for end in ends)
            if outside and (both or (ends[0] > high if value.high is None else ends[0] < low)):
                problems.append(
                    f"{parameter.name} [{parameter.unit}] of {sentence.scenario.name} is {low:g} "
                    f"to {high:g}, got '{phrase.said}'"
                )
    if problems:
        raise InputError(*problems)
