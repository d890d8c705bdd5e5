"""What is wrong with a station file, in words of the file: its keys, what they take, and the nearest key that there is."""

import difflib
import json
import re
import types
from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any, Union, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from ghest_rt.config.strict import FORM_IN_WORDS

_MOST = 20
_SHOWN_LETTERS = 40
_BARE = re.compile(r"[A-Za-z0-9_-]+")
_TAGS = ("backend", "kind")  # keys that choose one of several tables
_KINDS = {
    "float_type": "must be a number",
    "int_type": "must be a whole number",
    "int_from_float": "must be a whole number",
    "bool_type": "must be true or false",
    "string_type": "must be text in quotes",
    "tuple_type": "must be an array, [...]",
    "dict_type": "must be a table, { ... }",
    "model_type": "must be a table, { ... }",
    "finite_number": "must be a finite number",
}
_LIMITS = {
    "greater_than": ("gt", "more than"),
    "greater_than_equal": ("ge", "at least"),
    "less_than": ("lt", "less than"),
    "less_than_equal": ("le", "at most"),
}

Loc = Sequence[int | str]


def problems_in_words(document: Mapping[str, Any], error: ValidationError, model: type[BaseModel]) -> list[str]:
    """Return one line per problem, each with the key and what to do; of very many only the first ones.

    Args:
        document: The file as it was parsed.
        error: What pydantic found.
        model: Of the whole file.
    """
    lines: dict[str, str] = {}
    suggested: set[str] = set()
    items = [item for item in error.errors(include_url=False) if not _follows_from_others(item)]
    # Unknown keys first: one of them may be the one that is missing elsewhere.
    items.sort(key=lambda item: item["type"] != "extra_forbidden")
    for item in items[:_MOST]:
        key = _key(item["loc"], document)
        if item["type"] == "extra_forbidden":
            nearest = _nearest(str(item["loc"][-1]), _keys_at(model, item["loc"][:-1]))
            if nearest:
                suggested.add(".".join((*key.split(".")[:-1], nearest)))
            lines[key] = _unknown(nearest)
        elif item["type"] == "missing" and key in suggested:
            continue
        elif item["type"] in ("union_tag_invalid", "union_tag_not_found"):
            tag = item["ctx"]["discriminator"].strip("'")
            lines[f"{key}.{tag}"] = _choice(item)
        else:  # several for one value are the alternatives of a union
            words = _words(item, key)
            lines[key] = f"{lines[key]}, or {words.removeprefix('must be ')}" if key in lines else words
    told = [f"{key}: {words}" if key else words for key, words in lines.items()]
    return [*told, f"and {len(items) - _MOST} more"] if len(items) > _MOST else told


def _follows_from_others(item: ErrorDetails) -> bool:
    """Whether an array is only too short because of those of its values that are told of on their own."""
    return item["type"] == "too_short" and len(item["input"]) >= item["ctx"]["min_length"]


def _key(loc: Loc, document: Any) -> str:
    """Return the path of a key as it stands in the file: without the names of alternatives that pydantic adds."""
    path, node = "", document
    for place, part in enumerate(loc):
        last = place == len(loc) - 1
        if isinstance(part, int):
            path += f"[{part}]"
            node = node[part] if isinstance(node, list) and part < len(node) else None
        elif isinstance(node, dict) and not last and part in (node.get(tag) for tag in _TAGS):
            continue
        elif isinstance(node, dict) and part != "[key]":
            path += ("." if path else "") + (part if _BARE.fullmatch(str(part)) else _shown(part))
            node = node.get(part)
    return path


def _words(item: ErrorDetails, key: str) -> str:
    kind, context, shown = item["type"], item.get("ctx", {}), _shown(item["input"])
    if kind == "missing":
        return "is missing (add this key)" if isinstance(item["loc"][-1], str) else "is missing (add this value)"
    if kind in _KINDS:
        quoted = isinstance(item["input"], str) and kind in ("float_type", "int_type", "bool_type")
        return f"{_KINDS[kind]}, not {shown}{' (without quotes)' if quoted else ''}"
    if kind in _LIMITS:
        name, words = _LIMITS[kind]
        metres = " (this key is in metres; are these millimetres?)" if key.endswith("_m") and name in ("lt", "le") else ""
        return f"must be {words} {context[name]:g}, is {shown}{metres}"
    if kind == "literal_error":
        return f"must be {context['expected']}, not {shown}"
    if kind == "string_pattern_mismatch":
        form = FORM_IN_WORDS.get(context["pattern"], f"must be of the form {context['pattern']}")
        return f"{form}, not {shown}"
    if kind in ("too_short", "string_too_short"):
        return "must not be empty" if context["min_length"] == 1 else f"needs at least {context['min_length']}"
    if kind in ("too_long", "string_too_long"):
        what = "letters" if kind.startswith("string") else "values"
        return f"has too many {what}: at most {context['max_length']}"
    if kind == "json_invalid":
        return "tables or arrays are nested too deeply; is it a station file?"
    if kind == "value_error":
        return str(context["error"])
    return f"{item['msg'].replace('Input should', 'must')} (correct it)"


def _choice(item: ErrorDetails) -> str:
    context = item["ctx"]
    if item["type"] == "union_tag_not_found":
        return "is missing (add this key)"
    tags = [tag.strip("' ") for tag in context["expected_tags"].split(",")]
    nearest = _nearest(context["tag"], tags)
    guess = f"; did you mean {nearest}?" if nearest else ""
    return f"must be one of {', '.join(tags)}, not {_shown(context['tag'])}{guess}"


def _unknown(nearest: str | None) -> str:
    return f"is not known here; did you mean {nearest}?" if nearest else "is not known here (remove it or correct its spelling)"


def _nearest(word: str, known: Sequence[str]) -> str | None:
    return next(iter(difflib.get_close_matches(word, known, n=1)), None)


def _shown(value: object) -> str:
    text = json.dumps(value, ensure_ascii=False, default=str)
    return text if len(text) <= _SHOWN_LETTERS else f"{text[:_SHOWN_LETTERS]}…"


def _keys_at(model: type[BaseModel], loc: Loc) -> list[str]:
    """Return the keys that the table at `loc` may have."""
    found: Any = model
    for part in loc:
        found = next(_steps(found, part), None)
    return list(found.model_fields) if isinstance(found, type) and issubclass(found, BaseModel) else []


def _steps(annotation: Any, part: int | str) -> Iterator[Any]:
    """Yield the type of what `part` leads to, in each alternative of a type that has it."""
    origin = get_origin(annotation)
    if origin is Annotated:
        yield from _steps(get_args(annotation)[0], part)
    elif origin in (Union, types.UnionType):
        for alternative in get_args(annotation):
            yield from _steps(alternative, part)
    elif origin is dict:
        yield get_args(annotation)[1]
    elif isinstance(annotation, type) and issubclass(annotation, BaseModel):
        fields = annotation.model_fields
        choices = [get_args(fields[tag].annotation) for tag in _TAGS if tag in fields]
        if any(part in choice for choice in choices):
            yield annotation
        elif isinstance(part, str) and part in fields:
            yield fields[part].annotation
