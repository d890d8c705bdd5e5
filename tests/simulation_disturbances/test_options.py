"""How disturbances are written on the command line, and what is said when they are written wrong."""

import math
from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import CliRunner

from ghest_rt.cli.main import app
from ghest_rt.errors import BadInputError
from ghest_rt.simulation.disturbances import RAMP_S, parse_shift, parse_turn
from ghest_rt.simulation.faults import FaultyDevices, parse_fault
from ghest_rt.simulation.soft_tissue import find_soft_tissue


def test_a_shift_is_in_metres_and_a_turn_in_degrees() -> None:
    shift, turn = parse_shift("m1:x:-0.02"), parse_turn("m0:z:5")
    assert (shift.marker, shift.axis, shift.amount, shift.start_s) == ("m1", 0, -0.02, None)
    assert (turn.marker, turn.axis) == ("m0", 2)
    assert turn.amount == pytest.approx(math.radians(5))


def test_a_drift_begins_smoothly_at_its_second_and_is_whole_a_ramp_later() -> None:
    move = parse_shift("m1:x:0.02@4")
    assert [move.at(t) for t in (-1.0, 0.0, 4.0)] == [0.0, 0.0, 0.0]
    assert move.at(4.0 + RAMP_S / 2) == pytest.approx(0.01)
    assert [move.at(t) for t in (4.0 + RAMP_S, 9.0)] == pytest.approx([0.02, 0.02])
    steps = [move.at(4.0 + 0.01 * k + 0.01) - move.at(4.0 + 0.01 * k) for k in range(-2, 102)]
    assert min(steps) >= 0.0
    assert max(steps) < 1.9 * 0.02 * 0.01 / RAMP_S
    assert parse_shift("m1:x:0.02").at(-1.0) == 0.02


@pytest.mark.parametrize(
    ("parse", "text", "told"),
    [
        (parse_shift, "m1:x", r"--marker-shift m1:x: 2 parts where 3 belong: give it as MARKER:AXIS:METRES"),
        (parse_shift, "m2:x:0.02", r"--marker-shift m2:x:0.02: marker 'm2' is unknown: give m0 or m1"),
        (parse_shift, "m1:w:0.02", r"axis 'w' is unknown: give x, y or z"),
        (parse_shift, "m1:x:20mm", r"metres '20mm' cannot be used: give a number from -0.1 to 0.1"),
        (parse_shift, "m1:x:20", r"metres '20' cannot be used"),
        (parse_shift, "m1:x:nan", r"metres 'nan' cannot be used"),
        (parse_shift, "m1:x:0.02@", r"start '' cannot be used: give the second of the movement"),
        (parse_shift, "m1:x:0.02@-1", r"start '-1' cannot be used"),
        (parse_turn, "m0:z:5:1", r"--marker-turn m0:z:5:1: 4 parts where 3 belong: give it as MARKER:AXIS:DEGREES"),
        (parse_turn, "m0:z:90", r"degrees '90' cannot be used: give a number from -60 to 60"),
        (parse_fault, "melt:r1:4", r"--fault melt:r1:4: fault 'melt' is unknown: give one of blind, depth-lost, drop"),
        (parse_fault, "blind:r1:4", r"--fault blind:r1:4: 2 values where 3 belong: give it as blind:CAMERA:START_S:DURATION_S"),
        (parse_fault, "blind:r1:x:1", r"START_S 'x' cannot be used: give a second of the movement"),
        (parse_fault, "depth-lost:r0:4:0", r"DURATION_S '0' cannot be used: give a positive number of seconds"),
        (parse_fault, "drop:r1:10", r"FRACTION '10' cannot be used: give a fraction of the frames from 0 to 1"),
        (parse_fault, "late:r1:0.1:-1", r"DELAY_S '-1' cannot be used"),
        (find_soft_tissue, "wobbly", r"--soft-tissue wobbly: unknown: give one of none, published, severe"),
    ],
)
def test_what_cannot_be_used_is_told_with_option_part_and_remedy(parse: Callable[[str], object], text: str, told: str) -> None:
    with pytest.raises(BadInputError, match=told):
        parse(text)


def test_a_fault_of_a_camera_that_is_not_there_is_told() -> None:
    with pytest.raises(BadInputError, match=r"--fault drop:r7:0.1: camera 'r7' is not in the station file: give one of r0, r1"):
        FaultyDevices((parse_fault("drop:r7:0.1"),), ("r0", "r1"), seed=0)


@pytest.mark.parametrize("words", [["--marker-shift", "m1"], ["--marker-turn", "m1:z"], ["--fault", "drop"]])
def test_the_command_refuses_before_it_writes_anything(tmp_path: Path, words: list[str]) -> None:
    out = tmp_path / "a.mcap"
    result = CliRunner().invoke(app, ["simulate", "--movement", "SIR", "--out", str(out), *words])
    assert isinstance(result.exception, BadInputError)
    assert str(result.exception).startswith(" ".join(words))
    assert not out.exists()
