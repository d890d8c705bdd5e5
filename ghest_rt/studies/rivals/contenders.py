"""Who is compared: titles, what each needs, what its own publication reports, and what to bear in mind."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Contender:
    """A method of the comparison.

    Attributes:
        key: Its name in results.
        title: Its name for readers.
        source: The publication it follows.
        published: What that publication reports.
        published_short: The same in a few words, degrees.
        published_deg: The figure of the GH rotation to set beside ours, degrees; None where none is published of it.
        lag_ms: How long after an instant its answer is published; None where the station file says.
        caveat: What makes the two figures incomparable, or favours one side.
        strength: What it rests on where it does better than `fused`.
        ours: Whether it is a method of this system.
    """

    key: str
    title: str
    source: str
    published: str
    published_short: str
    published_deg: float | None
    lag_ms: float | None
    caveat: str
    strength: str
    ours: bool = False


_SEEN_BY_NO_ENCODER = "the girdle's own turning is seen by no encoder"
_PAPER = "Cortés et al., Optical Enhancement of Exoskeleton-Based Estimation of Glenohumeral Angles, 2016"
_REAL_PEOPLE = "Cortés et al., BioMed Res. Int. 2016, 2581924, real people against optical motion capture"

CONTENDERS = {
    contender.key: contender
    for contender in (
        Contender(
            key="exoskeleton",
            title="exoskeleton joints alone",
            source="practice of the paper's [10-13]: SAA = j0 + j1, SFE = j2, SIER = j6",
            published=f"SFE 8.4, SAA 8.2, SIER 16.2° RMS ({_REAL_PEOPLE})",
            published_short="SFE 8.4, SAA 8.2, SIER 16.2",
            published_deg=None,
            lag_ms=20.0,
            caveat=(
                "here the cuffs do not slip on soft tissue, as they do on people; the joints are meant for an arm near level, "
                f"with a hanging arm they are not the arm's axes at all; {_SEEN_BY_NO_ENCODER}"
            ),
            strength="small movements about the posture it was zeroed in, with cuffs that do not slip",
        ),
        Contender(
            key="coupled_chain",
            title="coupled-chain IK (EIKPE)",
            source="the paper's [16], inverse kinematics of limb and exoskeleton as one closed chain",
            published=f"SFE 3.9, SAA 3.3, SIER 6.5° RMS ({_REAL_PEOPLE})",
            published_short="SFE 3.9, SAA 3.3, SIER 6.5",
            published_deg=None,
            lag_ms=20.0,
            caveat=(
                "favoured here: its cuffs are exactly those of the simulation, the patient's dimensions and GH centre are "
                f"given exactly; {_SEEN_BY_NO_ENCODER} beyond two degrees of freedom of the clavicle"
            ),
            strength="the simulated cuffs are exactly those of its model, and the girdle hardly moves",
        ),
        Contender(
            key="swivel",
            title="swivel angle, palm to head",
            source="the paper's [18, 19], redundancy criterion of Kim et al., IEEE TBME 59 (2012) 1770",
            published="swivel angle alone, reaching movements without exoskeleton: mean error below 5°",
            published_short="swivel angle < 5",
            published_deg=None,
            lag_ms=20.0,
            caveat=(
                "a model of unassisted reaching: here the exoskeleton carries the arm, and the elbow is where therapy puts it; "
                "exact in the neutral posture, by calibration"
            ),
            strength="small movements about the posture it was zeroed in",
        ),
        Contender(
            key="swivel_wrist",
            title="swivel angle with the wrist",
            source="the paper's [17, 20]; offset for the wrist's orientation of Kim and Rosen, J. Intell. Robot. Syst. 2015",
            published="GH angles 4.8° RMSE in the best case, swivel angle 10° RMSE over all tasks ([20] by section 4.4)",
            published_short="4.8 (best case)",
            published_deg=4.8,
            lag_ms=20.0,
            caveat=(
                "as for the swivel angle; the published weight of the wrist against the criterion does not carry over: both "
                "weigh the same here"
            ),
            strength="small movements about the posture it was zeroed in",
        ),
        Contender(
            key="aruco",
            title="ArUco, OpenCV's defaults",
            source="Garrido-Jurado et al. 2014, OpenCV; markers as large as the disks' square, colour images only",
            published="none for GH angles",
            published_short="",
            published_deg=None,
            lag_ms=None,
            caveat=(
                "everything behind the markers is this system's: the same cameras, calibration and estimator as refined; "
                "without depth the tilt of a marker seen from the front is weakly determined, worst at 128 x 128 pixels"
            ),
            strength="the same optics; a marker with more edges",
        ),
        Contender(
            key="aruco_subpixel",
            title="ArUco, sub-pixel corners",
            source="the same with CORNER_REFINE_SUBPIX: the fair one",
            published="none for GH angles",
            published_short="",
            published_deg=None,
            lag_ms=None,
            caveat="as above",
            strength="the same optics; a marker with more edges",
        ),
        Contender(
            key="inertial",
            title="inertial sensors (imufusion)",
            source="Madgwick's filter (imufusion), gyroscopes and accelerometers, without magnetometers near motors",
            published="OpenSenseRT (2021): 5.6°, eight upper-limb angles at 30 Hz; 3° RMS dynamic (the paper's [5])",
            published_short="5.6 (eight angles)",
            published_deg=None,
            lag_ms=15.0,
            caveat=(
                "favoured here: true attitudes at the start, sensors screwed to the bones, at most half a minute; the filter's "
                "correction of the gyroscopes' offset may take slow movement for rest, and nothing corrects its heading"
            ),
            strength="the true attitudes were given at the start and the recording is too short for drift",
        ),
        Contender(
            key="paper",
            title="the paper's method",
            source=_PAPER,
            published="0.9° mean RMSE, simulated (Tables 6 and 7); 3.6° with markers displaced by 20 mm",
            published_short="0.9",
            published_deg=0.889,
            lag_ms=None,
            caveat="same calibration and optics as fused",
            strength="single frames without memory",
            ours=True,
        ),
        Contender(
            key="refined",
            title="refined",
            source="docs/vision.md",
            published="none",
            published_short="",
            published_deg=None,
            lag_ms=None,
            caveat="answers 45 ms late, when all its inputs are there on both sides of the instant",
            strength="it waits for measurements on both sides of the instant and has nothing to forecast",
            ours=True,
        ),
        Contender(
            key="fused",
            title="fused",
            source="docs/fused-estimator.md",
            published="none",
            published_short="",
            published_deg=None,
            lag_ms=0.0,
            caveat="answers for the instant of publishing",
            strength="",
            ours=True,
        ),
    )
}
"""By key, in the order of tables."""
