"""A run's results as one self-contained page that opens from disk with no network.

``data.py`` defines the page's data (plain dataclasses, no store); ``sentences.py`` summarises the
result in words; ``convergence.py`` condenses the evaluations for the charts; ``payload.py``
converts all of it into the JSON that the page reads; ``page.py`` assembles the page and writes it,
from the templates, styles and scripts in ``web``.
"""
