"""SIGINT and SIGTERM as a request to end, from the first moment to the last."""

import contextlib
import signal
from collections.abc import Callable, Iterator
from types import FrameType, TracebackType
from typing import Self

_NUMBERS = (signal.SIGINT, signal.SIGTERM)


class StopSignals:
    """While entered, SIGINT and SIGTERM end nothing by themselves but are noted; a second SIGINT interrupts as usual.

    To be used on the main thread.
    """

    def __init__(self) -> None:
        self._received = False
        self._callback: Callable[[], object] | None = None
        self._before: list[signal._HANDLER] = []

    def is_set(self) -> bool:
        """Return whether a signal has asked for the end."""
        return self._received

    @contextlib.contextmanager
    def calling(self, callback: Callable[[], object]) -> Iterator[None]:
        """Call back when a signal comes, or at once if one has come already; on the main thread, between two bytecodes."""
        self._callback = callback
        if self._received:
            callback()
        try:
            yield
        finally:
            self._callback = None

    def __enter__(self) -> Self:
        self._before = [signal.signal(number, self._handle) for number in _NUMBERS]
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        for number, handler in zip(_NUMBERS, self._before, strict=True):
            signal.signal(number, handler)

    def _handle(self, number: int, frame: FrameType | None) -> None:
        self._received = True
        signal.signal(signal.SIGINT, signal.default_int_handler)
        if self._callback is not None:
            self._callback()
