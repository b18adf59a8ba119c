"""A search with two simulators: a cheap one, the screen, proposes what the other one evaluates."""

from bridgegen.search.screened.agreement import NOTE, Agreement
from bridgegen.search.screened.screened import Screened, ScreenedRate

__all__ = ["NOTE", "Agreement", "Screened", "ScreenedRate"]
