"""Devices, pipeline and outputs that a test scripts."""

import asyncio
import queue
import threading
from collections.abc import Callable

import numpy as np

from ghest_drivers.errors import DeviceLost, EndOfStream, ReadTimeout
from ghest_drivers.samples import CameraInfo, EncoderInfo, EncoderSample, Intrinsics, RgbdFrame
from ghest_rt.messages.published import Event, EventKind, GhAngles, Health
from ghest_rt.messages.results import GhEstimate, MarkerObservation, MarkerStatus, Reason, Status

PINHOLE = Intrinsics(4, 4, 4.0, 4.0, 1.5, 1.5)
END = "end"


def camera_info(name: str, fx_px: float = 4.0) -> CameraInfo:
    color = Intrinsics(4, 4, fx_px, 4.0, 1.5, 1.5)
    return CameraInfo(name, "fake", "0", color, PINHOLE, 1e-4, np.eye(4), 66.6)


def frame(name: str, seq: int, t_ns: int) -> RgbdFrame:
    return RgbdFrame(camera_info(name), seq, np.zeros((4, 4, 3), np.uint8), None, t_ns, t_ns, t_ns, t_ns)


def encoder_sample(seq: int, t_ns: int) -> EncoderSample:
    return EncoderSample(seq, np.zeros(1), t_ns, t_ns, t_ns)


class FakeCamera:
    """Delivers what is put on its queue: frames, exceptions to raise, or `END`; `fail_open` makes opening fail that often."""

    def __init__(self, name: str, fail_open: int = 0, fx_px: tuple[float, ...] = (4.0,)) -> None:
        self.name = name
        self.script: queue.Queue[RgbdFrame | Exception | str] = queue.Queue()
        self.opened = 0
        self.closed = 0
        self._fail_open = fail_open
        self._fx_px = fx_px
        self._is_open = threading.Event()
        self._ended = False

    @property
    def info(self) -> CameraInfo:
        return camera_info(self.name, self._fx_px[min(self.opened, len(self._fx_px)) - 1])

    def open(self) -> None:
        if self._fail_open:
            self._fail_open -= 1
            raise DeviceLost("not there")
        self.opened += 1
        self._is_open.set()

    def read(self, timeout_s: float) -> RgbdFrame:
        if self._ended:
            raise EndOfStream
        try:
            item = self.script.get(timeout=max(timeout_s, 1e-4))
        except queue.Empty:
            if not self._is_open.is_set():
                raise DeviceLost("closed") from None
            raise ReadTimeout from None
        if isinstance(item, Exception):
            raise item
        if isinstance(item, str):
            self._ended = True
            raise EndOfStream
        return item

    def close(self) -> None:
        self.closed += 1
        self._is_open.clear()


class FakeEncoders:
    """The same for the encoder link."""

    def __init__(self) -> None:
        self.script: asyncio.Queue[EncoderSample | Exception | str] = asyncio.Queue()
        self.opened = 0
        self.closed = 0
        self._ended = False

    @property
    def info(self) -> EncoderInfo:
        return EncoderInfo("encoders", ("j0",))

    async def open(self) -> None:
        self.opened += 1

    async def read(self, timeout_s: float) -> EncoderSample:
        if self._ended:
            raise EndOfStream
        try:
            item = await asyncio.wait_for(self.script.get(), timeout_s)
        except TimeoutError:
            raise ReadTimeout from None
        if isinstance(item, Exception):
            raise item
        if isinstance(item, str):
            self._ended = True
            raise EndOfStream
        return item

    async def close(self) -> None:
        self.closed += 1


class FakePipeline:
    """Valid once both cameras and the encoders have delivered; remembers what it was given and asked for."""

    def __init__(self, observe_hook: Callable[[RgbdFrame], None] = lambda frame: None) -> None:
        self.asked_ns: list[int] = []
        self.observed: list[tuple[str, int]] = []
        self.newest_ns: dict[str, int] = {}
        self._hook = observe_hook

    def observe(self, frame: RgbdFrame) -> MarkerObservation:
        self._hook(frame)
        name = frame.info.name
        return MarkerObservation(
            name, name.replace("r", "m"), frame.seq, frame.t_capture_ns, frame.t_arrival_ns, MarkerStatus.OK
        )

    def add(self, item: MarkerObservation | EncoderSample) -> None:
        if isinstance(item, EncoderSample):
            self.newest_ns["encoders"] = item.t_capture_ns
        else:
            self.observed.append((item.camera, item.seq))
            self.newest_ns[item.camera] = item.t_capture_ns

    def counts(self) -> dict[str, int]:
        return {"encoders_repeated": 2}

    def estimate(self, t_ns: int) -> GhEstimate:
        self.asked_ns.append(t_ns)
        newest = dict(self.newest_ns)
        if len(newest) < 3:
            return GhEstimate(t_ns, Status.LOST, Reason.STARTING, None, None, None, None, None, newest)
        return GhEstimate(t_ns, Status.VALID, Reason.NONE, np.eye(3), np.eye(4), np.eye(4), np.eye(4), 1e-6 * np.eye(3), newest)


class Collector:
    """An output that keeps everything, and tells when something awaited has come."""

    def __init__(self) -> None:
        self.samples: list[GhAngles] = []
        self.healths: list[Health] = []
        self.events: list[Event] = []
        self._changed = asyncio.Event()

    def angles(self, message: GhAngles, estimate: GhEstimate) -> None:
        self.samples.append(message)
        self._changed.set()

    def health(self, message: Health) -> None:
        self.healths.append(message)
        self._changed.set()

    def event(self, message: Event) -> None:
        self.events.append(message)
        self._changed.set()

    def kinds(self, source: str) -> list[EventKind]:
        return [event.kind for event in self.events if event.source == source]

    async def until(self, condition: Callable[[], bool]) -> None:
        async with asyncio.timeout(10.0):
            while not condition():
                self._changed.clear()
                await self._changed.wait()
