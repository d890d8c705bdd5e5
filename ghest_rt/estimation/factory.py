"""Which estimator the station file asks for."""

from collections.abc import Mapping, Sequence
from typing import Literal

from ghest_rt.config.station import StationConfig
from ghest_rt.estimation.arm_chain import CAMERAS, ArmChain
from ghest_rt.estimation.fused.estimator import FusedEstimator
from ghest_rt.estimation.fused.reference import Reference
from ghest_rt.estimation.interface import GhEstimator
from ghest_rt.estimation.paper import PaperEstimator
from ghest_rt.estimation.refined import RefinedEstimator

EstimatorMethod = Literal["paper", "refined", "photometric", "fused"]


def make_estimator(
    config: StationConfig,
    urdf_text: str,
    source: str,
    encoder_joints: Sequence[str],
    *,
    method: EstimatorMethod | None = None,
    frame_rate_hz: Mapping[str, float] | None = None,
) -> GhEstimator:
    """Make the estimator for a station.

    Args:
        config: The station file.
        urdf_text: The URDF it names.
        source: Where the URDF came from, for messages.
        encoder_joints: The joints that the encoder link sends, in its order.
        method: Overrides `estimator.method`; "photometric" estimates as "refined" does, from better markers.
        frame_rate_hz: Nominal frame rate of each camera; the publishing rate where it is not given.

    Raises:
        BadInputError: The encoder link's joints are not the station file's, or the URDF does not fit the station.
    """
    chain = ArmChain(config, urdf_text, source, encoder_joints)
    max_gap_ns = round(config.estimator.max_gap_ms * 1e6)
    rates = frame_rate_hz or {}
    period_ns = {camera: round(1e9 / (rates.get(camera) or config.rate_hz)) for camera in CAMERAS}
    chosen = method or config.estimator.method
    if chosen == "paper":
        return PaperEstimator(chain, max_gap_ns, period_ns)
    if chosen == "fused":
        reference = Reference.of(config.calibration)
        return FusedEstimator(chain, max_gap_ns, period_ns, arm_length_m=config.calibration.arm_length_m, reference=reference)
    return RefinedEstimator(chain, max_gap_ns, period_ns, config.estimator.encoder_pairing)
