"""One SPARQL query in a process of its own, which may be ended: see `questions.ask_sparql`.

Reads a JSON object (``data``: N-Quads, ``query``, ``prefixes``, ``rows``, ``seconds``, ``bytes``)
and writes one: ``columns`` and ``rows`` (terms as in N-Triples), or ``error``.
"""

import json
import sys
from itertools import islice

import pyoxigraph as ox


def main() -> None:
    """Answer one query."""
    task = json.load(sys.stdin)
    answer: dict[str, object]
    try:
        import resource

        seconds, size = int(task["seconds"]) + 1, int(task["bytes"])
        resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))
        resource.setrlimit(resource.RLIMIT_AS, (size, size))
    except (ImportError, ValueError, OSError):
        pass  # where there is no such limit, the caller's clock alone ends the query
    store = ox.Store()
    store.load(task["data"].encode(), format=ox.RdfFormat.N_QUADS)
    try:
        found = store.query(task["query"], prefixes=task["prefixes"])
        if not isinstance(found, ox.QuerySolutions):
            answer = {"error": "the query must be a SELECT"}
        else:
            answer = {
                "columns": [name.value for name in found.variables],
                "rows": [
                    [None if term is None else str(term) for term in row]
                    for row in islice(found, task["rows"])
                ],
            }
    except (SyntaxError, ValueError, OSError) as error:
        answer = {"error": " ".join(str(error).split())}
    json.dump(answer, sys.stdout)


if __name__ == "__main__":
    main()
