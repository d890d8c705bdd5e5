"""Logging to standard error, and JSON on standard output."""

import json
import logging
import math
import numbers
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from ghest_rt.cli.journal import journal_handler
from ghest_rt.errors import GhestError


class _StderrHandler(logging.Handler):
    """Writes to whatever `sys.stderr` is at that moment, so that a live display can lift log lines above itself."""

    def emit(self, record: logging.LogRecord) -> None:
        try:
            sys.stderr.write(self.format(record) + "\n")
        except (OSError, ValueError):
            self.handleError(record)


def set_up_logging(verbose: bool) -> None:
    """Send the project's log to standard error, or to systemd's journal: warnings and milestones, or everything."""
    handler = journal_handler(os.environ) or _StderrHandler()
    if isinstance(handler, _StderrHandler):
        handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)-7s %(message)s", "%H:%M:%S"))
    root = logging.getLogger()
    root.handlers = [handler]
    root.setLevel(logging.WARNING)
    for name in ("ghest_rt", "ghest_drivers"):
        logging.getLogger(name).setLevel(logging.DEBUG if verbose else logging.INFO)


@contextmanager
def printing() -> Iterator[None]:
    """Print what is printed within, to the last byte.

    Raises:
        GhestError: Standard output takes no more, such as a file on a full disk. A reader that has gone is left to Typer.
    """
    try:
        yield
        sys.stdout.flush()
    except BrokenPipeError:
        raise
    except OSError as error:
        # What is buffered would be tried again at the end of the process, and its failure told once more.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        raise GhestError(f"standard output: cannot be written to: {error.strerror or error}") from error


def print_json(document: object) -> None:
    """Print one JSON document on standard output; what is not finite becomes null.

    Raises:
        GhestError: Standard output cannot be written to.
    """
    with printing():
        sys.stdout.write(json.dumps(_plain(document), indent=2, allow_nan=False) + "\n")


def _plain(value: object) -> object:
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    # NumPy's numbers, too, are registered there.
    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        return value
    if isinstance(value, numbers.Integral):
        return int(value)
    number = float(value)
    return number if math.isfinite(number) else None
