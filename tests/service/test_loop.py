"""The service with scripted devices: whatever they do, a sample leaves in every slot and none is older than it says."""

import asyncio
import itertools
import threading

import pytest

from ghest_drivers.errors import BadDeviceData, DeviceLost
from ghest_rt.errors import DeviceError
from ghest_rt.messages.published import EventKind, InputState
from ghest_rt.messages.results import GhEstimate, Reason, Status
from ghest_rt.service.inputs import Backoff, InputSettings
from tests.service.fakes import FakeCamera, FakePipeline, frame
from tests.service.rig import LAG_NS, Rig


async def test_samples_are_numbered_on_the_grid_and_carry_their_age() -> None:
    rig = Rig()

    async def scene() -> None:
        t_ns = rig.feed()
        await rig.out.until(lambda: any(s.status is Status.VALID for s in rig.out.samples))
        first = next(s for s in rig.out.samples if s.status is Status.VALID)
        assert first.age_ms["r0"] == pytest.approx((first.t_publish_ns - t_ns) * 1e-6)

    summary = await rig.during(scene)
    samples = rig.out.samples
    assert [s.seq for s in samples] == list(range(len(samples)))
    assert summary.published == len(samples)
    assert summary.unused == {"encoders_repeated": 2}
    assert all(s.t_publish_ns - s.t_sample_ns >= LAG_NS for s in samples)
    assert all(b.t_sample_ns > a.t_sample_ns for a, b in itertools.pairwise(samples))
    lost = [s for s in samples if s.status is Status.LOST]
    assert lost
    assert all(s.angles_deg is None and s.quaternion_wxyz is None and s.reason is Reason.STARTING for s in lost)


async def test_the_grid_is_anchored_at_the_first_instant_that_both_cameras_saw() -> None:
    rig = Rig()
    first_ns = 0

    async def scene() -> None:
        nonlocal first_ns
        rig.feed(cameras=("r0",))
        await asyncio.sleep(0.01)
        first_ns = rig.feed(1, cameras=("r1",))
        await rig.out.until(lambda: bool(rig.pipelines) and len(rig.pipelines[0].asked_ns) >= 3)

    await rig.during(scene)
    asked_ns = rig.pipelines[0].asked_ns
    assert min(asked_ns) >= first_ns
    assert all((t_ns - first_ns) % 5_000_000 == 0 for t_ns in asked_ns)


async def test_a_lost_camera_is_reported_and_opened_again() -> None:
    rig = Rig()

    async def scene() -> None:
        rig.feed()
        await rig.out.until(lambda: bool(rig.out.samples) and rig.out.samples[-1].status is Status.VALID)
        rig.cameras["r0"].script.put(DeviceLost("cable pulled"))
        rig.cameras["r0"].script.put(frame("r0", 7, rig.clock.now_ns()))
        await rig.out.until(lambda: rig.out.kinds("r0").count(EventKind.INPUT_STREAMING) == 2)

    summary = await rig.during(scene)
    assert rig.out.kinds("r0") == [
        EventKind.INPUT_CONNECTED,
        EventKind.INPUT_STREAMING,
        EventKind.INPUT_LOST,
        EventKind.INPUT_CONNECTED,
        EventKind.INPUT_STREAMING,
    ]
    lost = next(e for e in rig.out.events if e.kind is EventKind.INPUT_LOST)
    assert "cable pulled" in lost.message
    assert summary.inputs["r0"].reopened == 1
    assert summary.inputs["r1"].reopened == 0
    assert len(rig.pipelines) == 1


async def test_samples_leave_and_say_why_while_a_camera_has_never_come() -> None:
    rig = Rig(cameras={"r0": FakeCamera("r0", fail_open=10**6), "r1": FakeCamera("r1")})

    async def scene() -> None:
        await rig.out.until(lambda: any(s.reason is Reason.R0_NO_FRAMES for s in rig.out.samples))

    await rig.during(scene)
    assert all(s.angles_deg is None for s in rig.out.samples)
    assert rig.cameras["r0"].closed > 0


async def test_a_camera_that_comes_back_with_another_calibration_gets_a_new_pipeline() -> None:
    rig = Rig(cameras={"r0": FakeCamera("r0", fx_px=(4.0, 5.0)), "r1": FakeCamera("r1")})

    async def scene() -> None:
        rig.feed()
        await rig.out.until(lambda: EventKind.INPUT_STREAMING in rig.out.kinds("r0"))
        rig.cameras["r0"].script.put(DeviceLost("gone"))
        await rig.out.until(lambda: EventKind.INPUT_CHANGED in rig.out.kinds("r0"))

    await rig.during(scene)
    assert len(rig.pipelines) == 2


async def test_silent_encoders_are_reported_and_reopened() -> None:
    rig = Rig(InputSettings(read_timeout_s=0.005, silent_after=2, lost_after=6, backoff=Backoff(first_s=0.001)))

    async def scene() -> None:
        rig.feed()
        await rig.out.until(lambda: rig.out.kinds("encoders").count(EventKind.INPUT_CONNECTED) >= 2)

    summary = await rig.during(scene)
    kinds = rig.out.kinds("encoders")
    assert kinds.index(EventKind.INPUT_SILENT) < kinds.index(EventKind.INPUT_LOST)
    assert summary.inputs["encoders"].reopened >= 1
    assert rig.encoders.closed >= 2


