"""What the pages name is there: files, links, sections."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
_FILE = re.compile(r"`((?:[\w.-]+/)+[\w.-]+\.(?:py|toml|urdf|dbc|c|cpp|json))`")
_MADE = ("build/", "out/")  # by commands that the pages name
_LINK = re.compile(r"\]\((?!https?:)([^)#\s]*)(?:#([^)\s]*))?\)")


def _sections(page: Path) -> set[str]:
    heads = re.findall(r"^#+ +(.+)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", head.lower()).strip().replace(" ", "-") for head in heads}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_what_a_page_names_is_there(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    assert [name for name in _FILE.findall(text) if not name.startswith(_MADE) and not (ROOT / name).exists()] == []
    for name, section in _LINK.findall(text):
        target = page.parent / name if name else page
        assert target.exists(), name
        assert not section or target.suffix != ".md" or section in _sections(target), f"{name}#{section}"
