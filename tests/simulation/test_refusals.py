"""What the simulation refuses: options without effect or beyond their range, and stations that it cannot set up."""

import os
from dataclasses import replace
from pathlib import Path

import pytest

from ghest_rt.config.shipped import shipped_config_dir
from ghest_rt.errors import BadInputError, GhestError
from ghest_rt.simulation.command import simulate
from ghest_rt.simulation.disturbances import parse_shift
from ghest_rt.simulation.faults import parse_fault
from ghest_rt.simulation.options import SimulateOptions

KNEE = shipped_config_dir() / "examples" / "knee" / "station.toml"


def refuse(out: Path, told: str, **more: object) -> None:
    options = replace(SimulateOptions(out=out, movement="COMB", duration_s=0.2), **more)  # type: ignore[arg-type]
    with pytest.raises(BadInputError, match=told):
        simulate(options, lambda _: None)
    assert not list(out.parent.glob("*.mcap*"))


@pytest.mark.parametrize(
    ("more", "told"),
    [
        ({"seed": 10**23}, r"--seed 1000\d+: give a whole number from 0 to 9223372036854775807"),
        ({"seed": -1}, r"--seed -1: give a whole number from 0"),
        ({"duration_s": float("inf")}, r"--duration inf: give a positive number of seconds"),
        ({"faults": (parse_fault("drop:r0:1"),)}, r"camera r0 would deliver no frame at all: drop fewer"),
        ({"faults": (parse_fault("blind:r1:0.2:1"),)}, r"--fault blind:r1:0.2:1: begins after the end, 0.2 s"),
        ({"marker_moves": (parse_shift("m1:x:0.02@0.2"),)}, r"--marker-shift m1:x:0.02@0.2: begins after the end, 0.2 s"),
        (
            {"marker_moves": (parse_shift("m1:x:0.06"), parse_shift("m1:x:0.05"))},
            r"--marker-shift m1:x:0.06, m1:x:0.05: together 0.11 m: stay within 0.1 m",
        ),
    ],
)
def test_numbers_beyond_their_range_are_told_with_the_option(tmp_path: Path, more: dict[str, object], told: str) -> None:
    refuse(tmp_path / "a.mcap", told, **more)


@pytest.mark.parametrize(
    ("more", "told"),
    [
        ({"movement": "SFE"}, "--movement SFE: no use"),
        ({"motion": Path("nope.mot")}, "--motion nope.mot: no use"),
        ({"arm": "left"}, "--arm left: no use"),
        ({"height_m": 1.9}, "--height 1.9: no use"),
        ({"calibration_reference": True}, "--calibration-reference: no use"),
        ({"seed": -1}, "--seed -1"),
    ],
)
def test_the_knee_refuses_what_would_have_no_effect(tmp_path: Path, more: dict[str, object], told: str) -> None:
    refuse(tmp_path / "a.mcap", told, **{"movement": None, "station": KNEE, **more})


def test_another_ending_is_refused(tmp_path: Path) -> None:
    refuse(tmp_path / "a.txt", r"a.txt: a recording ends in .mcap")


@pytest.fixture
def station(tmp_path: Path) -> Path:
    folder = tmp_path / "station"
    folder.mkdir()
    for name in ("station-sim.toml", "armeo_spring.urdf"):
        (folder / name).write_text((shipped_config_dir() / name).read_text(encoding="utf-8"), encoding="utf-8")
    return folder / "station-sim.toml"


@pytest.mark.parametrize(
    ("file", "change", "told"),
    [
        ("station-sim.toml", ('link = "l8"', 'link = "l99"'), r'cameras.r1.link: the URDF has no link "l99"; it has l0, l1'),
        ("station-sim.toml", ('link = "l8"', 'link = "thorax"'), r'cameras.r1.link: the URDF has no link "thorax"'),
        ("armeo_spring.urdf", ('"l5"', '"elbow"'), r"no link l5, which the simulated patient's cuffs are fixed to"),
        ("armeo_spring.urdf", ('"j9"', '"wrist"'), r"the URDF has no joint j9"),
        ("armeo_spring.urdf", ('"l10"', '"thorax"'), r"the exoskeleton's URDF cannot be simulated: .*thorax"),
    ],
)
def test_a_station_that_cannot_be_set_up_is_told_with_the_place(
    tmp_path: Path, station: Path, file: str, change: tuple[str, str], told: str
) -> None:
    changed = station.with_name(file)
    changed.write_text(changed.read_text(encoding="utf-8").replace(*change), encoding="utf-8")
    refuse(tmp_path / "a.mcap", told, station=station)


def test_what_an_interruption_or_a_full_disk_leaves_is_removed_and_an_older_recording_kept(tmp_path: Path) -> None:
    out = tmp_path / "a.mcap"
    out.write_bytes(b"older")

    def interrupt(_: float) -> None:
        raise KeyboardInterrupt

    options = SimulateOptions(out=out, movement="COMB", duration_s=0.1)
    with pytest.raises(KeyboardInterrupt):
        simulate(options, interrupt)
    assert [path.name for path in tmp_path.iterdir()] == ["a.mcap"]
    (tmp_path / f"a.mcap.{os.getpid()}.part").symlink_to("/dev/full")
    with pytest.raises(GhestError, match=r"a.mcap: cannot write the recording: No space left on device; nothing is left"):
        simulate(options, lambda _: None)
    assert [path.name for path in tmp_path.iterdir()] == ["a.mcap"]
    assert out.read_bytes() == b"older"
