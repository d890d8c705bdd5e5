"""`ghest-rt study sensitivity`: results as files, figures, one document."""

import json
from pathlib import Path
from typing import Any

import cv2
import pytest
from typer.testing import CliRunner

from ghest_rt.cli.main import app
from ghest_rt.errors import BadInputError
from ghest_rt.studies.figures.sensitivity import draw_drift_by_method, draw_further, draw_sobol
from ghest_rt.studies.figures.style import save_figure
from ghest_rt.studies.sensitivity.parameters import further_parameters
from ghest_rt.studies.sensitivity.sobol import sobol_parameters


def test_the_command_prints_one_document_and_writes_the_papers_figures(tmp_path: Path) -> None:
    arguments = ["study", "sensitivity", "--out", str(tmp_path), "--movement", "SIR", "--duration", "0.2", "--quick"]
    arguments += ["--paper-only", "--method", "paper", "--method", "refined", "--workers", "1"]
    result = CliRunner().invoke(app, [*arguments, "--json"], catch_exceptions=False)
    assert result.exit_code == 0
    document = json.loads(result.stdout)
    assert document["paper"] == {"step_m": 0.002, "steps": 10, "mean_orientation_deg_at_20_mm": 3.6}
    assert len(document["rows"]) == 2 * 6 * 4
    assert {row["parameter"] for row in document["at_largest"]} == {"q1", "q2", "q3", "q4", "q5", "q6"}
    folder = tmp_path / "sensitivity"
    assert json.loads((folder / "summary.json").read_text()) == document
    assert (folder / "rows.csv").is_file()
    assert (folder / "rows.parquet").is_file()
    for name in ("drift_by_method", "figure16_SIR_paper", "figure16_SIR_refined"):
        image = cv2.imread(str(folder / "figures" / f"{name}.png"))
        assert image is not None
        assert image.std() > 15
    again = CliRunner().invoke(app, arguments, catch_exceptions=False)
    assert "q6 (m1 z)" in again.stdout


def test_figures_beyond_the_papers_are_drawn(tmp_path: Path) -> None:
    rows: list[dict[str, Any]] = [
        {
            "movement": "SFE",
            "method": method,
            "group": p.group,
            "parameter": p.name,
            "amount": amount,
            "unit": p.unit,
            "orientation_deg_rms": None if p.group == "both" and method == "paper" else 100 * amount,
        }
        for p in further_parameters()
        for method in ("paper", "refined")
        for amount in (0.0, 0.02)
    ]
    indices: list[dict[str, Any]] = [
        {"movement": "SFE", "output": output, "parameter": p.name, "S1": 0.1, "S1_conf": 0.02, "ST": 0.2, "ST_conf": 0.02}
        for output in ("position_m", "orientation_deg")
        for p in sobol_parameters()
    ]
    for name, figure in (("further", draw_further(rows)), ("sobol", draw_sobol(indices, "SFE", 16))):
        paths = save_figure(figure, tmp_path, name)
        assert [path.suffix for path in paths] == [".png", ".svg", ".pdf"]
        assert all(path.stat().st_size > 5000 for path in paths)


def test_a_number_of_samples_that_sobol_cannot_use_is_refused(tmp_path: Path) -> None:
    arguments = ["study", "sensitivity", "--out", str(tmp_path), "--sobol-samples", "100"]
    with pytest.raises(BadInputError, match="power of two"):
        CliRunner().invoke(app, arguments, catch_exceptions=False)


@pytest.mark.parametrize(
    ("share", "half", "told"), [(0.1, 0.02, False), (-0.03, 0.02, False), (-0.2, 0.02, True), (0.1, 0.4, True)]
)
def test_sobol_indices_that_cannot_be_read_are_called_so(share: float, half: float, told: bool) -> None:
    index = {"movement": "SFE", "parameter": "q1", "S1": share, "S1_conf": half, "ST": 0.2, "ST_conf": half}
    figure = draw_sobol([{"output": output, **index} for output in ("position_m", "orientation_deg")], "SFE", 16)
    assert ("too few samples to read" in figure.get_suptitle()) is told


def test_drift_is_drawn_with_a_column_for_each_method_and_one_legend() -> None:
    rows: list[dict[str, Any]] = [
        {"movement": "SFE", "method": method, "group": "shift", "parameter": "q1", "amount": amount}
        | {"position_m_rms": 0.5 * amount, "orientation_deg_rms": 100 * amount}
        for method in ("paper", "refined", "fused")
        for amount in (0.0, 0.01, 0.02)
    ]
    figure = draw_drift_by_method(rows, "sensor paper")
    assert [axes.get_title().partition(":")[0] for axes in figure.axes] == ["paper", "refined", "fused"] * 2
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == [
        "published, 3.6°",
        "mean over movements and q1 to q6",
        "least to greatest",
        "the other methods' means",
    ]
