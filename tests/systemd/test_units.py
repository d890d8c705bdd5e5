"""What systemd itself says of the units."""

import fnmatch
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from ghest_rt.cli.doctor.usb import usb_cameras
from tests.systemd.conftest import STATION, UNITS, Install, needs_systemd
from tests.systemd.system import TARGETS, analyze, other_station

LARGEST_EXPOSURE = 20  # tenths


@needs_systemd
def test_installed_units_verify_without_a_word(install: Install, root: Path, tmp_path: Path) -> None:
    assert install("--station", STATION, "--cpus", "1-2").returncode == 0
    assert install("--station", other_station(tmp_path / "other"), "--name", "bed-2").returncode == 0
    shutil.copytree(TARGETS, root / "usr/lib/systemd/system", symlinks=True)
    done = analyze("verify", f"--root={root}", "ghest-rt.service", "ghest-rt@bed-2.service")
    assert (done.returncode, done.stdout + done.stderr) == (0, "")


@needs_systemd
def test_verify_would_complain(install: Install, root: Path) -> None:
    install("--station", STATION)
    drop_in = root / "etc/systemd/system/ghest-rt.service.d/30-typo.conf"
    drop_in.parent.mkdir(exist_ok=True)
    drop_in.write_text("[Service]\nWatchdogSecs=3\n")
    shutil.copytree(TARGETS, root / "usr/lib/systemd/system", symlinks=True)
    assert "WatchdogSecs" in analyze("verify", f"--root={root}", "ghest-rt.service").stderr


@needs_systemd
@pytest.mark.parametrize("unit", ["ghest-rt.service", "ghest-rt@.service", "ghest-rt-gateway.service"])
def test_exposure_is_at_most_2(unit: str) -> None:
    done = analyze("security", "--offline=true", f"--threshold={LARGEST_EXPOSURE}", UNITS / unit)
    assert done.returncode == 0, done.stdout
    figure = re.search(r"Overall exposure level for \S+: (\d+\.\d)", done.stdout)
    assert figure is not None
    assert float(figure[1]) <= LARGEST_EXPOSURE / 10


def settings(unit: str) -> list[str]:
    lines = (UNITS / unit).read_text().splitlines()
    return [line for line in lines if line and not line.startswith("#")]


def test_the_template_is_the_single_unit_with_a_name_in_it() -> None:
    single, template = settings("ghest-rt.service"), settings("ghest-rt@.service")
    assert [re.sub(r" \(%i\)|/%i", "", line) for line in template] == single
    assert sum("%i" in line for line in template) == 4


def test_devices_and_networks_that_sensors_need_are_allowed() -> None:
    lines = settings("ghest-rt.service")
    devices = {line.split("=")[1].split()[0] for line in lines if line.startswith("DeviceAllow=")}
    assert devices == {"char-usb_device", "char-video4linux", "char-ttyUSB", "char-ttyACM", "char-ttyS"}
    families = next(line for line in lines if line.startswith("RestrictAddressFamilies="))
    assert families.split("=")[1].split() == ["AF_UNIX", "AF_INET", "AF_INET6", "AF_NETLINK", "AF_CAN"]
    assert not any(line.startswith(("PrivateDevices=yes", "PrivateNetwork=yes", "RestrictRealtime=yes")) for line in lines)


def test_udev_knows_the_cameras_that_the_doctor_knows(tmp_path: Path) -> None:
    rules = (UNITS / "70-ghest-rt.rules").read_text()
    patterns = re.search(r'ATTR\{idVendor\}=="8086", ATTR\{idProduct\}=="([^"]+)"', rules)
    assert patterns is not None
    for product in ("0aa5", "0b48", "0b5b", "0ad3", "0b07", "0b3a", "0b64", "1234", "0a2b"):
        device = tmp_path / product
        device.mkdir()
        (device / "idVendor").write_text("8086\n")
        (device / "idProduct").write_text(f"{product}\n")
        known = bool(usb_cameras(tmp_path))
        assert any(fnmatch.fnmatch(product, pattern) for pattern in patterns[1].split("|")) == known, product
        shutil.rmtree(device)


@pytest.mark.skipif(
    shutil.which("udevadm") is None
    or "verify" not in subprocess.run(["udevadm", "--help"], capture_output=True, text=True, check=False).stdout,
    reason="udevadm verify came with systemd 254",
)
def test_udev_rules_verify() -> None:
    done = subprocess.run(
        ["udevadm", "verify", str(UNITS / "70-ghest-rt.rules")], capture_output=True, text=True, timeout=30, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
