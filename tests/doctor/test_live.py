"""Devices watched for a while: their rate, their losses, and whether cameras disturb each other."""

from typing import Any

import pytest

from ghest_drivers.clock import VirtualClock
from ghest_drivers.errors import BadDeviceData, DeviceNotFound, ReadTimeout
from ghest_drivers.samples import RgbdFrame
from ghest_rt.cli.doctor.findings import Finding, State
from ghest_rt.cli.doctor.live import check_cameras, check_encoders
from tests.doctor.fakes import FakeCamera, FakeEncoders


def _live(**camera: Any) -> list[Finding]:
    clock = VirtualClock(10**9)
    return list(check_cameras({"r0": FakeCamera(clock, **camera)}, 2.0, clock))


def test_a_good_camera_passes_with_its_figures() -> None:
    (finding,) = _live()
    assert finding.state is State.OK
    assert "100 frames, 50.00 Hz, 0.0% missing, depth in 100% of the middle, 5.0 ms old" in finding.detail


@pytest.mark.parametrize(
    ("camera", "words"),
    [
        ({"period_ns": 40_000_000}, "too slow for 50 Hz"),
        ({"step": 2}, "frames are lost"),
        ({"depth": 0}, "hardly any depth"),
        ({"error": BadDeviceData("garbled")}, "33 unusable frames"),
    ],
)
def test_a_camera_that_is_not_good_enough_is_told_why(camera: dict[str, Any], words: str) -> None:
    (finding,) = _live(**camera)
    assert finding.state is State.NOTE
    assert words in finding.remedy


@pytest.mark.parametrize("error", [DeviceNotFound("not there"), ReadTimeout("silent")])
def test_a_camera_without_frames_is_missing(error: Exception) -> None:
    class Silent(FakeCamera):
        def read(self, timeout_s: float) -> RgbdFrame:
            clock.sleep_until_ns(clock.now_ns() + round(timeout_s * 1e9))
            raise error

    clock = VirtualClock(10**9)
    (finding,) = check_cameras({"r0": Silent(clock, error=error)}, 2.0, clock)
    assert (finding.state, finding.exit_code) == (State.MISSING, 3)


def test_cameras_that_blind_each_other_are_told() -> None:
    class Blinded(FakeCamera):
        def read(self, timeout_s: float) -> RgbdFrame:
            frame = super().read(timeout_s)
            if self.k > 100 and frame.depth_counts is not None:  # the second time, together
                frame.depth_counts[:, :4] = 0
            return frame

    clock = VirtualClock(10**9)
    findings = list(check_cameras({name: Blinded(clock) for name in ("r0", "r1")}, 2.0, clock))
    assert any("projectors disturb each other" in finding.remedy for finding in findings)


@pytest.mark.parametrize(("period_ns", "state"), [(15_000_000, State.OK), (50_000_000, State.NOTE)])
def test_encoders_are_measured(period_ns: int, state: State) -> None:
    clock = VirtualClock(10**9)
    finding = check_encoders(FakeEncoders(clock, period_ns), 2.0, clock)
    assert finding.state is state
    assert "last angles 90.0 deg" in finding.detail
