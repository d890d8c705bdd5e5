"""The live loop while a peer of the clinic floods its gateway, beside the same flood against a decoy's gateway.

The flooder runs on the same cores as the service, which it would not in a clinic; the decoy, another gateway before a station
that only answers, takes that out of the comparison: in both runs the machine has the same to do, but only in one does the
service have to do with it. The flooder is therapy software with a valid identity; the kind `handshakes` has none.
"""

import json
import socket
import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import psutil

from benchmarks.flooder import KINDS
from benchmarks.scenes import long_scene
from ghest_rt.security.authority import Authority
from ghest_rt.security.endpoints import split_endpoint
from ghest_rt.security.roles import Role

_COMMAND = (sys.executable, "-m", "ghest_rt.cli.main")
_FLOODER = (sys.executable, "-m", "benchmarks.flooder")
_SERVICE, _STATION = "tcp/127.0.0.1:17461", "tcp/127.0.0.1:17462"
_TARGET, _DECOY = "tls/127.0.0.1:17463", "tls/127.0.0.1:17464"
_WARM_UP_S = 2.0


def run(quick: bool) -> dict[str, Any]:
    """Flood by every kind for 20 s (quick: 5 s), the decoy's gateway and the service's by turns."""
    seconds = 5.0 if quick else 20.0
    recording = long_scene(seconds + _WARM_UP_S + 1.0)
    result: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as folder:
        authority = Authority.create(Path(folder) / "pki", "Benchmark", 10)
        router = authority.issue(Role.ROUTER, "hall", ("127.0.0.1",), 1)
        therapy = authority.issue(Role.THERAPY, "game-1", (), 1)
        for kind in KINDS:
            decoy, service = (_one(kind, seconds, recording, (router, therapy), flooded) for flooded in (_DECOY, _TARGET))
            ratio = round(service["p99_us"] / decoy["p99_us"], 2)
            result[kind] = {"decoy_flooded": decoy, "service_flooded": service, "ratio_p99": ratio}
    return result


def _one(kind: str, seconds: float, recording: Path, identities: tuple[Path, Path], flooded: str) -> dict[str, float]:
    router, therapy = (str(identity) for identity in identities)
    flood_command = [*_FLOODER, kind, flooded, therapy, str(seconds)]
    with ExitStack() as stack:

        def start(*command: str) -> "subprocess.Popen[bytes]":
            process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
            stack.callback(process.wait)
            stack.callback(process.terminate)
            return process

        start(*_FLOODER, "decoy", _STATION, therapy, str(10.0 * seconds))
        gateways = {
            outside: start(
                "nice", "-n", "10", *_COMMAND, "gateway", "--identity", router, "--listen", outside, "--station", inside
            )
            for outside, inside in ((_TARGET, _SERVICE), (_DECOY, _STATION))
        }
        for endpoint in (_TARGET, _DECOY):
            _wait_for(endpoint)
        service = start(*_COMMAND, "--replay", str(recording), "--listen", _SERVICE, "--json")
        _wait_for(_SERVICE)
        time.sleep(_WARM_UP_S)
        watched, gateway = psutil.Process(service.pid), psutil.Process(gateways[flooded].pid)
        before_s = _cpu_s(watched), _cpu_s(gateway)
        flood = subprocess.run(flood_command, stdout=subprocess.PIPE, check=True, timeout=seconds + 30.0)
        service_s, gateway_s = _cpu_s(watched) - before_s[0], _cpu_s(gateway) - before_s[1]
        memory_mb = watched.memory_info().rss / 1e6, gateway.memory_info().rss / 1e6
        report = json.loads(service.communicate()[0])["runs"][0]
    return {
        "sent_per_s": round(int(flood.stdout) / seconds),
        "p50_us": round(report["lateness"]["p50_us"]),
        "p99_us": round(report["lateness"]["p99_us"]),
        "missed_ticks": report["missed_ticks"],
        "valid_fraction": round(report["valid_fraction"], 4),
        "service_cores": round(service_s / seconds, 3),
        "service_mb": round(memory_mb[0], 1),
        "gateway_cores": round(gateway_s / seconds, 3),
        "gateway_mb": round(memory_mb[1], 1),
    }


def _cpu_s(process: psutil.Process) -> float:
    times = process.cpu_times()
    return float(times.user + times.system)


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
