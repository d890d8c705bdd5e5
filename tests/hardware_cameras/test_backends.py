"""Hardware cameras from a station file's settings to frames."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import TypeAdapter, ValidationError

from ghest_drivers.clock import Clock, MonotonicClock
from ghest_drivers.errors import DeviceNotFound, EndOfStream
from ghest_drivers.factory import make_camera
from ghest_drivers.hardware import camera_backends
from ghest_drivers.hardware.cameras.frozen import FrozenWatch
from ghest_drivers.hardware.supervisor.camera import SupervisedCamera
from ghest_rt.config.camera_devices import HardwareCameraBackend
from tests.hardware_cameras.contract_cases import installed

_LONG_S = 20.0
_DEVICES: Any = TypeAdapter(HardwareCameraBackend)
needs_realsense = pytest.mark.skipif(not installed("pyrealsense2"), reason="needs the extra realsense")
needs_oak = pytest.mark.skipif(not installed("depthai"), reason="needs the extra oak")


def settings_of(**device: object) -> dict[str, object]:
    """What the service hands to the factory for a device table of the station file."""
    settings: dict[str, object] = _DEVICES.validate_python(device).model_dump(exclude={"backend"})
    return settings


class MadeCamera:
    """In place of a driver: keeps the settings it is made with."""

    def __init__(self, name: str, source: object, settings: Any, clock: Clock) -> None:
        self.settings = settings


@pytest.mark.parametrize(
    "device", [{"backend": "realsense", "serial": "1"}, {"backend": "oak", "mxid": "1"}], ids=lambda device: device["backend"]
)
def test_live_cameras_run_in_a_process_of_their_own_unless_told_otherwise(device: dict[str, object]) -> None:
    backend = str(device["backend"])
    watched: Any = make_camera(backend, "r0", MonotonicClock(), settings_of(**device))
    assert isinstance(watched, FrozenWatch)
    assert isinstance(watched.camera, SupervisedCamera)


@needs_realsense
def test_every_realsense_setting_reaches_the_driver(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ghest_drivers.hardware.realsense.camera.RealsenseCamera", MadeCamera)
    settings = settings_of(
        backend="realsense", serial="1", preset="Short Range", laser_power=3, latency_ms=4.5, align=True, record_bag="x.bag",
        color_options={"gain": 3.0}, depth_width_px=320, depth_height_px=240, supervised=False,
    )  # fmt: skip
    watched: Any = make_camera("realsense", "r0", MonotonicClock(), settings)
    made = watched.camera.settings
    assert (made.preset, made.laser_power, made.latency_ns, made.align) == ("Short Range", 3, 4_500_000, True)
    assert (made.color_options, made.depth_width_px, made.record_bag) == ({"gain": 3.0}, 320, Path("x.bag"))


@needs_oak
def test_every_oak_setting_reaches_the_driver(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ghest_drivers.hardware.oak.camera.OakCamera", MadeCamera)
    settings = settings_of(backend="oak", mxid="18", rate_hz=30, sensitivity_iso=200, exposure_us=4000, supervised=False)
    watched: Any = make_camera("oak", "r0", MonotonicClock(), settings)
    made = watched.camera.settings
    assert (made.rate_hz, made.sensitivity_iso, made.exposure_us, made.width_px) == (30, 200, 4000, 640)


@pytest.mark.parametrize(
    ("backend", "device"),
    [
        pytest.param("realsense", {"serial": "000"}, marks=needs_realsense),
        pytest.param("oak", {"mxid": "18443010"}, marks=needs_oak),
    ],
)
def test_an_absent_device_is_told_through_the_process_boundary(backend: str, device: dict[str, object]) -> None:
    camera = make_camera(backend, "r0", MonotonicClock(), settings_of(backend=backend, **device))
    with pytest.raises(DeviceNotFound, match=r"no .* (000|18443010)"):
        camera.open()


@needs_realsense
def test_a_recording_plays_through_the_supervisor_without_losing_a_frame(tmp_path: Path) -> None:
    from tests.hardware_cameras.realsense_rig import INFO, depth_of, record_bag

    path = record_bag(tmp_path / "recorded.bag", 10**9, 20)
    settings = settings_of(
        backend="realsense_bag",
        path=str(path),
        width_px=64,
        height_px=48,
        depth_width_px=32,
        depth_height_px=24,
        supervised=True,
    )
    camera = make_camera("realsense_bag", "r0", MonotonicClock(), settings)
    camera.open()
    assert camera.info.depth_unit_m == INFO.depth_unit_m
    seqs = []
    with pytest.raises(EndOfStream):
        while True:
            frame = camera.read(_LONG_S)
            np.testing.assert_array_equal(frame.depth_counts, depth_of(frame.seq))
            seqs.append(frame.seq)
    assert seqs == list(range(20))
    camera.close()


@pytest.mark.parametrize(
    "device",
    [
        {"backend": "realsense"},
        {"backend": "realsense", "serial": ""},
        {"backend": "realsense", "serial": "1", "rate_hz": 0},
        {"backend": "oak", "serial": "1"},
        {"backend": "oak", "mxid": "1", "watchdog_ms": 1},
    ],
)
def test_settings_that_cannot_be_are_refused(device: dict[str, object]) -> None:
    with pytest.raises(ValidationError):
        settings_of(**device)


def test_the_service_process_imports_no_vendor_library_for_supervised_cameras() -> None:
    code = (
        "import sys\n"
        "from ghest_drivers.clock import MonotonicClock\n"
        "from ghest_drivers.factory import make_camera\n"
        "make_camera('realsense', 'r0', MonotonicClock(), {'serial': '1'})\n"
        "make_camera('oak', 'r1', MonotonicClock(), {'mxid': '1'})\n"
        "sys.exit(any(name in sys.modules for name in ('pyrealsense2', 'depthai', 'cv2')))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_a_missing_library_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    for module in [name for name in sys.modules if name.startswith("ghest_drivers.hardware.realsense")]:
        monkeypatch.delitem(sys.modules, module)
    monkeypatch.setitem(sys.modules, "pyrealsense2", None)
    with pytest.raises(DeviceNotFound, match=r"pip install .*\[realsense\]"):
        camera_backends.realsense(name="r0", clock=MonotonicClock(), serial="1", supervised=False)
