"""The movements: Table 2, and recorded ones of real people."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ghest_rt.errors import BadInputError
from ghest_rt.geometry.so3 import rot_x, rot_y, rot_z
from ghest_rt.simulation.opensim_file import read_motion_table
from ghest_rt.simulation.opensim_motion import E_FROM_OPENSIM, OpenSimMotion
from ghest_rt.simulation.therapy import MOVEMENTS, TherapyMotion, find_movement
from tests.real_data import real_files

TABLE_2 = {"SAbAd": ((6, 31, 10), 1000), "SFE": ((31, 8, 1), 1000), "SIR": ((3, 3, 34), 1000), "COMB": ((40, 90, 60), 2000)}
COLUMNS = "time clav_prot clav_elev scapula_upward_rot plane_elv shoulder_elv axial_rot elbow_flexion"


@pytest.mark.parametrize("name", TABLE_2)
@pytest.mark.parametrize("seed", [0, 7])
def test_amplitudes_and_sample_counts_of_table_2(name: str, seed: int) -> None:
    amplitude, samples = TABLE_2[name]
    motion = TherapyMotion(MOVEMENTS[name], seed)
    assert MOVEMENTS[name].samples == samples
    assert motion.duration_s == pytest.approx(samples / 66.6)
    angles = np.degrees([motion.angles_rad(k / 66.6) for k in range(samples)])
    np.testing.assert_allclose(np.ptp(angles, axis=0), amplitude, rtol=0.05)
    steps = np.abs(np.diff(angles, axis=0)) * 66.6
    assert steps.max() < 150.0  # degrees a second: nobody in therapy moves faster


def test_the_posture_is_the_y_x_z_rotation_of_the_angles() -> None:
    motion = TherapyMotion(MOVEMENTS["COMB"], 3)
    a, b, g = motion.angles_rad(4.2)
    np.testing.assert_allclose(motion.at(4.2).gh, rot_y(a) @ rot_x(b) @ rot_z(g), atol=1e-12)
    np.testing.assert_allclose(motion.at(4.2).gh, Rotation.from_euler("YXZ", (a, b, g)).as_matrix(), atol=1e-12)


def test_the_seed_decides_the_movement() -> None:
    one, same, other = (TherapyMotion(MOVEMENTS["SFE"], seed).angles_rad(3.0) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one, same)
    assert np.abs(one - other).max() > 1e-3


def test_movements_are_found_in_any_case_of_letters_and_unknown_ones_refused() -> None:
    assert find_movement("sabad").name == "SAbAd"
    with pytest.raises(BadInputError, match=r"'YOGA' is unknown: give one of SAbAd, SFE, SIR, COMB"):
        find_movement("YOGA")


def write_motion(path: Path, rows: list[str], columns: str = COLUMNS, header: str = "inDegrees=yes") -> Path:
    path.write_text("\n".join(["Coordinates", header, "endheader", columns.replace(" ", "\t"), *rows]) + "\n")
    return path


def opensim(tmp_path: Path, **columns: float) -> OpenSimMotion:
    names = COLUMNS.split()[1:]
    rows = [" ".join(map(str, [0.1 * k, *(columns.get(name, 0.0) * (k >= 3) for name in names)])) for k in range(6)]
    return OpenSimMotion(read_motion_table(write_motion(tmp_path / "m.mot", rows)), "m")


@pytest.mark.parametrize(
    ("plane_deg", "elevation_deg", "elbow_from_gh"),
    [
        (0.0, 0.0, (-1, 0, 0)),  # hanging
        (0.0, 90.0, (0, -1, 0)),  # out to the right
        (90.0, 90.0, (0, 0, -1)),  # forwards
        (30.0, 180.0, (1, 0, 0)),  # overhead
    ],
)
def test_recorded_gh_angles_point_the_arm_where_opensim_does(
    tmp_path: Path, plane_deg: float, elevation_deg: float, elbow_from_gh: tuple[int, int, int]
) -> None:
    motion = opensim(tmp_path, plane_elv=plane_deg, shoulder_elv=elevation_deg)
    np.testing.assert_allclose(motion.at(0.5).gh @ (0, 0, -1), elbow_from_gh, atol=1e-9)


def test_recorded_gh_rotation_is_taken_over_exactly(tmp_path: Path) -> None:
    motion = opensim(tmp_path, plane_elv=35.0, shoulder_elv=72.0, axial_rot=-20.0, scapula_upward_rot=25.0)
    in_scapula = Rotation.from_euler("YXY", (35.0, -72.0, -20.0), degrees=True)
    resting = opensim(tmp_path).at(0.5).gh
    np.testing.assert_allclose(
        motion.at(0.5).gh, E_FROM_OPENSIM @ in_scapula.as_matrix() @ E_FROM_OPENSIM.T @ resting, atol=1e-9
    )


def test_hanging_with_the_elbow_bent_the_forearm_points_forwards(tmp_path: Path) -> None:
    np.testing.assert_allclose(opensim(tmp_path).at(0.0).gh @ (0, 1, 0), (0, 0, -1), atol=1e-9)


def test_upward_rotation_turns_the_glenoid_up_and_elevation_of_the_clavicle_lifts_it(tmp_path: Path) -> None:
    outwards = np.array((0.0, -1.0, 0.0))
    moved = opensim(tmp_path, scapula_upward_rot=40.0).at(0.5)
    assert (moved.scapula @ outwards)[0] > 0.4
    assert opensim(tmp_path, clav_elev=10.0).at(0.5).clavicle_rad[1] == pytest.approx(np.radians(10.0))
    # The first row is the neutral posture.
    np.testing.assert_allclose(opensim(tmp_path, scapula_upward_rot=40.0).at(0.0).scapula, np.eye(3), atol=1e-9)


def test_a_file_in_radians_moves_the_same(tmp_path: Path) -> None:
    rows = [f"{0.1 * k:.1f} 0 0 0 {0.1 * k} {0.2 * k} 0 0" for k in range(5)]
    radians = OpenSimMotion(read_motion_table(write_motion(tmp_path / "r.mot", rows, header="inDegrees=no")), "r")
    in_degrees = [f"{0.1 * k:.1f} 0 0 0 {np.degrees(0.1 * k)} {np.degrees(0.2 * k)} 0 0" for k in range(5)]
    degrees = OpenSimMotion(read_motion_table(write_motion(tmp_path / "d.mot", in_degrees)), "d")
    np.testing.assert_allclose(radians.at(0.33).gh, degrees.at(0.33).gh, atol=1e-9)


ROWS = [f"{0.1 * k:.1f} 0 0 0 1 2 3 0" for k in range(6)]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("time plane_elv\n0 1\n", r"m.mot: no line `endheader`; give an OpenSim .mot file"),
        ("endheader\n", r"m.mot, line 2: no column names"),
        ("endheader\nt a\n0 1\n", r"m.mot, line 2: the first column must be `time`"),
        ("endheader\n" + "\n".join(["time a", *["0 1"] * 3]), r"m.mot: only 3 rows"),
        ("endheader\ntime a\n0 1\n1 2\n2\n3 4\n", r"m.mot, line 5: 1 values for 2 columns; is the file cut"),
        ("endheader\ntime a\n0 1\n1 x\n2 3\n3 4\n", r"m.mot, line 4: .*'x'; only numbers may stand here"),
        ("endheader\ntime a\n0 1\n1 nan\n2 3\n3 4\n", r"m.mot, line 4: a value is not finite; fill the gap"),
        ("endheader\ntime a\n0 1\n1 2\n1 3\n2 4\n", r"m.mot: time does not increase after 1 s; remove the repeated row"),
        ("nRows=9\nendheader\ntime a\n0 1\n1 2\n2 3\n3 4\n", r"m.mot: the header says nRows=9 but there are 4 rows"),
    ],
)
def test_a_bad_motion_file_is_refused_with_line_and_remedy(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "m.mot"
    path.write_text(text)
    with pytest.raises(BadInputError, match=message):
        read_motion_table(path)


def test_missing_or_binary_motion_files_and_missing_columns_are_told(tmp_path: Path) -> None:
    with pytest.raises(BadInputError, match=r"none.mot: cannot read the motion file: No such file"):
        read_motion_table(tmp_path / "none.mot")
    (tmp_path / "b.mot").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(BadInputError, match=r"b.mot: not a text file \(byte 0\)"):
        read_motion_table(tmp_path / "b.mot")
    table = read_motion_table(write_motion(tmp_path / "legs.mot", [f"{k} 0" for k in range(5)], columns="time knee_angle"))
    with pytest.raises(BadInputError, match=r"legs.mot: no column plane_elv, shoulder_elv, axial_rot"):
        OpenSimMotion(table, "legs")


def test_recorded_movements_of_real_people_go_from_hanging_to_overhead() -> None:
    for path in real_files("human_motion/[AF]*.mot"):
        motion = OpenSimMotion(read_motion_table(path), path.stem)
        height = [-(p.scapula @ p.gh)[0, 2] for p in (motion.at(t) for t in np.arange(0.0, motion.duration_s, 0.25))]
        assert height[0] < -0.9
        assert max(height) > 0.7
