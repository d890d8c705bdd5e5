"""The OAK driver's host part on the real SDK: its pipeline, its Sync node, its message types, no device."""

import time
from collections.abc import Iterator
from dataclasses import replace
from datetime import timedelta
from typing import Any

import cv2
import numpy as np
import pytest

pytest.importorskip("depthai", reason="needs the extra oak", exc_type=ImportError)

from ghest_drivers.clock import MonotonicClock
from ghest_drivers.errors import BadDeviceData, DeviceLost, DeviceNotFound, DriverError, ReadTimeout
from ghest_drivers.hardware.cameras.stats import CameraStats
from ghest_drivers.hardware.oak.camera import OakCamera, connected_camera
from ghest_drivers.hardware.oak.frames import GroupConverter, intrinsics_of, nanoseconds
from ghest_drivers.hardware.oak.sdk import dai
from ghest_drivers.hardware.oak.sockets import choose_sockets
from ghest_drivers.samples import CameraInfo, Intrinsics
from tests.hardware_cameras.oak_rig import HEIGHT, MATRIX, PERIOD, SETTINGS, WIDTH, HostSource, color_of, depth_of, image

_LONG_S = 20.0


@pytest.fixture
def source() -> HostSource:
    return HostSource()


@pytest.fixture
def camera(source: HostSource) -> Iterator[OakCamera]:
    camera = OakCamera("r1", source, SETTINGS, MonotonicClock())
    yield camera
    camera.close()


def test_images_arrive_unchanged_with_calibration_and_times(camera: OakCamera, source: HostSource) -> None:
    camera.open()
    for k in (1, 2, 3):
        source.send(k, skew=timedelta(milliseconds=2))
    frames = [camera.read(_LONG_S) for _ in range(4)]
    assert [frame.seq for frame in frames] == [0, 1, 2, 3]
    for k, frame in enumerate(frames):
        np.testing.assert_array_equal(frame.color_rgb, color_of(k))
        np.testing.assert_array_equal(frame.depth_counts, depth_of(k))
        sent_ns = nanoseconds(source.started + k * PERIOD - timedelta(milliseconds=100))
        assert abs(frame.t_capture_ns - sent_ns) < 200_000  # the SDK's clock is the host's; read one after the other
        assert frame.t_device_ns == sent_ns - 5_000_000_000
        assert frame.t_depth_capture_ns - frame.t_capture_ns == (2_000_000 if k else 0)
        assert frame.t_capture_ns < frame.t_arrival_ns
    info = camera.info
    assert (info.name, info.model, info.serial, info.rate_hz) == ("r1", "OAK-D-SR", "1844", 60.0)
    assert info.depth_unit_m == 0.0001
    assert info.color == info.depth == Intrinsics(WIDTH, HEIGHT, 60.0, 61.0, 31.5, 23.5)
    np.testing.assert_array_equal(info.color_from_depth, np.eye(4))


class InterruptedClock(MonotonicClock):
    """Its reader is held up for 20 ms after each of the first few readings, as on a busy machine."""

    def __init__(self, interruptions: int) -> None:
        self._left = interruptions

    def now_ns(self) -> int:
        now_ns = super().now_ns()
        if self._left:
            self._left -= 1
            time.sleep(0.02)
        return now_ns


def test_an_interruption_while_clocks_are_compared_does_not_shift_the_frames(source: HostSource) -> None:
    camera = OakCamera("r1", source, SETTINGS, InterruptedClock(9))
    camera.open()
    frame = camera.read(_LONG_S)
    camera.close()
    sent_ns = nanoseconds(source.started - timedelta(milliseconds=100))
    assert abs(frame.t_capture_ns - sent_ns) < 1_000_000


