"""Write files, tables and folders whole or not at all; read files up to a size.

Whatever ends a program early, nothing half-written replaces what was there.
"""

import csv
import json
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from errno import EACCES, EISDIR
from io import StringIO
from pathlib import Path
from select import select
from shutil import copymode, rmtree
from tempfile import TemporaryFile
from typing import Any, BinaryIO, TextIO, TypeVar

from reference.paper import InputError

PART = ".fire-rescue-part-"  # begins the name of what is being written
LARGEST_NUMBER = 2.0**64  # limit of numbers in files: larger ones would overflow


@contextmanager
def errors_naming(what: Path | str) -> Iterator[None]:
    """Turn errors about something, such as a file, into InputErrors that name it."""
    try:
        yield
    except (InputError, OSError) as error:
        raise InputError(f"{what}: {message_of(error)}") from error


def message_of(error: Exception) -> str:
    """Put an error into words for people; system errors name their file."""
    if not isinstance(error, OSError) or error.strerror is None:
        return str(error)
    file = f"{error.filename}: " if error.filename else ""
    return f"{file}cannot be read or written ({error.strerror})."


# -- Writing ------------------------------------------------------------------------


@contextmanager
def _reworded_errors(path: Path, advice: str) -> Iterator[None]:
    """Reword what the system says of writing; others have words already."""
    try:
        yield
    except OSError as error:
        if error.strerror is None:
            raise
        words = f"{path}: cannot be written ({error.strerror}). {advice}"
        raise OSError(words) from error


