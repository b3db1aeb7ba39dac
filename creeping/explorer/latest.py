"""The latest request and nothing else: a queue of one place, so that work does not pile up behind a hand that drags."""

from threading import Condition
from typing import Generic, TypeVar

T = TypeVar("T")


class Latest(Generic[T]):
    """Hands the latest value put in to one reader; values it had no time for are dropped."""

    def __init__(self) -> None:
        self._changed = Condition()
        self._value: T | None = None
        self._number = 0
        self._taken = 0
        self._closed = False

    @property
    def number(self) -> int:
        """Values put in so far."""
        return self._number

    @property
    def closed(self) -> bool:
        """Whether `close` was called."""
        return self._closed

    def put(self, value: T) -> None:
        """Replace what is waiting."""
        with self._changed:
            self._value, self._number = value, self._number + 1
            self._changed.notify_all()

    def close(self) -> None:
        """Let the reader go."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()

    def take(self) -> tuple[T, int] | None:
        """Wait for a value not yet taken, and its number; None once closed."""
        with self._changed:
            self._changed.wait_for(lambda: self._closed or self._taken < self._number)
            if self._closed:
                return None
            self._taken = self._number
            assert self._value is not None
            return self._value, self._number
