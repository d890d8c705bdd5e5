"""The new station file is the old one with other numbers: comments stay, and what cannot be changed safely is refused."""

from difflib import unified_diff

import numpy as np
import pytest

from ghest_rt.calibration.station_text import rigid_rows, with_calibration
from ghest_rt.config.load import parse_station
from ghest_rt.config.shipped import shipped_config_dir
from ghest_rt.config.station import Calibration
from ghest_rt.errors import BadInputError
from ghest_rt.geometry.se3 import transform
from ghest_rt.geometry.so3 import exp_so3

SHIPPED = sorted(path.name for path in shipped_config_dir().glob("station-*.toml"))


def text_of(name: str) -> str:
    return (shipped_config_dir() / name).read_text(encoding="utf-8")


def other(text: str, **changes: object) -> Calibration:
    values: dict[str, object] = {
        "id": "tuesday",
        "m0_from_gh": rigid_rows(transform(exp_so3(np.array([0.1, 0.2, -0.3])), (0.01, -0.02, 0.03))),
        "m1_from_elw": rigid_rows(transform(exp_so3(np.array([-0.1, 0.05, 0.2])), (-0.04, 0.05, 0.06))),
        "arm_length_m": 0.3155,
        "reference": {"elbow_in_link_m": (0.012, -0.115, -0.01), "forearm_twist_deg": 1.5},
    }
    return Calibration.model_validate({**parse_station(text, "old").calibration.model_dump(), **values, **changes})


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_files_keep_every_line_but_the_calibrations(name: str) -> None:
    old = text_of(name)
    wanted = other(old)
    new = with_calibration(old, name, wanted, "from tuesday.mcap")
    assert parse_station(new, name) == parse_station(old, name).model_copy(update={"calibration": wanted})
    changes = [
        line
        for line in unified_diff(old.split("\n"), new.split("\n"), n=0)
        if line[:1] in "+-" and line[:3] not in ("---", "+++")
    ]
    gone = [line[1:].split(" = ")[0] for line in changes if line.startswith("-")]
    assert gone == ["id", "m0_from_gh", "m1_from_elw"]


def test_calibrating_again_replaces_what_was_found_before() -> None:
    old = text_of("station-sim.toml")
    once = with_calibration(old, "a", other(old), "from tuesday.mcap")
    twice = with_calibration(once, "a", other(once, id="friday", arm_length_m=0.32), "from friday.mcap")
    assert "tuesday" not in twice
    assert len(twice.split("\n")) == len(once.split("\n"))


def test_a_reference_that_is_there_keeps_its_tolerances_and_comments() -> None:
    old = (
        text_of("station-sim.toml")
        + "\n[calibration.reference]  # mine\nelbow_in_link_m = [0.0, 0.1, 0.0]  # m\nelbow_sigma_m = 0.008\n"
    )
    reference = {"elbow_in_link_m": (0.012, -0.115, -0.01), "elbow_sigma_m": 0.008, "forearm_twist_deg": 1.5}
    new = with_calibration(old, "a", other(old, reference=reference), "from tuesday.mcap")
    assert "[calibration.reference]  # mine\nelbow_in_link_m = [0.012, -0.115, -0.01]  # m\nelbow_sigma_m = 0.008\n" in new


def test_a_matrix_over_several_lines_is_replaced_whole() -> None:
    old = text_of("station-sim.toml").replace(
        "m0_from_gh = [[1.0, 0.0, 0.0, -0.055], [0.0",
        "m0_from_gh = [  # by hand\n  [1.0, 0.0, 0.0, -0.055],  # ] not the end\n  [0.0",
    )
    new = with_calibration(old, "a", other(old), "from tuesday.mcap")
    assert "by hand" not in new
    assert parse_station(new, "a").calibration == other(old)


def test_a_file_written_in_another_way_is_refused_and_not_spoilt() -> None:
    head, _, tail = text_of("station-sim.toml").partition("[calibration]\n")
    body, _, rest = tail.partition("[calibration.link_from_camera]")
    inline = "".join(f"calibration.{line}\n" for line in body.splitlines() if "=" in line and not line.startswith("#"))
    old = f"{inline}{head}[calibration.link_from_camera]{rest}"
    with pytest.raises(BadInputError, match=r"one key a line|not a valid"):
        with_calibration(old, "a", other(text_of("station-sim.toml")), "from tuesday.mcap")


def test_rounding_leaves_a_rotation_that_the_station_file_takes() -> None:
    rng = np.random.default_rng(3)
    for _ in range(200):
        rows = rigid_rows(transform(exp_so3(rng.uniform(-2.0, 2.0, 3)), rng.uniform(-0.3, 0.3, 3)))
        text = text_of("station-sim.toml")
        assert other(text, m0_from_gh=rows).m0_from_gh == rows
