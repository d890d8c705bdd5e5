"""Whether a station is live, stale or lost, by the receiver's own clock."""

from ghest_rt.client.limits import Limits
from ghest_rt.client.updates import LinkCause, LinkChanged, LinkState


class Liveness:
    """Follows one station over one or several endpoints; every method returns the change it made, if any."""

    def __init__(self, station: str, limits: Limits, t_ns: int) -> None:
        """Begin without a connection, at `t_ns`."""
        self._station = station
        self._stale_after_ns = round(limits.stale_after_s * 1e9)
        self._lost_after_ns = round(limits.lost_after_s * 1e9)
        self._max_delay_s = limits.max_delay_s
        self._connected: set[str] = set()
        self._alive: set[str] = set()
        self._gone_ns: int | None = None  # since when no endpoint has the token any more
        self._appeared_ns = t_ns  # when the connection or the token came
        self._sample_ns: int | None = None  # of the newest sample that came by itself
        self._delayed = False
        self.link = LinkChanged(station, LinkState.LOST, LinkCause.NO_CONNECTION, t_ns)

    @property
    def deadline_ns(self) -> int | None:
        """When silence alone will change the state; None if it will not."""
        if self._waits_for_first:
            return self._appeared_ns + self._stale_after_ns
        if self.link.state is LinkState.LOST:
            return None
        silent = self.link.cause is LinkCause.SILENT
        return self._heard_ns + (self._lost_after_ns if silent else self._stale_after_ns)

    def on_sample(self, endpoint: str, delay_ms: float, t_ns: int) -> LinkChanged | None:
        """A sample came by itself."""
        self._connected.add(endpoint)
        self._sample_ns = t_ns
        self._delayed = delay_ms * 1e-3 > self._max_delay_s
        return self.on_time(t_ns)

    def on_token(self, endpoint: str, alive: bool, t_ns: int) -> LinkChanged | None:
        """The station's liveliness token appeared or was withdrawn."""
        if alive:
            self._connected.add(endpoint)
            self._alive.add(endpoint)
            self._gone_ns, self._appeared_ns = None, t_ns
        elif endpoint in self._alive:
            self._alive.remove(endpoint)
            self._gone_ns = None if self._alive else t_ns
        return self.on_time(t_ns)

    def on_connection(self, endpoint: str, connected: bool, t_ns: int) -> LinkChanged | None:
        """The connection to an endpoint came or went."""
        if connected:
            self._connected.add(endpoint)
            self._appeared_ns = t_ns
        else:
            self._connected.discard(endpoint)
        return self.on_time(t_ns)

    def on_time(self, t_ns: int) -> LinkChanged | None:
        """Time passed."""
        state, cause = self._judge(t_ns)
        if (state, cause) == (self.link.state, self.link.cause):
            return None
        self.link = LinkChanged(self._station, state, cause, t_ns)
        return self.link

    @property
    def _heard_ns(self) -> int:
        """Of the newest sign of life."""
        return self._appeared_ns if self._sample_ns is None else max(self._appeared_ns, self._sample_ns)

    @property
    def _waits_for_first(self) -> bool:
        """Whether connection or token have only just come, so that silence says nothing yet."""
        lost = self.link.cause in (LinkCause.NO_CONNECTION, LinkCause.SERVICE_GONE)
        return lost and bool(self._connected) and self._gone_ns is None

    def _judge(self, t_ns: int) -> tuple[LinkState, LinkCause]:
        if not self._connected:
            return LinkState.LOST, LinkCause.NO_CONNECTION
        if self._gone_ns is not None and (self._sample_ns is None or self._sample_ns <= self._gone_ns):
            return LinkState.LOST, LinkCause.SERVICE_GONE
        if self._sample_ns is not None and t_ns - self._sample_ns < self._stale_after_ns:
            return (LinkState.STALE, LinkCause.DELAYED) if self._delayed else (LinkState.LIVE, LinkCause.NONE)
        if self._waits_for_first and t_ns - self._heard_ns < self._stale_after_ns:
            return self.link.state, self.link.cause
        if t_ns - self._heard_ns < self._lost_after_ns:
            return LinkState.STALE, LinkCause.SILENT
        return LinkState.LOST, LinkCause.SILENT
