"""Workers that may die: others do again what they were doing; no row is lost or done twice.

A chunk whose worker ends is done again. One that ends two workers is halved, again and again,
until the row is alone that does it: that one is `Lost`, and all others have their results.

A machine that fails takes all its workers with it, those too that have nothing to do and that
nobody misses yet: so a chunk is blamed only if its worker was greeted, and answered, just before.
"""

from abc import ABC, abstractmethod
from collections import deque
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

from bridgegen.arrays import Float
from bridgegen.errors import WorkersError
from bridgegen.workers.bench import Unprepared
from bridgegen.workers.chunks import cut
from bridgegen.workers.recipe import Recipe
from bridgegen.workers.workers import Lost, Part, Portable

FALSE_STARTS = 3
"""So many workers in a row, or as many as there are, that end before they are ready are a reason to
give up."""

Hand = TypeVar("Hand")
"""A worker, however it is reached."""


@dataclass
class Chunk:
    """Rows that one worker works on at a time.

    Attributes:
        start: the first row.
        stop: the first that is not among them.
        ends: how many workers have ended that are known to have worked on these.
        doubted: whether one has ended to which these were given.
        suspect: whether it is what is left of a chunk that ended two.
    """

    start: int
    stop: int
    ends: int = 0
    doubted: bool = False
    suspect: bool = False

    @property
    def rows(self) -> int:
        """How many rows."""
        return self.stop - self.start

    def after_end(self, *, was_there: bool) -> list["Chunk"]:
        """Return what is to be done when a worker has ended with it; nothing if it is lost.

        Args:
            was_there: whether the worker is known to have been there when it was given these.
        """
        self.doubted = True
        self.ends += was_there
        if self.ends < (1 if self.suspect and self.rows > 1 else 2):
            return [self]
        if self.rows <= 1:
            return []
        middle = (self.start + self.stop) // 2
        halves = ((self.start, middle), (middle, self.stop))
        return [Chunk(a, b, doubted=True, suspect=True) for a, b in halves]


@dataclass(eq=False)
class Post(Generic[Hand]):
    """A worker, and what it is doing.

    Attributes:
        hand: it.
        ready: the keys of the recipes that it has made.
        making: that of the one that it is making.
        chunk: what it works on.
        begun: whether it is there, as far as is known.
        greeted: whether it has answered a greeting, and been given no chunk since.
    """

    hand: Hand
    ready: set[str] = field(default_factory=set)
    making: str | None = None
    chunk: Chunk | None = None
    begun: bool = False
    greeted: bool = False

    @property
    def is_idle(self) -> bool:
        """Whether it has nothing to do."""
        return self.begun and self.making is None and self.chunk is None


class Crew(ABC, Generic[Hand]):
    """`Workers` that are each in a process of their own, here or elsewhere."""

    def __init__(self) -> None:
        self._posts: dict[Hand, Post[Hand]] = {}
        self._false_starts = 0

    @property
    @abstractmethod
    def count(self) -> int:
        """See `Workers`."""

    @abstractmethod
    def _hire(self) -> Hand:
        """Begin another worker; it will say that it has begun."""

    @abstractmethod
    def _greet(self, hand: Hand) -> None:
        """Have a worker answer anything."""

    @abstractmethod
    def _prepare(self, hand: Hand, recipe: Recipe) -> None:
        """Have a worker make what a recipe says; it will answer, or say what it raised."""

    @abstractmethod
    def _work(self, hand: Hand, key: str, work: str, X: Float, given: tuple[Any, ...]) -> None:
        """Have a worker work on rows; it will answer, or say what it raised."""

    @abstractmethod
    def _hear(self) -> tuple[Hand, tuple[Any, ...]]:
        """Wait until a worker says something: see `bridgegen.workers.process`."""

    @abstractmethod
    def _dismiss(self, hand: Hand) -> str:
        """Let a worker go, dead or alive; return how it ended."""

    def map(self, portable: Portable, work: str, X: Float, *given: Any) -> list[Part]:
        """See `Workers`."""
        recipe, done = portable.recipe, dict[int, Part]()
        bounds = cut(len(X), self.count, portable.rows_at_once)
        waiting = deque(Chunk(start, stop) for start, stop in bounds)
        try:
            while waiting or any(post.chunk for post in self._posts.values()):
                self._share_out(waiting, recipe, work, X, given)
                hand, (kind, *rest) = self._hear()
                post = self._posts.get(hand)
                if post is None:  # it was let go
                    continue
                if kind == "begun" or (kind == "answer" and not post.begun):
                    post.begun = post.greeted = True
                elif kind == "died":
                    self._bury(post, waiting, done)
                elif kind == "raised" and isinstance(rest[0], Unprepared) and post.chunk:
                    post.ready.clear()
                    waiting.appendleft(post.chunk)
                    post.chunk, post.greeted = None, False
                elif kind == "raised":
                    raise rest[0]
                elif post.making is not None:
                    self._false_starts = 0
                    post.ready.add(post.making)
                    post.making = None
                elif post.chunk is not None:
                    done[post.chunk.start] = Part(post.chunk.rows, rest[0])
                    post.chunk, post.greeted = None, False
        except BaseException:
            self.close()  # nobody wants what they are doing
            raise
        return [done[start] for start in sorted(done)]

    def close(self) -> None:
        """See `Workers`."""
        posts, self._posts = self._posts, {}
        for hand in posts:
            self._dismiss(hand)

    def _missing(self, chunks: int) -> int:
        """Return how many workers to start for so many waiting chunks; none if it is negative."""
        free = sum(post.chunk is None for post in self._posts.values())
        return min(min(self.count, chunks) - free, self.count - len(self._posts))

    def _share_out(
        self, waiting: deque[Chunk], recipe: Recipe, work: str, X: Float, given: tuple[Any, ...]
    ) -> None:
        """Give everybody who is idle something to do, and begin who is missing."""
        for _ in range(self._missing(len(waiting))):
            hand = self._hire()
            self._posts[hand] = Post(hand)
        for post in [post for post in self._posts.values() if post.is_idle]:
            if not waiting:
                return
            if recipe.key not in post.ready:
                post.making = recipe.key
                self._prepare(post.hand, recipe)
            elif waiting[0].doubted and not post.greeted:
                post.begun = False
                self._greet(post.hand)
            else:
                post.chunk = chunk = waiting.popleft()
                self._work(post.hand, recipe.key, work, X[chunk.start : chunk.stop], given)

    def _bury(self, post: Post[Hand], waiting: deque[Chunk], done: dict[int, Part]) -> None:
        """Take account of a worker that has ended, and of what it was doing."""
        del self._posts[post.hand]
        reason, chunk = self._dismiss(post.hand), post.chunk
        if chunk is None:
            self._false_starts += not post.ready
            if self._false_starts >= max(FALSE_STARTS, self.count):
                raise WorkersError(
                    f"{self._false_starts} workers in a row ended before they were ready: {reason}"
                )
            return
        left = chunk.after_end(was_there=post.greeted)
        waiting.extendleft(reversed(left))
        if not left:
            done[chunk.start] = Part(chunk.rows, Lost(reason))
