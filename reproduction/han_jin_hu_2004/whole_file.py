"""Files that appear complete or not at all."""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO


@contextmanager
def whole_file(path: Path) -> Iterator[BinaryIO]:
    """Give a file to write, which takes its place at ``path`` when the block has ended well.

    Raises
    ------
    OSError
        If it cannot be written; names ``path``, and what was there before is as it was.
    """
    part = None
    try:
        handle, part = tempfile.mkstemp(prefix=path.name, suffix=".part", dir=path.parent)
        with os.fdopen(handle, "wb") as file:
            yield file
        # With the permissions of any new file, not only for its owner.
        mask = os.umask(0)
        os.umask(mask)
        os.chmod(part, 0o666 & ~mask)
        os.replace(part, path)
    except BaseException as error:
        if part is not None:
            os.unlink(part)
        if isinstance(error, OSError):
            raise OSError(
                error.errno, f"cannot be written ({error.strerror})", str(path)
            ) from error
        raise
