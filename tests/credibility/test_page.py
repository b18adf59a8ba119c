"""The page in a browser: offline, complete, and readable on a desk, on a phone, and in the dark."""

import pytest
from tests.pages import without_theme

import bridgegen as bg
from bridgegen.jobs.credibility import export


@pytest.fixture(scope="module")
def dossier(made, tmp_path_factory):
    return bg.export_credibility([*made.values()], out=tmp_path_factory.mktemp("dossier") / "out")


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("width", "scheme"), [(1440, "light"), (1440, "dark"), (390, "light"), (390, "dark")]
)
def test_it_is_readable(dossier, browser, width, scheme):
    page = browser.new_page(viewport={"width": width, "height": 900}, color_scheme=scheme)
    complaints: list[str] = []
    requests: list[str] = []
    page.on("console", lambda m: complaints.append(m.text) if m.type == "error" else None)
    page.on("request", lambda request: requests.append(request.url))
    page.goto(dossier.page.as_uri())
    assert complaints == []
    assert requests == [dossier.page.as_uri()]
    assert page.evaluate("document.documentElement.scrollWidth") == width
    assert "INCOMPLETE" in page.locator(".banner").inner_text()
    assert page.locator(".items tbody tr").count() == len(dossier.dossier.items)
    shown = page.locator(".items tbody th").all_inner_texts()
    for item, text in zip(dossier.dossier.items, shown, strict=True):
        assert text.startswith(f"{item.id} {item.title}")
    page.close()


@pytest.mark.thorough
def test_it_has_no_script_but_the_theme_and_all_that_the_record_says(dossier):
    text = without_theme(dossier.page.read_text("utf-8"))
    assert "<script" not in text
    assert "<img" not in text
    for one in dossier.dossier.evidence:
        assert one.sha256 in text
    assert all(key in text for key in dossier.dossier.sources)


def test_bits_that_differ_come_first(made, tmp_path, monkeypatch):
    monkeypatch.setattr(export, "differences", lambda *, rows: ["hypot"])
    found = bg.export_credibility([made["clean"]], out=tmp_path / "out")
    assert found.shown()[0].startswith("This machine does not give the published bits.")
    bits = next(item for item in found.dossier.items if item.id == "5.1")
    assert [line.text for line in bits.details] == ["Differs: hypot."]
