"""Points in NumPy's files: `.npy` (one array) and `.npz` (one array per stroke).

An array is (n, 2) of x, y, or (n, 3) of x, y, bulge; of any real or whole numbers. The name of
an array in an .npz is its layer. Pickled objects are never loaded: they could run anything.

An .npz is a ZIP: what it says of its own size is not believed, no more than MAX_UNPACKED_BYTES
are unpacked, and no memory is taken for numbers that are not there.
"""

from __future__ import annotations

import io
import math
import warnings
import zipfile
import zlib

import numpy as np

from camtool.errors import DrawingError
from camtool.geometry.polylines import Floats
from camtool.importers.points.stroke import COLUMNS, Stroke, Table

NPY_START = b"\x93NUMPY"
ZIP_START = b"PK\x03\x04"

MAX_UNPACKED_BYTES = 1 << 28
"""No more bytes than this are unpacked from one ZIP archive (268 MB: 16 million points)."""

MAX_MEMBERS = 100_000
"""A ZIP archive with more members is refused."""

_SAVE = "save it with numpy.save as an array (n, 2) of x, y or (n, 3) of x, y, bulge"


def parse_npy(data: bytes, file: str) -> Table:
    """The one stroke of an .npy; DrawingError when it is no such array."""
    return Table([Stroke(_array(data, file, ""), "of the array")])


def parse_npz(data: bytes, file: str) -> Table:
    """One stroke per array, on the layer of its name; DrawingError when one is none."""
    strokes: list[Stroke] = []
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            members = archive.infolist()
            if len(members) > MAX_MEMBERS:
                raise DrawingError(f"holds more than {MAX_MEMBERS} arrays", file=file)
            budget = MAX_UNPACKED_BYTES
            for member in members:
                layer = _layer(member.filename, file)
                with archive.open(member) as stream:
                    content = stream.read(budget + 1)
                budget -= len(content)
                if budget < 0:
                    raise DrawingError(
                        f"unpacks to more than {MAX_UNPACKED_BYTES // 1_000_000} MB",
                        file=file,
                        mend="split it into several files",
                    )
                points = _array(content, file, layer)
                strokes.append(Stroke(points, f"of array {layer}", layer=layer))
    # zipfile says so: a bad archive, a password, an unknown packing, a broken stream of bytes.
    except (zipfile.BadZipFile, RuntimeError, NotImplementedError, EOFError, OSError) as error:
        raise _broken(file, error) from error
    except (zlib.error, ValueError, OverflowError) as error:
        if isinstance(error, DrawingError):
            raise
        raise _broken(file, error) from error
    return Table(strokes)


def is_npz(data: bytes) -> bool:
    """Whether the first member of this ZIP archive is an array of NumPy."""
    length = int.from_bytes(data[26:28], "little")
    return data.startswith(ZIP_START) and data[30 : 30 + length].endswith(b".npy")


def _broken(file: str, error: Exception) -> DrawingError:
    reason = " ".join(str(error).split()) or type(error).__name__
    return DrawingError(f"cannot be unpacked: {reason}", file=file, mend="save it again")


def _layer(name: str, file: str) -> str:
    layer = name.removesuffix(".npy")
    if layer == name or not layer.isprintable() or not layer.strip():
        raise DrawingError(
            f"holds {name!r}, which is no array", file=file, mend="save it with numpy.savez"
        )
    return layer


def _array(data: bytes, file: str, name: str) -> Floats:
    """The points (n, 2) or (n, 3) of one .npy."""
    where = f"array {name}" if name else None
    shape, fortran, dtype, begin = _header(data, file, where)
    if dtype.hasobject or dtype.kind not in "fiu":
        what = "objects" if dtype.hasobject else f"numbers of type {dtype}"[:60]
        raise DrawingError(f"holds {what}, no coordinates", file=file, where=where, mend=_SAVE)
    if len(shape) != 2 or shape[1] not in COLUMNS:
        turned = len(shape) == 2 and shape[0] in COLUMNS
        raise DrawingError(
            f"is an array {shape}",
            file=file,
            where=where,
            mend="transpose it (array.T): a row is a point" if turned else _SAVE,
        )
    wanted = math.prod(shape) * dtype.itemsize
    if len(data) - begin != wanted:
        raise DrawingError(
            f"holds {len(data) - begin} bytes of numbers, wanted {wanted}", file=file, where=where
        )
    raw = np.frombuffer(data, dtype, offset=begin)
    with np.errstate(over="ignore", invalid="ignore"):
        points = raw.reshape(shape, order="F" if fortran else "C").astype(np.float64)
    _check(points, file, name)
    return points


def _header(
    data: bytes, file: str, where: str | None
) -> tuple[tuple[int, ...], bool, np.dtype[np.generic], int]:
    """Shape, order, type and where the numbers begin; the header is a literal and never run."""
    stream = io.BytesIO(data)
    try:
        version = np.lib.format.read_magic(stream)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of what a damaged header would mean elsewhere
            if version == (1, 0):
                shape, fortran, dtype = np.lib.format.read_array_header_1_0(stream)
            else:
                shape, fortran, dtype = np.lib.format.read_array_header_2_0(stream)
    # What a damaged header does to NumPy's reader is not documented.
    except Exception as error:
        raise DrawingError(
            "has a damaged header", file=file, where=where, mend="save it again"
        ) from error
    if any(size < 0 for size in shape):
        raise DrawingError(f"is an array {shape}", file=file, where=where, mend=_SAVE)
    return shape, bool(fortran), dtype, stream.tell()


def _check(points: Floats, file: str, name: str) -> None:
    """DrawingError naming the first row that is no point."""
    head = f"array {name}, " if name else ""
    odd = ~np.isfinite(points).all(axis=1)
    if odd.any():
        raise DrawingError(
            "a number is not finite", file=file, where=f"{head}row {int(np.argmax(odd))}"
        )
    steep = np.abs(points[:, 2:]).max(axis=1, initial=0.0) > 1.0
    if steep.any():
        raise DrawingError(
            "the third column is above 1: no bulge of an arc up to a half circle",
            file=file,
            where=f"{head}row {int(np.argmax(steep))}",
            mend="give two columns when the third one is a height; cut larger arcs in two",
        )
