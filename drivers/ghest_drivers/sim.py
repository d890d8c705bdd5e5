"""Devices of a simulated world, which is handed in: this package knows nothing of how it is simulated.

World time starts at 0 and is shown on the clock from `start_ns` on; the devices of one world share that instant. A world
that is slower than the clock is not waited for: frames that would come late by whole periods are left out, as by a real
camera, and show as a gap in `seq`.
"""

import asyncio
from dataclasses import replace
from typing import Protocol, runtime_checkable

from ghest_drivers.clock import AsyncSleeper, Clock
from ghest_drivers.errors import DeviceLost, EndOfStream, ReadTimeout
from ghest_drivers.samples import CameraInfo, EncoderInfo, EncoderSample, RgbdFrame

_SLICE_NS = 20_000_000  # how soon a waiting read notices that it was closed


@runtime_checkable
class SimWorld(Protocol):
    """What simulates; all its times are world times, nanoseconds from 0. Called from one thread per device."""

    def camera_info(self, name: str) -> CameraInfo:
        """Return what is fixed about a camera."""
        ...

    def frame(self, name: str, k: int) -> RgbdFrame | None:
        """Return the k-th frame of a camera (its `seq`), or None after the end."""
        ...

    def encoder_info(self) -> EncoderInfo:
        """Return the joints measured."""
        ...

    def encoder_sample(self, k: int) -> EncoderSample | None:
        """Return the k-th sample of the encoders (its `seq`), or None after the end."""
        ...


class SimCamera:
    """A camera of a simulated world; an `RgbdCamera`.

    Args:
        world: The world.
        name: The camera's name in it.
        clock: Sets the pace.
        start_ns: The clock's time at world time 0.
    """

    def __init__(self, world: SimWorld, name: str, clock: Clock, start_ns: int) -> None:
        self._world = world
        self._name = name
        self._clock = clock
        self._start_ns = start_ns
        self._is_open = False
        self._info: CameraInfo | None = None
        self._next = 0
        self._waiting: RgbdFrame | None = None

    @property
    def info(self) -> CameraInfo:
        """The simulated camera's facts."""
        if not self._is_open or self._info is None:
            raise DeviceLost(f"simulated camera {self._name} is not open")
        return self._info

    def open(self) -> None:
        """Start the camera."""
        self._info = self._world.camera_info(self._name)
        self._is_open = True

    def read(self, timeout_s: float) -> RgbdFrame:
        """Simulate the next frame and wait until it is due."""
        deadline_ns = self._clock.now_ns() + round(timeout_s * 1e9)
        info = self.info
        frame = self._waiting = self._waiting or self._simulate(info)
        while (now_ns := self._clock.now_ns()) < frame.t_arrival_ns:
            if now_ns >= deadline_ns:
                raise ReadTimeout(f"simulated camera {self._name}: no frame yet")
            self._clock.sleep_until_ns(min(frame.t_arrival_ns, deadline_ns, now_ns + _SLICE_NS))
            if not self._is_open:
                raise DeviceLost(f"simulated camera {self._name} was closed")
        self._waiting = None
        return frame

    def close(self) -> None:
        """Stop the camera."""
        self._is_open = False

    def _simulate(self, info: CameraInfo) -> RgbdFrame:
        period_ns = 1e9 / info.rate_hz
        frame = self._world.frame(self._name, self._next)
        if frame is None:
            raise EndOfStream(f"simulated camera {self._name}: the simulation is through")
        late_ns = self._clock.now_ns() - (frame.t_arrival_ns + self._start_ns)
        self._next += 1 + max(int(late_ns / period_ns), 0)
        return replace(
            frame,
            t_arrival_ns=frame.t_arrival_ns + self._start_ns,
            t_capture_ns=frame.t_capture_ns + self._start_ns,
            t_depth_capture_ns=frame.t_depth_capture_ns + self._start_ns,
        )


class SimEncoders:
    """The encoders of a simulated world; an `EncoderLink`. What was due before it is opened has gone by, as with a real link.

    From then on samples are cheap: late ones are delivered late, none is left out.

    Args:
        world: The world.
        clock: Sets the pace.
        start_ns: The clock's time at world time 0.
    """

    def __init__(self, world: SimWorld, clock: Clock, start_ns: int) -> None:
        self._world = world
        self._clock = clock
        self._start_ns = start_ns
        self._is_open = False
        self._sleeper = AsyncSleeper(clock)
        self._info: EncoderInfo | None = None
        self._next = 0
        self._waiting: EncoderSample | None = None

    @property
    def info(self) -> EncoderInfo:
        """The simulated encoders' joints."""
        if not self._is_open or self._info is None:
            raise DeviceLost("the simulated encoders are not open")
        return self._info

    async def open(self) -> None:
        """Start the encoders."""
        self._info = self._world.encoder_info()
        if not self._is_open:
            await self._pass_by()
        self._is_open = True

    async def read(self, timeout_s: float) -> EncoderSample:
        """Simulate the next sample and wait until it is due."""
        deadline_ns = self._clock.now_ns() + round(timeout_s * 1e9)
        info = self.info
        sample = self._waiting = self._waiting or self._simulate(info)
        await asyncio.sleep(0)  # late samples must not keep the event loop for themselves
        while (now_ns := self._clock.now_ns()) < sample.t_arrival_ns:
            if now_ns >= deadline_ns:
                raise ReadTimeout("simulated encoders: no sample yet")
            await self._sleeper.sleep_until_ns(min(sample.t_arrival_ns, deadline_ns, now_ns + _SLICE_NS))
            if not self._is_open:
                raise DeviceLost("the simulated encoders were closed")
        self._waiting = None
        return sample

    async def close(self) -> None:
        """Stop the encoders."""
        self._is_open = False
        self._sleeper.close()

    async def _pass_by(self) -> None:
        """Leave out what has been due by now."""
        self._waiting = None
        while (sample := self._world.encoder_sample(self._next)) is not None:
            if sample.t_arrival_ns + self._start_ns >= self._clock.now_ns():
                return
            self._next += 1
            await asyncio.sleep(0)

    def _simulate(self, info: EncoderInfo) -> EncoderSample:
        sample = self._world.encoder_sample(self._next)
        if sample is None:
            raise EndOfStream(f"simulated {info.name}: the simulation is through")
        self._next += 1
        return replace(
            sample,
            t_arrival_ns=sample.t_arrival_ns + self._start_ns,
            t_capture_ns=sample.t_capture_ns + self._start_ns,
        )