def test_without_depth_every_colour_image_is_a_frame(source: HostSource) -> None:
    camera = OakCamera("r1", source, replace(SETTINGS, depth=False), MonotonicClock())
    camera.open()
    try:
        for k in (1, 2):
            source.send(k, streams="c")
        frames = [camera.read(_LONG_S) for _ in range(3)]
    finally:
        camera.close()
    for k, frame in enumerate(frames):
        np.testing.assert_array_equal(frame.color_rgb, color_of(k))
        assert frame.depth_counts is None
        assert frame.t_depth_capture_ns == frame.t_capture_ns
    assert camera.stats.delivered == 3


def test_only_images_of_the_same_instant_are_paired(camera: OakCamera, source: HostSource) -> None:
    camera.open()
    source.send(1, streams="c")  # its depth image is lost
    source.send(2)
    frames = [camera.read(_LONG_S) for _ in range(2)]
    assert [frame.seq for frame in frames] == [0, 2]
    np.testing.assert_array_equal(frames[1].depth_counts, depth_of(2))
    assert camera.stats.missing == 1


def test_silence_is_a_timeout(camera: OakCamera) -> None:
    camera.open()
    camera.read(_LONG_S)
    with pytest.raises(ReadTimeout):
        camera.read(0.01)


def test_a_pipeline_that_stops_is_a_lost_device(camera: OakCamera, source: HostSource) -> None:
    camera.open()
    camera.read(_LONG_S)
    source.pipeline.stop()
    with pytest.raises(DeviceLost):
        camera.read(_LONG_S)


def test_a_wrong_image_is_bad_data_and_the_next_is_read(camera: OakCamera, source: HostSource) -> None:
    camera.open()
    camera.read(_LONG_S)
    t = source.started - timedelta(milliseconds=50)
    source.color.send(image(np.zeros((HEIGHT, 32, 3), np.uint8), 501, t))
    source.depth.send(image(depth_of(1), 1, t))
    with pytest.raises(BadDeviceData, match="colour image 501 is RGB888i"):
        camera.read(_LONG_S)
    source.send(4)
    assert camera.read(_LONG_S).depth_counts is not None


def test_it_opens_again_and_lets_go_of_the_device_each_time(camera: OakCamera, source: HostSource) -> None:
    for times in (1, 2):
        camera.open()
        assert camera.read(_LONG_S).seq == 0
        camera.close()
        assert source.released == times


def _converter(offset_ns: int = 0) -> tuple[GroupConverter, CameraStats]:
    stats = CameraStats()
    size = Intrinsics(WIDTH, HEIGHT, 1, 1, 0, 0)
    return GroupConverter(CameraInfo("r1", "m", "s", size, size, 1e-4, np.eye(4), 60.0), offset_ns, stats), stats


def test_rows_padded_by_the_device_are_unpadded() -> None:
    padded = image(np.pad(color_of(3), ((0, 0), (0, 16), (0, 0))), 1, timedelta(seconds=10))
    padded.setWidth(WIDTH)
    padded.setStride(3 * (WIDTH + 16))
    depth = image(depth_of(1), 1, timedelta(seconds=10))
    padded.setTransformation(depth.getTransformation())
    converter, _ = _converter()
    frame = converter.convert(padded, depth, 10_100_000_000)
    assert frame is not None
    np.testing.assert_array_equal(frame.color_rgb, color_of(3))


def test_the_middle_of_the_exposure_is_stamped() -> None:
    class Exposed:
        """An image exposed for 6 ms; the SDK only lets devices say so."""

        def __init__(self, raw: Any) -> None:
            self._raw = raw

        def getTimestamp(self, offset: Any = None) -> timedelta:  # noqa: N802
            return timedelta(seconds=10) - (timedelta(milliseconds=3) if offset is not None else timedelta())

        def __getattr__(self, name: str) -> Any:
            return getattr(self._raw, name)

    converter, _ = _converter()
    raw: Any = Exposed(image(color_of(0), 1, timedelta(seconds=10)))
    frame = converter.convert(raw, image(depth_of(0), 1, timedelta(seconds=10)), 10_100_000_000)
    assert frame is not None
    assert frame.t_capture_ns == 10_000_000_000 - 3_000_000


