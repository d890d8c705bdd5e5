"""The live loop while a peer of the clinic floods it, beside the same flood against a decoy in another process.

The flooder runs on the same cores as the service, which it would not in a clinic; the decoy, a session with the same settings
and one queryable, takes that out of the comparison: in both runs the machine has the same to do, but only in one does the
service have to do with it. `ghest-rt certs` makes the identities; the flooder is therapy software.
"""

import json
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import psutil

from benchmarks.flooder import KINDS
from benchmarks.scenes import long_scene
from ghest_rt.config.shipped import shipped_config_dir
from ghest_rt.security.authority import Authority
from ghest_rt.security.endpoints import split_endpoint
from ghest_rt.security.roles import Role

_COMMAND = str(Path(sys.executable).with_name("ghest-rt"))
_TARGET, _DECOY = "tls/127.0.0.1:17461", "tls/127.0.0.1:17462"
_WARM_UP_S = 2.0


def run(quick: bool) -> dict[str, Any]:
    """Flood by every kind for 20 s (quick: 5 s), the decoy and the service by turns."""
    seconds = 5.0 if quick else 20.0
    recording = long_scene(seconds + _WARM_UP_S + 1.0)
    result: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        authority = Authority.create(root / "pki", "Benchmark", 10)
        station = authority.issue(Role.STATION, "bed-1", ("127.0.0.1",), 1)
        therapy = authority.issue(Role.THERAPY, "game-1", (), 1)
        target = _station_file(root / "target", _TARGET, station)
        for kind in KINDS:
            rows = [_one(kind, seconds, recording, (target, station), endpoint, therapy) for endpoint in (_DECOY, _TARGET)]
            result[kind] = {"decoy_flooded": rows[0], "service_flooded": rows[1]}
            result[kind]["ratio_p99"] = round(rows[1]["p99_us"] / rows[0]["p99_us"], 2)
    return result


def _one(  # noqa: PLR0917
    kind: str, seconds: float, recording: Path, files: tuple[Path, Path], flooded: str, therapy: Path
) -> dict[str, float]:
    station_file, identity = files
    flooder = [sys.executable, "-m", "benchmarks.flooder"]
    service_command = [_COMMAND, "--replay", str(recording), "--station", str(station_file), "--json"]
    with (
        subprocess.Popen([*flooder, "decoy", _DECOY, str(identity), str(seconds + 2.0 * _WARM_UP_S)]) as decoy,
        subprocess.Popen(service_command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as service,
    ):
        watched = psutil.Process(service.pid)
        _wait_for(_TARGET)
        time.sleep(_WARM_UP_S)
        before_s = sum(watched.cpu_times()[:2])
        flood = subprocess.run(
            [*flooder, kind, flooded, str(therapy), str(seconds)], stdout=subprocess.PIPE, check=True, timeout=seconds + 30.0
        )
        used_s = sum(watched.cpu_times()[:2]) - before_s
        resident_mb = watched.memory_info().rss / 1e6
        report = json.loads(service.communicate()[0])["runs"][0]
        decoy.wait()
    return {
        "sent_per_s": round(int(flood.stdout) / seconds),
        "p50_us": round(report["lateness"]["p50_us"]),
        "p99_us": round(report["lateness"]["p99_us"]),
        "missed_ticks": report["missed_ticks"],
        "valid_fraction": report["valid_fraction"],
        "cpu_share_of_one_core": round(used_s / seconds, 3),
        "resident_mb": round(resident_mb, 1),
    }


def _wait_for(endpoint: str) -> None:
    _, host, port = split_endpoint(endpoint)
    for _ in range(300):
        try:
            socket.create_connection((host, port)).close()
        except ConnectionRefusedError:
            time.sleep(0.1)
        else:
            return
    raise TimeoutError(f"nobody listens on {endpoint}")


def _station_file(folder: Path, endpoint: str, identity: Path) -> Path:
    folder.mkdir()
    shipped = shipped_config_dir()
    (folder / "armeo_spring.urdf").write_bytes((shipped / "armeo_spring.urdf").read_bytes())
    path = folder / "station.toml"
    text = (shipped / "station-sim.toml").read_text()
    path.write_text(f'{text}\n[publisher]\nlisten = ["{endpoint}"]\nidentity = "{identity}"\n')
    return path
