"""The RealSense driver on the real SDK: software devices, and .bag files made by the SDK's own recorder."""

import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("pyrealsense2", reason="needs the extra realsense", exc_type=ImportError)

from ghest_drivers.clock import MonotonicClock, VirtualClock
from ghest_drivers.errors import BadDeviceData, DeviceLost, DeviceNotFound, DriverError, EndOfStream
from ghest_drivers.hardware.cameras.frame_queue import FrameQueue
from ghest_drivers.hardware.cameras.stats import CameraStats
from ghest_drivers.hardware.realsense.assembly import FrameAssembler
from ghest_drivers.hardware.realsense.camera import RealsenseCamera, bag_camera
from ghest_drivers.hardware.realsense.sdk import rs
from ghest_drivers.hardware.realsense.settings import RealsenseSettings
from ghest_drivers.hardware.realsense.software import SoftwareRealsense, write_bag
from ghest_drivers.hardware.realsense.source import BagFile, ConnectedDevice
from ghest_drivers.hardware.realsense.timestamps import TimeDomain
from ghest_drivers.samples import RgbdFrame
from tests.hardware_cameras.realsense_rig import COLOR_FROM_DEPTH, INFO, PERIOD_NS, SETTINGS, Rig, color_of, depth_of

_LONG_S = 20.0


@pytest.fixture
def rig() -> Iterator[Rig]:
    rig = Rig()
    rig.camera.open()
    yield rig
    rig.camera.close()


def test_it_states_the_calibration_of_the_device(rig: Rig) -> None:
    info = rig.camera.info
    assert (info.name, info.model, info.serial, info.rate_hz) == ("r0", "Intel RealSense SR300", "S1", 60.0)
    assert info.depth_unit_m == 0.000125
    np.testing.assert_allclose(info.color_from_depth, COLOR_FROM_DEPTH, atol=1e-7)
    np.testing.assert_allclose(info.color.matrix, INFO.color.matrix)
    np.testing.assert_allclose(info.color.distortion, INFO.color.distortion, rtol=1e-6)
    np.testing.assert_allclose(info.depth.matrix, INFO.depth.matrix)


def test_images_arrive_unchanged_and_paired(rig: Rig) -> None:
    for k in range(5):
        rig.clock.sleep_until_ns(6_000_000_000 + k * PERIOD_NS)
        rig.send(k, 1_000_000_000 + k * PERIOD_NS)
    frames = rig.read_all()
    assert [frame.seq for frame in frames] == [0, 1, 2, 3, 4]
    for k, frame in enumerate(frames):
        np.testing.assert_array_equal(frame.color_rgb, color_of(k))
        np.testing.assert_array_equal(frame.depth_counts, depth_of(k))
        assert frame.t_device_ns == 1_000_000_000 + k * PERIOD_NS
        assert frame.t_arrival_ns == 6_000_000_000 + k * PERIOD_NS


def test_without_depth_colour_images_leave_at_once() -> None:
    rig = Rig(replace(SETTINGS, depth=False))
    rig.camera.open()
    for k in range(3):
        rig.clock.sleep_until_ns(6_000_000_000 + k * PERIOD_NS)
        rig.send(k, 1_000_000_000 + k * PERIOD_NS, streams="c")
        (frame,) = rig.read_all()
        assert frame.depth_counts is None
        np.testing.assert_array_equal(frame.color_rgb, color_of(k))
        assert frame.t_arrival_ns == 6_000_000_000 + k * PERIOD_NS
    assert rig.camera.info.depth == rig.camera.info.color
    assert rig.camera.stats.without_depth == 0
    rig.camera.close()


def test_without_depth_settings_of_depth_are_refused() -> None:
    rig = Rig(replace(SETTINGS, depth=False, laser_power=3.0))
    with pytest.raises(DriverError, match="need depth"):
        rig.camera.open()


def test_frames_are_stamped_with_device_time_and_not_with_their_arrival(rig: Rig) -> None:
    rng = np.random.default_rng(1)
    host_minus_device_ns = 3_000_000_000
    for k in range(200):
        t_ns = 1_000_000_000 + k * PERIOD_NS
        rig.clock.sleep_until_ns(t_ns + host_minus_device_ns + int(rng.exponential(3e6)))
        rig.send(k, t_ns)
    errors = np.array([frame.t_capture_ns - frame.t_device_ns - host_minus_device_ns for frame in rig.read_all()[-50:]])
    assert abs(errors).max() < 1_000_000  # delays of 3 ms on average, up to 20 ms


def test_latency_and_half_the_exposure_are_taken_off() -> None:
    settings = replace(SETTINGS, latency_ns=10_000_000, exposure_us=4000)
    rig = Rig(settings)
    rig.camera.open()
    rig.send(0, 1_000_000_000)
    frame = rig.camera.read(0.0)
    assert frame.t_capture_ns == rig.clock.now_ns() - 10_000_000 - 2_000_000
    rig.camera.close()


