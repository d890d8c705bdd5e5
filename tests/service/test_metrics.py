"""The endpoint for Prometheus: what it says, who may reach it, and that nobody can hold it up for long."""

import socket
import subprocess
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import pytest
from pydantic import ValidationError

pytest.importorskip("prometheus_client", reason="needs the extra metrics")

from prometheus_client.parser import text_string_to_metric_families

from ghest_rt.config.metrics import Address, Metrics
from ghest_rt.config.shipped import shipped_config_dir
from ghest_rt.messages.published import Event, EventKind, Health, InputState
from ghest_rt.service.health import HealthMeter, SampleCounts
from ghest_rt.service.inputs import InputCounters
from ghest_rt.service.metrics import MetricsEndpoint
from ghest_rt.service.pacing import Pacer
from tests.endpoints import free_port
from tests.program import COMMAND


def health() -> Health:
    pacer = Pacer(lambda: 0, lambda t_ns: t_ns, lambda k, t_ns: None)
    for lateness_us in (10, 100, 100, 5000):
        pacer.lateness.add(lateness_us * 1000)
    counters = InputCounters(state=InputState.SILENT, received=70, missing=3, newest_ns=10**9)
    return HealthMeter(0, SampleCounts(), pacer, {"r0": counters}).measure(0, 2 * 10**9, 0)


@pytest.fixture
def endpoint() -> Iterator[MetricsEndpoint]:
    with MetricsEndpoint("bed-1", Address("127.0.0.1", 0)) as endpoint:
        yield endpoint


def scrape(endpoint: MetricsEndpoint) -> dict[tuple[str, tuple[tuple[str, str], ...]], float]:
    with urllib.request.urlopen(endpoint.url, timeout=10) as answer:
        text = answer.read().decode()
    return {
        (sample.name, tuple(sorted(sample.labels.items()))): sample.value
        for family in text_string_to_metric_families(text)
        for sample in family.samples
    }


def test_it_answers_before_there_is_anything_to_tell(endpoint: MetricsEndpoint) -> None:
    values = scrape(endpoint)
    assert next(labels for name, labels in values if name == "ghest_info")[0] == ("station", "bed-1")


def test_prometheus_reads_what_health_says(endpoint: MetricsEndpoint) -> None:
    endpoint.health(health())
    endpoint.event(
        Event(run_id="r", seq=0, t_ns=0, t_unix_ns=0, severity="error", kind=EventKind.INPUT_LOST, source="r0", message="")
    )
    values = scrape(endpoint)
    assert values["ghest_input_received_total", (("input", "r0"),)] == 70
    assert values["ghest_input_state", (("input", "r0"), ("state", "silent"))] == 1
    assert values["ghest_input_state", (("input", "r0"), ("state", "streaming"))] == 0
    assert values["ghest_input_age_seconds", (("input", "r0"),)] == pytest.approx(1.0)
    assert values["ghest_tick_lateness_seconds_count", ()] == 4
    assert values["ghest_tick_lateness_seconds_bucket", (("le", "0.000128"),)] == 3
    assert values["ghest_tick_lateness_seconds_bucket", (("le", "+Inf"),)] == 4
    assert values["ghest_events_total", (("kind", "input_lost"), ("severity", "error"), ("source", "r0"))] == 1
    assert 0 <= values["ghest_health_age_seconds", ()] < 60


def test_only_the_metrics_are_served(endpoint: MetricsEndpoint) -> None:
    for path in ("/etc/passwd", "/metrics/../secret"):
        with pytest.raises(urllib.error.HTTPError, match="404"):
            urllib.request.urlopen(endpoint.url.replace("/metrics", path), timeout=10)


def test_a_client_that_dawdles_is_hung_up_on(endpoint: MetricsEndpoint) -> None:
    host, port = endpoint.url.removeprefix("http://").removesuffix("/metrics").split(":")
    with socket.create_connection((host, int(port))) as slow:
        slow.settimeout(20)
        slow.sendall(b"GET /metrics HTTP/1.0\r\n")
        start_s = time.monotonic()
        scrape(endpoint)  # waits for its turn
        assert time.monotonic() - start_s < 10
        assert slow.recv(1) == b""
    started_s = time.monotonic()
    endpoint.health(health())  # what the loop does
    assert time.monotonic() - started_s < 1


def test_a_taken_port_is_told_and_the_service_does_without(endpoint: MetricsEndpoint, caplog: pytest.LogCaptureFixture) -> None:
    port = int(endpoint.url.split(":")[2].removesuffix("/metrics"))
    with MetricsEndpoint("bed-2", Address("127.0.0.1", port)) as second:
        assert second.url == ""
        second.health(health())
    assert "metrics.listen" in caplog.text


@pytest.mark.parametrize("listen", ["127.0.0.1:9464", "[::1]:9464", "localhost:0"])
def test_addresses_of_this_machine_are_taken(listen: str) -> None:
    address = Metrics(listen=listen).address
    assert address is not None
    assert f"{address.port}" == listen.rpartition(":")[2]


@pytest.mark.parametrize("listen", ["0.0.0.0:9464", "[::]:9464", "10.0.0.7:9464", "clinic-server:9464"])
def test_other_machines_are_refused_unless_said(listen: str) -> None:
    with pytest.raises(ValidationError, match="beyond_loopback"):
        Metrics(listen=listen)
    assert Metrics(listen=listen, beyond_loopback=True).address is not None


@pytest.mark.parametrize("listen", ["9464", "127.0.0.1", "127.0.0.1:99999", "http://127.0.0.1:1/"])
def test_a_malformed_address_is_refused(listen: str) -> None:
    with pytest.raises(ValidationError, match="host:port"):
        Metrics(listen=listen)


def test_a_running_service_can_be_scraped(tmp_path: Path) -> None:
    pytest.importorskip("mujoco", reason="needs the extra sim")
    config = shipped_config_dir()
    (tmp_path / "armeo_spring.urdf").write_text((config / "armeo_spring.urdf").read_text())
    port = free_port()
    station = tmp_path / "station.toml"
    station.write_text((config / "station-sim.toml").read_text() + f'\n[metrics]\nlisten = "127.0.0.1:{port}"\n')
    service = subprocess.Popen(
        [*COMMAND, "run", "--station", station, "--no-publish"],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )
    deadline_s = time.monotonic() + 30
    text = ""
    try:
        while "ghest_input_received_total" not in text:
            assert time.monotonic() < deadline_s
            assert service.poll() is None
            try:
                with urllib.request.urlopen(f"http://127.0.0.1:{port}/metrics", timeout=10) as answer:
                    text = answer.read().decode()
            except urllib.error.URLError:
                time.sleep(0.1)
    finally:
        service.terminate()
        service.communicate(timeout=20)
    assert 'ghest_samples_total{status="valid"}' in text
