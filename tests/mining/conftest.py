"""A page of recordings in a browser."""

import pytest


@pytest.fixture
def page_of(browser):
    """Return a function that opens a page at a width [px]."""
    pages = []

    def opened(path, width):
        page = browser.new_page(viewport={"width": width, "height": 900})
        pages.append(page)
        page.goto(path.as_uri())
        return page

    yield opened
    for page in pages:
        page.close()
