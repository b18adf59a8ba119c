"""Everything that is looked at in a browser: reports, pictures, films.

``data.py`` defines the report's data; ``sentences.py`` summarises the result in words;
``payload.py`` converts all of it into the JSON that the page reads; ``page.py`` assembles the page
from the templates, styles and scripts in ``web``. A job's own page stands in its folder. Imports
`recordings` and below.
"""
