"""From payloads to messages. Fields that a later version added are passed over; what cannot be understood is an error."""

import json
from typing import TypeVar

from pydantic import BaseModel, ValidationError

from ghest_rt.messages.published import GhAngles

_Model = TypeVar("_Model", bound=BaseModel)

_VERSION = 1


class _Page(BaseModel):
    samples: list[GhAngles]


class RefusedError(Exception):
    """A payload is no message that this version knows; the text says what to do."""


def read_message(model: type[_Model], payload: bytes) -> _Model:
    """Return a message.

    Raises:
        RefusedError: It is none, or of a later schema version.
    """
    try:
        return model.model_validate_json(payload, extra="ignore")
    except ValidationError as error:
        raise RefusedError(_reason(model, payload, error)) from error


def read_page(payload: bytes) -> list[GhAngles]:
    """Return the samples of an answer of `gh/recent`.

    Raises:
        RefusedError: It is none.
    """
    try:
        return _Page.model_validate_json(payload, extra="ignore").samples
    except ValidationError as error:
        raise RefusedError("the answer to the question for missing samples is not of this version") from error


def _reason(model: type[BaseModel], payload: bytes, error: ValidationError) -> str:
    first = error.errors(include_url=False)[0]
    place = ".".join(map(str, first["loc"]))
    if place == "schema_version":
        theirs = json.loads(payload).get("schema_version")
        return f"{model.__name__} of schema version {theirs}, but this client knows {_VERSION}: update ghest-rt here"
    return f"not a {model.__name__}: {place or 'the payload'}: {first['msg']}"
