"""What the tests of several algorithms share."""

import pytest

from bridgegen.testing.algorithms import Late


@pytest.fixture
def late():
    """A search that gets results late, as `Late` says."""
    return Late
