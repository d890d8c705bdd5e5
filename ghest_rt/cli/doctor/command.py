"""`ghest-rt doctor`: look, say, and end with the right exit code."""

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from pathlib import Path

from rich.console import Console
from rich.table import Table
from rich.text import Text

from ghest_drivers.clock import MonotonicClock
from ghest_drivers.hardware.probe import probe
from ghest_rt.cli.console import print_json, printing
from ghest_rt.cli.doctor.checklist import Item, items_for
from ghest_rt.cli.doctor.devices import Present, check_present, check_station_devices, check_without_station
from ghest_rt.cli.doctor.findings import Finding, State, exit_code, missing
from ghest_rt.cli.doctor.host import check_host, check_ticks
from ghest_rt.cli.doctor.links import can_interfaces, serial_ports
from ghest_rt.cli.doctor.live import check_cameras, check_encoders
from ghest_rt.cli.doctor.machine import EXTRA_OF_BACKEND, check_endpoints, check_extras, check_machine, check_real_time
from ghest_rt.cli.doctor.station_file import look_at_station
from ghest_rt.cli.doctor.usb import usb_cameras
from ghest_rt.config.load import LoadedStation
from ghest_rt.config.station import Publisher
from ghest_rt.errors import BadInputError, GhestError
from ghest_rt.service.devices import make_devices

_STYLES = {State.OK: "green", State.NOTE: "yellow", State.MISSING: "bold red"}


def run_doctor(station_path: Path | None, live_s: float | None, as_json: bool) -> int:
    """Look at everything, print it, and return the exit code.

    Args:
        station_path: Station file whose needs are looked at; None: only what is there.
        live_s: Also open the station's devices for so long.
        as_json: Print one JSON document instead of a table.

    Raises:
        BadInputError: Devices shall be opened, but no station file says which.
    """
    if live_s is not None and station_path is None:
        raise BadInputError("--live opens the devices of a station: name it with --station FILE")
    findings, items = _look(station_path, live_s)
    code = exit_code(findings)
    if as_json:
        print_json(
            {
                "exit_code": code,
                "findings": [asdict(finding) for finding in findings],
                "checklist": [{"id": item.id, "what": item.what} for item in items],
            }
        )
    else:
        with printing():
            _print(Console(), findings, items, code)
    return code


def _look(station_path: Path | None, live_s: float | None) -> tuple[list[Finding], tuple[Item, ...]]:
    station, findings = look_at_station(station_path)
    backends = _backends(station)
    findings += check_machine()
    findings += check_extras(_extras(station, backends))
    findings += check_real_time()
    findings += check_host()
    findings.append(check_ticks())
    publisher = station.config.publisher if station is not None else Publisher()
    findings += check_endpoints(publisher.listen if publisher.enabled else ())
    present = _present()
    findings += check_present(present)
    if station is not None:
        findings += check_station_devices(station, present)
        if live_s is not None and exit_code(findings) == 0:
            findings += _live(station, live_s)
    elif station_path is None:
        findings += check_without_station(present)
    return findings, items_for(backends)


def _backends(station: LoadedStation | None) -> set[str]:
    if station is None:
        return set()
    config = station.config
    return {config.encoders.device.backend, *(camera.device.backend for camera in config.cameras.values())}


def _extras(station: LoadedStation | None, backends: set[str]) -> set[str]:
    needed = {EXTRA_OF_BACKEND[name] for name in backends if name in EXTRA_OF_BACKEND}
    if station is not None:
        config = station.config
        asked = {"security": config.publisher.identity or config.recorder.encrypt_to, "metrics": config.metrics.address}
        needed |= {extra for extra, wanted in asked.items() if wanted}
    return needed


def _present() -> Present:
    with ThreadPoolExecutor(2) as pool:
        realsense, oak = pool.submit(probe, "realsense"), pool.submit(probe, "oak")
        return Present(
            {"realsense": realsense.result(), "oak": oak.result()}, usb_cameras(), list(serial_ports()), list(can_interfaces())
        )


def _live(station: LoadedStation, seconds: float) -> Iterator[Finding]:
    if {"sim", "replay"} & _backends(station):
        yield missing("live", "the station is simulated or replayed", "take --live away, or name devices in the file", 2)
        return
    clock = MonotonicClock()
    try:
        cameras, encoders = make_devices(station, clock, {})
    except GhestError as error:
        yield missing("live", str(error), "correct the station file", error.exit_code)
        return
    yield from check_cameras(cameras, seconds, clock)
    yield check_encoders(encoders, seconds, clock)


def _print(console: Console, findings: list[Finding], items: tuple[Item, ...], code: int) -> None:
    table = Table(box=None, padding=(0, 2, 0, 0), show_header=False)
    for finding in findings:
        what = Text(finding.detail)
        if finding.remedy:
            what.append(f"\n→ {finding.remedy}", style="dim" if finding.state is State.NOTE else "")
        table.add_row(Text(finding.state, style=_STYLES[finding.state]), Text(finding.check), what)
    console.print(table)
    if items:
        console.print("\nTo be tried by hand, once per station (docs/hardware.md says how):")
        for item in items:
            console.print(Text(f"  [ ] {item.id}: {item.what}"))
    needed = [finding.check for finding in findings if finding.exit_code]
    verdict = f"Not ready: {', '.join(needed)}" if needed else "Ready."
    console.print(Text(f"\n{verdict}", style="bold red" if code else "bold green"))
