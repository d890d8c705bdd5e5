"""What leaves the process on Zenoh, as JSON. Degrees and milliseconds here, in contrast to the inside.

`docs/subscribing.md` explains every field to subscribers; `docs/schema/` holds the JSON Schemas made from these classes.
"""

from enum import StrEnum
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from ghest_rt.messages.results import Reason, Status

Vector3 = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
NonNegative = Annotated[float, Field(ge=0.0)]

RUN_ID = "Of the publishing process, made anew at every start: with another one, seq starts again at 0"


class _Message(BaseModel):
    """The base of every message: refuses unknown fields, cannot be changed once made."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Clinical(_Message):
    """The three clinical angles in degrees, or their standard deviations."""

    flexion: float = Field(description="Raising the arm, degrees; minus the angle about y")
    abduction: float = Field(description="Horizontal abduction, away from the body, degrees")
    rotation: float = Field(description="Internal rotation about the upper arm's own axis, degrees")


class IsbYxy(_Message):
    """The ISB's Y-X-Y angles of the GH joint (Wu et al. 2005, 2.4.7), degrees; docs/angles.md."""

    plane_of_elevation: float = Field(description="0 = abduction, 90 = forward flexion")
    elevation: float = Field(ge=0.0, le=180.0, description="Between the arm and straight down")
    axial_rotation: float = Field(description="Internal rotation")


class SwingTwist(_Message):
    """Swing to where the arm points by the shortest way, then twist about the arm; degrees."""

    swing_flexion: float = Field(description="Part of the swing that raises the arm")
    swing_abduction: float = Field(description="Part of the swing away from the body")
    twist: float = Field(description="Internal rotation about the arm; equals the torsion of tilt and torsion")
    tilt: float = Field(ge=0.0, le=180.0, description="Size of the swing: between the arm and straight forward")
    azimuth: float = Field(description="Direction of the tilt")


class Singular(_Message):
    """Which angles stand so near their singularity that they say little one by one; the quaternion never does."""

    euler_yxz: bool = Field(description="Also holds for angles_deg")
    isb_yxy: bool
    swing_twist: bool
    azimuth: bool = Field(description="The azimuth of swing_twist_deg alone")


class MarkerDriftState(_Message):
    """How far a marker has moved on its bone since the calibration; axes of the marker as calibrated."""

    flagged: bool = Field(description="It has moved, beyond what calibration leaves open; the angles are corrected for it")
    probability: float = Field(ge=0.0, le=1.0, description="That it has moved; flagged above 0.5")
    slide_mm: Vector3 = Field(description="Displacement, millimetres; to 0.01 mm")
    slide_sigma_mm: Vector3 = Field(description="Standard deviations of slide_mm; large where the data say nothing")
    turn_deg: Vector3 = Field(description="Rotation vector, degrees; to 0.01 degrees")
    turn_sigma_deg: Vector3 = Field(description="Standard deviations of turn_deg")


class Drift(_Message):
    """The drift of both markers."""

    m0: MarkerDriftState
    m1: MarkerDriftState


class Elbow(_Message):
    """The elbow's angles in degrees, or their standard deviations; docs/angles.md says what they rest on."""

    flexion: float = Field(
        description="0 = stretched; angle between upper arm and forearm module about the elbow's flexion axis"
    )
    carrying: float = Field(description="How far the forearm module leaves the flexion plane, away from the body")
    pronation: float | None = Field(description="Of the hand module against the forearm module; null without such an encoder")


class GhAngles(_Message):
    """The glenohumeral joint at one instant: `ghest/<station>/gh/angles`. Without angles when the status is `lost`."""

    schema_version: Literal[1] = 1
    run_id: str = Field(description=RUN_ID)
    seq: int = Field(ge=0, description="Counts every message of this run; a gap is a lost message")
    t_sample_ns: int = Field(description="Instant the angles hold for, host monotonic clock, on an absolute grid")
    t_publish_ns: int = Field(description="Instant of publishing, same clock")
    t_sample_unix_ns: int = Field(description="t_sample_ns as Unix time")
    status: Status
    reason: Reason
    angles_deg: Clinical | None
    sigma_deg: Clinical | None = Field(description="Standard deviations of angles_deg; null if the method computes none")
    euler_yxz_deg: Vector3 | None = Field(description="(a, b, g): intrinsic rotations about y, x, z, the paper's angles")
    quaternion_wxyz: Quaternion | None = Field(description="Unit quaternion of the upper arm in the GH frame, w >= 0")
    isb_yxy_deg: IsbYxy | None
    swing_twist_deg: SwingTwist | None
    singular: Singular | None
    arm_position_m: Vector3 | None = Field(description="Middle of the upper arm in the frame of marker m0, metres")
    age_ms: dict[str, float | None] = Field(
        description="Per input (r0, r1, encoders): from the capture of its newest sample used to publishing; null if never seen"
    )
    method: str
    calibration_id: str
    joint: str = Field(default="gh", description="What is measured; another joint than gh has no isb_yxy_deg, swing_twist_deg")
    drift: Drift | None = Field(default=None, description="Of the markers; null when lost or where the method does not look")
    elbow_deg: Elbow | None = Field(default=None, description="Null when lost or where the station file has no [elbow]")
    elbow_sigma_deg: Elbow | None = Field(default=None, description="Standard deviations of elbow_deg")