def refuse_unwritable(path: Path) -> None:
    """Raise OSError for a file that cannot be written: better now than after an hour.

    Its folder is made later.
    """
    with _reworded_errors(path, "Name a file in a folder that is yours."):
        if path.is_dir():
            raise IsADirectoryError(EISDIR, os.strerror(EISDIR))
        if path.exists() and not os.access(path, os.W_OK):
            raise PermissionError(EACCES, os.strerror(EACCES))
        there = next(above for above in path.absolute().parents if above.exists())
        with TemporaryFile(dir=there) as file:
            file.write(b"x")  # the disk may be full


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a path for a file or folder that replaces this one after the block.

    Folders on the way to it are made. A folder replaces none but an empty one. Who may
    read and write it stays as it was. If the block ends early, even by Ctrl-C, what was
    made is removed. Raises OSError with a message for people.
    """
    whole = Path(os.path.realpath(path))  # which also takes a link to itself
    own = f"{PART}{whole.stem[:40]}-{os.getpid()}{whole.suffix}"
    partial = whole.with_name(own)
    advice = "What was there is as it was. Make room, or name another place."
    with _reworded_errors(path, advice), folder_for_block(whole.parent):
        try:
            yield partial
            if whole.exists():
                copymode(whole, partial)
            os.replace(partial, whole)
        finally:
            _remove(partial)


def remove_parts(folder: Path) -> None:
    """Remove what was being written in a folder by processes that were killed."""
    for partial in folder.glob(f"{PART}*"):
        _remove(partial)


def _remove(path: Path) -> None:
    """Remove a file or folder, if it is there and can be removed."""
    rmtree(path, ignore_errors=True)
    with suppress(OSError):
        path.unlink()


def write_whole(path: Path, content: bytes | memoryview) -> None:
    """Write a partial file, flush it to disk, then replace the file at once."""
    with replacing(path) as partial, partial.open("wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())


def write_json(path: Path, content: dict[str, Any]) -> None:
    """Write an object for `read_json`, whole or not at all.

    Raises InputError for a name in it that is no text, OSError.
    """
    text = json.dumps(content, indent=2, ensure_ascii=False) + "\n"
    if not is_text(text):
        raise InputError(f"{path}: would hold a name that is no UTF-8. Rename it.")
    write_whole(path, text.encode())


def is_text(word: str) -> bool:
    """Whether UTF-8 can write it: names of files may be any bytes."""
    try:
        word.encode()
    except UnicodeEncodeError:
        return False
    return True


def make_folder(folder: Path) -> None:
    """Make the folder, if there is none. Raises OSError with a message for people."""
    with _reworded_errors(folder, "Name another folder."):
        folder.mkdir(parents=True, exist_ok=True)


@contextmanager
def folder_for_block(folder: Path) -> Iterator[None]:
    """Make the folder, and those on the way to it; remove them if they stay empty.

    Raises OSError with a message for people.
    """
    new = [one for one in (folder, *folder.parents) if not one.exists()]
    try:
        make_folder(folder)
        yield
    finally:
        with suppress(OSError):  # one that holds something stays
            for one in new:
                one.rmdir()


# -- Reading ------------------------------------------------------------------------


def refuse_no_file(path: Path) -> None:
    """Raise InputError for a folder, and for a device or pipe, which may never end."""
    if path.exists() and not path.is_file():
        raise InputError(f"{path}: is a folder, a device or a pipe. Name a file.")


PIPE_SECONDS = 1.0  # that a pipe's writer may let us wait before it opens it


def open_to_read(path: Path) -> BinaryIO:
    """Open a file; a pipe that nobody writes to is at its end. Raises OSError.

    The system's own open would wait for a writer for ever.
    """
    if not path.is_fifo():
        return path.open("rb")
    pipe = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
    select([pipe], [], [], PIPE_SECONDS)
    os.set_blocking(pipe, True)  # reads wait for a writer that is there
    return os.fdopen(pipe, "rb")


def read_text(path: Path, most: int = 1 << 22) -> str:
    """Read a text of at most `most` bytes. Raises ValueError, OSError."""
    refuse_no_file(path)
    with path.open("rb") as file:
        content = file.read(most + 1)
    if len(content) > most:
        raise InputError(f"{path}: has more than {most:,} bytes. Name another file.")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(f"{path}: is no text. Save it as UTF-8.") from None


def read_json(path: Path) -> dict[str, Any]:
    """Read a JSON object as plain data. Raises ValueError for others, OSError."""
    text = read_text(path)
    with suppress(ValueError, RecursionError):
        content = json.loads(text)
        writable = is_text(json.dumps(content, ensure_ascii=False))
        if isinstance(content, dict) and writable:
            return content
    raise InputError(f"{path}: is no JSON object, or is damaged. Name another file.")


# -- Tables -------------------------------------------------------------------------

RowMade = TypeVar("RowMade")
LONGEST_LINE = 1 << 20  # of a table, characters: a foreign file may have no other
csv.field_size_limit(LONGEST_LINE)  # a cell lists all who died


class Table:
    """A CSV file to which rows are appended; missing values stay empty."""

    def __init__(
        self, path: Path, columns: Sequence[str], rows: Iterable[Mapping[str, Any]]
    ):
        """Write the file anew, whole, with these rows. Raises OSError."""
        self.path = path
        self.columns = columns
        write_whole(path, self._text([dict(zip(columns, columns, strict=True)), *rows]))

    def append(self, rows: Iterable[Mapping[str, Any]]) -> None:
        """Add rows at the end, on disk. Raises OSError with a message for people."""
        advice = "A row that is cut is left out. Make room."
        with _reworded_errors(self.path, advice), self.path.open("ab") as file:
            file.write(self._text(rows))
            file.flush()
            os.fsync(file.fileno())

    def _text(self, rows: Iterable[Mapping[str, Any]]) -> bytes:
        text = StringIO()
        csv.DictWriter(text, self.columns, lineterminator="\n").writerows(rows)
        return text.getvalue().encode()


def read_table(
    path: Path,
    columns: Sequence[str],
    made: Callable[[dict[str, str]], RowMade],
    advice: str = "Name another folder.",
) -> list[RowMade]:
    """Read the rows of a `Table` through `made`; none where there is no file.

    advice: what to do about a file that is another table
    An unfinished last row is dropped. Raises ValueError for a file that holds anything
    else, OSError for one that cannot be read.
    """
    if not path.exists():
        return []
    refuse_no_file(path)
    with path.open(encoding="utf-8-sig", errors="replace", newline="\n") as file:
        whole = _whole_lines(file)
        head = next(whole, "")
        if path.stat().st_size and head.rstrip("\r\n") != ",".join(columns):
            raise InputError(f"{path}: is no table of these runs. {advice}")
        lines = csv.reader(whole)
        try:
            return [made(_by_column(columns, row)) for row in lines if row]
        except (ValueError, csv.Error) as error:
            raise InputError(
                f"{path}:{lines.line_num + 1}: this row is damaged ({error!s:.99}). "
                "Remove it, or begin anew in another folder."
            ) from error


def _whole_lines(file: TextIO) -> Iterator[str]:
    """Yield lines up to one that has no end yet; what is too long comes in parts."""
    for line in iter(lambda: file.readline(LONGEST_LINE), ""):
        if line[-1] != "\n" and len(line) < LONGEST_LINE:
            return
        yield line


def _by_column(columns: Sequence[str], row: Sequence[str]) -> dict[str, str]:
    """Name a row's cells. Raises InputError where some are missing, or too many."""
    if len(row) != len(columns):
        raise InputError(f"it has {len(row)} cells, the table {len(columns)} columns")
    return dict(zip(columns, row, strict=True))


def read_number(cell: str) -> float:
    """Read a cell's number. Raises ValueError if it is not finite or absurdly large."""
    value = float(cell)
    if not abs(value) <= LARGEST_NUMBER:
        raise InputError(f"{cell:.40} is no number of a run")
    return value
