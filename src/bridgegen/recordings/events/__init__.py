"""Events in recorded traffic: a detector per kind, and the parameters of scenarios in them."""