class Lateness(_Message):
    """How late ticks came, microseconds."""

    p50_us: NonNegative
    p99_us: NonNegative
    p999_us: NonNegative
    max_us: NonNegative


class LatenessHistogram(_Message):
    """How many ticks since the start came how late."""

    le_us: tuple[float, ...] = Field(description="Upper edges of the bins, microseconds, rising")
    ticks: tuple[int, ...] = Field(
        description="Ticks up to each edge, all earlier bins included; `count` less the last came later"
    )
    count: int = Field(ge=0, description="All ticks")
    sum_us: NonNegative = Field(description="Their lateness added up")


class InputState(StrEnum):
    """How an input is doing."""

    CONNECTING = "connecting"
    STREAMING = "streaming"
    SILENT = "silent"  # open, but nothing arrives
    LOST = "lost"  # gone; being opened again with growing pauses
    ENDED = "ended"  # a finite source is through


class InputHealth(_Message):
    """One camera or the encoders, counted since the start."""

    state: InputState
    received: int = Field(ge=0, description="Samples taken from the device")
    missing: int = Field(ge=0, description="Gaps in the device's own count")
    skipped: int = Field(ge=0, description="Frames passed over because vision was slower than the camera")
    bad: int = Field(ge=0, description="Samples that could not be used")
    reopened: int = Field(ge=0, description="Times the device was opened again")
    rate_hz: NonNegative = Field(description="Over the last second")
    age_ms: float | None = Field(
        default=None, description="From the capture of its newest sample to this message; null if never seen"
    )
    refused: dict[str, int] = Field(default={}, description="What the device or its driver did not pass on, by reason")
    temperature_c: float | None = Field(default=None, description="Of the device, where it tells")


class Health(_Message):
    """How the service itself is doing, once a second: `ghest/<station>/health`."""

    schema_version: Literal[1] = 1
    seq: int = Field(ge=0)
    t_ns: int = Field(description="Host monotonic clock")
    t_unix_ns: int
    uptime_s: NonNegative
    status: Status = Field(description="Of the newest published sample")
    reason: Reason
    published: int = Field(ge=0, description="Samples published")
    valid: int = Field(ge=0, description="Samples published with status valid")
    degraded: int = Field(default=0, ge=0, description="Samples published with status degraded")
    rate_hz: NonNegative = Field(description="Published samples a second, over the last second")
    missed_ticks: int = Field(ge=0, description="Grid slots skipped because the machine was too busy")
    lateness: Lateness = Field(description="Since the start")
    lateness_recent: Lateness | None = Field(default=None, description="Over the last 4096 ticks, about a minute")
    lateness_histogram: LatenessHistogram | None = Field(default=None, description="Since the start")
    unused: dict[str, int] = Field(default={}, description="Samples that the estimator did not use since the start, by reason")
    inputs: dict[str, InputHealth]
    cpu_percent: NonNegative = Field(description="Of one core, over the last second")
    memory_mb: NonNegative = Field(description="Resident")
    threads: int = Field(default=0, ge=0)
    open_files: int = Field(default=0, ge=0)
    major_faults: int = Field(default=0, ge=0, description="Page faults since the start that had to wait for the disk")
    collection_ms: NonNegative = Field(
        default=0.0, description="Longest garbage collection since the start; never within a tick"
    )


class EventKind(StrEnum):
    """What happened."""

    STARTED = "started"
    STOPPED = "stopped"
    INPUT_CONNECTED = "input_connected"
    INPUT_SILENT = "input_silent"
    INPUT_STREAMING = "input_streaming"
    INPUT_LOST = "input_lost"
    INPUT_ENDED = "input_ended"
    INPUT_CHANGED = "input_changed"
    BAD_DATA = "bad_data"
    FRAMES_SKIPPED = "frames_skipped"
    STATUS_CHANGED = "status_changed"
    MARKER_DRIFTED = "marker_drifted"  # a marker has moved on its bone
    MARKER_BACK = "marker_back"  # it is where the calibration has it again
    RECORDING_DROPS = "recording_drops"  # the disk is slower than the data
    RECORDING_STOPPED = "recording_stopped"  # the disk is full or gone
    INTERNAL_ERROR = "internal_error"


class Event(_Message):
    """Something worth knowing happened: `ghest/<station>/events`."""

    schema_version: Literal[1] = 1
    run_id: str = Field(description=RUN_ID)
    seq: int = Field(ge=0)
    t_ns: int = Field(description="Host monotonic clock")
    t_unix_ns: int
    severity: Literal["info", "warning", "error"]
    kind: EventKind
    source: str = Field(description="Input concerned (r0, r1, encoders), marker (m0, m1), service, or recorder")
    message: str


PUBLISHED: dict[str, type[BaseModel]] = {"gh_angles": GhAngles, "health": Health, "event": Event}


def json_schemas() -> dict[str, dict[str, object]]:
    """Return the JSON Schema (2020-12) of every published message, by file name stem."""
    schemas: dict[str, dict[str, object]] = {}
    for name, model in PUBLISHED.items():
        schema: dict[str, object] = {
            "$schema": "https://json-schema.org/draft/2020-12/schema",
            **model.model_json_schema(mode="serialization"),
        }
        schemas[name] = schema
    return schemas
