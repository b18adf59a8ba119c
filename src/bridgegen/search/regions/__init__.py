"""Critical regions of a search space: rules that are verified with fresh scenarios.

`find_regions` finds and verifies them; `words` puts them in sentences, `owl` in ontology classes.
"""

from bridgegen.search.regions.box import Box, Evidence
from bridgegen.search.regions.find import Found, Region, find_regions

__all__ = ["Box", "Evidence", "Found", "Region", "find_regions"]
