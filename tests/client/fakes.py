"""Messages, a station that publishes when told, and a network in between that can be cut, held up and mended."""

import contextlib
import socket
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from types import TracebackType
from typing import Self

from ghest_rt.client import Gap, Sample, Update, Updates
from ghest_rt.config.load import load_station
from ghest_rt.config.shipped import shipped_config_dir
from ghest_rt.messages.published import Event, EventKind, GhAngles
from ghest_rt.messages.results import GhEstimate, Reason, Status
from ghest_rt.security.identity import Identity
from ghest_rt.security.session import open_session
from ghest_rt.service.publisher import ZenohPublisher

SLOT_NS = 15_000_000


def message(seq: int, run_id: str = "a", t_publish_ns: int | None = None) -> GhAngles:
    """A sample without angles; published when its slot comes, by the sender's clock."""
    t_ns = seq * SLOT_NS if t_publish_ns is None else t_publish_ns
    nothing = dict.fromkeys(
        (
            "angles_deg",
            "sigma_deg",
            "euler_yxz_deg",
            "quaternion_wxyz",
            "isb_yxy_deg",
            "swing_twist_deg",
            "singular",
            "arm_position_m",
        )
    )
    return GhAngles.model_validate(
        nothing
        | {
            "run_id": run_id,
            "seq": seq,
            "t_sample_ns": t_ns - 45_000_000,
            "t_publish_ns": t_ns,
            "t_sample_unix_ns": t_ns,
            "status": Status.LOST,
            "reason": Reason.M0_NOT_SEEN,
            "age_ms": {"r0": None, "r1": None, "encoders": None},
            "method": "refined",
            "calibration_id": "cal",
        }
    )


NOTHING = GhEstimate(0, Status.LOST, Reason.M0_NOT_SEEN, None, None, None, None, None, {})


class FakeStation:
    """A station's publisher in this process, without devices: what it publishes is said by the test."""

    def __init__(
        self,
        station: str = "one",
        run_id: str = "a",
        endpoint: str = "tcp/127.0.0.1:0",
        router: str | None = None,
        identity: Identity | None = None,
    ) -> None:
        config = load_station(shipped_config_dir() / "station-sim.toml").config
        config = config.model_copy(update={"station": config.station.model_copy(update={"id": station})})
        listen, connect = ((endpoint,), ()) if router is None else ((), (router,))
        self.session, endpoints = open_session(listen, connect, identity)
        self.endpoint = endpoints[0] if router is None else router
        self.publisher = ZenohPublisher(self.session, config)
        self.run_id = run_id
        self.next_seq = 0
        self._open = True

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        if self._open:
            self._open = False
            self.publisher.close()
            self.session.close()

    def publish(self, count: int = 1, period_s: float = 0.0) -> None:
        for _ in range(count):
            self.publisher.angles(message(self.next_seq, self.run_id, time.monotonic_ns()), NOTHING)
            self.next_seq += 1
            time.sleep(period_s)

    def publish_until(self, done: Callable[[], bool], timeout_s: float = 10.0, period_s: float = 0.015) -> int:
        """Publish at the grid's rate until something has happened; return after how many samples."""
        first_seq, end_s = self.next_seq, time.monotonic() + timeout_s
        while not done():
            if time.monotonic() > end_s:
                raise TimeoutError("it did not happen while samples were published")
            self.publish(period_s=period_s)
        return self.next_seq - first_seq

    def event(self, text: str, seq: int = 0) -> None:
        self.publisher.event(
            Event(
                run_id=self.run_id,
                seq=seq,
                t_ns=0,
                t_unix_ns=0,
                severity="info",
                kind=EventKind.STARTED,
                source="service",
                message=text,
            )
        )


@dataclass
class Told:
    """Collects updates on a thread of its own."""

    updates: Updates
    all: list[Update] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._thread = threading.Thread(target=self._collect, daemon=True)
        self._thread.start()

    def _collect(self) -> None:
        while (update := self.updates.get()) is not None:
            self.all.append(update)

    def samples(self) -> list[Sample]:
        return [update for update in self.all if isinstance(update, Sample)]

    def seqs(self) -> list[int]:
        return [sample.message.seq for sample in self.samples()]

    def gaps(self) -> list[Gap]:
        return [update for update in self.all if isinstance(update, Gap)]

    def wait(self, done: Callable[[], bool], timeout_s: float = 10.0) -> None:
        wait(done, timeout_s)


def wait(done: Callable[[], bool], timeout_s: float = 10.0) -> None:
    end_s = time.monotonic() + timeout_s
    while not done():
        if time.monotonic() > end_s:
            raise TimeoutError("it did not happen")
        time.sleep(0.005)


class Network:
    """A TCP relay on this machine: `cut` breaks every connection and refuses new ones, `hold` lets nothing pass for a while."""

    def __init__(self, endpoint: str) -> None:
        self._target = ("127.0.0.1", int(endpoint.rpartition(":")[2]))
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.endpoint = f"{endpoint.partition('/')[0]}/127.0.0.1:{self._listener.getsockname()[1]}"
        self._flowing = threading.Event()
        self._flowing.set()
        self._whole = True
        self._sockets: list[socket.socket] = []
        threading.Thread(target=self._accept, daemon=True).start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._flowing.set()
        self.cut()
        self._listener.close()

    def cut(self) -> None:
        self._whole = False
        for end in self._sockets:
            with contextlib.suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)
            end.close()
        self._sockets = []

    def mend(self) -> None:
        self._whole = True

    def hold(self) -> None:
        self._flowing.clear()

    def release(self) -> None:
        self._flowing.set()

    def _accept(self) -> None:
        while True:
            try:
                near, _ = self._listener.accept()
            except OSError:
                return
            if not self._whole:
                near.close()
                continue
            try:
                far = socket.create_connection(self._target)
            except OSError:
                near.close()
                continue
            self._sockets += [near, far]
            for source, sink in ((near, far), (far, near)):
                threading.Thread(target=self._pass, args=(source, sink), daemon=True).start()

    def _pass(self, source: socket.socket, sink: socket.socket) -> None:
        with contextlib.suppress(OSError):
            while data := source.recv(65536):
                self._flowing.wait()
                sink.sendall(data)
        for end in (source, sink):
            with contextlib.suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)
            end.close()