def test_without_a_stated_latency_one_frame_period_is_assumed() -> None:
    rig = Rig(replace(SETTINGS, latency_ns=None))
    rig.camera.open()
    rig.send(0, 1_000_000_000)
    assert rig.camera.read(0.0).t_capture_ns == rig.clock.now_ns() - PERIOD_NS
    rig.camera.close()


def test_the_frames_own_metadata_says_where_mid_exposure_was(rig: Rig) -> None:
    rig.device.set_metadata("frame_timestamp", 500_000)
    rig.device.set_metadata("sensor_timestamp", 493_000)
    rig.send(0, 1_000_000_000)
    assert rig.camera.read(0.0).t_capture_ns == rig.clock.now_ns() - 7_000_000


def test_capture_times_run_on_over_the_wrap_of_the_counter(rig: Rig) -> None:
    wrap_ns = (1 << 32) * 1000
    frames = []
    for k in range(120):
        t_ns = wrap_ns - 60 * PERIOD_NS + k * PERIOD_NS
        rig.clock.sleep_until_ns(6_000_000_000 + k * PERIOD_NS)
        rig.send(k, t_ns % wrap_ns)
        frames += rig.read_all()
    assert len(frames) == 120
    steps = np.diff([frame.t_capture_ns for frame in frames])
    assert abs(steps - PERIOD_NS).max() < 100_000
    assert rig.camera.stats.clock_suspect == 0


def test_a_clock_that_steps_back_costs_a_few_frames_and_never_a_wrong_time(rig: Rig) -> None:
    for k in range(60):
        rig.clock.sleep_until_ns(6_000_000_000 + k * PERIOD_NS)
        rig.send(k, (9_000_000_000 if k < 40 else 2_000_000_000) + k * PERIOD_NS)
    frames = rig.read_all()
    assert len(frames) >= 54
    for frame in frames:
        assert abs(frame.t_capture_ns - frame.t_arrival_ns) < 1_000_000
    assert rig.camera.stats.clock_suspect > 0


def test_global_time_is_wall_clock_time(rig: Rig) -> None:
    age_ns = 12_000_000
    rig.send(0, rig.unix_ns + rig.clock.now_ns() - age_ns, domain=TimeDomain.GLOBAL)
    assert abs(rig.camera.read(0.0).t_capture_ns - (rig.clock.now_ns() - age_ns)) < 1000


def test_depth_that_is_late_is_waited_for_and_depth_that_never_comes_is_not(rig: Rig) -> None:
    t0_ns = 1_000_000_000
    rig.send(0, t0_ns, streams="c")
    assert rig.read_all() == []
    rig.send(0, t0_ns + 3_000_000, streams="d")
    assert rig.read_all()[0].depth_counts is not None
    for k in (1, 2, 3):
        rig.clock.sleep_until_ns(rig.clock.now_ns() + PERIOD_NS)
        rig.send(k, t0_ns + k * PERIOD_NS, streams="c")
    (frame,) = rig.read_all()
    assert frame.seq == 1
    assert frame.depth_counts is None
    assert frame.t_depth_capture_ns == frame.t_capture_ns
    assert rig.camera.stats.without_depth == 1


def test_a_gap_in_the_device_numbers_is_a_gap_in_seq(rig: Rig) -> None:
    for k in (0, 1, 4, 5):
        rig.clock.sleep_until_ns(6_000_000_000 + k * PERIOD_NS)
        rig.send(k, 1_000_000_000 + k * PERIOD_NS)
    assert [frame.seq for frame in rig.read_all()] == [0, 1, 4, 5]
    assert rig.camera.stats.missing == 2


class _WrongFrame:
    """An SDK frame whose pixels are not what its profile promised."""

    def __init__(self, pixels: Any) -> None:
        self._pixels = pixels

    def get_data(self) -> Any:
        return self._pixels

    def get_profile(self) -> Any:
        return self

    def stream_type(self) -> Any:
        return rs.stream.color

    def get_timestamp(self) -> float:
        return 1000.0

    def get_frame_timestamp_domain(self) -> Any:
        return rs.timestamp_domain.hardware_clock

    def supports_frame_metadata(self, key: Any) -> bool:
        return False

    def keep(self) -> None:
        """Nothing to keep."""

    def get_frame_number(self) -> int:
        return 1


