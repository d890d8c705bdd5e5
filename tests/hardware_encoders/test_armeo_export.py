"""Armeocontrol exports: made-up ones with every irregularity, and the real ones where they are at hand."""

from pathlib import Path

import numpy as np
import pytest

from ghest_drivers.clock import MonotonicClock
from ghest_drivers.errors import BadDeviceData, DeviceLost, DeviceNotFound, EndOfStream, ReadTimeout
from ghest_drivers.hardware.encoders.armeo_export import ArmeoSettings, armeo_link, read_armeo_export
from ghest_drivers.hardware.encoders.channels import Channel
from ghest_drivers.hardware.encoders.stats import LinkStats, Rejection
from ghest_drivers.interfaces import EncoderLink
from tests.real_data import real_files

MS = 1_000_000
DEG = np.pi / 180

EXPORT = """Timestamp; Inner Shoulder; Elbow; Grip
23:59:59.970; 1.0; -10.000; 0.1;
23:59:59.985; 2.0; -11.000; 0.1;
23:59:59.986; 2.0; -11.000; 0.1;
00:00:00.001; 3.0; -12.000; 0.1;
00:00:00.016; 4.0; -13.000; 0.1;
00:00:00.010; 5.0; -14.000; 0.1;
rubbish
25:00:00.000; 5.0; -14.000; 0.1;
00:00:00.032; nan; -14.000; 0.1;

00:00:00.032; 6,0; -15.000; 0.1"""


@pytest.fixture
def export(tmp_path: Path) -> Path:
    path = tmp_path / "export.csv"
    path.write_text(EXPORT, encoding="utf-8")
    return path


def channels() -> tuple[Channel, ...]:
    return (Channel("j4", "Elbow", rad_per_count=DEG, sign=-1), Channel("j0", "Inner Shoulder", rad_per_count=DEG))


def test_columns_by_title_midnight_passed_and_irregular_rows_counted(export: Path) -> None:
    stats = LinkStats()
    data = read_armeo_export(export, ("Elbow", "Inner Shoulder"), stats)
    assert list(np.diff(data.t_ns)) == [15 * MS, 16 * MS, 15 * MS, 16 * MS]
    assert data.values[:, 1] == pytest.approx([1, 2, 3, 4, 6])
    assert data.values[:, 0] == pytest.approx([-10, -11, -12, -13, -15])
    assert stats.rejected == {Rejection.DUPLICATE: 1, Rejection.NOT_ADVANCING: 1, Rejection.BAD_FIELDS: 3}


async def test_replay_as_an_encoder_link(export: Path) -> None:
    link = armeo_link(ArmeoSettings(export, channels(), paced=False), MonotonicClock())
    with pytest.raises(DeviceLost):
        _ = link.info
    await link.open()
    await link.open()
    assert isinstance(link, EncoderLink)
    assert link.info.joint_names == ("j4", "j0")
    samples = [await link.read(0.0) for _ in range(5)]
    assert [sample.seq for sample in samples] == [0, 1, 2, 3, 4]
    assert samples[0].angles_rad == pytest.approx([10 * DEG, 1 * DEG])
    assert np.diff([sample.t_capture_ns for sample in samples]) == pytest.approx([15 * MS, 16 * MS, 15 * MS, 16 * MS])
    with pytest.raises(EndOfStream):
        await link.read(0.0)
    await link.close()


async def test_replay_at_its_pace(export: Path) -> None:
    clock = MonotonicClock()
    link = armeo_link(ArmeoSettings(export, channels()), clock)
    await link.open()
    first = await link.read(1.0)
    with pytest.raises(ReadTimeout):
        await link.read(0.001)
    second = await link.read(1.0)
    assert clock.now_ns() >= second.t_arrival_ns == first.t_arrival_ns + 15 * MS
    await link.close()


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "no column 'Timestamp'"),
        ("Timestamp; x; z\n00:00:00.000; 1; 2;", "no column 'Elbow', 'Inner Shoulder'"),
        ("Timestamp; Elbow; Inner Shoulder\n", "no usable encoder samples"),
    ],
)
async def test_other_files_are_refused(tmp_path: Path, content: str, message: str) -> None:
    path = tmp_path / "other.csv"
    path.write_text(content, encoding="utf-8")
    with pytest.raises(DeviceNotFound, match=f"other.csv: .*{message}"):
        await armeo_link(ArmeoSettings(path, channels()), MonotonicClock()).open()


async def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(DeviceNotFound, match=r"none\.csv: cannot be read"):
        await armeo_link(ArmeoSettings(tmp_path / "none.csv", channels()), MonotonicClock()).open()


def test_a_missing_column_is_told_with_those_there_are(export: Path) -> None:
    with pytest.raises(BadDeviceData, match=r"no column 'Wrist'.*Inner Shoulder, Elbow, Grip"):
        read_armeo_export(export, ("Wrist",), LinkStats())


async def test_real_exports_load_with_their_real_timing() -> None:
    periods, rows, repeated = [], 0, 0
    files = real_files("armeo_recordings/*.csv")
    for path in files:
        stats = LinkStats()
        data = read_armeo_export(path, ("x", "z"), stats)
        assert set(stats.rejected) <= {Rejection.DUPLICATE, Rejection.NOT_ADVANCING}
        assert stats.rejected[Rejection.NOT_ADVANCING] <= 3
        rows += len(data.t_ns)
        repeated += stats.rejected.total()
        periods.append(np.diff(data.t_ns) / MS)
        assert np.abs(data.values).max() < 100  # centimetres
        link = armeo_link(ArmeoSettings(path, (Channel("j0", "x"), Channel("j1", "z")), paced=False), MonotonicClock())
        await link.open()
        for _ in range(len(data.t_ns)):
            await link.read(0.0)
        with pytest.raises(EndOfStream):
            await link.read(0.0)
    assert len(files) == 5
    assert rows + repeated == sum(len(path.read_text().splitlines()) - 1 for path in files)
    assert 0.005 < repeated / rows < 0.02
    assert np.median(np.concatenate(periods)) == pytest.approx(15.6, abs=0.5)
