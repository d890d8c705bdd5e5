"""What every encoder backend promises (ghest_drivers.interfaces.EncoderLink)."""

import asyncio
import contextlib
import itertools

import numpy as np
import pytest

from ghest_drivers.clock import MonotonicClock
from ghest_drivers.errors import DeviceLost, EndOfStream, ReadTimeout
from ghest_drivers.interfaces import EncoderLink

_SAMPLES = 5
_LONG_S = 20.0


async def _exhaust(encoders: EncoderLink) -> None:
    with contextlib.suppress(ReadTimeout):
        while True:
            await encoders.read(0.3)


async def test_they_have_info_only_while_open(encoders: EncoderLink) -> None:
    with pytest.raises(DeviceLost):
        _ = encoders.info
    await encoders.open()
    assert encoders.info.joint_names
    await encoders.close()
    with pytest.raises(DeviceLost):
        _ = encoders.info


async def test_opening_twice_does_not_disturb_the_stream(encoders: EncoderLink) -> None:
    await encoders.open()
    first = await encoders.read(_LONG_S)
    await encoders.open()
    assert (await encoders.read(_LONG_S)).seq > first.seq


async def test_samples_are_numbered_and_stamped_in_order(encoders: EncoderLink) -> None:
    await encoders.open()
    samples = [await encoders.read(_LONG_S) for _ in range(_SAMPLES)]
    for before, after in itertools.pairwise(samples):
        assert after.seq > before.seq
        assert after.t_capture_ns > before.t_capture_ns
        assert after.t_arrival_ns >= before.t_arrival_ns


async def test_samples_are_latched_before_they_arrive_and_arrive_before_they_are_read(encoders: EncoderLink) -> None:
    clock = MonotonicClock()
    await encoders.open()
    for _ in range(_SAMPLES):
        sample = await encoders.read(_LONG_S)
        assert 0 < sample.t_capture_ns <= sample.t_arrival_ns <= clock.now_ns()


async def test_there_is_one_angle_per_joint(encoders: EncoderLink) -> None:
    await encoders.open()
    for _ in range(_SAMPLES):
        sample = await encoders.read(_LONG_S)
        assert sample.angles_rad.shape == (len(encoders.info.joint_names),)
        assert sample.angles_rad.dtype == np.float64


async def test_silence_is_a_timeout_and_not_an_end(silent_encoders: EncoderLink) -> None:
    await silent_encoders.open()
    await _exhaust(silent_encoders)
    for timeout_s in (0.0, 0.02):
        with pytest.raises(ReadTimeout):
            await silent_encoders.read(timeout_s)


async def test_the_end_stays_the_end(ending_encoders: EncoderLink) -> None:
    await ending_encoders.open()
    with pytest.raises(EndOfStream):
        await _exhaust(ending_encoders)
    with pytest.raises(EndOfStream):
        await ending_encoders.read(_LONG_S)


async def test_closing_is_harmless_at_any_time(encoders: EncoderLink) -> None:
    await encoders.close()
    await encoders.open()
    await encoders.read(_LONG_S)
    await encoders.close()
    await encoders.close()
    with pytest.raises(DeviceLost):
        await encoders.read(0.0)


async def test_closing_wakes_a_waiting_read(silent_encoders: EncoderLink) -> None:
    await silent_encoders.open()
    await _exhaust(silent_encoders)
    reading = asyncio.ensure_future(silent_encoders.read(50.0))
    await asyncio.sleep(0.05)
    assert not reading.done(), "the read should wait"
    await silent_encoders.close()
    with pytest.raises(DeviceLost):
        await asyncio.wait_for(reading, 10.0)


async def test_a_cancelled_read_leaves_the_link_usable(encoders: EncoderLink) -> None:
    await encoders.open()
    await encoders.read(_LONG_S)
    reading = asyncio.ensure_future(encoders.read(_LONG_S))
    await asyncio.sleep(0)
    reading.cancel()
    with contextlib.suppress(asyncio.CancelledError):
        await reading
    await encoders.read(_LONG_S)


async def test_they_stream_again_after_reopening(encoders: EncoderLink) -> None:
    await encoders.open()
    await encoders.read(_LONG_S)
    await encoders.close()
    await encoders.open()
    assert (await encoders.read(_LONG_S)).angles_rad.size
