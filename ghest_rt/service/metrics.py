"""The service's health as metrics for Prometheus, on an HTTP endpoint of its own thread.

The loop hands over a reference to its newest health message once a second and is done; whoever asks is served from that, one
request at a time and with a deadline, on a thread of ordinary priority. A flood of requests or a client that dawdles can
delay other requests, never a tick.
"""

import contextlib
import logging
import socket
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from http.server import BaseHTTPRequestHandler, HTTPServer
from types import TracebackType
from typing import Any, Self

from ghest_rt import __version__
from ghest_rt.config.metrics import Address
from ghest_rt.extras import need_extra
from ghest_rt.messages.published import Event, GhAngles, Health
from ghest_rt.messages.results import GhEstimate

_log = logging.getLogger(__name__)

_REQUEST_S = 2.0
_PATHS = ("/", "/metrics")


class MetricsEndpoint:
    """An output of the service that Prometheus can scrape; listens while entered.

    Args:
        station: The station's id, a label of `ghest_info`.
        address: Where to listen.
        now_ns: A monotonic clock, for the age of the newest health message.

    Attributes:
        url: Where it really listens, once entered.
    """

    def __init__(self, station: str, address: Address, now_ns: Callable[[], int] = time.monotonic_ns) -> None:
        self.url = ""
        self._station = station
        self._address = address
        self._now_ns = now_ns
        self._newest: tuple[Health, int] | None = None
        self._events: Counter[tuple[str, str, str]] = Counter()
        self._server: _Server | None = None

    def __enter__(self) -> Self:
        """Listen; if the port is taken, say so and do without.

        Raises:
            GhestError: The extra `metrics` is not installed.
        """
        need_extra("metrics", "the metrics endpoint")
        host, port = self._address
        try:
            self._server = _Server(self._address, self.text)
        except OSError as error:
            # The angles matter more than their metrics.
            _log.error("no metrics: metrics.listen: %s:%d: %s", host, port, error.strerror or error)
            return self
        shown = f"[{host}]" if ":" in host else host
        self.url = f"http://{shown}:{self._server.server_address[1]}/metrics"
        _log.info("metrics on %s", self.url)
        threading.Thread(target=self._server.serve_forever, name="metrics", daemon=True).start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        if self._server is not None:
            self._server.shutdown()
            self._server.server_close()

    def angles(self, message: GhAngles, estimate: GhEstimate) -> None:
        """Single samples are no metrics."""

    def health(self, message: Health) -> None:
        """Keep the newest state for the next one who asks."""
        self._newest = (message, self._now_ns())

    def event(self, message: Event) -> None:
        """Count it."""
        self._events[message.source, str(message.kind), message.severity] += 1

    def text(self) -> bytes:
        """Return all metrics in Prometheus's text format."""
        from prometheus_client import CollectorRegistry, generate_latest  # noqa: PLC0415  (optional: the extra `metrics`)

        registry = CollectorRegistry(auto_describe=False)
        registry.register(_Once(self._collect))
        return bytes(generate_latest(registry))

    def _collect(self) -> Iterator[Any]:
        from ghest_rt.service.metric_families import families  # noqa: PLC0415  (likewise)

        newest = self._newest
        health, age_s = (None, None) if newest is None else (newest[0], (self._now_ns() - newest[1]) * 1e-9)
        yield from families(self._station, __version__, health, age_s, dict(self._events))


class _Once:
    """What prometheus-client calls a collector."""

    def __init__(self, collect: Callable[[], Iterator[Any]]) -> None:
        self.collect = collect


class _Server(HTTPServer):
    """One request at a time, each cut off after `_REQUEST_S`; few may wait."""

    request_queue_size = 8
    allow_reuse_address = True

    def __init__(self, address: Address, text: Callable[[], bytes]) -> None:
        self.text = text
        self.address_family = socket.AF_INET6 if ":" in address.host else socket.AF_INET
        super().__init__((address.host, address.port), _Handler)

    def server_bind(self) -> None:
        """Bind without asking the name service who we are, as the base class does."""
        socket.socket.setsockopt(self.socket, socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self.socket.bind(self.server_address)
        self.server_address = self.socket.getsockname()
        self.server_name, self.server_port = str(self.server_address[0]), int(self.server_address[1])

    def process_request(self, request: Any, client_address: Any) -> None:
        """Serve, and hang up on a client that takes too long over it."""
        deadline = threading.Timer(_REQUEST_S, _hang_up, (request,))
        deadline.daemon = True
        deadline.start()
        try:
            super().process_request(request, client_address)
        finally:
            deadline.cancel()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """A client that went away is no news."""


class _Handler(BaseHTTPRequestHandler):
    server_version = "ghest-rt"
    sys_version = ""
    server: _Server

    def do_GET(self) -> None:
        """Answer."""
        if self.path.partition("?")[0] not in _PATHS:
            self.send_error(404)
            return
        body = self.server.text()
        self.send_response(200)
        self.send_header("Content-Type", "text/plain; version=0.0.4; charset=utf-8")
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: object) -> None:  # noqa: A002  (the base class's name)
        """Requests are not worth a line."""


def _hang_up(request: socket.socket) -> None:
    with contextlib.suppress(OSError):
        request.shutdown(socket.SHUT_RDWR)
