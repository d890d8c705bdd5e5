"""The newest samples as published, kept for subscribers that missed some."""

from dataclasses import dataclass

CAPACITY = 2000  # half a minute at 66.6 Hz
_PAGE_BYTES = 256_000


@dataclass(frozen=True, slots=True)
class _Kept:
    run_id: str
    seq: int
    payload: bytes


class RecentSamples:
    """A ring of payloads by sequence number.

    The loop's thread adds, threads of Zenoh's read: a slot is written and read in one piece, so no lock can hold up the tick.
    """

    def __init__(self, capacity: int = CAPACITY) -> None:
        self._slots: list[_Kept | None] = [None] * capacity
        self._newest: _Kept | None = None

    @property
    def newest(self) -> bytes | None:
        """The newest payload; None before the first."""
        kept = self._newest
        return None if kept is None else kept.payload

    def add(self, run_id: str, seq: int, payload: bytes) -> None:
        """Keep a payload, in the place of the oldest one."""
        kept = _Kept(run_id, seq, payload)
        self._slots[seq % len(self._slots)] = kept
        self._newest = kept

    def page(self, run_id: str, first_seq: int, last_seq: int) -> bytes:
        """Return a JSON document `{"run_id": …, "samples": […]}`: a run from `first_seq` to `last_seq`, as far as kept.

        One page holds about 250 kB; whoever wants more asks again from behind the last one.
        """
        newest = self._newest
        samples: list[bytes] = []
        if newest is not None and newest.run_id == run_id:
            size = 0
            for seq in range(max(first_seq, newest.seq - len(self._slots) + 1), min(last_seq, newest.seq) + 1):
                kept = self._slots[seq % len(self._slots)]
                if kept is None or kept.seq != seq or kept.run_id != run_id:
                    continue
                size += len(kept.payload)
                if samples and size > _PAGE_BYTES:
                    break
                samples.append(kept.payload)
        run = b"null" if newest is None else b'"' + newest.run_id.encode() + b'"'
        return b'{"run_id":' + run + b',"samples":[' + b",".join(samples) + b"]}"
