"""Files: written whole or not at all, into folders that are made where there are none.

Whatever ends a program early, nothing half-written takes the place of what was there.
"""

import os
from pathlib import Path


def write_whole(path: Path, content: bytes | memoryview) -> None:
    """Write beside the file, down to the disk, then take its place at once."""
    partial = path.with_name(f".{path.name}-{os.getpid()}.part")
    try:
        with partial.open("wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        os.replace(partial, path)
    except OSError as error:
        raise OSError(
            f"{path}: cannot be written ({error.strerror}); what was there before is "
            "as it was. Make room, or take another folder."
        ) from error
    finally:
        partial.unlink(missing_ok=True)


def make_folder(folder: Path) -> None:
    """The folder, if there is none. Raises OSError with a message for people."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OSError(
            f"{folder}: cannot be made ({error.strerror}). Name another folder."
        ) from error
