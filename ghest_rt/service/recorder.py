"""Everything that the devices deliver into recordings, losslessly, while the service runs; off its event loop."""

import copy
import logging
import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from pydantic import BaseModel

from ghest_drivers.clock import Clock
from ghest_drivers.samples import CameraInfo, EncoderSample, RgbdFrame
from ghest_rt.errors import GhestError
from ghest_rt.recording import layout
from ghest_rt.recording.writer import RecordingWriter
from ghest_rt.service.recorder_parts import Parts
from ghest_rt.service.recorder_settings import RecorderCounts, RecorderSettings

_log = logging.getLogger(__name__)

_SMALL_BYTES = 1_000  # what is no image
# Left to encoder samples and messages when images have filled the queue: the disk recovers, and they are not the cause.
_RESERVE_BYTES = 2_000_000


@dataclass(frozen=True, slots=True)
class _Item:
    """Something to write: `write` is called on the recorder's thread."""

    topics: tuple[str, ...]
    size_bytes: int
    t_queued_ns: int
    write: Callable[[RecordingWriter], None]
    source: str = ""
    t_arrival_ns: int = 0


class Recorder:
    """Takes samples from any thread without waiting and writes them on its own.

    When the disk is slower than the data, what comes is dropped, newest first, and counted by topic; after a failure of the
    disk all that comes is. `counts` says how it stands.

    Args:
        parts: Where to write.
        settings: Sizes and times.
        clock: The clock of the samples.
    """

    def __init__(self, parts: Parts, settings: RecorderSettings, clock: Clock) -> None:
        self._parts = parts
        self._settings = settings
        self._clock = clock
        self._counts = RecorderCounts(parts=parts.files)
        self._lock = threading.Lock()  # of the counts
        self._queued = threading.Condition()
        self._queue: deque[_Item] = deque()
        self._queue_bytes = 0
        self._stop = False
        self._thread = threading.Thread(target=self._run, name="recorder", daemon=True)

    def start(self) -> None:
        """Begin to write."""
        self._thread.start()

    def counts(self) -> RecorderCounts:
        """Return how it stands, a copy; from any thread."""
        with self._lock:
            return copy.deepcopy(self._counts)

    def camera(self, info: CameraInfo) -> None:
        """Note a camera that has been opened; before its first frame."""
        t_ns = self._clock.now_ns()
        self._put(_Item((layout.camera_topic(info.name),), _SMALL_BYTES, t_ns, lambda _: self._parts.add_camera(info, t_ns)))

    def grid(self, t_0_ns: int) -> None:
        """Note the grid on which samples are published."""
        self._put(_Item((), _SMALL_BYTES, self._clock.now_ns(), lambda _: self._parts.set_grid(t_0_ns)))

    def frame(self, frame: RgbdFrame) -> None:
        """Record a frame. Its arrays must not change any more."""
        name, depth = frame.info.name, frame.depth_counts
        topics = (layout.color_topic(name),) if depth is None else (layout.color_topic(name), layout.depth_topic(name))
        size_bytes = frame.color_rgb.nbytes + (0 if depth is None else depth.nbytes)
        self._put(_Item(topics, size_bytes, self._clock.now_ns(), lambda w: w.write_frame(frame), name, frame.t_arrival_ns))

    def encoder(self, sample: EncoderSample, names: tuple[str, ...]) -> None:
        """Record an encoder sample of the joints `names`."""
        self._put(
            _Item(
                (layout.ENCODER_TOPIC,),
                _SMALL_BYTES,
                self._clock.now_ns(),
                lambda w: w.write_encoder(sample, names),
                "encoders",
                sample.t_arrival_ns,
            )
        )

    def published(self, topic: str, message: BaseModel, *, seq: int, t_publish_ns: int, t_ns: int) -> None:
        """Record a message as it was published."""
        self._put(
            _Item(
                (topic,),
                _SMALL_BYTES,
                self._clock.now_ns(),
                lambda w: w.write_published(topic, message, seq=seq, t_publish_ns=t_publish_ns, t_ns=t_ns),
            )
        )

    def close(self) -> RecorderCounts:
        """Write what has been taken, close the files and return what it came to. A disk that hangs is left behind."""
        with self._queued:
            self._stop = True
            self._queued.notify()
        self._thread.join(self._settings.drain_s)
        if self._thread.is_alive():
            self._fail(f"{self._parts.files[-1]}: the disk did not take the last data within {self._settings.drain_s:g} s")
        return self.counts()

    def _put(self, item: _Item) -> None:
        with self._queued:
            limit = self._settings.queue_bytes + (_RESERVE_BYTES if item.size_bytes <= _SMALL_BYTES else 0)
            fits = self._queue_bytes + item.size_bytes <= limit and not self._counts.failure and not self._stop
            if fits:
                self._queue.append(item)
                self._queue_bytes += item.size_bytes
                self._queued.notify()
        if not fits:
            self._drop(item)

    def _run(self) -> None:
        try:
            while self._write_queued():
                self._parts.flush_if_due()
        except Exception as error:  # must not take the service along, whatever it is
            if not isinstance(error, GhestError):
                _log.exception("recorder: unexpected error")
            self._fail(str(error))
            with self._queued:
                left, self._queue = self._queue, deque()
            for item in left:
                self._drop(item)
        try:
            self._parts.close()
        except (GhestError, OSError) as error:
            self._fail(str(error))
        with self._lock:
            self._counts.written_bytes = self._parts.written_bytes

    def _write_queued(self) -> bool:
        """Write what waits, or wait for it; False when all is written and no more will come."""
        with self._queued:
            if not self._queue and not self._stop:
                self._queued.wait(self._settings.flush_ns * 1e-9)
            item = self._queue.popleft() if self._queue else None
            if item is None:
                return not self._stop
        try:
            self._write(item)
        except Exception:
            self._drop(item)
            raise
        finally:
            with self._queued:
                self._queue_bytes -= item.size_bytes
        return True

    def _write(self, item: _Item) -> None:
        if item.source:
            self._parts.saw(item.source, item.t_arrival_ns)
        try:
            item.write(self._parts.writer)
        except ValueError as error:  # a frame that contradicts its camera: it is left out, the rest goes on
            _log.debug("recorder: %s", error)
            self._drop(item)
            return
        waited_ns = self._clock.now_ns() - item.t_queued_ns
        with self._lock:
            counts = self._counts
            for topic in item.topics:
                counts.written[topic] = counts.written.get(topic, 0) + 1
            counts.max_wait_ns = max(counts.max_wait_ns, waited_ns)
            counts.written_bytes = self._parts.written_bytes

    def _drop(self, item: _Item) -> None:
        with self._lock:
            for topic in item.topics:
                self._counts.dropped[topic] = self._counts.dropped.get(topic, 0) + 1

    def _fail(self, reason: str) -> None:
        with self._lock:
            self._counts.failure = self._counts.failure or reason
