"""One asyncio task for the encoder link: keeps it open and hands its samples on."""

import asyncio
import logging

from ghest_drivers.errors import BadDeviceData, DeviceLost, DriverError, EndOfStream, ReadTimeout
from ghest_drivers.interfaces import EncoderLink, TellsVitals
from ghest_drivers.samples import DeviceVitals
from ghest_rt.messages.published import EventKind, InputState
from ghest_rt.service.inputs import InputCounters, InputListener, InputSettings, Severity

_log = logging.getLogger(__name__)

ENCODERS = "encoders"


class EncoderWorker:
    """Keeps the encoder link open and its samples flowing, whatever the device does."""

    def __init__(self, link: EncoderLink, listener: InputListener, settings: InputSettings) -> None:
        self.counters = InputCounters()
        self._link = link
        self._listener = listener
        self._settings = settings
        self._go = asyncio.Event()

    def go(self) -> None:
        """Let samples through; until then the link is only opened."""
        self._go.set()

    def vitals(self) -> DeviceVitals:
        """Return what the link says of itself."""
        return self._link.vitals() if isinstance(self._link, TellsVitals) else DeviceVitals()

    async def run(self) -> None:
        """Run until the link ends or the task is cancelled; closes the link."""
        error: Exception | None = None
        try:
            error = await self._keep_open()
        finally:
            await self._close()
        self._listener.input_ended(ENCODERS, error)

    async def _keep_open(self) -> Exception | None:
        delays_s = self._settings.backoff.delays_s()
        while True:
            received = self.counters.received
            try:
                await self._link.open()
                self._listener.encoders_connected(self._link.info)
                await self._go.wait()
                await self._stream()
            except EndOfStream:
                self.counters.state = InputState.ENDED
                self._event(EventKind.INPUT_ENDED, "info", "no more samples")
                return None
            except Exception as error:  # libraries below raise what they like; none of it may end the service
                if not isinstance(error, DriverError):
                    _log.exception("encoders: unexpected error")
                self.counters.state = InputState.LOST
                self._event(EventKind.INPUT_LOST, "error", f"{type(error).__name__}: {error}")
                if not self._settings.reconnect:
                    return error
                await self._close()
                if self.counters.received > received:
                    delays_s = self._settings.backoff.delays_s()
                await asyncio.sleep(next(delays_s))
                self.counters.reopened += 1
                self.counters.last_seq = None

    async def _stream(self) -> None:
        counters, settings = self.counters, self._settings
        in_vain = 0
        while True:
            try:
                sample = await self._link.read(settings.read_timeout_s)
            except ReadTimeout:
                in_vain += 1
                if in_vain == settings.silent_after:
                    counters.state = InputState.SILENT
                    self._event(EventKind.INPUT_SILENT, "warning", "the link is open but sends no samples")
                if in_vain >= settings.lost_after:
                    raise DeviceLost(f"no sample for {in_vain * settings.read_timeout_s:.1f} s") from None
                continue
            except BadDeviceData as error:
                if not counters.bad:
                    self._event(EventKind.BAD_DATA, "warning", f"a sample was not usable: {error} (more are only counted)")
                counters.bad += 1
                continue
            in_vain = 0
            counters.count(sample.seq, sample.t_capture_ns)
            if counters.state is not InputState.STREAMING:
                counters.state = InputState.STREAMING
                self._event(EventKind.INPUT_STREAMING, "info", "samples are arriving")
            self._listener.encoder_sample(sample)

    def _event(self, kind: EventKind, severity: Severity, message: str) -> None:
        self._listener.input_event(ENCODERS, kind, severity, message)

    async def _close(self) -> None:
        try:
            await self._link.close()
        except Exception:
            _log.exception("encoders: close failed")
