"""What the calibration session saw besides the markers: in the station file, and held against a session."""

import math
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from ghest_rt.config.load import load_station
from ghest_rt.config.shipped import shipped_config_dir
from ghest_rt.config.station import CalibrationReference
from ghest_rt.estimation.fused.axial import AxialJudge
from ghest_rt.estimation.fused.reference import Reference
from ghest_rt.estimation.fused.tuning import Tuning
from ghest_rt.simulation.anatomy import anatomy
from ghest_rt.simulation.calibrating import with_reference

STATION: Path = shipped_config_dir() / "station-sim.toml"
MS = 1_000_000


def test_lengths_in_millimetres_are_refused() -> None:
    with pytest.raises(ValidationError, match="elbow_in_link_m is more than 1 m"):
        CalibrationReference(elbow_in_link_m=(12.0, -115.0, -10.0))


def test_the_simulated_clinic_keeps_what_it_saw_within_tolerance_and_by_seed() -> None:
    station, body = load_station(STATION), anatomy(1.75)
    found = [with_reference(station, body, seed, "SFE") for seed in (1, 1, 2)]
    said = [each.config.calibration.reference for each in found]
    assert said[0] == said[1]
    assert said[0].elbow_in_link_m != said[2].elbow_in_link_m
    assert with_reference(found[0], body, 2, "SFE") is found[0]
    places = np.array(
        [with_reference(station, body, seed, "COMB").config.calibration.reference.elbow_in_link_m for seed in range(12)]
    )
    assert np.all((places.std(axis=0) > 0.002) & (places.std(axis=0) < 0.010))


@pytest.mark.parametrize(("apart_deg", "taken"), [(0.0, False), (2.0, False), (9.0, True)])
def test_a_cuff_that_sits_elsewhere_is_taken_out_only_when_clear_but_never_ruled_out(apart_deg: float, taken: bool) -> None:
    judge = AxialJudge(Tuning(), Reference(forearm_rad=math.radians(1.5), forearm_sigma_rad=math.radians(2.0)))
    apart = math.radians(1.5 + apart_deg)
    for k in range(80):
        judge.add(k * 40 * MS, np.array([math.sin(apart), 0.0, math.cos(apart)]), 0.2 * math.sin(0.3 * k))
    offset_deg = math.degrees(judge.slip.offset_rad)
    assert (offset_deg > 4.0) if taken else (offset_deg == 0.0)
    assert math.degrees(math.sqrt(judge.slip.offset_variance)) > 0.3
