"""A run's results as one self-contained page that opens from disk with no network.

``data.py`` says what the page is made of (plain dataclasses, no store); ``sentences.py`` words the
result; ``convergence.py`` condenses the evaluations for the charts; ``payload.py`` turns all of it
into the JSON that the page reads; ``page.py`` puts the page together and writes it, from the
templates, styles and scripts in ``web``.
"""
