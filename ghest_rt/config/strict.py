"""The base of every table of the station file."""

from pydantic import BaseModel, ConfigDict


class Strict(BaseModel):
    """A table that refuses unknown keys and cannot be changed once read."""

    model_config = ConfigDict(extra="forbid", frozen=True)
