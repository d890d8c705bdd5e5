"""The JSON Schemas in docs/schema are those of the messages."""

import json
from pathlib import Path

import pytest

from ghest_rt.messages.published import json_schemas

FOLDER = Path(__file__).parents[2] / "docs" / "schema"


@pytest.mark.parametrize("name", sorted(json_schemas()))
def test_the_schema_in_the_documentation_is_current(name: str) -> None:
    """If this fails: `ghest-rt schema --out docs/schema`."""
    assert json.loads((FOLDER / f"{name}.schema.json").read_text()) == json_schemas()[name]


def test_every_field_of_a_sample_is_explained_to_subscribers() -> None:
    text = (FOLDER.parent / "subscribing.md").read_text()
    fields = json_schemas()["gh_angles"]["properties"]
    assert isinstance(fields, dict)
    assert [field for field in fields if f"`{field}`" not in text] == []
