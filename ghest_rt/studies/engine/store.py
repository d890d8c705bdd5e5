"""Results on disk, one file per task, so that an interrupted study goes on where it was."""

import hashlib
import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ghest_rt.errors import BadInputError, GhestError
from ghest_rt.studies.engine.task import Result


@dataclass(frozen=True, slots=True)
class ResultStore:
    """A folder of results named by their tasks' keys: `<key>.json`, with `<key>.npz` beside it where there are arrays.

    A result is there once its JSON file is: files appear whole or not at all, whatever happens to the process that writes.
    One that was damaged afterwards, be it by a single bit, does not count as there, and is made again: values and arrays are
    kept with their hashes.

    Attributes:
        folder: Where they are.
    """

    folder: Path

    def prepare(self) -> None:
        """Make the folder, before hours are spent on results that could not be kept.

        Raises:
            BadInputError: It cannot be made or written to.
        """
        probe = self.folder / f".{os.getpid()}.probe"
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            probe.touch()
            probe.unlink()
        except OSError as error:
            raise BadInputError(
                f"--out: {self.folder} cannot be written to: {error.strerror or error}; name another folder"
            ) from error

    def has(self, key: str) -> bool:
        """Say whether a result is there, whole."""
        try:
            found = self._read(key)
        except (OSError, ValueError):
            return False
        if not isinstance(found, dict) or not {"cpu_s", "values", "values_sha256", "arrays_sha256"} <= set(found):
            return False
        if _hash_of_json([found["cpu_s"], found["values"]]) != found["values_sha256"]:
            return False
        try:
            return found["arrays_sha256"] is None or _hash_of_file(self._npz(key)) == found["arrays_sha256"]
        except OSError:
            return False

    def save(self, key: str, result: Result, cpu_s: float) -> None:
        """Keep a result.

        Args:
            key: Its task's key.
            result: The result.
            cpu_s: Processor time it took.

        Raises:
            GhestError: The folder cannot be written to.
        """
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            arrays_sha256 = None
            if result.arrays:
                part = self.folder / f".{key}.{os.getpid()}.npz"
                np.savez(part, allow_pickle=False, **result.arrays)
                arrays_sha256 = _hash_of_file(part)
                part.replace(self._npz(key))
            part = self.folder / f".{key}.{os.getpid()}.json"
            kept = {
                "cpu_s": cpu_s,
                "values": result.values,
                "values_sha256": _hash_of_json([cpu_s, result.values]),
                "arrays_sha256": arrays_sha256,
            }
            part.write_text(json.dumps(kept), encoding="utf-8")
            part.replace(self._json(key))
        except OSError as error:
            raise GhestError(f"{self.folder}: results cannot be kept: {error.strerror or error}") from error

    def values(self, key: str) -> dict[str, object]:
        """Return a result's scalars and rows."""
        found: dict[str, object] = self._read(key)["values"]
        return found

    def cpu_s(self, key: str) -> float:
        """Return the processor time that a result took."""
        return float(self._read(key)["cpu_s"])

    def load(self, key: str) -> Result:
        """Return a result with its arrays.

        Raises:
            GhestError: It was damaged since `has` said that it is there.
        """
        if not self.has(key):
            raise GhestError(f"{self._json(key)}: a result was damaged; run the same command again, and it is made again")
        arrays = {}
        if self._read(key)["arrays_sha256"] is not None:
            with np.load(self._npz(key), allow_pickle=False) as file:
                arrays = {name: file[name] for name in file.files}
        return Result(self.values(key), arrays)

    def _read(self, key: str) -> dict[str, Any]:
        found: dict[str, Any] = json.loads(self._json(key).read_text(encoding="utf-8"))
        return found

    def _json(self, key: str) -> Path:
        return self.folder / f"{key}.json"

    def _npz(self, key: str) -> Path:
        return self.folder / f"{key}.npz"


def _hash_of_json(values: object) -> str:
    return hashlib.sha256(json.dumps(values, sort_keys=True).encode()).hexdigest()


def _hash_of_file(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