async def test_unusable_data_is_counted_and_told_once() -> None:
    rig = Rig()

    async def scene() -> None:
        for _ in range(5):
            rig.cameras["r1"].script.put(BadDeviceData("half an image"))
        rig.feed()
        await rig.out.until(lambda: EventKind.INPUT_STREAMING in rig.out.kinds("r1"))

    summary = await rig.during(scene)
    assert summary.inputs["r1"].bad == 5
    assert rig.out.kinds("r1").count(EventKind.BAD_DATA) == 1


@pytest.mark.parametrize(("settled_after_ns", "told"), [(0, 1), (10**12, 0)])
async def test_slow_vision_neither_delays_a_tick_nor_works_on_old_frames(settled_after_ns: int, told: int) -> None:
    release = threading.Event()

    def slow(frame: object) -> None:
        release.wait(10.0)

    settings = InputSettings(read_timeout_s=0.01, lost_after=10_000, max_backlog_ns=0, settled_after_ns=settled_after_ns)
    rig = Rig(settings, observe_hook=slow)

    async def scene() -> None:
        rig.feed(0)
        await rig.out.until(lambda: rig.service.summary().inputs["r0"].received == 1 and len(rig.out.samples) > 10)
        assert not rig.pipelines[0].observed  # vision still holds the first frames; the samples went out all the same
        for seq in range(1, 6):
            rig.feed(seq)
        release.set()
        await rig.out.until(lambda: ("r0", 5) in rig.pipelines[0].observed and ("r1", 5) in rig.pipelines[0].observed)

    summary = await rig.during(scene)
    assert [seq for name, seq in rig.pipelines[0].observed if name == "r0"] == [0, 5]
    assert summary.inputs["r0"].skipped == 4
    assert summary.inputs["r0"].missing == 0
    assert rig.out.kinds("r0").count(EventKind.FRAMES_SKIPPED) == told


async def test_gaps_in_the_cameras_count_are_counted() -> None:
    rig = Rig()

    async def scene() -> None:
        rig.feed(10)
        rig.feed(14)
        await rig.out.until(lambda: rig.service.summary().inputs["r0"].received == 2)

    assert (await rig.during(scene)).inputs["r0"].missing == 3


async def test_the_end_of_all_inputs_ends_the_service_after_the_last_sample_they_allow() -> None:
    rig = Rig()
    last_ns = rig.feed(0)
    rig.end()
    summary = await asyncio.wait_for(rig.service.run(), 10.0)
    assert rig.pipelines[0].asked_ns[-1] == last_ns
    assert summary.valid >= 1
    assert summary.inputs["r0"].state is InputState.ENDED
    assert all(camera.closed for camera in rig.cameras.values())
    assert rig.encoders.closed
    assert rig.out.events[-1].kind is EventKind.STOPPED


async def test_inputs_that_end_without_a_frame_end_the_service() -> None:
    rig = Rig()
    rig.end()
    summary = await asyncio.wait_for(rig.service.run(), 10.0)
    assert summary.valid == 0


async def test_a_recording_that_breaks_is_a_device_error() -> None:
    rig = Rig(InputSettings(read_timeout_s=0.01, reconnect=False))
    rig.feed()
    rig.cameras["r0"].script.put(DeviceLost("block 7 is damaged"))
    with pytest.raises(DeviceError, match=r"r0.*block 7"):
        await asyncio.wait_for(rig.service.run(), 10.0)


async def test_a_failing_estimator_ends_the_service_with_its_error() -> None:
    class Broken(FakePipeline):
        def estimate(self, t_ns: int) -> GhEstimate:
            raise ZeroDivisionError("estimator")

    rig = Rig(pipeline=Broken)
    rig.feed()
    with pytest.raises(ZeroDivisionError, match="estimator"):
        await asyncio.wait_for(rig.service.run(), 10.0)


async def test_stopping_does_not_wait_for_a_device_that_hangs() -> None:
    hang = threading.Event()

    class Hanging(FakeCamera):
        def close(self) -> None:
            super().close()
            hang.wait(20.0)

    rig = Rig(cameras={"r0": Hanging("r0"), "r1": FakeCamera("r1")})

    async def scene() -> None:
        await rig.out.until(lambda: len(rig.out.samples) > 2)

    await asyncio.wait_for(rig.during(scene), 10.0)
    hang.set()
    await asyncio.sleep(0.05)


async def test_nothing_is_left_running() -> None:
    before = set(threading.enumerate())
    rig = Rig()

    async def scene() -> None:
        rig.feed()
        await rig.out.until(lambda: len(rig.out.samples) > 5)

    await rig.during(scene)
    for thread in set(threading.enumerate()) - before:
        thread.join(5.0)
        assert not thread.is_alive(), thread.name


def test_pauses_double_up_to_their_limit() -> None:
    delays_s = Backoff().delays_s()
    assert [next(delays_s) for _ in range(7)] == [0.25, 0.5, 1.0, 2.0, 4.0, 5.0, 5.0]


async def test_a_first_frame_that_comes_while_the_service_stops_starts_nothing() -> None:
    rig = Rig()

    async def scene() -> None:
        rig.feed(cameras=("r0",))
        await rig.out.until(lambda: bool(rig.pipelines) and "r0" in rig.pipelines[0].newest_ns)

    await rig.during(scene)
    published = len(rig.out.samples)
    late = rig.pipelines[0].observe(frame("r1", 0, rig.clock.now_ns()))
    rig.service.observed(late)
    await asyncio.sleep(0.05)
    assert len(rig.out.samples) == published
