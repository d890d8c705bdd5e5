"""The devices of a replay."""

import asyncio

from ghest_drivers.clock import AsyncSleeper, Clock
from ghest_drivers.replay.outlet import FEED_WAIT_S, Outlet
from ghest_drivers.samples import CameraInfo, EncoderInfo, EncoderSample, RgbdFrame


class ReplayCamera:
    """A camera of a recording; an `RgbdCamera`."""

    def __init__(self, outlet: Outlet[RgbdFrame], info: CameraInfo, clock: Clock) -> None:
        self.outlet = outlet
        self._info = info
        self._clock = clock

    @property
    def info(self) -> CameraInfo:
        """The recorded camera's facts."""
        self.outlet.check_open()
        return self._info

    def open(self) -> None:
        """Start playing."""
        self.outlet.open()

    def read(self, timeout_s: float) -> RgbdFrame:
        """Wait until the next frame is due."""
        deadline_ns = self._clock.now_ns() + round(timeout_s * 1e9)
        while True:
            found = self.outlet.poll(deadline_ns)
            if isinstance(found, RgbdFrame):
                return found
            if found is None:
                self.outlet.wait_for_feeder()
            else:
                self._clock.sleep_until_ns(found)

    def close(self) -> None:
        """Stop delivering."""
        self.outlet.close()


class ReplayEncoders:
    """The encoders of a recording; an `EncoderLink`."""

    def __init__(self, outlet: Outlet[EncoderSample], info: EncoderInfo, clock: Clock) -> None:
        self.outlet = outlet
        self._info = info
        self._clock = clock
        self._sleeper = AsyncSleeper(clock)

    @property
    def info(self) -> EncoderInfo:
        """The recorded encoders' joints."""
        self.outlet.check_open()
        return self._info

    async def open(self) -> None:
        """Start playing."""
        self.outlet.open()

    async def read(self, timeout_s: float) -> EncoderSample:
        """Wait until the next sample is due."""
        deadline_ns = self._clock.now_ns() + round(timeout_s * 1e9)
        while True:
            found = self.outlet.poll(deadline_ns)
            if isinstance(found, EncoderSample):
                return found
            if found is None:
                await asyncio.sleep(FEED_WAIT_S)
            else:
                await self._sleeper.sleep_until_ns(found)

    async def close(self) -> None:
        """Stop delivering."""
        self.outlet.close()
        self._sleeper.close()
