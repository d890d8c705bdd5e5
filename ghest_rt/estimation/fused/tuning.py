"""What the filter believes before it has seen anything: noise, motion, drift. Sources in docs/fused-estimator.md."""

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Tuning:
    """Noise and priors of the filter; radians, metres, seconds.

    Attributes:
        rate_memory_s: Rates decay to zero with this time constant.
        jerk_s: Movement at full agility is as jerky as if each acceleration acted at once, for this time.
        jerky_agility: At this agility, half of that.
        rotation_density: Spectral density of rotational acceleration at agility 1, rad^2/s^3.
        position_density: The same of the GH centre, m^2/s^3.
        least_agility: The agility that remains at rest.
        starting_agility: The agility before anything is known.
        most_agility: The greatest agility, during movement that the model does not foresee.
        bridging_agility: The least agility of m0's and m1's body while the marker is not seen: what it does then is not known.
        agility_gain: How fast the agility follows the innovations.
        agility_fall: How fast it falls while the innovations are white.
        agility_rest: How much faster while the exoskeleton stands still.
        still_rad_s: Camera r1 turning slower than this is nearly still.
        forecast_doubt: Factor on the process noise after the newest sighting: nothing corrects a forecast that is published.
        rotation_floor_rad: Added to the standard deviation of every measured rotation.
        position_floor_m: Added to that of every measured position.
        encoder_m: Standard deviation of a marker's position in E that comes from the exoskeleton, resolution of encoders aside.
        encoder_rad: The same of its rotation.
        default_rotation_rad: Standard deviation of a measured rotation that comes without covariance.
        default_position_m: The same of a position.
        surprising: A normalised innovation squared above this is unforeseen movement, as far as a surge explains it.
        gate: Above this in spite of a whole surge, the measurement is an outlier (6 degrees of freedom).
        surge_rad: A movement no model foresees may turn a body by this much between frames.
        surge_m: And shift the GH centre by this much.
        surge_rate_rad_s: And change its rate by this much.
        surge_rate_m_s: And the GH centre's by this much.
        jump_count: This many outliers in a row that agree with each other are a marker that has jumped.
        jump_span_ns: Least time they must span.
        regain_count: After this many outliers in a row, alike or not, the marker is taken as it is seen.
        creep_m2_s: How fast the GH centre may creep in the frame of m0 and of m1, m^2/s.
        loose_m2_s: How much faster, times the slack, while the markers clearly contradict each other: either may be moving.
        slack_gain: How fast the creep grows while the markers contradict each other about the GH centre.
        slack_fall: How fast it falls while they do not.
        most_slack: The greatest factor on the creep.
        unknown_gh_m: Standard deviation of the GH centre in a marker's frame before anything is seen.
        slide_m: Standard deviation of a slide, if there is one, per axis: m0, m1.
        turn_rad: The same of a turn.
        calibrated_m: Slide that is calibration, not drift: the tolerance of the test.
        calibrated_rad: The same of the turn.
        exact_m: What is left of a slide where there is no drift.
        exact_rad: What is left of a turn where there is no drift.
        slide_cost: Twice the logarithm of the odds against a slide.
        turn_cost: Twice the logarithm of the odds against a turn: m0, m1.
        turn_doubt: Taken off the cost of a turn for the covariance: m0, m1.
        arm_length_m: Standard deviation of a calibrated arm length.
        axial_memory_s: The disagreement of forearm and m1 about the arm is averaged over this time; faster is movement.
        reference_s: Over this time at first it is learned how forearm and m1 agree, and where the elbow is.
        elbow_memory_s: Over which time the elbow's place is averaged after that.
        elbow_m: How far the elbow may wander in camera r1, per axis.
        elbow_lever_m: How much farther per radian that the arm turns there: the patient's axis is beside the exoskeleton's.
        axial_noise_rad2_s: Spectral density of the forearm's wander against the arm during movement.
        axial_tolerance_rad: What forearm and m1 may come to disagree by without a slip.
        carrying_rad: Standard deviation of the forearm out of the elbow frame's y-z plane: magnified as the elbow stretches.
        axial_shift_rad: Standard deviation of a slip of m1 about the arm, if there is one.
        axial_shift_cost: Twice the logarithm of the odds against it.
        axial_offset_rad: Standard deviation of a turn of m1 about the arm since the calibration, if there is one.
        axial_offset_cost: Twice the logarithm of the odds against it.
        axial_offset_doubt: Taken off that for the covariance.
        lag_memory_s: Over which time the lag of m1 behind the axial rotation is learned.
        lag_sigma: Standard deviation of that lag, if there is one, rad per rad.
        lag_tolerance: What the forearm may seem to lead by without a lag.
        lag_cost: Twice the logarithm of the odds against a lag.
        unknown_arm_length_m: Prior standard deviation of the arm length where it is not calibrated.
    """

    rate_memory_s: float = 3.0
    jerk_s: float = 0.02
    jerky_agility: float = 1000.0
    rotation_density: float = 2e-5
    position_density: float = 1e-5
    least_agility: float = 0.2
    starting_agility: float = 100.0
    most_agility: float = 1e6
    bridging_agility: tuple[float, float] = (1000.0, 300.0)
    agility_gain: float = 0.15
    agility_fall: float = 0.3
    agility_rest: float = 0.2
    still_rad_s: float = 0.03
    forecast_doubt: float = 5.0
    rotation_floor_rad: float = math.radians(0.003)
    position_floor_m: float = 3e-6
    encoder_m: float = 3e-5
    encoder_rad: float = math.radians(0.002)
    default_rotation_rad: float = math.radians(0.3)
    default_position_m: float = 5e-4
    surprising: float = 22.0
    gate: float = 45.0
    surge_rad: float = 0.01
    surge_m: float = 0.0015
    surge_rate_rad_s: float = 1.0
    surge_rate_m_s: float = 0.1
    jump_count: int = 4
    jump_span_ns: int = 40_000_000
    regain_count: int = 8
    creep_m2_s: tuple[float, float] = (3e-7, 3e-8)
    loose_m2_s: float = 3e-7
    slack_gain: float = 1.5
    slack_fall: float = 0.35
    most_slack: float = 3e3
    unknown_gh_m: float = 0.04
    slide_m: tuple[float, float] = (0.02, 0.015)
    turn_rad: tuple[float, float] = (math.radians(3.0), math.radians(3.0))
    calibrated_m: float = 1e-3
    calibrated_rad: float = math.radians(0.3)
    exact_m: float = 1e-5
    exact_rad: float = math.radians(0.005)
    slide_cost: float = 12.0
    turn_cost: tuple[float, float] = (21.0, 13.5)
    axial_memory_s: float = 1.0
    reference_s: float = 2.0
    elbow_memory_s: float = 0.3
    elbow_m: float = 0.0025
    elbow_lever_m: float = 0.015
    axial_noise_rad2_s: float = math.radians(0.5) ** 2 * 0.3
    axial_tolerance_rad: float = math.radians(1.0)
    carrying_rad: float = math.radians(5.0)
    axial_shift_rad: float = math.radians(8.0)
    axial_shift_cost: float = 8.0
    axial_offset_rad: float = math.radians(5.0)
    axial_offset_cost: float = 8.0
    axial_offset_doubt: float = 5.0
    lag_memory_s: float = 30.0
    lag_sigma: float = 0.3
    lag_tolerance: float = 0.04
    lag_cost: float = 8.0
    turn_doubt: tuple[float, float] = (15.0, 9.0)
    arm_length_m: float = 1e-3
    unknown_arm_length_m: float = 0.05
