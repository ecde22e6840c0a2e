"""One writer at a time: a lock that the end of the process releases in every case.

It is the operating system's lock (``flock``; on Windows ``msvcrt.locking``) of a file within the
store, which is there while the store is written. After a kill the file stays, without a lock. A
regular file, because network file systems know locks of files only: NFS holds them between
machines, Lustre if it is mounted with ``flock``.
"""

import os
import sys
import warnings
from contextlib import suppress
from pathlib import Path

from ..errors import ParameterError

LOCK = ".lock"
# Others may remove the file between its opening and its locking, each of them once.
_TRIALS = 100


class Lock:
    """The lock of the store at ``path``, held until ``release``.

    Where the file system has no locks there is none, and a RuntimeWarning says so.

    Raises
    ------
    ParameterError
        If another holds it.
    OSError
        If the file cannot be made.
    """

    def __init__(self, path: Path) -> None:
        self._file = path / LOCK
        self._handle: int | None = None
        for _ in range(_TRIALS):
            handle = os.open(self._file, os.O_RDWR | os.O_CREAT, 0o666)
            try:
                _lock(handle)
            except BlockingIOError as error:
                os.close(handle)
                raise ParameterError(
                    f"store = {str(path)!r} is being written by another process; wait until it ends"
                ) from error
            except OSError as error:
                os.close(handle)
                self.release()
                warnings.warn(
                    f"store = {str(path)!r}: the file system has no locks ({error.strerror}); see "
                    "to it that no other process writes there",
                    RuntimeWarning,
                    stacklevel=2,
                )
                return
            self._handle = handle
            if self._is_there():
                return
            os.close(handle)
            self._handle = None
        raise ParameterError(f"store = {str(path)!r} is being written by many others; wait")

    def _is_there(self) -> bool:
        """Whether the locked file is still the one that others will open."""
        assert self._handle is not None
        try:
            return os.path.samestat(os.fstat(self._handle), os.stat(self._file))
        except FileNotFoundError:
            return False

    def release(self) -> None:
        """Release the lock."""
        with suppress(OSError):  # gone with the store; or Windows, where an open file stays
            self._file.unlink()
        if self._handle is not None:
            os.close(self._handle)
            self._handle = None


def _lock(handle: int) -> None:
    """Lock an open file without waiting; BlockingIOError if another process has the lock."""
    if sys.platform == "win32":
        import msvcrt

        try:
            msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
        except PermissionError as error:
            raise BlockingIOError(error.errno, error.strerror) from error
    else:
        import fcntl

        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
