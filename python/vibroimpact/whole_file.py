"""Files that appear complete or not at all; an error names the file and says what to do."""

import errno
import os
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

# What to do about an error of the file system, by its number.
_REMEDIES = {
    **dict.fromkeys((errno.ENOSPC, errno.EDQUOT, errno.EFBIG), "with room enough"),
    **dict.fromkeys((errno.EACCES, errno.EPERM, errno.EROFS), "with permission to write there"),
}


def remedy(error: OSError) -> str:
    """Return what to do so that writing is possible."""
    return _REMEDIES.get(error.errno or 0, "once it can be written")


@contextmanager
def whole_file(path: str | os.PathLike[str]) -> Iterator[BinaryIO]:
    """Give a file to write, which takes its place at ``path`` when the block has ended well.

    Until then, and also if writing fails or the process is killed, ``path`` is unchanged; a kill
    leaves a file ``*.part`` beside it. A device or a pipe is written as it is.

    Raises
    ------
    OSError
        If it cannot be written: the disk is full, the folder is missing, permission is denied ...
    """
    try:
        target = Path(os.path.realpath(path))  # what a link points to, not the link
        with open(target, "wb") if is_special(target) else _replacing(target) as file:
            yield file
    except OSError as error:
        raise OSError(
            error.errno or errno.EIO,
            f"cannot be written ({error.strerror or error}); {remedy(error)} the same call writes "
            "it, and a file that was there before is as it was",
            os.fspath(path),
        ) from error


def is_special(path: str | os.PathLike[str]) -> bool:
    """Say whether this is a device or a pipe, which is written as it is."""
    try:
        mode = os.stat(path).st_mode
    except OSError:
        return False
    return not (stat.S_ISREG(mode) or stat.S_ISDIR(mode))


@contextmanager
def _replacing(target: Path) -> Iterator[BinaryIO]:
    """Give a file beside the target that takes its place."""
    handle, part = tempfile.mkstemp(prefix=target.name, suffix=".part", dir=target.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            yield file
        os.chmod(part, _permissions(target))
        os.replace(part, target)
    except BaseException:
        os.unlink(part)
        raise


def _permissions(target: Path) -> int:
    """Return the permissions of the file that is replaced, or those of any new file."""
    try:
        return stat.S_IMODE(os.stat(target).st_mode)
    except FileNotFoundError:
        mask = os.umask(0)
        os.umask(mask)
        return 0o666 & ~mask
