"""Digests of 10,000 rows of each scenario and driver: the published ones, or another machine's.

python -m benchmarks.bits            # compare with those published; 10 to 15 minutes
python -m benchmarks.bits --write    # after a change of results that CHANGELOG names
python -m benchmarks.bits --new      # add those of scenarios that have none, and of verdicts
python -m benchmarks.bits --verdicts # the same, of digests with verdicts alone: a minute
python -m benchmarks.bits --pages    # of runs' rows, as their reports simulate them; 10 minutes
"""

import argparse
import json
from pathlib import Path

from benchmarks import bits_pages

from bridgegen.base.errors import InputError
from bridgegen.engine import conformance
from bridgegen.scenario.language.reader import names


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help="publish this machine's digests")
    parser.add_argument("--new", action="store_true", help="publish those of new scenarios")
    parser.add_argument("--verdicts", action="store_true", help="publish those with verdicts alone")
    parser.add_argument("--pages", nargs="*", help="compare what reports simulate, of some")
    options = parser.parse_args()
    if options.pages is not None:
        bits_pages.main(options.pages)
        return
    path = Path(conformance.__file__).with_name("conformance.json")
    if options.verdicts:
        published = conformance.published() | {"verdicts": conformance.verdict_digests()}
        path.write_text(json.dumps(published, indent=1) + "\n", encoding="utf-8")
        return
    write = options.write or options.new
    known = {} if options.write else conformance.published()["rows"]
    found = {}
    for scenario in names():
        for driver in conformance.DRIVERS:
            key = f"{scenario} {driver}"
            if options.new and key in known:
                found[key] = known[key]
                continue
            try:
                found[key] = conformance.rows_digest(scenario, driver)
            except InputError as error:
                print(f"{key}: {error}", flush=True)
                continue
            same = "" if write else "same" if found[key] == known.get(key) else "DIFFERS"
            print(f"{key}: {found[key]} {same}", flush=True)
    if write:
        functions, verdicts = conformance.function_digests(), conformance.verdict_digests()
        all_of_them = {"functions": functions, "rows": found, "verdicts": verdicts}
        text = json.dumps(all_of_them, indent=1)
        path.write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
