"""Backends are found by name, imported only when chosen, and say what to install."""

import subprocess
import sys

import pytest

from ghest_drivers import factory
from ghest_drivers.clock import VirtualClock
from ghest_drivers.errors import DeviceNotFound
from ghest_drivers.factory import Backend, make_camera, make_encoders


def test_an_unknown_backend_is_told_with_those_there_are() -> None:
    with pytest.raises(DeviceNotFound, match=r"no camera backend 'kinect'; there are .*sim"):
        make_camera("kinect", "r0", VirtualClock(), {})


def test_a_missing_library_is_told_with_the_extra_that_brings_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(factory.ENCODERS, "rare", Backend("a_vendor_library_nobody_has", "Link", "rare"))
    with pytest.raises(DeviceNotFound, match=r"a_vendor_library_nobody_has.*pip install .*\[rare\]"):
        make_encoders("rare", VirtualClock(), {})


def test_a_library_that_the_backend_would_import_later_is_asked_for_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(factory.CAMERAS, "rare", Backend("builtins", "dict", "rare", ("sys", "a_library_nobody_has")))
    with pytest.raises(DeviceNotFound, match=r"rare needs a_library_nobody_has: pip install .*\[rare\]"):
        make_camera("rare", "r0", VirtualClock(), {})


def test_settings_reach_the_backend(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(factory.CAMERAS, "recorder", Backend("builtins", "dict"))
    clock = VirtualClock()
    assert make_camera("recorder", "r1", clock, {"serial": "7"}) == {"serial": "7", "name": "r1", "clock": clock}


def test_every_backend_of_the_tables_exists_without_its_library_being_imported() -> None:
    for backend in (*factory.CAMERAS.values(), *factory.ENCODERS.values()):
        code = f"import sys, ghest_drivers.factory\nsys.exit({backend.module!r} in sys.modules)"
        assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0, backend.module
