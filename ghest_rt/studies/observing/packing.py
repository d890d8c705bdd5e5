"""An observed session as a task's result: arrays that are kept on disk or sent to a worker."""

from typing import Any, cast

import numpy as np

from ghest_drivers.samples import EncoderSample
from ghest_rt.config.load import LoadedStation, parse_station
from ghest_rt.messages.results import MarkerObservation, MarkerStatus, TruthSample
from ghest_rt.simulation.sensors import find_sensors
from ghest_rt.studies.engine.task import Result
from ghest_rt.studies.observing.observed import Observed
from ghest_rt.vision.station import Method

_STATUS = tuple(MarkerStatus)
_TRUTH = ("m0_from_arm", "e_from_m0", "e_from_m1", "e_from_arm")


def pack(session: Observed, sensor: str) -> Result:
    """Return a session as a result; `sensor` is the name of its sensors."""
    values: dict[str, object] = {
        "sensor": sensor,
        "station_toml": session.station.toml_text,
        "urdf": session.station.urdf_text,
        "source": session.station.source,
        "joints": list(session.joints),
        "cameras": list(session.camera_infos),
        "markers": [list(key) for key in session.markers],
        "truth_joints": list(session.truth[0].joints_rad) if session.truth else [],
    }
    arrays: dict[str, Any] = {
        "encoder_times": np.array([(e.seq, e.t_device_ns, e.t_arrival_ns, e.t_capture_ns) for e in session.encoders]),
        "encoder_angles": np.array([e.angles_rad for e in session.encoders]),
        "truth_t": np.array([t.t_ns for t in session.truth]),
        "truth_gh": np.array([t.gh_from_arm for t in session.truth]),
        "truth_joints": np.array([list(t.joints_rad.values()) for t in session.truth]),
        **{f"truth_{name}": np.array([getattr(t, name) for t in session.truth]) for name in _TRUTH},
    }
    for (method, camera), found in session.markers.items():
        name = f"{method}_{camera}"
        arrays[f"{name}_facts"] = np.array(
            [(o.seq, o.t_capture_ns, o.t_arrival_ns, _STATUS.index(o.status), o.disks_used, o.depth_used) for o in found]
        )
        arrays[f"{name}_pose"] = np.array(
            [np.full((4, 4), np.nan) if o.camera_from_marker is None else o.camera_from_marker for o in found]
        )
        if any(o.covariance is not None for o in found):
            arrays[f"{name}_cov"] = np.array([np.full((6, 6), np.nan) if o.covariance is None else o.covariance for o in found])
    return Result(values, arrays)


def unpack(result: Result) -> Observed:
    """Return the session that a result holds."""
    v, a = cast(dict[str, Any], result.values), cast(dict[str, Any], result.arrays)
    station = LoadedStation(parse_station(v["station_toml"], v["source"]), v["station_toml"], v["urdf"], v["source"])
    profile = find_sensors(v["sensor"]).camera
    encoders = [
        EncoderSample(seq, angles, device, arrival, capture)
        for (seq, device, arrival, capture), angles in zip(a["encoder_times"].tolist(), a["encoder_angles"], strict=True)
    ]
    truth = [
        TruthSample(t, gh, m0_arm, m0, m1, arm, dict(zip(v["truth_joints"], joints, strict=True)))
        for t, gh, joints, m0_arm, m0, m1, arm in zip(
            a["truth_t"].tolist(),
            a["truth_gh"],
            a["truth_joints"].tolist(),
            *(a[f"truth_{name}"] for name in _TRUTH),
            strict=True,
        )
    ]
    markers = {(method, camera): _observations(a, method, camera, station) for method, camera in v["markers"]}
    infos = {camera: profile.info(camera) for camera in v["cameras"]}
    return Observed(station, infos, tuple(v["joints"]), encoders, truth, markers)


def _observations(a: dict[str, Any], method: Method, camera: str, station: LoadedStation) -> list[MarkerObservation]:
    name, marker = f"{method}_{camera}", station.config.cameras[camera].marker
    facts = a[f"{name}_facts"].tolist()
    covariances = a.get(f"{name}_cov", [None] * len(facts))
    return [
        MarkerObservation(
            camera=camera,
            marker=marker,
            seq=seq,
            t_capture_ns=capture,
            t_arrival_ns=arrival,
            status=_STATUS[status],
            camera_from_marker=None if np.isnan(pose[0, 0]) else pose,
            covariance=None if covariance is None or np.isnan(covariance[0, 0]) else covariance,
            disks_used=disks,
            depth_used=bool(depth),
        )
        for (seq, capture, arrival, status, disks, depth), pose, covariance in zip(
            facts, a[f"{name}_pose"], covariances, strict=True
        )
    ]
