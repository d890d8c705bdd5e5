"""The elbow's angles of a simulated patient, whose strap holds the forearm 2.5 degrees off the module's axis."""

import math
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="needs the extra sim")

from ghest_rt.simulation.command import simulate
from ghest_rt.simulation.options import SimulateOptions
from ghest_rt.studies.score import run_with_truth, score_recording


@pytest.mark.parametrize("arm", ["right", "left"])
def test_flexion_and_pronation_are_those_of_the_patient(tmp_path: Path, arm: str) -> None:
    out = tmp_path / "comb.mcap"
    simulate(SimulateOptions(out=out, movement="COMB", duration_s=1.0, seed=31, arm=arm), lambda share: None)
    for method in ("refined", "fused"):
        run = run_with_truth(out, method)
        errors, pronations, sigmas = [], [], []
        for estimate in run.estimates:
            truth = run.truth.at(estimate.t_sample_ns)
            assert estimate.elbow is not None and estimate.elbow.sigma_rad is not None
            assert truth is not None and truth.elbow_rad is not None
            assert estimate.elbow.pronation_rad is not None
            errors.append(math.degrees(estimate.elbow.flexion_rad - truth.elbow_rad[0]))
            pronations.append(math.degrees(estimate.elbow.pronation_rad - truth.elbow_rad[1]))
            sigmas.append(math.degrees(estimate.elbow.sigma_rad[0]))
        assert 1.0 < float(np.mean(errors)) < 2.5  # the strap
        assert float(np.std(errors)) < 0.3
        assert float(np.abs(pronations).max()) < 0.2
        assert min(sigmas) > 2.9
        assert score_recording(out, method).elbow_flexion_rmse_deg == pytest.approx(np.sqrt(np.mean(np.square(errors))))
