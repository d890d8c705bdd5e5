"""One thread pulls a recording's events ahead of time; each device hands its samples over when they are due."""

import threading
from collections.abc import Callable, Iterable, Mapping

from ghest_drivers.clock import Clock
from ghest_drivers.errors import DeviceNotFound
from ghest_drivers.replay.devices import ReplayCamera, ReplayEncoders
from ghest_drivers.replay.outlet import Feed, Outlet
from ghest_drivers.samples import CameraInfo, EncoderInfo, EncoderSample, RgbdFrame


class ReplayPlayer:
    """Plays events to one device each.

    Time: the first `read` of any device fixes the axis; a sample recorded as arriving at t is due at
    start + (t - first arrival) / speed, and all its host times are moved to that axis alike. As with real devices, what
    nobody reads in time is dropped, oldest first, and shows as a gap in `seq`.

    Args:
        events: Frames and encoder samples in the order of arrival; anything else goes to `on_other`.
        camera_infos: The cameras, by name; frames of others are passed over.
        encoder_info: The encoder link.
        clock: Sets the pace.
        speed: Recorded seconds per second of the clock.
        on_other: Called on the feeding thread with each event that belongs to no device, such as ground truth, somewhat
            ahead of its time.

    Raises:
        ValueError: `speed` is not a positive number.
    """

    def __init__(
        self,
        events: Iterable[object],
        camera_infos: Mapping[str, CameraInfo],
        encoder_info: EncoderInfo,
        clock: Clock,
        speed: float = 1.0,
        *,
        on_other: Callable[[object], None] | None = None,
    ) -> None:
        if not 0.0 < speed < float("inf"):
            raise ValueError(f"speed {speed} is not a positive number")
        self._events = events
        self._on_other = on_other
        self._feed = Feed(clock, speed)
        self._cameras = {
            name: ReplayCamera(Outlet(self._feed, f"camera {name}", self._start), info, clock)
            for name, info in camera_infos.items()
        }
        self._encoders = ReplayEncoders(Outlet(self._feed, "encoders", self._start), encoder_info, clock)
        self._thread: threading.Thread | None = None

    @property
    def offset_ns(self) -> int | None:
        """Clock time less recording time at the first sample, for all samples if speed is 1; None before the first read."""
        timeline = self._feed.timeline
        if timeline.start_ns is None or timeline.first_ns is None:
            return None
        return timeline.start_ns - timeline.first_ns

    def to_recording_ns(self, t_ns: int) -> int:
        """Return the recording time of a clock time.

        Raises:
            ValueError: Before the first read.
        """
        return self._feed.timeline.to_recording_ns(t_ns)

    def camera(self, name: str) -> ReplayCamera:
        """Return the camera of that name.

        Raises:
            DeviceNotFound: It is not in the recording.
        """
        if name not in self._cameras:
            raise DeviceNotFound(f"the recording has no camera {name}; it has {', '.join(sorted(self._cameras)) or 'none'}")
        return self._cameras[name]

    def encoders(self) -> ReplayEncoders:
        """Return the encoder link."""
        return self._encoders

    def close(self) -> None:
        """Stop feeding for good and wake all reads, which raise DeviceLost; harmless if done before."""
        self._feed.close()
        if self._thread is not None and self._thread is not threading.current_thread():
            self._thread.join()

    def _start(self) -> None:
        """Start the feeding thread with the first device opened."""
        with self._feed.changed:
            if self._feed.closed:
                raise DeviceNotFound("the replay is closed: play the recording anew")
            if self._thread is None:
                self._thread = threading.Thread(target=self._run, name="replay-feeder", daemon=True)
                self._thread.start()

    def _run(self) -> None:
        error: Exception | None = None
        events = iter(self._events)
        try:
            for event in events:
                if not self._take(event):
                    break
        except Exception as broken:  # whatever it is, the readers must learn of it
            error = broken
        finally:
            close = getattr(events, "close", None)
            if close is not None:
                close()
            self._feed.end(error)

    def _take(self, event: object) -> bool:
        """Pass one event on; False once the player is closed."""
        if isinstance(event, EncoderSample):
            return self._encoders.outlet.put(event)
        if not isinstance(event, RgbdFrame):
            if self._on_other is not None:
                self._on_other(event)
        elif event.info.name in self._cameras:
            return self._cameras[event.info.name].outlet.put(event)
        return not self._feed.closed
