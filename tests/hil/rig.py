"""The whole service as a process of its own, the far ends of its devices, and a subscriber in place of the therapy software."""

import json
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import zenoh

from ghest_rt.config.shipped import shipped_config_dir
from ghest_rt.security.session import Mode, open_session
from tests.endpoints import free_endpoint
from tests.hardware_encoders.can_senders import ARMEO_SOURCES
from tests.hil.injection import FOLDER_VARIABLE, Window, inject
from tests.hil.scene import FRAME_RATE_HZ, STATION_FILE, Scene, read_scene, write_scene
from tests.program import COMMAND

ROOT = Path(__file__).parents[2]
FIXTURES = ("realsense-serial", "oak-can")
_START_S = 60.0
_CAN_GROUP = "239.74.163.2"


@dataclass(frozen=True, slots=True)
class Sample:
    """A message as the subscriber got it, and when."""

    t_received_ns: int
    body: dict[str, Any]

    @property
    def valid(self) -> bool:
        return bool(self.body["status"] == "valid")


class Subscriber:
    """Listens to a station, in place of the therapy software."""

    def __init__(self, endpoint: str, mode: Mode = "peer") -> None:
        self.tokens: list[tuple[int, bool]] = []  # when the station's liveliness token came (True) and went
        self.angles: list[Sample] = []
        self.events: list[Sample] = []
        self.healths: list[Sample] = []
        self._changed = threading.Condition()
        self._session, _ = open_session((), (endpoint,), mode=mode)
        self._subscribers: list[object] = [
            self._session.declare_subscriber(f"ghest/*/{key}", self._into(kept))
            for key, kept in (("gh/angles", self.angles), ("events", self.events), ("health", self.healths))
        ]
        self._subscribers.append(self._session.liveliness().declare_subscriber("ghest/*/alive", self._token, history=True))

    def _into(self, kept: list[Sample]) -> Callable[[zenoh.Sample], None]:
        def take(sample: zenoh.Sample) -> None:
            message = Sample(time.monotonic_ns(), json.loads(sample.payload.to_bytes()))
            with self._changed:
                kept.append(message)
                self._changed.notify_all()

        return take

    def _token(self, sample: zenoh.Sample) -> None:
        with self._changed:
            self.tokens.append((time.monotonic_ns(), sample.kind == zenoh.SampleKind.PUT))

    def wait_until(self, condition: Callable[[], bool], timeout_s: float) -> bool:
        with self._changed:
            return self._changed.wait_for(condition, timeout_s)

    def between(self, from_ns: int, until_ns: int) -> list[Sample]:
        """Samples published in a time window."""
        return [sample for sample in list(self.angles) if from_ns <= sample.body["t_publish_ns"] < until_ns]

    def take_angles(self) -> list[Sample]:
        """Return what has come and forget it: for runs that would fill the memory."""
        with self._changed:
            taken = self.angles[:]
            self.angles.clear()
        return taken

    def close(self) -> None:
        self._session.close()


class Rig:
    """A running service with a subscriber; with fixtures it also has a scene to compare with, and faults to inject."""

    def __init__(
        self, name: str, service: "subprocess.Popen[str]", subscriber: Subscriber, folder: Path | None, scene: Scene | None
    ) -> None:
        self.name = name
        self.service = service
        self.subscriber = subscriber
        self.scene = scene
        self._folder = folder

    def inject(self, devices: tuple[str, ...], fault: str, seconds: float) -> Window:
        """Let devices misbehave from a moment from now on; returns when."""
        assert self._folder is not None
        from_ns = time.monotonic_ns() + 50_000_000
        window = Window(devices, fault, from_ns, from_ns + round(seconds * 1e9))
        inject(self._folder, window)
        return window

    def wait_valid(self, count: int, timeout_s: float) -> bool:
        """Wait until the newest samples are all valid; False if they are not in time, or the service has ended."""
        angles = self.subscriber.angles
        start = len(angles)
        deadline_s = time.monotonic() + timeout_s

        def well() -> bool:
            return len(angles) >= start + count and all(sample.valid for sample in angles[-count:])

        while self.service.poll() is None and time.monotonic() < deadline_s:
            if self.subscriber.wait_until(well, 0.5):
                return True
        return False

    def log(self) -> str:
        """Return what the service has written; with fixtures only."""
        assert self._folder is not None
        return (self._folder / f"{self.name}.log").read_text()

    def stop(self) -> int:
        """End the service as systemd would; returns its exit code."""
        self.service.send_signal(signal.SIGTERM)
        return self.service.wait(10)


@contextmanager
def far_ends(name: str, folder: Path) -> Iterator[tuple[Path, dict[str, str], int]]:
    """Run what sends encoder samples; yields the station file, the environment for a service on it, and that process's id."""
    if not (folder / "scene.npz").exists():
        write_scene(folder, time.monotonic_ns())
    station = folder / f"{name}.toml"
    station.write_text(station_text(name, folder))
    environment = {**os.environ, FOLDER_VARIABLE: str(folder), "OPENBLAS_NUM_THREADS": "1", "PYTHONPATH": str(ROOT)}
    channel = ("pty", str(folder / "armeo")) if name == "realsense-serial" else ("can", _CAN_GROUP, str(_can_port(folder)))
    talker = subprocess.Popen(
        [sys.executable, "-m", "tests.hil.armeo_talker", *channel], cwd=ROOT, env=environment, stdout=subprocess.PIPE, text=True
    )
    try:
        assert talker.stdout is not None and talker.stdout.readline() == "ready\n"
        yield station, environment, talker.pid
    finally:
        talker.kill()
        talker.communicate()


