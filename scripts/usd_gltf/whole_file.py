"""Files that are either whole or not there, as `src/store/atomic.rs` writes them.

A temporary file is locked while it is written. The system drops the lock when its writer dies, so a
later writer in the same folder can tell what is left over, and removes it.
"""

from __future__ import annotations

import fcntl
import os
import tempfile
from pathlib import Path

PREFIX, SUFFIX = ".candelabra-", ".part"


def write_atomically(path: Path, data: bytes) -> None:
    """Write to a temporary file in the same folder, flush it to the disk, rename it. The file is as
    open as the user's mask allows."""
    path.parent.mkdir(parents=True, exist_ok=True)
    sweep(path.parent)
    handle, temporary = tempfile.mkstemp(prefix=PREFIX, suffix=SUFFIX, dir=path.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            _lock(file)
            file.write(data)
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


def sweep(folder: Path) -> None:
    """Remove the temporary files in a folder that dead writers have left."""
    for path in folder.glob(f"{PREFIX}*{SUFFIX}"):
        try:
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
