"""What the operating system does to punctuality: clocks, sleep states, processors set aside, swapping, quotas, ticks.

`docs/real-time.md` explains every finding. None of them stops the service.
"""

import asyncio
import time
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from ghest_rt.cli.doctor.findings import Finding, note, ok
from ghest_rt.service.alarm import make_alarm
from ghest_rt.service.pacing import Pacer
from ghest_rt.service.process import punctual_process
from ghest_rt.sync.grid import Grid

_GOOD_CLOCKS = ("tsc", "kvm-clock", "arch_sys_counter", "hyperv_clocksource_tsc_page")
_USBFS_MB = 256  # two cameras fill the kernel's 16
_SLACK_NS = 50_000
_IDLE_US = 200
_SWAPPINESS = 10
_SPARE_MB = 500
_TICK_HZ = 66.6
_TICK_S = 1.0
_LATE_US = 2000.0

Check = Callable[[Path], Finding | None]


def check_host(root: Path = Path("/")) -> Iterator[Finding]:
    """Look at the kernel's settings below `root`; what a machine does not tell is left out."""
    checks: tuple[Check, ...] = (
        _governor,
        _idle_states,
        _clock_source,
        _timer_slack,
        _rt_share,
        _cpus_set_aside,
        _cpu_quota,
        _swapping,
        _memory,
        _usb_memory,
    )
    yield from (finding for check in checks if (finding := check(root)) is not None)


def check_ticks(seconds: float = _TICK_S) -> Finding:
    """Let the service's own pacer tick for a while and tell how late it was."""
    with punctual_process():
        pacer = asyncio.run(_tick(seconds))
    p50_us, p99_us, max_us = pacer.recent.percentiles_us((50.0, 99.0, 100.0))
    detail = f"{pacer.ticks} ticks at {_TICK_HZ} Hz: late p50 {p50_us:.0f}, p99 {p99_us:.0f}, largest {max_us:.0f} µs"
    if pacer.missed or p99_us > _LATE_US:
        missed = f", {pacer.missed} missed" if pacer.missed else ""
        return note("ticks", detail + missed, "the machine is busy, or not tuned: docs/real-time.md, 'Host tuning'")
    return ok("ticks", detail)


async def _tick(seconds: float) -> Pacer:
    pacer = Pacer(time.monotonic_ns, lambda t_ns: t_ns, lambda k, t_ns: None)
    alarm = make_alarm(asyncio.get_running_loop(), pacer.wake)
    pacer.start(Grid(time.monotonic_ns(), _TICK_HZ), alarm)
    await asyncio.sleep(seconds)
    pacer.stop()
    alarm.close()
    return pacer


def _governor(root: Path) -> Finding | None:
    found = {_text(path) for path in root.glob("sys/devices/system/cpu/cpu[0-9]*/cpufreq/scaling_governor")} - {""}
    if not found:
        return None
    detail = ", ".join(sorted(found))
    if found == {"performance"}:
        return ok("CPU frequency governor", detail)
    return note("CPU frequency governor", detail, "cpupower frequency-set -g performance")


def _idle_states(root: Path) -> Finding | None:
    deepest_us, name = 0, ""
    for state in root.glob("sys/devices/system/cpu/cpu0/cpuidle/state*"):
        latency_us = _number(state / "latency")
        if _text(state / "disable") != "1" and latency_us is not None and latency_us > deepest_us:
            deepest_us, name = latency_us, _text(state / "name")
    if not name:
        return None
    detail = f"deepest {name}, {deepest_us} µs to wake up"
    return note("CPU sleep", detail, f"cpupower idle-set -D {_IDLE_US}") if deepest_us > _IDLE_US else ok("CPU sleep", detail)


def _clock_source(root: Path) -> Finding | None:
    source = _text(root / "sys/devices/system/clocksource/clocksource0/current_clocksource")
    if not source:
        return None
    if source in _GOOD_CLOCKS:
        return ok("clock source", source)
    return note("clock source", f"{source}: reading the time is slow", "see dmesg why the kernel gave up tsc (often: firmware)")


def _timer_slack(root: Path) -> Finding | None:
    slack_ns = _number(root / "proc/self/timerslack_ns")
    if slack_ns is None:
        return None
    detail = f"{slack_ns / 1000:g} µs"
    if slack_ns <= _SLACK_NS:
        return ok("timer slack", detail)
    return note("timer slack", detail, "TimerSlackNSec=50us in the unit, or start the service from another parent")


