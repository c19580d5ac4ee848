"""Files that are either whole or not there, as `src/store/atomic.rs` writes them.

A temporary file is locked while it is written. The system drops the lock when its writer dies, so a
later writer in the same folder can tell what is left over, and removes it.
"""

from __future__ import annotations

import fcntl
import os
import tempfile
import time
from pathlib import Path

PREFIX, SUFFIX = ".candelabra-", ".part"
_LONGEST_WRITE_S = 24 * 3600
_TRIES = 8


def _own_prefix() -> str:
    """The prefix, and what tells this machine, since it was started, from others."""
    try:
        boot = Path("/proc/sys/kernel/random/boot_id").read_text()
    except OSError:
        boot = ""
    return f"{PREFIX}{boot.split('-')[0].strip()}-"


def write_atomically(path: Path, *parts: bytes) -> None:
    """Write `parts`, one after another, to a temporary file in the same folder, flush it to the disk, rename
    it. The file is as open as the user's mask allows."""
    path.parent.mkdir(parents=True, exist_ok=True)
    sweep(path.parent)
    file, temporary = _temporary_file(path.parent)
    try:
        with file:
            file.writelines(parts)
            file.flush()
            mask = os.umask(0)
            os.umask(mask)
            os.chmod(temporary, 0o666 & ~mask)
            os.fsync(file.fileno())
            # Open, and so locked, until it has its own name.
            os.replace(temporary, path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise


def _temporary_file(folder: Path):
    """A locked file and its name. A sweeper may come between its making and its lock, but not many
    times in a row."""
    for _ in range(_TRIES):
        handle, name = tempfile.mkstemp(prefix=_own_prefix(), suffix=SUFFIX, dir=folder)
        file = os.fdopen(handle, "wb")
        _lock(file)
        if os.path.exists(name):
            return file, name
        file.close()
    raise OSError(f"{folder}: another program removes temporary files as fast as they are made")


def sweep(folder: Path) -> None:
    """Remove the temporary files in a folder that dead writers have left; those of other machines,
    whose locks may not be seen here, when they are a day old."""
    for path in folder.glob(f"{PREFIX}*{SUFFIX}"):
        try:
            is_own = path.name.startswith(_own_prefix())
            if not is_own and time.time() - path.stat().st_mtime < _LONGEST_WRITE_S:
                continue
            with path.open("rb") as file:
                if path.is_file() and not path.is_symlink() and _lock(file):
                    path.unlink()
        except OSError:
            pass  # It is gone, or another user's: in nobody's way.


def _lock(file) -> bool:
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        return True
    except OSError:
        return False
