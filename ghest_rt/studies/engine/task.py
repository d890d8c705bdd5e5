"""What a task of a study is: a description that can be hashed, stored and sent, and the function that carries it out."""

import hashlib
import importlib
import json
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from numpy.typing import NDArray

Json = Mapping[str, object]


@dataclass(frozen=True, slots=True, eq=False)
class Result:
    """What a task found.

    Attributes:
        values: Scalars and rows, as JSON takes them.
        arrays: Larger data that other tasks need.
    """

    values: dict[str, object]
    arrays: dict[str, NDArray[Any]] = field(default_factory=dict)


Handler = Callable[[dict[str, object], Sequence[Result]], Result]


@dataclass(frozen=True, slots=True)
class Task:
    """One piece of a study.

    Attributes:
        kind: The function that carries it out, as "package.module:function": it takes the parameters and the results of
            `needs`, and returns a `Result`. Workers import it by this name.
        parameters_json: Its parameters, as canonical JSON text.
        needs: Tasks whose results it takes.
        cost: How long it takes, in any unit common to a study; for progress and order alone.
    """

    kind: str
    parameters_json: str
    needs: tuple["Task", ...] = ()
    cost: float = field(default=1.0, compare=False)

    @staticmethod
    def of(kind: str, parameters: Json, *, needs: tuple["Task", ...] = (), cost: float = 1.0) -> "Task":
        """Return a task from parameters that JSON can take."""
        return Task(kind, json.dumps(parameters, sort_keys=True, separators=(",", ":"), allow_nan=False), needs, cost)

    def __str__(self) -> str:
        return f"{self.kind} {self.parameters_json}"

    @property
    def parameters(self) -> dict[str, object]:
        """The parameters."""
        parsed: dict[str, object] = json.loads(self.parameters_json)
        return parsed

    def key(self, salt: Callable[[str], str]) -> str:
        """Return the hash of everything the result depends on: kind, parameters, needs and the code.

        Args:
            salt: What the code of a kind is hashed to, such as `ghest_rt.studies.engine.salt.code_salt`.
        """
        parts = (self.kind, self.parameters_json, salt(self.kind), *(need.key(salt) for need in self.needs))
        return hashlib.sha256("\0".join(parts).encode()).hexdigest()[:32]

    def run(self, needs: Sequence[Result]) -> tuple[Result, float]:
        """Carry the task out; return its result and the processor time it took, seconds.

        Args:
            needs: The results of the tasks needed, in their order.
        """
        start_s = time.process_time()
        result = find_handler(self.kind)(self.parameters, needs)
        return result, time.process_time() - start_s


def find_handler(kind: str) -> Handler:
    """Return the function that a kind names."""
    module, _, name = kind.partition(":")
    handler: Handler = getattr(importlib.import_module(module), name)
    return handler
