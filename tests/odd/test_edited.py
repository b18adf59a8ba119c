"""Values of YAML files change where they stand; nothing else of the file does."""

import yaml
from hypothesis import given
from hypothesis import strategies as st
from tests.approval import refuses

from bridgegen.base.errors import FileFormatError
from bridgegen.scenario.language.plain_yaml import read_plain_yaml, replaced

NAMES = st.text("abc_", min_size=1, max_size=4)
VALUES = st.one_of(
    st.integers(-99, 99), st.floats(allow_nan=False, allow_infinity=False),
    st.text(st.characters(codec="utf-8", exclude_categories=("C", "Z")), max_size=9),
)  # fmt: skip
DATA = st.dictionaries(
    NAMES, st.recursive(VALUES, lambda one: st.lists(one, max_size=3)
                        | st.dictionaries(NAMES, one, max_size=3), max_leaves=9),
    min_size=1, max_size=4,
)  # fmt: skip


def leaves(data, path=()):
    pairs = data.items() if isinstance(data, dict) else enumerate(data)
    for key, value in pairs:
        if isinstance(value, dict | list):
            yield from leaves(value, (*path, key))
        else:
            yield (*path, key)


def at(data, path):
    for key in path:
        data = data[key]
    return data


@given(DATA, st.sampled_from([True, False, None]), st.data())
def test_one_value_changes_and_no_other(data, flow, draw):
    text = yaml.safe_dump(data, default_flow_style=flow, allow_unicode=True)
    paths = list(leaves(data))
    assert set(read_plain_yaml(text.encode(), "a.yaml").scalars) == set(paths)
    if not paths:
        return
    path = draw.draw(st.sampled_from(paths))
    before, after = (
        read_plain_yaml(one.encode(), "a.yaml").data
        for one in (text, replaced(text, {path: "12.5"}, "a.yaml"))
    )
    for each in paths:
        assert at(after, each) == (12.5 if each == path else at(before, each))


def test_comments_quotes_and_line_ends_stay():
    text = "\ufeffa: 1 # one\r\nb: {c: '2', d: \"x\"} # é\r\n\r\ne:\r\n- 90 km/h # fast\r\n"
    values = {("b", "c"): "3", ("e", 0): "80 km/h"}
    assert replaced(text, values, "a.yaml") == text.replace("'2'", "3").replace("90", "80")


def test_what_is_no_plain_yaml_is_refused():
    with refuses(FileFormatError, "line 1"):
        replaced("a: &b 1\nc: *b\n", {}, "a.yaml")
