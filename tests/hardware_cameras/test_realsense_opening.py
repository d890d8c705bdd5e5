"""Opening a RealSense camera: the device chosen, its calibration, mode and options, or why it is refused."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("pyrealsense2", reason="needs the extra realsense", exc_type=ImportError)

from ghest_drivers.clock import MonotonicClock, VirtualClock
from ghest_drivers.errors import DeviceLost, DeviceNotFound, DriverError
from ghest_drivers.hardware.realsense.camera import RealsenseCamera
from ghest_drivers.hardware.realsense.sdk import rs
from ghest_drivers.hardware.realsense.settings import RealsenseSettings
from ghest_drivers.hardware.realsense.software import SoftwareRealsense
from ghest_drivers.hardware.realsense.source import ConnectedDevice
from tests.hardware_cameras.realsense_rig import COLOR_FROM_DEPTH, INFO, SETTINGS, Rig, opened


def test_it_states_the_calibration_of_the_device(rig: Rig) -> None:
    info = rig.camera.info
    assert (info.name, info.model, info.serial, info.rate_hz) == ("r0", "Intel RealSense SR300", "S1", 60.0)
    assert info.depth_unit_m == 0.000125
    np.testing.assert_allclose(info.color_from_depth, COLOR_FROM_DEPTH, atol=1e-7)
    np.testing.assert_allclose(info.color.matrix, INFO.color.matrix)
    np.testing.assert_allclose(info.color.distortion, INFO.color.distortion, rtol=1e-6)
    np.testing.assert_allclose(info.depth.matrix, INFO.depth.matrix)


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


def test_a_mode_the_camera_lacks_is_refused_with_those_it_has() -> None:
    rig = Rig(replace(SETTINGS, width_px=1280, height_px=720))
    with pytest.raises(DriverError, match=r"no mode color rgb8 1280x720 at 60 Hz; it has: 64x48 at 60 Hz"):
        rig.camera.open()
    with pytest.raises(DeviceLost):
        _ = rig.camera.info


def test_without_depth_settings_of_depth_are_refused() -> None:
    rig = Rig(replace(SETTINGS, depth=False, laser_power=3.0))
    with pytest.raises(DriverError, match="need depth"):
        rig.camera.open()


def test_options_are_set_in_the_devices_units() -> None:
    options = {"enable_auto_exposure": (0.0, 1.0, 1.0), "exposure": (1.0, 10000.0, 100.0), "gain": (0.0, 128.0, 64.0)}
    settings = replace(SETTINGS, exposure_us=8000, laser_power=12, color_options={"gain": 40.0})
    with opened(settings, color_options=options, depth_options={"laser_power": (0.0, 16.0, 16.0)}) as rig:
        assert rig.device.option("enable_auto_exposure")[0] == 0.0
        assert rig.device.option("exposure")[0] == 80.0  # a separate colour sensor counts 100 µs
        assert rig.device.option("gain")[0] == 40.0
        assert rig.device.option("laser_power")[1] == 12.0


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
