"""Samples of a station in order, every one once; what is missing is asked for, and told if it does not come."""

from dataclasses import dataclass

from ghest_rt.client.updates import Gap, GapCause, Restarted, Sample

Ordered = Sample | Gap | Restarted

_RUNS_REMEMBERED = 16


@dataclass(frozen=True, slots=True)
class FillRequest:
    """Samples to ask a station for.

    Attributes:
        station: Whom.
        run_id: Of which run.
        first_seq: From here.
        last_seq: To here.
    """

    station: str
    run_id: str
    first_seq: int
    last_seq: int


class Sequence:
    """Puts a station's samples in order.

    Newer samples wait while missing ones are asked for, no longer than `fill_within_ns`.
    """

    def __init__(self, station: str, fill_within_ns: int | None) -> None:
        """Begin without a run.

        Args:
            station: Whose samples.
            fill_within_ns: How long to wait for what is missing; None: do not ask.
        """
        self._station = station
        self._fill_within_ns = fill_within_ns
        self._run_id: str | None = None
        self._past_runs: list[str] = []
        self._next_seq = 0
        self._held: dict[int, Sample] = {}
        self._asked: FillRequest | None = None
        self._to_send: FillRequest | None = None
        self._deadline_ns = 0

    @property
    def deadline_ns(self) -> int | None:
        """When `expire` wants to be called; None if nothing is waited for."""
        return None if self._asked is None else self._deadline_ns

    def is_past(self, run_id: str) -> bool:
        """Whether a run has been followed by another one."""
        return run_id in self._past_runs

    def take_request(self) -> FillRequest | None:
        """Return what to ask for now, once."""
        request, self._to_send = self._to_send, None
        return request

    def accept(self, sample: Sample, t_ns: int) -> list[Ordered]:
        """Take in a sample that came by itself; return what is now in order."""
        message = sample.message
        out: list[Ordered] = []
        if message.run_id != self._run_id:
            if message.run_id in self._past_runs:
                return []
            if self._run_id is not None:
                out = self._conclude(max(self._held, default=self._next_seq - 1))
                out.append(Restarted(self._station, message.run_id, message.seq))
                self._past_runs = [*self._past_runs, self._run_id][-_RUNS_REMEMBERED:]
            self._run_id, self._next_seq, self._asked = message.run_id, message.seq, None
        self._hold(sample)
        return out + self._advance(t_ns)

    def answer(self, request: FillRequest, samples: list[Sample], t_ns: int) -> list[Ordered]:
        """Take in one page of what was asked for; an empty one says that there is no more.

        Args:
            request: The one this answers.
            samples: In rising order.
            t_ns: Now.
        """
        if request != self._asked:
            return []
        for sample in samples:
            self._hold(sample)
        newest = samples[-1].message.seq if samples else request.last_seq
        if request.first_seq <= newest < request.last_seq:
            self._ask(FillRequest(request.station, request.run_id, newest + 1, request.last_seq), t_ns)
            return []
        return self._conclude(request.last_seq) + self._advance(t_ns)

    def expire(self, t_ns: int) -> list[Ordered]:
        """Give up what was asked for too long ago."""
        if self._asked is None or t_ns < self._deadline_ns:
            return []
        return self._conclude(self._asked.last_seq) + self._advance(t_ns)

    def _hold(self, sample: Sample) -> None:
        if sample.message.seq >= self._next_seq and sample.message.run_id == self._run_id:
            self._held.setdefault(sample.message.seq, sample)

    def _advance(self, t_ns: int) -> list[Ordered]:
        out: list[Ordered] = []
        while True:
            while self._asked is None and (sample := self._held.pop(self._next_seq, None)) is not None:
                out.append(sample)
                self._next_seq += 1
            if self._asked is not None or not self._held or self._run_id is None:
                return out
            last_seq = min(self._held) - 1
            if self._fill_within_ns is None:
                out += self._conclude(last_seq)
            else:
                self._ask(FillRequest(self._station, self._run_id, self._next_seq, last_seq), t_ns)

    def _ask(self, request: FillRequest, t_ns: int) -> None:
        self._asked = self._to_send = request
        self._deadline_ns = t_ns + (self._fill_within_ns or 0)

    def _conclude(self, last_seq: int) -> list[Ordered]:
        """Hand out everything up to `last_seq`, with gaps for what did not come."""
        out: list[Ordered] = []
        self._asked = self._to_send = None
        run_id = self._run_id or ""
        for seq in sorted(seq for seq in self._held if seq <= last_seq):
            if seq > self._next_seq:
                out.append(Gap(self._station, run_id, self._next_seq, seq - 1, GapCause.UNFILLED))
            out.append(self._held.pop(seq))
            self._next_seq = seq + 1
        if last_seq >= self._next_seq:
            out.append(Gap(self._station, run_id, self._next_seq, last_seq, GapCause.UNFILLED))
            self._next_seq = last_seq + 1
        return out
