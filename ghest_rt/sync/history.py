"""A bounded, time-ordered history of anything."""

from bisect import bisect_left, bisect_right
from typing import Generic, TypeVar

Item = TypeVar("Item")


class History(Generic[Item]):
    """The newest items in the order of their times; holds between `capacity` and twice that many."""

    def __init__(self, capacity: int) -> None:
        self._capacity = capacity
        self._times_ns: list[int] = []
        self._items: list[Item] = []

    def __len__(self) -> int:
        return len(self._times_ns)

    @property
    def newest_ns(self) -> int | None:
        """Time of the newest item; None if there is none."""
        return self._times_ns[-1] if self._times_ns else None

    def insert(self, t_ns: int, item: Item) -> bool:
        """Insert in the order of time; return False, and leave all as it was, if that very time is taken."""
        if not self._times_ns or t_ns > self._times_ns[-1]:
            self._times_ns.append(t_ns)
            self._items.append(item)
            if len(self._times_ns) >= 2 * self._capacity:
                del self._times_ns[: self._capacity]
                del self._items[: self._capacity]
            return True
        index = bisect_left(self._times_ns, t_ns)
        if self._times_ns[index] == t_ns:
            return False
        self._times_ns.insert(index, t_ns)
        self._items.insert(index, item)
        return True

    def before(self, t_ns: int) -> tuple[int, Item] | None:
        """Return the newest item not later than `t_ns` with its time, or None."""
        index = bisect_right(self._times_ns, t_ns) - 1
        return None if index < 0 else (self._times_ns[index], self._items[index])

    def after(self, t_ns: int) -> tuple[int, Item] | None:
        """Return the oldest item not earlier than `t_ns` with its time, or None."""
        index = bisect_left(self._times_ns, t_ns)
        return None if index == len(self._times_ns) else (self._times_ns[index], self._items[index])