def _rt_share(root: Path) -> Finding | None:
    runtime_us, period_us = (_number(root / "proc/sys/kernel" / name) for name in ("sched_rt_runtime_us", "sched_rt_period_us"))
    if runtime_us is None or not period_us:
        return None
    if runtime_us == 0:
        return note("real-time share", "none: real-time threads never run", "sysctl kernel.sched_rt_runtime_us=950000")
    return ok("real-time share", "unlimited" if runtime_us < 0 else f"{100 * runtime_us / period_us:.0f} % of each CPU")


def _cpus_set_aside(root: Path) -> Finding:
    isolated = cpus_of(_text(root / "sys/devices/system/cpu/isolated"))
    allowed = cpus_of(_status_line(root, "Cpus_allowed_list"))
    everything = cpus_of(_text(root / "sys/devices/system/cpu/online"))
    if isolated:
        if len(isolated) < 2:
            return note("CPUs set aside", _listed(isolated), "two cameras need two: isolcpus= with at least two CPUs")
        return ok("CPUs set aside", f"{_listed(isolated)}; used with ghest-rt install-service --cpus {_listed(isolated)}")
    if allowed and everything and len(allowed) < len(everything):
        return ok("CPUs set aside", f"this process may use {_listed(allowed)} of {_listed(everything)}")
    return note("CPUs set aside", "none: the service shares all with everything else", "ghest-rt install-service --cpus LIST")


def _cpu_quota(root: Path) -> Finding | None:
    group = _text(root / "proc/self/cgroup").rpartition(":")[2].strip("/")
    limit = _text(root / "sys/fs/cgroup" / group / "cpu.max") or _text(root / "sys/fs/cgroup/cpu.max")
    quota, _, period = limit.partition(" ")
    if not quota.isdigit() or not period.isdigit():
        return None
    detail = f"{int(quota) / int(period):g} CPUs for this process and those beside it: it is stopped when they are used up"
    return note("CPU quota", detail, "CPUQuota= (systemd) or --cpus (containers): take it away, set CPUs aside instead")


def _swapping(root: Path) -> Finding | None:
    swap_kb, swappiness = _meminfo(root).get("SwapTotal"), _number(root / "proc/sys/vm/swappiness")
    if swap_kb is None or swappiness is None:
        return None
    if not swap_kb:
        return ok("swap", "none")
    detail = f"{swap_kb // 1024} MB, swappiness {swappiness}"
    return ok("swap", detail) if swappiness <= _SWAPPINESS else note("swap", detail, f"sysctl vm.swappiness={_SWAPPINESS}")


def _memory(root: Path) -> Finding | None:
    available_kb = _meminfo(root).get("MemAvailable")
    if available_kb is None:
        return None
    detail = f"{available_kb // 1024} MB available"
    if available_kb >= _SPARE_MB * 1024:
        return ok("memory", detail)
    return note("memory", detail, "end other programs: a station with two cameras takes 200 to 400 MB")


def _usb_memory(root: Path) -> Finding | None:
    memory_mb = _number(root / "sys/module/usbcore/parameters/usbfs_memory_mb")
    if memory_mb is None:
        return None
    if memory_mb == 0 or memory_mb >= _USBFS_MB:
        return ok("USB transfer memory", "unlimited" if memory_mb == 0 else f"{memory_mb} MB")
    remedy = f"ghest-rt install-service sets it; or: echo {_USBFS_MB} > /sys/module/usbcore/parameters/usbfs_memory_mb"
    return note("USB transfer memory", f"{memory_mb} MB: two cameras fill it", remedy)


def cpus_of(text: str) -> frozenset[int]:
    """Return the CPUs of a kernel list like "0-2,5"; what is malformed counts as none."""
    found: set[int] = set()
    for part in text.split(","):
        first, _, last = part.strip().partition("-")
        if first.isdigit() and (not last or last.isdigit()):
            found.update(range(int(first), int(last or first) + 1))
    return frozenset(found)


def _listed(cpus: Iterable[int]) -> str:
    ranges: list[list[int]] = []
    for cpu in sorted(cpus):
        if ranges and cpu == ranges[-1][1] + 1:
            ranges[-1][1] = cpu
        else:
            ranges.append([cpu, cpu])
    return ",".join(str(first) if first == last else f"{first}-{last}" for first, last in ranges)


def _meminfo(root: Path) -> dict[str, int]:
    lines = (line.partition(":") for line in _text(root / "proc/meminfo").splitlines())
    return {name: int(value.split()[0]) for name, _, value in lines if value.split()[:1] and value.split()[0].isdigit()}


def _status_line(root: Path, name: str) -> str:
    lines = _text(root / "proc/self/status").splitlines()
    return next((line.partition(":")[2].strip() for line in lines if line.startswith(f"{name}:")), "")


def _number(path: Path) -> int | None:
    text = _text(path)
    return int(text) if text.lstrip("-").isdigit() else None


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8", errors="replace").strip()
    except OSError:
        return ""
