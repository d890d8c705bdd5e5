"""What is known of one station: its samples in order, its delay, and whether it is live. No threads, no Zenoh."""

import math

from ghest_rt.client.delay import DelayMeter
from ghest_rt.client.limits import Limits
from ghest_rt.client.liveness import Liveness
from ghest_rt.client.sequence import FillRequest, Sequence
from ghest_rt.client.updates import LinkChanged, Refused, Sample, Update
from ghest_rt.messages.published import GhAngles

_TWO_SERVICES = "do two services publish under this station's id? Give each its own (station.id)"


class StationTracker:
    """Every method takes the receiver's time and returns what to tell, in order.

    Attributes:
        newest: The newest sample that came by itself, whether or not older ones are still waited for.
    """

    def __init__(self, station: str, limits: Limits, fill: bool, t_ns: int) -> None:
        self.newest: Sample | None = None
        self._station = station
        self._delay = DelayMeter()
        self._run_id: str | None = None
        self._sequence = Sequence(station, round(limits.fill_within_s * 1e9) if fill else None)
        self._liveness = Liveness(station, limits, t_ns)

    @property
    def link(self) -> LinkChanged:
        """The present state."""
        return self._liveness.link

    @property
    def deadline_ns(self) -> int | None:
        """When `on_time` wants to be called at the latest."""
        deadlines = [t_ns for t_ns in (self._sequence.deadline_ns, self._liveness.deadline_ns) if t_ns is not None]
        return min(deadlines, default=None)

    def take_request(self) -> FillRequest | None:
        """Return what the station shall be asked for now, once."""
        return self._sequence.take_request()

    def on_message(self, endpoint: str, message: GhAngles, t_ns: int) -> list[Update]:
        """A sample came by itself at `t_ns`."""
        if self._sequence.is_past(message.run_id):
            return [
                Refused(self._station, f"samples of run {message.run_id} come after those of {self._run_id}: {_TWO_SERVICES}")
            ]
        if message.run_id != self._run_id or self._stepped_back(message):
            self._run_id, self._delay = message.run_id, DelayMeter()
        sample = Sample(self._station, message, t_ns, self._delay.measure(t_ns, message.t_publish_ns) * 1e-6)
        if self.newest is None or self.newest.message.run_id != message.run_id or self.newest.message.seq < message.seq:
            self.newest = sample
        ordered = self._sequence.accept(sample, t_ns)
        return [*_told(self._liveness.on_sample(endpoint, sample.delay_ms, t_ns)), *ordered]

    def _stepped_back(self, message: GhAngles) -> bool:
        """Whether the sender's clock did: a recording replayed with `--speed max` begins again."""
        last = None if self.newest is None else self.newest.message
        return last is not None and message.seq > last.seq and message.t_publish_ns < last.t_publish_ns

    def on_last(self, message: GhAngles, t_ns: int) -> list[Update]:
        """The last sample came because we asked for it on arrival: it may be of long ago."""
        return [*self._sequence.accept(self._recovered(message, t_ns), t_ns)]

    def on_filled(self, request: FillRequest, messages: list[GhAngles], t_ns: int) -> list[Update]:
        """A page of missing samples came; an empty one says that there is no more."""
        return [*self._sequence.answer(request, [self._recovered(message, t_ns) for message in messages], t_ns)]

    def _recovered(self, message: GhAngles, t_ns: int) -> Sample:
        known = message.run_id == self._run_id
        delay_ms = self._delay.delay_ms(t_ns, message.t_publish_ns) if known else math.inf
        return Sample(self._station, message, t_ns, delay_ms, recovered=True)

    def on_token(self, endpoint: str, alive: bool, t_ns: int) -> list[Update]:
        """The liveliness token appeared or was withdrawn."""
        return _told(self._liveness.on_token(endpoint, alive, t_ns))

    def on_connection(self, endpoint: str, connected: bool, t_ns: int) -> list[Update]:
        """The connection to an endpoint came or went."""
        return _told(self._liveness.on_connection(endpoint, connected, t_ns))

    def on_time(self, t_ns: int) -> list[Update]:
        """Time passed."""
        return [*self._sequence.expire(t_ns), *_told(self._liveness.on_time(t_ns))]


def _told(change: LinkChanged | None) -> list[Update]:
    return [] if change is None else [change]
