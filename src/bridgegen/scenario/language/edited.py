"""Values of a YAML text, replaced where they stand: comments and layout stay as they are."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import yaml

from bridgegen.scenario.language.plain_yaml import Path, read_plain_yaml


@dataclass(frozen=True)
class Scalar:
    """A value in a text.

    Attributes:
        start: its first character, quotes included.
        end: the one after its last.
        text: it, without quotes.
    """

    start: int
    end: int
    text: str


def scalars(text: str, place: str) -> dict[Path, Scalar]:
    """Return the values of a YAML text, by their path from the root.

    Args:
        text: of a whole file.
        place: the file, for messages.

    Raises:
        FileFormatError: no YAML, or more than plain YAML.
    """
    read_plain_yaml(text.encode(), place)
    found: dict[Path, Scalar] = {}
    events = yaml.parse(text, Loader=yaml.SafeLoader)
    for event in events:
        if isinstance(event, yaml.DocumentStartEvent):
            _take(next(events), events, (), found)
    return found


def replaced(text: str, values: Mapping[Path, str], place: str) -> str:
    """Return a text in which some values are others.

    Args:
        text: of a whole file.
        values: the new ones, by path, as they are to stand in the file.
        place: the file, for messages.

    Raises:
        KeyError: no value stands there.
        FileFormatError: see `scalars`.
    """
    found = scalars(text, place)
    for path in sorted(values, key=lambda one: -found[one].start):
        at = found[path]
        text = text[: at.start] + values[path] + text[at.end :]
    return text


def _take(
    event: yaml.Event, events: Iterator[yaml.Event], path: Path, found: dict[Path, Scalar]
) -> None:
    if isinstance(event, yaml.SequenceStartEvent):
        number = 0
        while not isinstance(event := next(events), yaml.SequenceEndEvent):
            _take(event, events, (*path, number), found)
            number += 1
    elif isinstance(event, yaml.MappingStartEvent):
        while not isinstance(event := next(events), yaml.MappingEndEvent):
            assert isinstance(event, yaml.ScalarEvent)  # of plain YAML, keys are texts
            _take(next(events), events, (*path, event.value), found)
    elif isinstance(event, yaml.ScalarEvent):
        start, end = event.start_mark, event.end_mark
        assert start is not None
        assert end is not None
        found[path] = Scalar(start.index, end.index, event.value)
