"""A call that blocks in a thread of its own, for tests of what ends it from outside."""

import threading
from collections.abc import Callable

from ghest_drivers.errors import DriverError


class BlockedCall:
    """A call in a thread of its own; keeps the driver's error that ends it.

    Args:
        call: What is expected to block.
    """

    def __init__(self, call: Callable[[], object]) -> None:
        self._call = call
        self._raised: DriverError | None = None
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        try:
            self._call()
        except DriverError as error:
            self._raised = error

    def blocks(self, for_s: float) -> bool:
        """Return whether it has not ended after so long."""
        self._thread.join(for_s)
        return self._thread.is_alive()

    def error(self, within_s: float) -> DriverError | None:
        """Return the error that has ended it; None if it returned."""
        self._thread.join(within_s)
        assert not self._thread.is_alive(), "still blocked"
        return self._raised
