"""The base of every table of the station file, and the forms that texts in it have."""

from pydantic import BaseModel, ConfigDict

NAME_FORM = r"^[A-Za-z0-9_-]{1,64}$"
BYTES_FORM = r"^([0-9A-Fa-f]{2}){1,8}$"
BINARY_FIELD_FORM = r"^[A-Za-z0-9_]+:[uif](8|16|32|64)$"
TEXT_FIELD_FORM = r"^[A-Za-z0-9_]+$"
FORM_IN_WORDS = {
    NAME_FORM: "must be 1 to 64 letters, digits, - and _",
    BYTES_FORM: 'must be 1 to 8 bytes, two hexadecimal digits each, like "a55a"',
    BINARY_FIELD_FORM: 'must read name:type, like "a0:i32"; types are u, i and f with 8, 16, 32 or 64 bits',
    TEXT_FIELD_FORM: "must be letters, digits and _",
}


class Strict(BaseModel):
    """A table that refuses unknown keys and numbers that are not finite, and cannot be changed once read."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)