@pytest.mark.parametrize("pixels", [np.zeros((24, 32, 3), np.uint8), np.zeros((48, 64), np.uint16)])
def test_an_image_of_the_wrong_size_or_type_is_bad_data(pixels: Any) -> None:
    stats = CameraStats()
    queue = FrameQueue(4, stats)
    assembler = FrameAssembler(INFO, ConnectedDevice("S1", 0, lambda: 0), SETTINGS, queue, stats)
    assembler.take(_WrongFrame(pixels), 10**9)
    assembler.finish()
    with pytest.raises(BadDeviceData, match=r"color frame 1 is .* not uint8 \(48, 64, 3\)"):
        queue.get(0.0)
    assert stats.bad == 1


def test_a_reader_that_is_late_gets_the_newest_frames() -> None:
    rig = Rig(replace(SETTINGS, queue_frames=4))
    rig.camera.open()
    for k in range(10):
        rig.clock.sleep_until_ns(6_000_000_000 + k * PERIOD_NS)
        rig.send(k, 1_000_000_000 + k * PERIOD_NS)
    assert [frame.seq for frame in rig.read_all()] == [6, 7, 8, 9]
    assert rig.camera.stats.overruns == 6
    rig.camera.close()


def test_the_camera_is_chosen_by_serial_number_and_the_error_names_the_others() -> None:
    context = rs.context()
    devices = [SoftwareRealsense(replace(INFO, serial=serial)) for serial in ("S1", "S2")]
    for device in devices:
        device.device.add_to(context)
    camera = RealsenseCamera("r1", ConnectedDevice("S2", 0, lambda: 0), SETTINGS, VirtualClock(), context=lambda: context)
    camera.open()
    assert camera.info.serial == "S2"
    camera.close()
    absent = RealsenseCamera("r1", ConnectedDevice("S9", 0, lambda: 0), SETTINGS, VirtualClock(), context=lambda: context)
    with pytest.raises(DeviceNotFound, match=r"S9; connected: .*S1, .*S2"):
        absent.open()


def test_without_any_camera_it_says_so_at_once() -> None:
    camera = RealsenseCamera("r0", ConnectedDevice("S1", 0, lambda: 0), SETTINGS, MonotonicClock())
    with pytest.raises(DeviceNotFound, match="connected: none"):
        camera.open()


def test_two_cameras_do_not_mix_their_frames() -> None:
    context = rs.context()
    devices = [SoftwareRealsense(replace(INFO, serial=serial)) for serial in ("S1", "S2")]
    cameras = []
    for device, serial in zip(devices, ("S1", "S2"), strict=True):
        device.device.add_to(context)
        source = ConnectedDevice(serial, 0, lambda: 0)
        cameras.append(RealsenseCamera(serial, source, SETTINGS, VirtualClock(10**9), context=lambda: context))
    for camera in cameras:
        camera.open()
    for k, device in enumerate(devices):
        device.send_depth(depth_of(k), 0, 10**9, TimeDomain.HARDWARE)
        device.send_color(color_of(k), 0, 10**9, TimeDomain.HARDWARE)
    for k, camera in enumerate(cameras):
        frame = camera.read(_LONG_S)
        assert frame.info.name == f"S{k + 1}"
        np.testing.assert_array_equal(frame.color_rgb, color_of(k))
        camera.close()


def test_a_mode_the_camera_lacks_is_refused_with_those_it_has() -> None:
    rig = Rig(replace(SETTINGS, width_px=1280, height_px=720))
    with pytest.raises(DriverError, match=r"no mode color rgb8 1280x720 at 60 Hz; it has: 64x48 at 60 Hz"):
        rig.camera.open()
    with pytest.raises(DeviceLost):
        _ = rig.camera.info


def test_stamps_do_not_come_from_the_wall_clock() -> None:
    options = {"global_time_enabled": (0.0, 1.0, 1.0)}
    rig = Rig(color_options=options, depth_options=options)
    rig.camera.open()
    assert rig.device.option("global_time_enabled") == (0.0, 0.0)
    rig.camera.close()


def test_options_are_set_in_the_devices_units() -> None:
    options = {"enable_auto_exposure": (0.0, 1.0, 1.0), "exposure": (1.0, 10000.0, 100.0), "gain": (0.0, 128.0, 64.0)}
    settings = replace(SETTINGS, exposure_us=8000, laser_power=12, color_options={"gain": 40.0})
    rig = Rig(settings, color_options=options, depth_options={"laser_power": (0.0, 16.0, 16.0)})
    rig.camera.open()
    assert rig.device.option("enable_auto_exposure")[0] == 0.0
    assert rig.device.option("exposure")[0] == 80.0  # a separate colour sensor counts 100 µs
    assert rig.device.option("gain")[0] == 40.0
    assert rig.device.option("laser_power")[1] == 12.0
    rig.camera.close()


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        (replace(SETTINGS, laser_power=99), "laser_power = 99 is outside 0 to 16"),
        (replace(SETTINGS, color_options={"sparkle": 1.0}), "no option 'sparkle'; it has: .*exposure"),
        (replace(SETTINGS, preset="Short Range"), "has no presets"),
    ],
)
def test_options_the_device_cannot_take_are_refused(settings: RealsenseSettings, words: str) -> None:
    rig = Rig(settings, color_options={"exposure": (1.0, 9.0, 1.0)}, depth_options={"laser_power": (0.0, 16.0, 16.0)})
    with pytest.raises(DriverError, match=words):
        rig.camera.open()