def service_command(station: Path, record_to: Path | None = None) -> list[str]:
    """Return how the service is started on fixtures; with `record_to`, as `ghest-rt record`."""
    doing = ["run"] if record_to is None else ["record", "--out", str(record_to)]
    return [sys.executable, "-m", "tests.hil.service", *doing, "--station", str(station)]


@contextmanager
def fixture_rig(name: str, folder: Path, record_to: Path | None = None) -> Iterator[Rig]:
    """Run the service on fixtures, "realsense-serial" or "oak-can"; with `record_to`, as `ghest-rt record` does."""
    with (
        far_ends(name, folder) as (station, environment, _),
        _running(name, service_command(station, record_to), environment, folder, read_scene(folder)) as rig,
    ):
        yield rig


@contextmanager
def station_rig(station: Path) -> Iterator[Rig]:
    """Run the service on a real station."""
    command = [*COMMAND, "run", "--station", str(station)]
    with _running(f"station {station}", command, dict(os.environ), None, None) as rig:
        yield rig


@contextmanager
def _running(
    name: str, command: list[str], environment: dict[str, str], folder: Path | None, scene: Scene | None
) -> Iterator[Rig]:
    endpoint = free_endpoint()
    log = folder / f"{name}.log" if folder is not None else Path(os.devnull)
    with log.open("w") as output:
        service = subprocess.Popen(
            [*command, "--listen", endpoint], cwd=ROOT, env=environment, stdout=output, stderr=output, text=True
        )
        subscriber = Subscriber(endpoint)
        rig = Rig(name, service, subscriber, folder, scene)
        try:
            if not rig.wait_valid(20, _START_S):
                raise RuntimeError(f"{name}: no valid angles within {_START_S:g} s:\n{log.read_text() if folder else ''}")
            yield rig
        finally:
            subscriber.close()
            if service.poll() is None:
                service.terminate()
                try:
                    service.wait(10)
                except subprocess.TimeoutExpired:
                    service.kill()
                    service.wait()


def station_text(name: str, folder: Path) -> str:
    """Return the station file: the scene's, with the fixtures' devices."""
    facts = json.loads((folder / "scene.json").read_text())
    settings = ", ".join(f"{key} = {value!r}" for key, value in facts["settings_m"].items())
    lines = [
        f"settings_m = {{ {settings} }}" if line.startswith("settings_m") else line
        for line in (folder / STATION_FILE).read_text().splitlines()
    ]
    text = "\n".join(lines).replace('id = "sim"', 'id = "hil"', 1).replace("lag_ms = 45.0", "lag_ms = 70.0")
    size = f"width_px = 128, height_px = 128, rate_hz = {FRAME_RATE_HZ}"
    for camera in ("r0", "r1"):
        if name == "realsense-serial":
            device = f'{{ backend = "realsense", serial = "hil-{camera}", {size} }}'
        else:
            device = f'{{ backend = "oak", mxid = "hil-{camera}", {size} }}'
        head, tail = text.split(f"[cameras.{camera}]")
        text = head + f"[cameras.{camera}]" + tail.replace('{ backend = "sim" }', device, 1)
    if name == "realsense-serial":
        encoders = f'{{ backend = "serial", port = "{folder / "armeo"}", latency_ms = 1.0 }}'
        return text.replace('{ backend = "sim" }', encoders, 1)
    shutil.copy(shipped_config_dir() / "armeo_spring.dbc", folder)
    channels = ", ".join(
        f'{joint} = {{ source = "{source}", deg_per_count = 1.0 }}'
        for joint, source in zip(facts["joints"], ARMEO_SOURCES, strict=True)
    )
    bus = f'{{ interface = "udp_multicast", channel = "{_CAN_GROUP}", options = {{ port = {_can_port(folder)} }} }}'
    encoders = (
        f'{{ backend = "can", bus = {bus}, dbc = "armeo_spring.dbc", time_signal = "Armeo_Wrist.DeviceTime", '
        f'time_tick_ns = 10000, status_signal = "Armeo_Wrist.Status", counter_signal = "Counter", '
        f'checksum_signal = "Checksum", latency_ms = 1.0, channels = {{ {channels} }} }}'
    )
    return text.replace('{ backend = "sim" }', encoders, 1)


def _can_port(folder: Path) -> int:
    """Return a port of this folder's own, so that two runs on one machine do not hear each other."""
    return 40_000 + zlib.crc32(str(folder).encode()) % 9_000


def wait_until(condition: Callable[[], bool], timeout_s: float) -> bool:
    """Look again and again; return whether it came true in time."""
    deadline_s = time.monotonic() + timeout_s
    while not condition():
        if time.monotonic() > deadline_s:
            return False
        time.sleep(0.01)
    return True
