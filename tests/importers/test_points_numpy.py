"""NumPy's files: shapes and types, what is refused, and damaged archives."""

import io
import itertools
import math
import zipfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from camtool.errors import DrawingError
from camtool.geometry.drawing import Drawing
from camtool.importers.options import ReadOptions
from camtool.importers.points import tables as points_numpy
from camtool.importers.points.reader import read
from camtool.importers.read import read_bytes
from tests.fuzz.reading import read_or_refuse

SQUARE = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [0.0, 0.0]])


def npy(array: np.ndarray) -> bytes:
    stream = io.BytesIO()
    np.save(stream, array)
    return stream.getvalue()


def npz(packed: bool = True, **arrays: np.ndarray) -> bytes:
    stream = io.BytesIO()
    (np.savez_compressed if packed else np.savez)(stream, **arrays)
    return stream.getvalue()


def points(data: bytes, **options: object) -> Drawing:
    return read(data, "p.npy", ReadOptions(**options))


@pytest.mark.parametrize("kind", ["f8", "f4", "f2", ">f8", "i2", "u1", "i8"])
@pytest.mark.parametrize("order", ["C", "F"])
def test_any_real_or_whole_numbers(kind: str, order: str) -> None:
    drawing = points(npy(np.array(SQUARE, dtype=kind, order=order)))
    assert drawing.paths.closed.tolist() == [True]
    np.testing.assert_array_equal(drawing.paths.vertices[:, :2], SQUARE[:3])


def test_a_third_column_is_the_bulge() -> None:
    drawing = points(npy(np.array([[0, 0, 0.5], [2, 0, -1.0], [4, 0, 0.25]])), units="in")
    assert drawing.paths[0].vertices[:, 2].tolist() == [0.5, -1.0, 0.0]
    assert drawing.paths[0].end.tolist() == [101.6, 0.0]


def test_each_array_of_an_npz_is_a_stroke_on_its_layer() -> None:
    for packed in (False, True):
        drawing = points(npz(packed, CUT=SQUARE, MARK=SQUARE[1:3] + 10.0))
        assert drawing.layers == ("CUT", "MARK")
        assert drawing.paths.closed.tolist() == [True, False]
        assert drawing.used == {"stroke": 2}


@pytest.mark.parametrize(
    ("array", "message"),
    [
        (np.array([[0, None], [1, 2]], dtype=object), "holds objects"),
        (np.zeros((3, 2), dtype=complex), "numbers of type complex128"),
        (np.zeros((3, 2), dtype=bool), "numbers of type bool"),
        (np.zeros((3, 2), dtype="U3"), "no coordinates"),
        (np.zeros(3, dtype=[("x", "f8"), ("y", "f8")]), "no coordinates"),
        (np.zeros((2, 7)), "transpose it"),
        (np.zeros((7, 4)), "is an array (7, 4)"),
        (np.zeros(6), "is an array (6,)"),
        (np.float64(3.0), "is an array ()"),
        (np.zeros((2, 3, 2)), "is an array (2, 3, 2)"),
        (np.zeros((0, 2)), "holds no lines"),
        (np.array([[0.0, 1.0], [np.nan, 2.0]]), "row 1: a number is not finite"),
        (np.array([[0.0, 1.0], [2.0, -np.inf]]), "row 1: a number is not finite"),
        (np.array([[0.0, 1.0, 0.0], [2.0, 2.0, 5.0]]), "give two columns when the third one is a"),
    ],
)
def test_other_arrays_are_refused(array: np.ndarray, message: str) -> None:
    with pytest.raises(DrawingError) as caught:
        points(npy(array))
    assert message in str(caught.value)


def test_a_pickle_is_never_loaded(tmp_path: Path) -> None:
    class Bad:
        def __reduce__(self) -> tuple[object, tuple[str]]:
            return (Path.touch, (str(tmp_path / "ran"),))

    for data in (npy(np.array([Bad()], dtype=object)), npz(a=np.array([Bad()], dtype=object))):
        with pytest.raises(DrawingError, match="objects"):
            points(data)
    assert not (tmp_path / "ran").exists()


def test_a_header_that_promises_more_than_there_is_takes_no_memory() -> None:
    data = npy(SQUARE).replace(b"(4, 2), }" + b" " * 11, b"(400000000000, 2), }", 1)
    with pytest.raises(DrawingError, match=r"64 bytes of numbers, wanted 6400000000000"):
        points(data)
    with pytest.raises(DrawingError, match="bytes of numbers"):
        points(npy(SQUARE) + npy(SQUARE))
    with pytest.raises(DrawingError, match="bytes of numbers"):
        points(npy(SQUARE)[:-1])


def test_a_zip_bomb_is_stopped(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(points_numpy, "MAX_UNPACKED_BYTES", 1_000_000)
    small, large = np.zeros((20_000, 2)), np.zeros((1_000_000, 2))
    with pytest.raises(DrawingError, match="unpacks to more than 1 MB"):
        points(npz(a=large))
    with pytest.raises(DrawingError, match="unpacks to more than 1 MB"):
        points(npz(a=small, b=small, c=small, d=small))


def test_members_are_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(points_numpy, "MAX_MEMBERS", 2)
    with pytest.raises(DrawingError, match="more than 2 arrays"):
        points(npz(a=SQUARE, b=SQUARE, c=SQUARE))


@pytest.mark.parametrize("name", ["a.txt", "a\n.npy", ".npy"])
def test_archives_of_something_else_are_refused(name: str) -> None:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        archive.writestr("ok.npy", npy(SQUARE))
        archive.writestr(name, npy(SQUARE))
    with pytest.raises(DrawingError, match="which is no array"):
        points(stream.getvalue())


LENGTHS = st.floats(-1e5, 1e5, width=32)


@given(hnp.arrays(np.float64, st.tuples(st.integers(2, 12), st.just(2)), elements=LENGTHS))
def test_arrays_are_the_points_of_a_csv(rows: np.ndarray) -> None:
    if max(math.dist(a, b) for a, b in itertools.pairwise(rows.tolist())) < 1e-4:
        return
    text = "\n".join(f"{x!r},{y!r}" for x, y in rows.tolist()).encode()
    plain = read(text, "p.csv", ReadOptions(gap_mm=0.0))
    for data in (npy(rows), npy(np.asfortranarray(rows)), npz(a=rows)):
        told = read_bytes(data, "p", ReadOptions(gap_mm=0.0))
        np.testing.assert_array_equal(told.paths.vertices, plain.paths.vertices)


SAMPLES = (npy(SQUARE), npy(SQUARE.astype("f4")), npz(a=SQUARE), npz(False, a=SQUARE, b=SQUARE))


@given(
    st.sampled_from(SAMPLES),
    st.lists(st.tuples(st.integers(0, 10_000), st.integers(0, 255)), max_size=4),
    st.integers(0, 10_000),
)
def test_damaged_files_are_read_or_refused(
    data: bytes, changes: list[tuple[int, int]], cut: int
) -> None:
    broken = bytearray(data)
    for place, value in changes:
        broken[place % len(broken)] = value
    broken = broken[: cut % (2 * len(broken)) + 1]
    read_or_refuse(bytes(broken), "p.npy", ReadOptions(format="points"))
