"""`ghest-rt decrypt` and `ghest-rt recording-key`: sealed recordings, and the keys that open them."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path

import typer
from rich.console import Console
from rich.progress import BarColumn, DownloadColumn, Progress, TaskID, TextColumn, TimeRemainingColumn

from ghest_rt.errors import BadInputError
from ghest_rt.extras import need_extra
from ghest_rt.security.sealing import SEALED_SUFFIX, make_recording_key


def decrypt(sealed: Sequence[Path], key: Path, out: Path | None) -> None:
    """Restore sealed recordings beside themselves, or in another folder.

    Raises:
        BadInputError: A file is not sealed, not for this key or not readable; a restored file exists already; or a file was cut
            off or changed: then all that comes before is restored. Every other file is restored before this is raised.
        GhestError: The extra `security` is not installed.
    """
    need_extra("security", "a sealed recording")
    from ghest_rt.security.unsealing import load_keys, unseal  # noqa: PLC0415  (needs the extra `security`)

    keys = load_keys(key)
    paths = [path for given in sealed for path in _files(given)]
    wrong: list[str] = []
    columns = (TextColumn("{task.description}"), BarColumn(), DownloadColumn(), TimeRemainingColumn())
    console = Console(stderr=True)
    with Progress(*columns, console=console, disable=not console.is_terminal, transient=True) as bar:
        for path in paths:
            name = path.name.removesuffix(SEALED_SUFFIX)
            folder = path.parent if out is None else out
            try:
                folder.mkdir(parents=True, exist_ok=True)
                if name == path.name and folder == path.parent:
                    raise BadInputError(f"{path}: does not end in {SEALED_SUFFIX}; if it is sealed, name a folder with --out")
                task = bar.add_task(path.name, total=path.stat().st_size)
                restored = unseal(path, folder / name, keys, partial(_advance, bar, task))
            except BadInputError as error:
                wrong.append(str(error))
                continue
            typer.echo(f"{restored.path}: {restored.size_bytes / 1e6:.1f} MB")
            if not restored.whole:
                wrong.append(f"{path}: cut off or changed; {restored.path} holds what comes before, and can be read")
    if wrong:
        raise BadInputError("\n".join(wrong))


def recording_key(out: Path) -> None:
    """Make a pair of keys for sealed recordings.

    Raises:
        BadInputError: The file exists, or cannot be written.
        GhestError: The extra `security` is not installed.
    """
    public = make_recording_key(out)
    typer.echo(
        f"secret key: {out}: keep it off the stations, with a copy: without it sealed recordings are lost\n"
        f"public key: {public}\n"
        f'ghest-rt record --encrypt-to {public}, or [recorder] encrypt_to = ["{public}"] in the station file'
    )


def _advance(bar: Progress, task: TaskID, size_bytes: int) -> None:
    bar.update(task, completed=size_bytes)


def _files(given: Path) -> list[Path]:
    if not given.is_dir():
        if not given.exists():
            raise BadInputError(f"{given}: no such file")
        return [given]
    found = sorted(given.glob(f"*{SEALED_SUFFIX}"))
    if not found:
        raise BadInputError(f"{given}: no sealed recording (*{SEALED_SUFFIX}) in this folder")
    return found
