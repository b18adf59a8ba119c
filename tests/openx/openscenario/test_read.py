import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.approval import approve, refuses

from bridgegen.base.errors import FileFormatError, InputError, UnsupportedError
from bridgegen.openx.openscenario.read import read
from bridgegen.openx.openscenario.reader import MAX_PROBLEMS


def line_of(data: bytes, text: bytes) -> int:
    return data[: data.index(text)].count(b"\n") + 1


@pytest.mark.parametrize(
    ("old", "new", "error", "text", "at"),
    [
        # outside the model
        (b"<TeleportAction>", b"<HoverAction/><TeleportAction>", UnsupportedError,
         "HoverAction in PrivateAction is not supported", b"<HoverAction"),
        (b'priority="override"', b'priority="override" colour="red"', UnsupportedError,
         "attribute colour of Event is not supported", b"<Event "),
        (b' delay="0.0"', b' dellay="0.0" delay="0.0"', UnsupportedError, "did you mean delay?",
         b"<Condition "),
        (b"<FileHeader ", b'<FileHeader xmlns="http://www.example.org/" ', UnsupportedError,
         "{http://www.example.org/}FileHeader in OpenSCENARIO is not supported", b"<FileHeader"),
        (b'revMinor="2"', b'revMinor="4"', UnsupportedError, "1.0, 1.1, 1.2, 1.3, got 1.4",
         b"<FileHeader"),
        (b'revMajor="1"', b'revMajor="2"', UnsupportedError, "got 2.2", b"<FileHeader"),
        # malformed
        (b'tolerance="2.0"', b'tolerance="two"', FileFormatError,
         "tolerance of ReachPositionCondition must be of type double, got 'two'",
         b"<ReachPositionCondition"),
        (b'tolerance="2.0"', b"", FileFormatError,
         "ReachPositionCondition must have the attribute tolerance", b"<ReachPositionCondition"),
        (b'conditionEdge="none"', b'conditionEdge="None"', FileFormatError,
         "conditionEdge of Condition must be one of none, rising, falling, risingOrFalling",
         b"<Condition "),
        (b'animation="false"', b'animation="no"', FileFormatError, "type boolean", b"<TimeOfDay"),
        (b"<TeleportAction>", b"<TeleportAction>here", FileFormatError,
         "TeleportAction holds no text, got 'here'", b"<TeleportAction>"),
        (b"</TeleportAction>", b"there</TeleportAction>", FileFormatError,
         "TeleportAction holds no text, got 'there'",
         b"<TeleportAction>"),
        (b"<CatalogLocations/>", b"", FileFormatError,
         "OpenSCENARIO must have CatalogLocations", b"<OpenSCENARIO>"),
        (b"<CatalogLocations/>", b"<CatalogLocations/><CatalogLocations/>", FileFormatError,
         "OpenSCENARIO must have one CatalogLocations, got 2", b"<OpenSCENARIO>"),
        (b'visualRange="${', b'visualRange="${(', FileFormatError, "visualRange of Fog", b"<Fog "),
        (b'visualRange="${', b'visualRange="${speed*', FileFormatError, "unknown name speed",
         b"<Fog "),
    ],
)  # fmt: skip
def test_a_mistake_is_named_with_its_line(s4, old, new, error, text, at):
    assert old in s4
    data = s4.replace(old, new, 1)
    with pytest.raises(error) as caught:
        read(data, "mine.xosc")
    message = caught.value.problems[0]
    assert text in message
    assert message.startswith("mine.xosc: ")
    line = int(re.search(r"\(line (\d+)\)", message)[1])
    assert line == line_of(data, at)


def test_all_mistakes_come_at_once_in_order(s4):
    data = s4.replace(b'tolerance="2.0"', b'tolerance="x"')
    data = data.replace(b'animation="false"', b'animation="no"')
    data = data.replace(b"<TeleportAction>", b"<Beam/><TeleportAction>", 1)
    with pytest.raises(FileFormatError) as caught:
        read(data)
    assert [p.split(" of ")[0].split(": ")[1] for p in caught.value.problems] == [
        "animation",
        "Beam in PrivateAction is not supported (line " + str(line_of(data, b"<Beam/>")) + ")",
        "tolerance",
    ]


def test_only_outside_the_model_is_unsupported(s4):
    data = s4.replace(b"<Weather ", b'<Weather dust="1" ')
    data = data.replace(b"<TeleportAction>", b"<Beam/><TeleportAction>")
    with pytest.raises(UnsupportedError) as caught:
        read(data)
    assert len(caught.value.problems) == 3


