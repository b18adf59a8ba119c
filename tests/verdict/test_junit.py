"""JUnit XML: what Jenkins' schema allows, and texts as they were."""

from xml.etree import ElementTree

from hypothesis import given
from hypothesis import strategies as st
from tests.approval import refuses

from bridgegen.base.errors import StorageError
from bridgegen.cli.verdict.junit import Case, Suite, junit_xml, refuse_junit, write_junit

# Jenkins' xunit-plugin, junit-10.xsd: attributes (required ones first) and children.
SCHEMA = {
    "testsuites": ((), {"name", "tests", "failures", "errors", "time"}, {"testsuite"}),
    "testsuite": (
        ("name", "tests", "failures", "errors"),
        {"time", "skipped"},
        {"testsuite", "properties", "testcase", "system-out", "system-err"},
    ),
    "properties": ((), set(), {"property"}),
    "property": (("name", "value"), set(), set()),
    "testcase": (
        ("name",),
        {"classname", "time"},
        {"skipped", "error", "failure", "system-out", "system-err"},
    ),
    "failure": ((), {"type", "message"}, set()),
    "error": ((), {"type", "message"}, set()),
    "skipped": ((), {"type", "message"}, set()),
    "system-out": ((), set(), set()),
}


def check(data: bytes) -> ElementTree.Element:
    """Return a document's root, once it is known to keep the schema and to count rightly."""
    root = ElementTree.fromstring(data)
    assert root.tag == "testsuites"
    for element in root.iter():
        required, others, children = SCHEMA[element.tag]
        assert {*required} <= {*element.attrib} <= {*required} | others, element.tag
        assert {child.tag for child in element} <= children
    for element in (root, *root.iter("testsuite")):
        for name, tag in (("tests", "testcase"), ("failures", "failure"), ("errors", "error")):
            assert element.get(name) == str(len([*element.iter(tag)]))
    for element in root.iter("testsuite"):
        assert element.get("skipped") == str(len([*element.iter("skipped")]))
    return root


texts = st.text(max_size=20)
problems = st.sampled_from([None, "failure", "error", "skipped"])
cases = st.builds(Case, texts, texts, problems, texts, texts)
suites = st.builds(
    Suite,
    texts,
    st.lists(cases, max_size=3),
    st.dictionaries(texts, texts, max_size=3),
    st.none() | st.floats(0, 1e6),
)


@given(st.lists(suites, max_size=3))
def test_any_text_makes_a_valid_document(given_suites):
    root = check(junit_xml(given_suites))
    for suite, element in zip(given_suites, root, strict=True):
        assert len(element.findall("testcase")) == len(suite.cases)
        for case, test in zip(suite.cases, element.findall("testcase"), strict=True):
            found = test.find("failure" if case.problem == "failure" else case.problem or "none")
            assert (found is None) == (case.problem is None)


def test_texts_come_back_as_they_were():
    text = 'an angry <b>&"driver"</b>\n\tsaid ]]> 猫'
    case = Case("a.b", text, "failure", text, text)
    root = check(junit_xml([Suite(text, [case], {text: text})]))
    assert root[0].get("name") == text
    assert root.find(".//property").attrib == {"name": text, "value": text}
    assert root.find(".//failure").text == f"{text}\n{text}"


def test_what_xml_cannot_hold_is_replaced():
    root = check(junit_xml([Suite("a\x00b\x1b[31m\ud800", [])]))
    assert root[0].get("name") == "a\ufffdb\ufffd[31m\ufffd"


def test_another_file_is_never_overwritten(tmp_path):
    path = tmp_path / "new" / "folder" / "j.xml"
    write_junit(path, [Suite("one", [])])
    write_junit(path, [Suite("two", [])])
    assert check(path.read_bytes())[0].get("name") == "two"
    (tmp_path / "other.xml").write_text("<project/>")
    for wrong, message in (
        (tmp_path / "other.xml", "overwritten"),
        (tmp_path, tmp_path.name),
        (tmp_path / "other.xml" / "j.xml", "writable"),
    ):
        with refuses(StorageError, message):
            refuse_junit(wrong)
