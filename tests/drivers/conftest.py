"""Backends that the contract suites run over. A further backend is one more entry in `CAMERA_CASES` or `ENCODER_CASES`."""

from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import AbstractAsyncContextManager, AbstractContextManager, asynccontextmanager, contextmanager
from dataclasses import dataclass

import numpy as np
import pytest

from ghest_drivers.clock import MonotonicClock
from ghest_drivers.interfaces import EncoderLink, RgbdCamera
from ghest_drivers.replay import ReplayPlayer
from ghest_drivers.samples import CameraInfo, EncoderInfo, EncoderSample, Intrinsics, RgbdFrame
from ghest_drivers.sim import SimCamera, SimEncoders
from tests.hardware_cameras.contract_cases import installed, oak_camera, realsense_camera, supervised_camera
from tests.hardware_encoders.contract_cases import armeo_encoders, can_encoders, canopen_encoders, serial_encoders

SAMPLES = 8
_PERIOD_NS = 4_000_000
_MINUTE_NS = 60_000_000_000
_JOINTS = ("j0", "j1")
CAMERA_INFO = CameraInfo(
    "r0", "test", "1", Intrinsics(6, 4, 5, 5, 2.5, 1.5), Intrinsics(6, 4, 5, 5, 2.5, 1.5), 0.001, np.eye(4), 250.0
)
ENCODER_INFO = EncoderInfo("encoders", _JOINTS)


def make_frame(k: int, t_arrival_ns: int, info: CameraInfo = CAMERA_INFO) -> RgbdFrame:
    t_ns = t_arrival_ns - 1_000_000
    color = np.full((4, 6, 3), k % 256, np.uint8)
    return RgbdFrame(info, k, color, np.full((4, 6), k, np.uint16), 7 * k, t_arrival_ns, t_ns, t_ns - 1000)


def make_encoder_sample(k: int, t_arrival_ns: int) -> EncoderSample:
    return EncoderSample(k, np.array([0.1 * k, -0.2 * k]), 3 * k, t_arrival_ns, t_arrival_ns - 500_000)


def arrival_ns(k: int, silent: bool) -> int:
    """The first sample is early; in a silent stream the next is a minute away."""
    return 2_000_000 + k * (_MINUTE_NS if silent else _PERIOD_NS)


class TinyWorld:
    """A simulated world with next to nothing in it."""

    def __init__(self, silent: bool) -> None:
        self.silent = silent

    def camera_info(self, name: str) -> CameraInfo:
        return CAMERA_INFO

    def frame(self, name: str, k: int) -> RgbdFrame | None:
        return make_frame(k, arrival_ns(k, self.silent)) if k < SAMPLES else None

    def encoder_info(self) -> EncoderInfo:
        return ENCODER_INFO

    def encoder_sample(self, k: int) -> EncoderSample | None:
        return make_encoder_sample(k, arrival_ns(k, self.silent)) if k < SAMPLES else None


@dataclass(frozen=True)
class CameraCase:
    """How a backend takes part.

    Attributes:
        make: Given `silent`, a camera that is not open. Not silent: at least `SAMPLES` frames within a second or so of
            opening. Silent: at most one frame, then none for a minute.
        ends: Whether the stream that is not silent ends.
    """

    make: Callable[[bool], AbstractContextManager[RgbdCamera]]
    ends: bool


@dataclass(frozen=True)
class EncoderCase:
    """How a backend takes part: as `CameraCase`."""

    make: Callable[[bool], AbstractAsyncContextManager[EncoderLink]]
    ends: bool


def _player(silent: bool) -> ReplayPlayer:
    events: list[object] = []
    for k in range(SAMPLES):
        t_ns = 5 * _MINUTE_NS + arrival_ns(k, silent)
        events += [make_frame(k, t_ns), make_encoder_sample(k, t_ns)]
    return ReplayPlayer(events, {"r0": CAMERA_INFO}, ENCODER_INFO, MonotonicClock())


@contextmanager
def replay_camera(silent: bool) -> Iterator[RgbdCamera]:
    player = _player(silent)
    yield player.camera("r0")
    player.close()


@asynccontextmanager
async def replay_encoders(silent: bool) -> AsyncIterator[EncoderLink]:
    player = _player(silent)
    yield player.encoders()
    player.close()


@contextmanager
def sim_camera(silent: bool) -> Iterator[RgbdCamera]:
    clock = MonotonicClock()
    yield SimCamera(TinyWorld(silent), "r0", clock, clock.now_ns())


@asynccontextmanager
async def sim_encoders(silent: bool) -> AsyncIterator[EncoderLink]:
    clock = MonotonicClock()
    yield SimEncoders(TinyWorld(silent), clock, clock.now_ns())


CAMERA_CASES = {
    "replay": CameraCase(replay_camera, ends=True),
    "sim": CameraCase(sim_camera, ends=True),
    "supervised": CameraCase(supervised_camera, ends=True),
}
if installed("pyrealsense2"):
    CAMERA_CASES["realsense"] = CameraCase(realsense_camera, ends=False)
if installed("depthai"):
    CAMERA_CASES["oak"] = CameraCase(oak_camera, ends=False)
ENCODER_CASES = {
    "replay": EncoderCase(replay_encoders, ends=True),
    "sim": EncoderCase(sim_encoders, ends=True),
    "serial": EncoderCase(serial_encoders, ends=False),
    "can": EncoderCase(can_encoders, ends=False),
    "canopen": EncoderCase(canopen_encoders, ends=False),
    "armeo": EncoderCase(armeo_encoders, ends=True),
}


@pytest.fixture(params=CAMERA_CASES.values(), ids=CAMERA_CASES.keys())
def camera_case(request: pytest.FixtureRequest) -> CameraCase:
    case: CameraCase = request.param
    return case


@pytest.fixture(params=ENCODER_CASES.values(), ids=ENCODER_CASES.keys())
def encoder_case(request: pytest.FixtureRequest) -> EncoderCase:
    case: EncoderCase = request.param
    return case


@pytest.fixture
def camera(camera_case: CameraCase) -> Iterator[RgbdCamera]:
    """A camera with frames, not open."""
    with camera_case.make(False) as camera:
        yield camera
        camera.close()


@pytest.fixture(params=[name for name, case in CAMERA_CASES.items() if case.ends])
def ending_camera(request: pytest.FixtureRequest) -> Iterator[RgbdCamera]:
    """A camera whose frames end, not open."""
    with CAMERA_CASES[request.param].make(False) as camera:
        yield camera
        camera.close()


@pytest.fixture
def silent_camera(camera_case: CameraCase) -> Iterator[RgbdCamera]:
    """A camera that sends one frame at most, not open."""
    with camera_case.make(True) as camera:
        yield camera
        camera.close()


@pytest.fixture
async def encoders(encoder_case: EncoderCase) -> AsyncIterator[EncoderLink]:
    """A link with samples, not open."""
    async with encoder_case.make(False) as encoders:
        yield encoders
        await encoders.close()


@pytest.fixture(params=[name for name, case in ENCODER_CASES.items() if case.ends])
async def ending_encoders(request: pytest.FixtureRequest) -> AsyncIterator[EncoderLink]:
    """A link whose samples end, not open."""
    async with ENCODER_CASES[request.param].make(False) as encoders:
        yield encoders
        await encoders.close()


@pytest.fixture
async def silent_encoders(encoder_case: EncoderCase) -> AsyncIterator[EncoderLink]:
    """A link that sends one sample at most, not open."""
    async with encoder_case.make(True) as encoders:
        yield encoders
        await encoders.close()
