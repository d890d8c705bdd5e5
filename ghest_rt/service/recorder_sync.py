"""Make the disk take what was written, again and again, on a thread of its own: the wait for it holds up nobody."""

import contextlib
import logging
import os
import threading

_log = logging.getLogger(__name__)


class DiskSync:
    """Syncs the file given last every `period_s`, and each file a last time when it is followed by another.

    Attributes:
        failure: What the disk said if it did not take the data; None so far.
    """

    def __init__(self, period_s: float) -> None:
        self.failure: OSError | None = None
        self._period_s = period_s
        self._changed = threading.Condition()
        self._fds: list[int] = []
        self._stop = False
        self._thread = threading.Thread(target=self._run, name="recorder-sync", daemon=True)

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def watch(self, fd: int) -> None:
        """Sync this file from now on; the descriptor is duplicated, the caller keeps its own."""
        with self._changed:
            self._fds.append(os.dup(fd))

    def stop(self, timeout_s: float) -> None:
        """Sync a last time and end; a disk that hangs is left behind."""
        with self._changed:
            self._stop = True
            self._changed.notify_all()
        self._thread.join(timeout_s)
        if self._thread.is_alive():
            _log.warning("the disk did not take the last data within %.0f s", timeout_s)

    def _run(self) -> None:
        while True:
            with self._changed:
                if not self._stop:
                    self._changed.wait(self._period_s)
                stop, fds = self._stop, self._fds
                done = fds if stop else fds[:-1]
                self._fds = [] if stop else fds[-1:]
            for fd in fds:
                self._sync(fd)
            for fd in done:
                with contextlib.suppress(OSError):
                    os.close(fd)
            if stop:
                return

    def _sync(self, fd: int) -> None:
        try:
            os.fdatasync(fd)
        except OSError as error:
            self.failure = self.failure or error
