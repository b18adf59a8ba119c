"""Everything that is looked at in a browser: reports, pictures, films.

All pages are Jinja templates that extend ``web/base.html``: `templates` renders them, `charts`
draws for those without scripts. A job's own page (``page.py`` prepares its data, ``page.html``
shows it) stands in its folder; those of fits, scenarios and the ontology are here. Of the report,
``data.py`` defines the data, ``sentences.py`` summarises the result in words, ``payload.py``
converts all of it into the JSON that the page reads, and ``page.py`` joins the scripts and styles
in ``web``. Imports `recordings` and below.
"""
