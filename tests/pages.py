"""What tests of pages share."""

from bridgegen.pages.templates import THEME


def without_theme(text: str) -> str:
    """Return a page without the script for light or dark, which stands in each."""
    assert text.count(f"<script>{THEME}</script>") == 1
    return text.replace(f"<script>{THEME}</script>", "")
