"""What cameras say of themselves, across the process boundary too."""

from pathlib import Path

import pytest

from ghest_drivers.clock import MonotonicClock
from ghest_drivers.errors import DriverError
from ghest_drivers.hardware.cameras.frozen import FrozenWatch
from ghest_drivers.hardware.supervisor.camera import SupervisedCamera
from ghest_drivers.hardware.supervisor.link import Limits
from ghest_drivers.hardware.supervisor.protocol import BackendSpec

_LIMITS = Limits(open_s=30.0, first_frame_s=10.0, silence_s=5.0, close_s=0.5)


def test_a_supervised_camera_passes_on_what_its_process_says_and_adds_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(Path(__file__).parent / "fakes"))
    spec = BackendSpec("ghest_fake_cameras", "VitalCamera", {"then": "segfault", "frames": 200})
    camera = SupervisedCamera("r0", spec, MonotonicClock(), _LIMITS)
    assert camera.vitals().temperature_c is None
    camera.open()
    try:
        for _ in range(20):
            camera.read(10.0)
        vitals = camera.vitals()
        assert vitals.temperature_c == 41.0
        assert vitals.refused["bad"] == 3
        assert vitals.refused["processes_lost"] == 0
        with pytest.raises(DriverError):
            while True:
                camera.read(10.0)
        camera.close()
        camera.open()
        camera.read(10.0)
        while camera.vitals().temperature_c is None:
            camera.read(10.0)
        assert camera.vitals().refused["bad"] == 6  # of both processes
        assert camera.vitals().refused["processes_lost"] == 1
    finally:
        camera.close()
    assert FrozenWatch(camera).vitals().refused["frozen"] == 0


def test_a_realsense_tells_its_temperature_where_it_has_one() -> None:
    pytest.importorskip("pyrealsense2", reason="needs the extra realsense", exc_type=ImportError)
    from tests.hardware_cameras.realsense_rig import PERIOD_NS, opened

    for options, expected in (({"depth_options": {"asic_temperature": (0.0, 100.0, 41.0)}}, 41.0), ({}, None)):
        with opened(**options) as rig:
            for k in range(3):
                rig.send_in_time(k)
            rig.send(2, 1_000_000_000 + 2 * PERIOD_NS)  # once more: refused
            rig.read_all()
            vitals = rig.camera.vitals()
            assert vitals.temperature_c == expected
            assert vitals.refused["repeated"] >= 1
