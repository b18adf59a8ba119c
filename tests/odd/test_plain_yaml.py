import json
import math

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.approval import refuses

from bridgegen.base.errors import FileFormatError
from bridgegen.scenario.language import plain_yaml
from bridgegen.scenario.language.plain_yaml import MAX_BYTES, MAX_DEPTH, read_plain_yaml

SCALARS = {
    "text": "text", "'3'": "3", '"true"': "true", "3": 3, "-3": -3, "+3": 3, "007": 7,
    "3.5": 3.5, ".5": 0.5, "3.": 3.0, "1e-3": 0.001, "1E3": 1000.0, "-2.5e+1": -25.0,
    "true": True, "False": False, "null": None, "~": None, "": None, ".inf": math.inf,
    "-.inf": -math.inf,
    # What YAML 1.1 makes truth values, base 60 numbers, dates, octals and merges of, are texts.
    "yes": "yes", "on": "on", "off": "off", "12:30": "12:30", "2020-01-01": "2020-01-01",
    "0x1F": "0x1F", "1_000": "1_000", "m/s²": "m/s²",
}  # fmt: skip


@pytest.fixture(params=["SafeLoader", "CSafeLoader"])
def _either_parser(request, monkeypatch):
    """The one in C, which is used where it is, and the one in Python must agree."""
    if not hasattr(yaml, request.param):
        pytest.skip("PyYAML without libyaml")
    monkeypatch.setattr(plain_yaml, "_LOADER", getattr(yaml, request.param))


@pytest.mark.usefixtures("_either_parser")
@pytest.mark.parametrize(("text", "value"), SCALARS.items())
def test_scalars(text, value):
    read = read_plain_yaml(f"key: {text}\n".encode(), "f.yaml").data
    assert read == {"key": value}
    assert type(read["key"]) is type(value)


def test_nan_is_read():
    assert math.isnan(read_plain_yaml(b".nan", "f.yaml").data)


_texts = st.text(st.characters(codec="utf-8", exclude_categories=["C", "Zl", "Zp"]), max_size=20)
_plain = st.recursive(
    st.one_of(
        st.none(),
        st.booleans(),
        st.integers(-(10**9), 10**9),
        st.floats(allow_nan=False, allow_infinity=False),
        _texts,
    ),
    lambda inner: st.one_of(
        st.lists(inner, max_size=4), st.dictionaries(_texts, inner, max_size=4)
    ),
    max_leaves=12,
)


@given(_plain)
@settings(deadline=None)
def test_json_is_read_as_it_is(data):
    text = json.dumps(data, ensure_ascii=False)
    assert read_plain_yaml(text.encode(), "f.yaml").data == data


def test_lines_are_those_of_the_keys():
    text = "a: 1\nb:\n  c:\n    - 5\n    - d: 6\n      e: >\n        long\n        text\n"
    document = read_plain_yaml(text.encode(), "f.yaml")
    assert document.at(("a",)) == "f.yaml, line 1"
    assert document.at(("b", "c")) == "f.yaml, line 3"
    assert document.at(("b", "c", 0)) == "f.yaml, line 4"
    assert document.at(("b", "c", 1, "e")) == "f.yaml, line 6"
    assert document.at(("b", "c", 1, "missing", "deeper")) == "f.yaml, line 5"
    assert document.at(("missing",)) == "f.yaml, line 1"


HOSTILE = {
    "anchors are refused: &x (f.yaml, line 1)": "a: &x 1",
    "aliases are refused: write out what *x stands for (f.yaml, line 2)": "a: &x 1\nb: *x",
    "tags are refused: !!python/object/apply:os.system (f.yaml, line 1)":
        "a: !!python/object/apply:os.system [ls]",
    "tags are refused: tag:yaml.org,2002:str (f.yaml, line 1)": "a: !!str 3",
    "the key 'a' occurs twice, first in line 1 (f.yaml, line 3)": "a: 1\nb: 2\na: 3",
    "a key must be a text, got 3 (f.yaml, line 2)": "a: 1\n3: 2",
    "a key must be a text, got ['x'] (f.yaml, line 1)": "? [x]\n: 2",
    "a file holds one document, here begins a second (f.yaml, line 2)": "a: 1\n--- \nb: 2",
    f"entries may nest {MAX_DEPTH} deep (f.yaml, line 1)": "[" * 40 + "]" * 40,
    f"a file may have {MAX_BYTES} bytes at most (f.yaml)": "#" * (MAX_BYTES + 1),
}  # fmt: skip


@pytest.mark.usefixtures("_either_parser")
@pytest.mark.parametrize(("message", "text"), HOSTILE.items(), ids=[k[:30] for k in HOSTILE])
def test_hostile_files(message, text):
    with pytest.raises(FileFormatError) as caught:
        read_plain_yaml(text.encode(), "f.yaml")
    assert message.replace("!!", "tag:yaml.org,2002:") in caught.value.problems


def test_depth_is_counted_in_entries():
    text = "[" * MAX_DEPTH + "x" + "]" * MAX_DEPTH
    assert read_plain_yaml(text.encode(), "f.yaml").data is not None
    with refuses(FileFormatError, "32"):
        read_plain_yaml(f"[{text}]".encode(), "f.yaml")


def test_a_bomb_of_aliases_does_not_expand():
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 10)}]" for n in range(1, 12)]
    with refuses(FileFormatError):
        read_plain_yaml("\n".join(lines).encode(), "f.yaml")


def test_all_that_is_wrong_is_said_at_once():
    with pytest.raises(FileFormatError) as caught:
        read_plain_yaml(b"a: &x 1\na: 2\nb: *x\nc: [", "f.yaml")
    assert len(caught.value.problems) == 4
    assert caught.value.problems[-1].startswith("not YAML: ")
    assert ", line " in caught.value.problems[-1]


@pytest.mark.parametrize("data", [b"\xff\xfea", b"a: \xe9"])
def test_not_utf8(data):
    with refuses(FileFormatError):
        read_plain_yaml(data, "f.yaml")


def test_byte_order_mark_is_skipped():
    assert read_plain_yaml(b"\xef\xbb\xbfa: 1", "f.yaml").data == {"a": 1}


@given(st.one_of(st.binary(max_size=60), st.text("a:-[]{}&*!|>'\"#%@ \n?,0", max_size=60)))
@settings(deadline=None)
def test_any_bytes_are_yaml_or_one_clear_error(data):
    data = data if isinstance(data, bytes) else data.encode()
    try:
        document = read_plain_yaml(data, "f.yaml")
    except FileFormatError as caught:
        problems = caught.problems
    else:
        problems = [document.at(("no", "such", "path"))]
    assert all("f.yaml" in problem for problem in problems)