def test_unplugging_is_noticed_without_a_timeout(bag: Path) -> None:
    context = rs.context()
    played = context.load_device(str(bag))  # a device that can be taken out of a context
    source = ConnectedDevice("S1", 0, lambda: 0)
    camera = RealsenseCamera("r0", source, SETTINGS, MonotonicClock(), context=lambda: context)
    camera.open()
    camera.read(_LONG_S)
    del played
    raised: list[DriverError] = []

    def read() -> None:
        try:
            while True:
                camera.read(_LONG_S)
        except DriverError as error:
            raised.append(error)

    reader = threading.Thread(target=read)
    reader.start()
    context.unload_device(str(bag))
    reader.join(_LONG_S)
    assert [type(error) for error in raised] == [DeviceLost]
    assert "unplugged" in str(raised[0])
    camera.close()


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path: Path = tmp_path_factory.mktemp("bag") / "recorded.bag"
    t_ns = [7_000_000_000 + k * PERIOD_NS for k in range(30)]
    frames = [RgbdFrame(INFO, k, color_of(k), depth_of(k), t, t, t, t) for k, t in enumerate(t_ns)]
    assert write_bag(path, INFO, frames, MonotonicClock()) == 30
    return path


def _play(camera: RealsenseCamera, pause_s: float = 0.0) -> list[RgbdFrame]:
    camera.open()
    frames: list[RgbdFrame] = []
    with pytest.raises(EndOfStream):
        while True:
            frames.append(camera.read(_LONG_S))
            time.sleep(pause_s)
    camera.close()
    return frames


@pytest.mark.parametrize("real_time", [True, False])
def test_a_bag_gives_back_every_frame_and_the_calibration(bag: Path, real_time: bool) -> None:
    camera = bag_camera("r0", bag, SETTINGS, MonotonicClock(), real_time=real_time)
    camera.open()
    info = camera.info
    frames = _play(camera)
    assert [frame.seq for frame in frames] == list(range(30))
    for k, frame in enumerate(frames):
        np.testing.assert_array_equal(frame.color_rgb, color_of(k))
        np.testing.assert_array_equal(frame.depth_counts, depth_of(k))
    assert info.depth_unit_m == 0.000125
    np.testing.assert_allclose(info.color_from_depth, COLOR_FROM_DEPTH, atol=1e-7)
    np.testing.assert_allclose(info.color.distortion, INFO.color.distortion, rtol=1e-6)


def test_a_bag_read_as_fast_as_possible_waits_for_a_slow_reader_and_keeps_its_own_times(bag: Path) -> None:
    frames = _play(bag_camera("r0", bag, replace(SETTINGS, queue_frames=2), VirtualClock(), real_time=False), pause_s=0.01)
    times_ns = [frame.t_capture_ns for frame in frames]
    assert len(times_ns) == 30
    np.testing.assert_allclose(times_ns, [7_000_000_000 + k * PERIOD_NS for k in range(30)], atol=2000)


def test_what_the_driver_records_to_a_bag_can_be_played_back(tmp_path: Path) -> None:
    path = tmp_path / "live.bag"
    rig = Rig(replace(SETTINGS, record_bag=path))
    rig.camera.open()
    for k in range(5):
        rig.clock.sleep_until_ns(6_000_000_000 + k * PERIOD_NS)
        rig.send(k, 1_000_000_000 + k * PERIOD_NS)
        time.sleep(0.01)
    assert len(rig.read_all()) == 5
    rig.camera.close()
    frames = _play(bag_camera("r0", path, SETTINGS, MonotonicClock(), real_time=False))
    assert [int(frame.color_rgb[0, 0, 0]) for frame in frames] == [0, 1, 2, 3, 4]
    assert [int(frame.depth_counts[0, 0]) for frame in frames if frame.depth_counts is not None] == [
        1000,
        1001,
        1002,
        1003,
        1004,
    ]


@pytest.mark.parametrize("content", [None, b"", b"this is no bag"])
def test_a_bag_that_is_missing_or_foreign_is_refused(tmp_path: Path, content: bytes | None) -> None:
    path = tmp_path / "x.bag"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(DeviceNotFound, match=r"x\.bag"):
        RealsenseCamera("r0", BagFile(path), SETTINGS, VirtualClock()).open()
