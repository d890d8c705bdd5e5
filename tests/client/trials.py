"""Figures of the transport: `python -m tests.client.trials`.

Every line of the table is a trial with real processes on this machine, over its loopback interface.
"""

import json
import signal
import statistics
import sys
import time
from collections.abc import Callable

from ghest_rt.client import ConnectionChanged, GhestClient
from tests.client.fakes import FakeStation, Network, Told
from tests.client.processes import answer, process, tell
from tests.endpoints import free_endpoint

PERIOD_S = 1 / 66.6
REPEATS = 5


def ten_thousand(way: str) -> str:
    """10,000 samples as fast as one after the other is published, to another process."""
    endpoint = free_endpoint()
    routers = [process("route", endpoint)] if way == "router" else []
    for router in routers:
        router.__enter__()
    with process("publish", endpoint, way, 10_000, 0.0003) as station, process("subscribe", endpoint, 9_999) as subscriber:
        tell(station)
        heard = json.loads(answer(subscriber))
    for router in routers:
        router.__exit__(None, None, None)
    seqs = heard["seqs"]
    missing = seqs[-1] - seqs[0] + 1 - len(seqs)
    before = f"{seqs[0]} published before the connection stood" if seqs[0] else "from the first one on"
    return f"{len(seqs)} received, {missing} missing, {heard['recovered']} of them asked for again; {before}"


def recovery(
    break_it: Callable[[], None], mend: Callable[[], None], station: FakeStation, endpoint: str
) -> tuple[float, int, int]:
    """Break for a second, mend; return seconds until a present sample is there again, samples recovered, and lost."""
    with GhestClient(endpoint) as client:
        told = Told(client.updates())
        station.publish_until(lambda: client.latest() is not None)
        break_it()
        station.publish_until(lambda: any(isinstance(u, ConnectionChanged) and not u.connected for u in told.all))
        station.publish(66, PERIOD_S)
        mended_s = time.monotonic()
        mend()
        station.publish_until(lambda: client.latest() is not None, period_s=0.002)
        back_s = time.monotonic() - mended_s
        station.publish_until(lambda: told.seqs()[-1] >= station.next_seq - 2)
        return back_s, sum(sample.recovered for sample in told.samples()), sum(gap.count for gap in told.gaps())


def cut_network() -> str:
    """The connection breaks and cannot be made for a second."""
    results = []
    for _ in range(REPEATS):
        with FakeStation() as station, Network(station.endpoint) as network:
            results.append(recovery(network.cut, network.mend, station, network.endpoint))
    return summary(results)


def restart_router() -> str:
    """The router between station and client is killed, and another one started after a second."""
    results = []
    for _ in range(REPEATS):
        endpoint = free_endpoint()
        with process("route", endpoint) as router, FakeStation(router=endpoint) as station:
            second = process("route", endpoint)
            results.append(recovery(router.kill, second.__enter__, station, endpoint))
            second.__exit__(None, None, None)
    return summary(results)


def summary(results: list[tuple[float, int, int]]) -> str:
    back_s = [result[0] for result in results]
    recovered, lost = (sum(result[k] for result in results) for k in (1, 2))
    worst = f"worst of {REPEATS}: {max(back_s):.2f} s"
    return f"live again after {statistics.median(back_s):.2f} s ({worst}); {recovered} recovered, {lost} lost"


def hanging() -> str:
    """What publishing takes beside a stopped subscriber whose connection is full, against without it, taken in turns."""
    with FakeStation() as station, process("hang", station.endpoint) as stopped:
        alone = measure(station)
        stopped.send_signal(signal.SIGSTOP)
        station.publish(12_000)  # more than the connection takes
        beside = measure(station)
        stopped.send_signal(signal.SIGCONT)
    with FakeStation() as station:
        again = measure(station)
    return f"alone {alone} µs, beside it {beside} µs, alone again {again} µs (p50 / p99 / max of {MEASURED})"


MEASURED = 400


def measure(station: FakeStation) -> str:
    took_us = []
    for _ in range(MEASURED):
        before_ns = time.perf_counter_ns()
        station.publish()
        took_us.append((time.perf_counter_ns() - before_ns) * 1e-3)
        time.sleep(PERIOD_S)
    took_us.sort()
    return f"{took_us[MEASURED // 2]:.0f} / {took_us[MEASURED * 99 // 100]:.0f} / {took_us[-1]:.0f}"


TRIALS: dict[str, Callable[[], str]] = {
    "10,000 samples to another process": lambda: ten_thousand("direct"),
    "the same through a router": lambda: ten_thousand("router"),
    "network cut for 1 s": cut_network,
    "router killed, another process started after 1 s": restart_router,
    "publishing beside a stopped subscriber": hanging,
}

if __name__ == "__main__":
    for name, trial in TRIALS.items():
        sys.stdout.write(f"| {name} | {trial()} |\n")
        sys.stdout.flush()