def test_a_flood_of_mistakes_is_cut_off(s4):
    data = s4.replace(b"<CatalogLocations/>", b"<CatalogLocations/>" + b"<Beam/>" * 10_000)
    with pytest.raises(UnsupportedError) as caught:
        read(data)
    assert len(caught.value.problems) == MAX_PROBLEMS + 1
    approve(caught.value.problems[-1], "950")


@pytest.mark.parametrize(
    ("data", "text"),
    [
        (b"", "not well-formed"),
        (b"<OpenSCENARIO>", "not well-formed"),
        (b"\x00\xff", "not well-formed"),
        (b"<OpenDRIVE/>", "OpenDRIVE"),
        (b"<OpenSCENARIO/>", "FileHeader"),
        (b'<!DOCTYPE x [<!ENTITY a "b">]><OpenSCENARIO/>', "DOCTYPE"),
        (b'<!DOCTYPE x SYSTEM "file:///etc/passwd"><OpenSCENARIO/>', "DOCTYPE"),
        (b"<OpenSCENARIO>" + b"<Event>" * 100 + b"</Event>" * 100 + b"</OpenSCENARIO>", "deep"),
    ],
)
def test_hostile_and_broken_files(data, text):
    with refuses(FileFormatError, text):
        read(data)


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(FileFormatError, match=r"nothing\.xosc"):
        read(tmp_path / "nothing.xosc")
    with pytest.raises(FileFormatError, match=re.escape(str(tmp_path))):
        read(str(tmp_path))


def test_a_file_by_its_path(s4, tmp_path):
    (tmp_path / "s4.xosc").write_bytes(s4)
    assert read(tmp_path / "s4.xosc") == read(str(tmp_path / "s4.xosc")) == read(s4)


def test_what_does_not_matter_is_accepted(s4):
    data = s4.replace(
        b"<OpenSCENARIO>",
        b"<!-- a comment --><OpenSCENARIO "
        b'xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" '
        b'xsi:noNamespaceSchemaLocation="OpenSCENARIO.xsd"><?pi x?>',
    )
    # children in another order: a reader needs none
    center = re.search(rb"<Center [^>]*>", data)[0]
    dimensions = re.search(rb"<Dimensions [^>]*>", data)[0]
    data = data.replace(center, b"<!---->").replace(dimensions, dimensions + center)
    assert read(data) == read(s4)


_FRAGMENTS = [
    b"<", b">", b"/>", b'"', b"$", b"${", b"}", b"&amp;", b"&x;", b"\x00", b"-", b"INF", b"1e999",
    b"<Story/>", b"$ego_speed", b'name=""', b"ParameterDeclaration", b"\xff", b"0", b"true",
]  # fmt: skip


def complaints(data: bytes) -> tuple[str, ...]:
    """What the reader says against a file; any other exception is a failure."""
    try:
        read(data)
    except InputError as error:
        return error.problems
    return ()


@settings(max_examples=250)
@given(st.data())
def test_mutated_files_give_a_model_or_one_clear_error(s4, data):
    mutant = s4
    for _ in range(data.draw(st.integers(1, 4))):
        start = data.draw(st.integers(0, len(mutant)))
        length = data.draw(st.sampled_from([0, 1, 3, 20, 200]))
        put = data.draw(st.sampled_from(_FRAGMENTS) | st.binary(max_size=4))
        mutant = mutant[:start] + put + mutant[start + length :]
    problems = complaints(mutant)
    assert len(problems) <= MAX_PROBLEMS + 1
    assert all(problem.startswith("document: ") for problem in problems[:MAX_PROBLEMS])


_TOKEN = re.compile(rb'"[^"]*"|<[A-Za-z]+|</[A-Za-z]+>')


@settings(max_examples=250)
@given(st.data())
def test_well_formed_mutants_too(s4, data):
    """Values and tags changed for others of the same file, which stays well-formed XML."""
    tokens = sorted({t[0] for t in _TOKEN.finditer(s4) if t[0].startswith(b'"')})
    spots = [t for t in _TOKEN.finditer(s4) if t[0].startswith(b'"')]
    mutant = s4
    for spot in sorted(
        data.draw(st.lists(st.sampled_from(spots), min_size=1, max_size=5, unique_by=id)),
        key=lambda t: -t.start(),
    ):
        value = data.draw(st.sampled_from([*tokens, b'""', b'"-1"', b'"${1/0}"', b'"$nobody"']))
        mutant = mutant[: spot.start()] + value + mutant[spot.end() :]
    assert all(problem.startswith("document: ") for problem in complaints(mutant))
