"""The report: one page, everything in it, nothing from outside."""

import json
import shutil
from html.parser import HTMLParser
from pathlib import Path

import pytest
from typer.testing import CliRunner

from ghest_rt.cli.main import app
from ghest_rt.errors import BadInputError
from ghest_rt.studies.figures.style import Drawn, new_figure
from ghest_rt.studies.numbers import number
from ghest_rt.studies.report.accuracy_section import accuracy_section
from ghest_rt.studies.report.write import write_report
from ghest_rt.studies.results import write_study
from ghest_rt.studies.session.errors import POSE_QUANTITIES


class Page(HTMLParser):
    """Collects what a page refers to, its texts, and whether its tags match."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.refers_to: list[str] = []
        self.texts: list[str] = []
        self.open: list[str] = []
        self.ids: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.refers_to += [value or "" for name, value in attrs if name in {"src", "href", "srcset", "action"}]
        self.ids += [value or "" for name, value in attrs if name == "id"]
        if tag not in {"meta", "img", "br", "link"}:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.texts.append(data.strip())


@pytest.fixture(scope="module")
def page(results: Path, tmp_path_factory: pytest.TempPathFactory) -> str:
    out = tmp_path_factory.mktemp("report") / "report.html"
    assert write_report(results, out) == ["accuracy", "sensitivity", "compare", "latency"]
    return out.read_text(encoding="utf-8")


def test_the_page_needs_nothing_from_outside(page: str) -> None:
    found = Page(page)
    assert found.open == []
    for target in found.refers_to:
        assert target.startswith("data:image/png;base64,") or target.removeprefix("#") in found.ids
    assert "<script" not in page
    assert "@import" not in page
    assert "url(" not in page


def test_every_study_has_its_tables_and_figures(page: str) -> None:
    text = "\n".join(Page(page).texts)
    for heading in (
        "Table 5: position of the markers",
        "Table 6: pose of the upper arm",
        "Beyond the paper",
        "Does fused win?",
    ):
        assert heading in text
    for caption in ("caption of figure13_paper", "caption of figure17_COMB_fused", "Errors angle by angle: sensor paper"):
        assert caption in text
    assert page.count("data:image/png") == 9


def test_the_papers_values_stand_beside_ours(page: str) -> None:
    texts = Page(page).texts
    assert "0.889" in texts  # Table 6, mean orientation
    assert "0.83" not in texts
    assert "0.830" in texts  # Table 5, mean of m0, in millimetres
    assert "3.60" in texts  # with markers displaced
    assert "SFE 3.9, SAA 3.3, SIER 6.5" in texts


def test_the_inertial_sensors_drift_is_a_mean_over_all_sessions(page: str) -> None:
    assert "after holding still for 120 s it is off by 8.00° (mean of 2 sessions, 7.50° to 8.50°)" in page


def test_computing_times_come_from_the_clock(page: str) -> None:
    assert Page(page).texts.count("1.00, 1.00") == 4  # a clock that goes on by 1 ms whenever it is read


def test_what_does_not_hold_is_said(page: str) -> None:
    assert "does not hold" in Page(page).texts
    assert "COMB is <worst>" in Page(page).texts
    assert "<worst>" not in page  # escaped


def test_the_least_error_of_a_row_is_marked_whoever_has_it() -> None:
    entries = [
        {"movement": "SFE", "quantity": q, "sensor": "paper", "method": m, "rms": rms, "rms_low": None, "rms_high": None}
        | {"paper_rms": None, "valid_fraction": 1.0}
        for q in POSE_QUANTITIES
        for m, rms in (("paper", 0.9), ("refined", 0.00501), ("fused", 0.00502), ("never", None))
    ]
    summary = {"table": entries, "duration_s": None, "seeds": [1], "figures": []}
    (row,) = accuracy_section(summary, Path()).tables[1].rows
    assert [cell.kind for cell in row[1:9]] == [*["number", "best", "number", "number"], *["number", "best", "best", "number"]]
    assert [cell.text for cell in row[5:9]] == ["0.900", "0.0050", "0.0050", "–"]


def test_the_first_tile_names_the_methods_of_our_own_that_fused_does_not_beat(page: str) -> None:
    assert "Against the other methods here: the paper" in page
    assert "refined" in page.partition("Against the other methods here: ")[2].partition("</small>")[0]


def test_a_statement_that_could_not_be_judged_neither_holds_nor_fails(results: Path, tmp_path: Path) -> None:
    shutil.copytree(results / "accuracy", tmp_path / "accuracy")
    path = tmp_path / "accuracy" / "summary.json"
    summary = json.loads(path.read_text())
    summary["checks"][0]["holds"] = None
    path.write_text(json.dumps(summary))
    write_report(tmp_path, tmp_path / "report.html")
    texts = Page((tmp_path / "report.html").read_text(encoding="utf-8")).texts
    assert "not judged" in texts
    assert "does not hold" not in texts


def test_the_same_results_give_the_same_page(results: Path, page: str, tmp_path: Path) -> None:
    write_report(results, tmp_path / "again.html")
    assert (tmp_path / "again.html").read_text(encoding="utf-8") == page


def test_shares_and_what_was_played_are_told(page: str) -> None:
    texts = Page(page).texts
    assert texts.count("87.5, 87.5, 87.5") == 2 * 5  # valid by method: Tables 5 and 6, movements and their mean
    assert "valid (%)" in texts
    assert "answered (%)" in texts
    assert "first 1.5 s of each movement" in page
    assert "8 s of each, in its own time" in page


def test_what_an_earlier_run_left_is_removed_and_never_reported(tmp_path: Path) -> None:
    def run(*names: str, rows: bool = True) -> None:
        tables = {"rows": [{"x": 1.0}], "sobol": [{"y": 2.0}] if rows else []}
        write_study(tmp_path, {"study": "accuracy"}, tables, [Drawn(n, f"<{n}>", new_figure(1, 1)) for n in names])

    run("figure13_paper", "figure13_sr300")
    figures = tmp_path / "accuracy" / "figures"
    (figures / "of_mine.png").write_bytes(b"kept")
    run("figure13_paper", rows=False)
    assert sorted(path.name for path in figures.iterdir()) == [
        *(f"figure13_paper.{ending}" for ending in ("pdf", "png", "svg")),
        "of_mine.png",
    ]
    assert sorted(path.name for path in (tmp_path / "accuracy").iterdir()) == [
        "figures",
        "rows.csv",
        "rows.parquet",
        "summary.json",
    ]
    listed = json.loads((tmp_path / "accuracy" / "summary.json").read_text())
    assert (listed["tables"], [figure["name"] for figure in listed["figures"]]) == (["rows"], ["figure13_paper"])


def test_a_study_that_was_not_run_is_named_with_its_command(results: Path, tmp_path: Path) -> None:
    shutil.copytree(results / "latency", tmp_path / "latency")
    out = tmp_path / "report.html"
    assert write_report(tmp_path, out) == ["latency"]
    assert "ghest-rt study accuracy" in out.read_text(encoding="utf-8")


def test_an_empty_folder_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BadInputError, match="holds no study"):
        write_report(tmp_path, tmp_path / "report.html")


def test_another_ending_is_refused(results: Path, tmp_path: Path) -> None:
    with pytest.raises(BadInputError, match=r"r.pdf: the report is an HTML page; name a file that ends in .html"):
        write_report(results, tmp_path / "r.pdf")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("content", ["{", "[1]", '{"candidates": []}'])
def test_a_damaged_summary_is_named_with_the_remedy(tmp_path: Path, content: str) -> None:
    (tmp_path / "latency").mkdir()
    (tmp_path / "latency" / "summary.json").write_text(content)
    with pytest.raises(BadInputError, match=r"latency.*run `ghest-rt study latency` again"):
        write_report(tmp_path, tmp_path / "report.html")


def test_the_command_tells_what_it_wrote(results: Path, tmp_path: Path) -> None:
    out = tmp_path / "r.html"
    result = CliRunner().invoke(app, ["study", "report", str(results), "--out", str(out), "--json"])
    assert result.exit_code == 0, result.output
    document = json.loads(result.stdout)
    assert document["studies"] == ["accuracy", "sensitivity", "compare", "latency"]
    assert document["size_bytes"] == out.stat().st_size


@pytest.mark.parametrize(
    ("value", "text"),
    [(None, "–"), (0.0042, "0.0042"), (0.042, "0.042"), (0.123, "0.123"), (1.2345, "1.23"), (9.999, "10.0"), (1234.5, "1234")],
)
def test_numbers_have_three_digits_or_so(value: float | None, text: str) -> None:
    assert number(value) == text
