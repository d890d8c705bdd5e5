"""`ghest-rt schema`: the JSON Schemas of what is published."""

import json
from pathlib import Path

from ghest_rt.cli.console import print_json
from ghest_rt.errors import BadInputError
from ghest_rt.messages.published import json_schemas


def show_schemas(folder: Path | None) -> None:
    """Print all schemas as one document, or write one file each.

    Raises:
        BadInputError: The folder cannot be written to.
    """
    schemas = json_schemas()
    if folder is None:
        print_json(schemas)
        return
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, schema in schemas.items():
            (folder / f"{name}.schema.json").write_text(json.dumps(schema, indent=2) + "\n", encoding="utf-8")
    except OSError as error:
        raise BadInputError(f"{folder}: cannot be written: {error.strerror or error}") from error
