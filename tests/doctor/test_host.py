"""What the doctor says of the operating system, on machines made of files; and that the pacer can be measured."""

from pathlib import Path

import pytest

from ghest_rt.cli.doctor.findings import Finding, State
from ghest_rt.cli.doctor.host import check_host, check_ticks, cpus_of

TUNED = {
    "sys/devices/system/cpu/cpu0/cpufreq/scaling_governor": "performance",
    "sys/devices/system/cpu/cpu1/cpufreq/scaling_governor": "performance",
    "sys/devices/system/cpu/cpu0/cpuidle/state0/name": "C1",
    "sys/devices/system/cpu/cpu0/cpuidle/state0/latency": "2",
    "sys/devices/system/cpu/cpu0/cpuidle/state0/disable": "0",
    "sys/devices/system/cpu/cpu0/cpuidle/state1/name": "C10",
    "sys/devices/system/cpu/cpu0/cpuidle/state1/latency": "890",
    "sys/devices/system/cpu/cpu0/cpuidle/state1/disable": "1",
    "sys/devices/system/clocksource/clocksource0/current_clocksource": "tsc",
    "sys/devices/system/cpu/isolated": "2-3",
    "sys/devices/system/cpu/online": "0-3",
    "sys/module/usbcore/parameters/usbfs_memory_mb": "256",
    "sys/fs/cgroup/a.slice/cpu.max": "max 100000",
    "proc/self/cgroup": "0::/a.slice",
    "proc/self/status": "Name:\tpython\nCpus_allowed_list:\t0-3\n",
    "proc/self/timerslack_ns": "50000",
    "proc/sys/kernel/sched_rt_runtime_us": "950000",
    "proc/sys/kernel/sched_rt_period_us": "1000000",
    "proc/sys/vm/swappiness": "10",
    "proc/meminfo": "MemTotal: 16000000 kB\nMemAvailable: 8000000 kB\nSwapTotal: 2000000 kB\nHugePages_Total: 0\n",
}


def findings(tmp_path: Path, changes: dict[str, str | None]) -> dict[str, Finding]:
    for name, text in {**TUNED, **changes}.items():
        if text is not None:
            path = tmp_path / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text + "\n")
    return {finding.check: finding for finding in check_host(tmp_path)}


def test_a_tuned_machine_has_nothing_to_be_noted(tmp_path: Path) -> None:
    found = findings(tmp_path, {})
    assert len(found) == 9  # no quota: not mentioned
    assert [finding for finding in found.values() if finding.state is not State.OK] == []


@pytest.mark.parametrize(
    ("check", "changes", "words"),
    [
        ("CPU frequency governor", {"sys/devices/system/cpu/cpu1/cpufreq/scaling_governor": "powersave"}, "powersave"),
        ("CPU sleep", {"sys/devices/system/cpu/cpu0/cpuidle/state1/disable": "0"}, "C10, 890 µs"),
        ("clock source", {"sys/devices/system/clocksource/clocksource0/current_clocksource": "hpet"}, "hpet"),
        ("timer slack", {"proc/self/timerslack_ns": "5000000"}, "5000 µs"),
        ("real-time share", {"proc/sys/kernel/sched_rt_runtime_us": "0"}, "never run"),
        ("CPUs set aside", {"sys/devices/system/cpu/isolated": ""}, "shares all"),
        ("CPUs set aside", {"sys/devices/system/cpu/isolated": "3"}, "3"),
        ("CPU quota", {"sys/fs/cgroup/a.slice/cpu.max": "150000 100000"}, "1.5 CPUs"),
        ("swap", {"proc/sys/vm/swappiness": "60"}, "swappiness 60"),
        ("memory", {"proc/meminfo": "MemAvailable: 200000 kB\nSwapTotal: 0 kB"}, "195 MB"),
        ("USB transfer memory", {"sys/module/usbcore/parameters/usbfs_memory_mb": "16"}, "16 MB"),
    ],
)
def test_what_costs_punctuality_is_noted_with_a_remedy(
    tmp_path: Path, check: str, changes: dict[str, str | None], words: str
) -> None:
    finding = findings(tmp_path, changes)[check]
    assert finding.state is State.NOTE
    assert words in finding.detail
    assert finding.remedy
    assert finding.exit_code == 0


def test_what_a_machine_does_not_tell_is_left_out(tmp_path: Path) -> None:
    assert {finding.check for finding in check_host(tmp_path)} == {"CPUs set aside"}


def test_lists_of_cpus() -> None:
    assert cpus_of("0-2,5") == {0, 1, 2, 5}
    assert cpus_of("") == cpus_of("none") == frozenset()


def test_the_services_own_pacer_is_measured() -> None:
    finding = check_ticks(0.2)
    assert "ticks at 66.6 Hz" in finding.detail
    assert finding.exit_code == 0


def test_every_finding_is_explained_in_the_documentation(tmp_path: Path) -> None:
    text = (Path(__file__).parents[2] / "docs" / "real-time.md").read_text()
    checks = {*findings(tmp_path, {"sys/fs/cgroup/a.slice/cpu.max": "1 1"}), "ticks", "real-time priority", "locked memory"}
    assert [check for check in checks if f"**{check}**" not in text] == []