@pytest.mark.parametrize("stamp_s", [0.0, 9.0, 10_000.0])
def test_a_host_stamp_that_cannot_be_gives_way_to_the_device_clock(stamp_s: float) -> None:
    converter, _ = _converter()
    for k in range(100):
        t_ns = 100_000_000_000 + k * 16_667_000
        color = image(color_of(0), k, timedelta(seconds=stamp_s))
        color.setTimestampDevice(timedelta(microseconds=7_000_000 + k * 16_667))
        late_ns = (k % 7) * 1_000_000
        frame = converter.convert(color, image(depth_of(0), k, timedelta(seconds=stamp_s)), t_ns + late_ns)
        assert frame is not None
        assert abs(frame.t_capture_ns - t_ns) <= 200_000


def test_repeated_images_are_counted_and_not_passed_on() -> None:
    converter, stats = _converter()
    pair = image(color_of(0), 1, timedelta(seconds=10)), image(depth_of(0), 1, timedelta(seconds=10))
    assert converter.convert(*pair, 10_100_000_000) is not None
    assert converter.convert(*pair, 10_110_000_000) is None
    assert stats.repeated == 1


@pytest.mark.parametrize(
    ("coefficients", "limit_px"),
    [
        ([0.1, -0.05, 0.001, -0.002, 0.01], 1e-3),
        ([0.9, 0.2, 0.0005, -0.0004, 0.02, 1.0, 0.25, 0.03], 0.25),  # rational, as a calibrated wide lens
    ],
)
def test_opencv_sees_the_lens_as_depthai_states_it(coefficients: list[float], limit_px: float) -> None:
    given = (coefficients + [0.0] * 14)[:14]
    intrinsics = intrinsics_of(image(color_of(0), 1, timedelta(), given))
    points = np.array([[x, y, 1.0] for x in np.linspace(-0.5, 0.5, 9) for y in np.linspace(-0.38, 0.38, 7)])
    theirs, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), np.array(MATRIX), np.array(given))
    ours, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), intrinsics.matrix, np.array(intrinsics.distortion))
    assert np.abs(ours - theirs).max() < limit_px


def test_an_image_without_calibration_is_refused() -> None:
    bare = image(color_of(0), 1, timedelta())
    bare.setTransformation(dai.ImgTransformation(WIDTH, HEIGHT))
    with pytest.raises(BadDeviceData, match="calibrat"):
        intrinsics_of(bare)


def _feature(socket: str, *types: str) -> Any:
    feature = dai.CameraFeatures()
    feature.socket = getattr(dai.CameraBoardSocket, socket)
    feature.supportedTypes = [getattr(dai.CameraSensorType, name) for name in types]
    return feature


@pytest.mark.parametrize(
    ("features", "color"),
    [
        ([_feature("CAM_A", "COLOR"), _feature("CAM_B", "MONO"), _feature("CAM_C", "MONO")], "CAM_A"),  # OAK-D
        ([_feature("CAM_B", "COLOR"), _feature("CAM_C", "COLOR")], "CAM_B"),  # OAK-D SR
    ],
)
def test_colour_comes_from_the_middle_or_else_from_the_left(features: list[Any], color: str) -> None:
    assert choose_sockets(features).color.name == color


@pytest.mark.parametrize("features", [[_feature("CAM_A", "COLOR")], [_feature("CAM_B", "MONO"), _feature("CAM_C", "MONO")], []])
def test_devices_without_colour_or_stereo_are_refused(features: list[Any]) -> None:
    with pytest.raises(DriverError, match="OAK"):
        choose_sockets(features)


def test_without_a_device_it_says_so_without_waiting_for_one() -> None:
    with pytest.raises(DeviceNotFound, match="no free OAK camera with id 1844; free ones: none"):
        connected_camera("r1", "1844", replace(SETTINGS), MonotonicClock()).open()
