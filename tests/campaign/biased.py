"""Other simulators than the embedded one: biased copies of it."""

from bridgegen.base.errors import InputError
from bridgegen.simulation.choice import Kind


class Biased:
    """The embedded simulator, in which parameters have other values than they are said to have."""

    rows_at_once = runs_at_once = 4

    def __init__(self, embedded, change):
        self.embedded, self._change = embedded, change

    def __getattr__(self, name):
        return getattr(self.embedded, name)

    def run(self, roads, rows, values, **more):
        return self.embedded.run(roads, rows, self._change(dict(values)), **more)


def slower(values):
    """The ego starts slower, the other vehicle is faster and starts further away."""
    for name, by in (("ego_speed", -0.7), ("bv_speed", 0.3), ("bv_start", 2.0)):
        if name in values:
            values[name] = values[name] + by
    return values


def not_finite(values):
    raise InputError("no row can be simulated")


def biased_kind(name, change):
    """Return the embedded simulator with other values of parameters, as one that can be chosen."""
    return Kind(
        name,
        "Ours, biased.",
        lambda embedded, storyboard, settings, access: Biased(embedded, change),
        settings={"noise": "none"},
    )
