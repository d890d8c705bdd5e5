"""What an installation consists of: steps that can be shown before they are done."""

import os
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from ghest_rt.errors import GhestError

_TIMEOUT_S = 60.0


class Step(Protocol):
    """One thing to do."""

    @property
    def shown(self) -> str:
        """The step in one line."""
        ...

    def do(self) -> None:
        """Do it.

        Raises:
            GhestError: It cannot be done; says why.
        """
        ...


@dataclass(frozen=True, slots=True)
class WriteFile:
    """Write a file in one piece; readable by all, unless `mode` says otherwise."""

    path: Path
    data: bytes
    mode: int = 0o644

    @property
    def shown(self) -> str:
        """See `Step.shown`."""
        return f"{'replace' if self.path.exists() else 'write'} {self.path}"

    def do(self) -> None:
        """See `Step.do`."""
        new = self.path.with_name(f".{self.path.name}.new")
        try:
            self.path.parent.mkdir(mode=0o755, parents=True, exist_ok=True)
            new.unlink(missing_ok=True)
            new.touch(mode=0o600, exist_ok=False)
            new.write_bytes(self.data)
            new.chmod(self.mode)
            new.replace(self.path)
        except OSError as error:
            raise GhestError(f"cannot write {self.path}: {error.strerror or error}{_need_root(error)}") from error


@dataclass(frozen=True, slots=True)
class RemoveFile:
    """Remove a file, and folders that are empty then, up to `keep`."""

    path: Path
    keep: Path

    @property
    def shown(self) -> str:
        """See `Step.shown`."""
        return f"remove {self.path}"

    def do(self) -> None:
        """See `Step.do`."""
        try:
            self.path.unlink(missing_ok=True)
        except OSError as error:
            raise GhestError(f"cannot remove {self.path}: {error.strerror or error}{_need_root(error)}") from error
        for folder in self.path.parents:
            if folder == self.keep or not folder.is_relative_to(self.keep):
                return
            try:
                folder.rmdir()
            except OSError:  # not empty
                return


@dataclass(frozen=True, slots=True)
class RunCommand:
    """Run a program of systemd's; `may_fail` for those whose failure leaves nothing undone."""

    command: tuple[str, ...]
    may_fail: bool = False

    @property
    def shown(self) -> str:
        """See `Step.shown`."""
        return f"run {' '.join(self.command)}"

    def do(self) -> None:
        """See `Step.do`."""
        try:
            done = subprocess.run(self.command, capture_output=True, text=True, timeout=_TIMEOUT_S, check=False)  # noqa: S603
        except FileNotFoundError as error:
            raise GhestError(f"{self.command[0]} is not there: this machine does not run systemd") from error
        except subprocess.TimeoutExpired as error:
            raise GhestError(f"{' '.join(self.command)}: no answer within {_TIMEOUT_S:.0f} s") from error
        if done.returncode != 0 and not self.may_fail:
            raise GhestError(f"{' '.join(self.command)}: exit code {done.returncode}: {done.stderr.strip()}")


def shown(steps: Sequence[Step]) -> list[str]:
    """Return the steps as lines."""
    return [step.shown for step in steps]


def _need_root(error: OSError) -> str:
    return "; run it as root: sudo ghest-rt install-service …" if isinstance(error, PermissionError) and os.geteuid() else ""
