import contextlib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.approval import refuses

from bridgegen.base.errors import FileFormatError
from bridgegen.openx import xml
from bridgegen.openx.xml import parse_xml, read_bytes


def test_a_document_s_root_with_its_lines():
    root = parse_xml(b"<a>\n<b/>\n</a>")
    assert root.tag == "a"
    assert root[0].sourceline == 2


@pytest.mark.parametrize(
    "text",
    [
        b'<!DOCTYPE a [<!ENTITY x "y">]><a>&x;</a>',
        b'<!DOCTYPE a [<!ENTITY x SYSTEM "file:///etc/hostname">]><a>&x;</a>',
        b'<!DOCTYPE a SYSTEM "http://127.0.0.1:9/a.dtd"><a/>',
        b"<a>&undeclared;</a>",
        b"<a><b></a>",
        b"",
        b"\xff\xfe\x00",
        b"<a>" * 1000 + b"</a>" * 1000,
        b"<a>" * 70 + b"</a>" * 70,
    ],
)
def test_what_is_hostile_or_broken_is_one_error_that_names_the_place(text):
    with pytest.raises(FileFormatError, match=r"^strange\.xml: ") as error:
        parse_xml(text, "strange.xml")
    assert len(error.value.problems) == 1


def test_a_file_may_not_be_larger_than_the_limit(tmp_path, monkeypatch):
    path = tmp_path / "large.xml"
    path.write_bytes(b"<a/>" + b" " * 100)
    with refuses(FileFormatError, "104", "50"):
        read_bytes(path, limit=50)
    monkeypatch.setattr(xml, "MAX_BYTES", 50)
    with pytest.raises(FileFormatError, match="50 bytes"):
        parse_xml(path.read_bytes())


@pytest.mark.parametrize("name", ["missing.xml", "."])
def test_what_cannot_be_read_is_named(tmp_path, name):
    with refuses(FileFormatError):
        parse_xml(tmp_path / name)


@given(st.binary(max_size=400))
def test_any_bytes_give_a_root_or_one_error(data):
    with contextlib.suppress(FileFormatError):
        assert isinstance(parse_xml(data).tag, str)


def test_a_path_is_named_in_the_message():
    with pytest.raises(FileFormatError, match=r"nowhere\.xml"):
        parse_xml(Path("nowhere.xml"))
