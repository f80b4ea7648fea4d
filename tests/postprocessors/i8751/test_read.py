"""What the i8751 reader makes of packets, listings and hex dumps, good and bad."""

import numpy as np
import pytest
from camtool_postprocessors.i8751 import read as reading
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import ProgramError
from camtool.findings import Severity
from camtool.target.registry import LoadedTarget
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.findings import ProgramCode
from camtool.toolpath.moves import COLUMNS, Kind, Toolpath
from tests.oracles import i8751_packets
from tests.postprocessors.i8751.machines import OPTIONS, STEP_MM, loaded

pytestmark = pytest.mark.checked

RECORD = bytes.fromhex("01 03 00 64 02 05 00 02 03 04 01 2C 00 00")
"""X 100 steps forward, Y stands, 2 s, Z 300 steps back, no wait."""

STILL = bytes.fromhex("01 05 02 05 00 00 03 05 00 00")
ONE = b"\x13" + RECORD + b"\x45\x54"

LISTING = b"X+1.2500 Y+0.0000 T2 Z-3.7500 T0\nEND\n"

DUMP = b"""; a comment
0000  13              ; access key <- LISTO
0001  01 03 00 64     ; X +100 steps <- B M M M
0005  02 05           ; Y stands <- B M
0007  00 02           ; T1 2 s <- ? ?
0009  03 04 01 2C     ; Z -300 steps <- B M M M
000D  00 00           ; T2 0 s <- ? ?
000F  45              ; end of packet <- F
0010  54              ; end of data <- A
"""
EXAMPLES = {"packets": ONE, "listing": LISTING, "hex": DUMP}


def read(data: bytes, *settings: str) -> Toolpath:
    target = loaded(*settings)
    path: Toolpath = target.target.read(data, target.machine)
    return path


def rows(path: Toolpath) -> list[tuple[object, ...]]:
    """Kind, end in steps, value and block of each row."""
    return [
        (
            move.kind.name,
            *(round(value / STEP_MM, 6) for value in move.end),
            move.value,
            move.block,
        )
        for move in path
    ]


def test_a_high_byte_is_told_where_nobody_knows_its_worth() -> None:
    (found,) = read(ONE).findings
    assert (found.code, found.severity) == (ProgramCode.READ_TWO_WAYS, Severity.WARNING)
    assert (found.where, found.measured) == ("record 1", 1.0)
    assert "up to 1 step elsewhere" in found.message
    assert read(ONE, "long_runs=true").findings == ()
    short = b"\x13" + RECORD.replace(b"\x01\x2c", b"\x00\xff") + b"\x45\x54"
    assert read(short).findings == ()


@pytest.mark.parametrize("form", EXAMPLES)
def test_the_worked_example(form: str) -> None:
    path = read(EXAMPLES[form], f"format={form}")
    assert rows(path) == [
        ("RAPID", 100, 0, 0, None, 0),
        ("DWELL", 100, 0, 0, 2, 0),
        ("LINE", 100, 0, -300, None, 0),
        ("END", 100, 0, -300, None, 1),
    ]


def test_feeds_are_those_of_the_controller() -> None:
    path = read(
        b"\x13" + bytes.fromhex("01 05 02 05 00 00 03 04 00 50 00 00") + RECORD + b"\x45\x54"
    )
    z, x = path.feed[0], path.feed[1]
    assert z == pytest.approx(8.0 * STEP_MM * 60.0, rel=0.001)  # 80 steps: start rate
    assert x == pytest.approx(100 * STEP_MM / 6.27 * 60.0, rel=0.002)


def test_both_waits_and_several_packets() -> None:
    waits = bytes.fromhex("01 05 02 05 00 07 03 05 00 FF")
    data = b"\x13" + waits * 5 + b"\x45" + RECORD + STILL + b"\x45\x54"
    path = read(data)
    assert [move.value for move in path if move.kind == Kind.DWELL] == [7, 255] * 5 + [2]
    assert [move.block for move in path if move.value == 255] == [0, 1, 2, 3, 4]
    assert path.block[-1] == 7


@pytest.mark.parametrize(
    ("setting", "record", "xyz"),
    [
        ("plus_backward=xz", RECORD, (-100, 0, 300)),
        ("high_byte='255'", RECORD, (100, 0, -299)),
        ("first_pulse=repeats", RECORD, (99, 0, -299)),
        (
            "dwell_mark=30H",
            RECORD.replace(b"\x00\x02\x03", b"\x30\x02\x03")[:-2] + b"\x30\x00",
            (100, 0, -300),
        ),
    ],
)
def test_other_readings(setting: str, record: bytes, xyz: tuple[int, int, int]) -> None:
    path = read(b"\x13" + record + b"\x45\x54", setting)
    assert rows(path)[-1][1:4] == xyz


def test_a_key_for_each_packet() -> None:
    data = b"\x13" + RECORD + b"\x45\x13" + RECORD + b"\x45\x54"
    assert rows(read(data, "key=each-packet"))[-1][1:4] == (200, 0, -600)
    with pytest.raises(ProgramError, match=r"record 2, byte 17 .*: 13H: wanted motor 01H"):
        read(data)
    with pytest.raises(ProgramError, match=r"access key 13H; see dialect\.key"):
        read(b"\x13" + RECORD + b"\x45" + RECORD + b"\x45\x54", "key=each-packet")


BAD = {
    "nothing": (b"", "the program is empty"),
    "no key": (RECORD, "byte 1 (offset 0000): 01H is not the access key 13H"),
    "text": (LISTING, "use --set dialect.format=listing or hex"),
    "key alone": (b"\x13", "record 1, byte 2 (offset 0001): the program breaks off"),
    "end at once": (b"\x13\x54", "54H: wanted motor 01H"),
    "empty packet": (b"\x13\x45\x54", "45H: wanted motor 01H"),
    "empty second packet": (
        b"\x13" + STILL + b"\x45\x45\x54",
        "record 2, byte 13 (offset 000C): 45H",
    ),
    "no 45H": (
        b"\x13" + STILL + b"\x54",
        "record 2, byte 12 (offset 000B): 54H: wanted motor 01H",
    ),
    "no 54H": (b"\x13" + STILL + b"\x45", "breaks off: wanted 45H before it ended a packet"),
    "after 54H": (ONE + b"\x00", "a byte after 54H, the end of data; remove it"),
    "line end": (ONE + b"\r\n", "a byte after 54H"),
    "six records": (
        b"\x13" + STILL * 6 + b"\x45\x54",
        "record 6, byte 52 (offset 0033): 01H where the packet must end",
    ),
    "motor 2 first": (
        b"\x13" + STILL[2:],
        "record 1, byte 2 (offset 0001): 02H: wanted motor 01H",
    ),
    "sense 06": (
        b"\x13\x01\x06",
        "byte 3 (offset 0002): 06H: wanted the sense of motor 1: 03H, 04H or 05H",
    ),
    "sense cut": (b"\x13\x01", "byte 3 (offset 0002): the program breaks off: wanted the sense"),
    "PH cut": (b"\x13\x01\x03", "wanted PH of motor 1"),
    "PL cut": (b"\x13\x01\x03\x00", "wanted PL of motor 1"),
    "no motor 2": (b"\x13\x01\x05\x03\x05", "03H: wanted motor 02H"),
    "no T1": (b"\x13\x01\x05\x02\x05\x03\x05", "03H: wanted 00H before T1"),
    "ASCII dwell": (
        b"\x13\x01\x05\x02\x05\x30\x05",
        "30H: wanted 00H before T1; use --set dialect.dwell_mark=30H",
    ),
    "T1 cut": (b"\x13\x01\x05\x02\x05\x00", "wanted the seconds of T1"),
    "no T2": (b"\x13" + STILL[:-2] + b"\x45\x54", "45H: wanted 00H before T2"),
    "standing with steps": (b"\x13\x01\x05\x00\x64", "00H: wanted motor 02H"),
    "turning without steps": (
        b"\x13\x01\x03\x00\x00" + STILL[2:] + b"\x45\x54",
        "byte 4 (offset 0003): a motor turns, but for 0 steps",
    ),
    "ASCII digits": (b"\x131 3 0 100", "31H: wanted motor 01H"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_packets(name: str) -> None:
    expect(*BAD[name])


BAD_LISTINGS = {
    "blank": (b" \n", "line 2, column 1: the listing breaks off; its last line is END"),
    "only END": (b"END\n", "the program is empty"),
    "no END": (LISTING[:-4], "record 2, line 2, column 1: the listing breaks off"),
    "half an END": (LISTING[:-2], "record 2, line 2, column 1: 'EN': wanted X with a sign"),
    "small end": (LISTING.lower(), "wanted X"),
    "after END": (
        LISTING + LISTING,
        "record 2, line 3, column 1: 'X+1.2500 Y+0.0000 T2 Z-3.7500 T0' after END",
    ),
    "no sign": (
        b"X1.25 Y+0.0 T2 Z-3.75 T0\n",
        "line 1, column 1: 'X1.25 Y+0.0 T2 Z-3.75 T0': wanted X with a sign",
    ),
    "no Y": (b"X+1.25 T2 Z-3.75 T0\n", "column 8: 'X+1.25 T2 Z-3.75 T0': wanted Y"),
    "no T1": (
        b"X+1.25 Y+0.0 Z-3.75 T0\n",
        "column 14: 'X+1.25 Y+0.0 Z-3.75 T0': wanted T with whole seconds",
    ),
    "no T2": (b"X+1.25 Y+0.0 T0 Z-3.75\n", "column 23: 'X+1.25 Y+0.0 T0 Z-3.75': wanted T"),
    "order": (b"Y+1.25 X+0.0 T0 Z-3.75 T0\n", "column 1: 'Y+1.25 X+0.0 T0 Z-3.75 T0': wanted X"),
    "comma": (
        b"X+1,25 Y+0,0 T0 Z-3,75 T0\n",
        "wanted X with a sign, digits, a point and decimals; write a point, no comma",
    ),
    "no digits": (b"X+.5 Y+0.0 T0 Z+0.0 T0\n", "column 1: "),
    "no decimals": (b"X+5. Y+0.0 T0 Z+0.0 T0\n", "column 1: "),
    "no point": (b"X+5 Y+0.0 T0 Z+0.0 T0\n", "column 1: "),
    "exponent": (
        b"X+5.0e1 Y+0.0 T0 Z+0.0 T0\n",
        "column 6: 'X+5.0e1 Y+0.0 T0 Z+0.0 T0': wanted Y",
    ),
    "fraction of a second": (b"X+1.25 Y+0.0 T0.5 Z+0.0 T0\n", "column 16: "),
    "long wait": (
        b"X+1.25 Y+0.0 T256 Z+0.0 T0\n",
        "record 1, line 1, column 15: 256 s is more than a byte",
    ),
    "too far": (
        b"X+819.2000 Y+0.0 T0 Z+0.0 T0\n",
        "column 2: +819.2000 mm is more than 65535 steps",
    ),
    "more": (
        b"X+1.25 Y+0.0 T0 Z+0.0 T0 F5\n",
        "column 26: 'X+1.25 Y+0.0 T0 Z+0.0 T0 F5': wanted nothing more",
    ),
    "two on a line": (
        b"X+1.25 Y+0.0 T0 Z+0.0 T0 X+1.25 Y+0.0 T0 Z+0.0 T0\n",
        "wanted nothing more",
    ),
    "bytes": (ONE, "line 1, column 1: the byte 13H belongs to no text; for packets"),
    "not ASCII": (b"; \r\n; \xc2\xb5m\n", "line 2, column 3: the byte C2H belongs to no text"),
    "hex": (DUMP, "line 2, column 1: '0000 13 ; access key <- LI…': wanted X"),
}


@pytest.mark.parametrize("name", BAD_LISTINGS)
def test_bad_listings(name: str) -> None:
    expect(*BAD_LISTINGS[name], "format=listing")


BAD_DUMPS = {
    "blank": (b"; nothing\n", "the program is empty"),
    "offset": (
        DUMP.replace(b"0005", b"0006"),
        "line 4, column 1: offset 0006, but 0005 bytes came before",
    ),
    "missing line": (
        DUMP.replace(b"0007  00 02           ; T1 2 s <- ? ?\n", b""),
        "line 5, column 1: offset 0009, but 0007",
    ),
    "no offset": (b"13 01 05\n", "line 1, column 1: '13 01 05' is no line of a hex dump"),
    "three digits": (DUMP.replace(b"03 00 64", b"03 000 64"), "line 3, column 13: "),
    "one digit": (DUMP.replace(b"03 00 64", b"03 0 64"), "line 3, column 13: "),
    "no hex digit": (DUMP.replace(b"03 00 64", b"03 0G 64"), "line 3, column 13: "),
    "no comment sign": (DUMP.replace(b"; Y", b"  Y"), "line 4, column 25: "),
    "bad byte": (
        DUMP.replace(b"01 03 00 64", b"01 06 00 64"),
        "record 1, offset 0002, line 3, column 10: 06H: wanted the sense",
    ),
    "cut": (
        DUMP[: DUMP.index(b"000D")],
        "record 1, offset 000D, line 6, column 7: the program breaks off",
    ),
    "no line end": (DUMP[:-1], "line 9, column 41: the last line has no end"),
    "wrong reply": (
        DUMP.replace(b"<- B M\n", b"<- B B\n"),
        "offset 0005, line 4: replies 'B B', expected 'B M'",
    ),
    "few replies": (DUMP.replace(b"<- B M\n", b"<- B\n"), "replies 'B', expected 'B M'"),
    "listing": (
        LISTING,
        "line 1, column 1: 'X+1.2500 Y+0.0000 T2 Z-3.7500 T0' is no line of a hex dump",
    ),
    "NUL": (DUMP.replace(b"13 ", b"13\x00"), "line 2, column 9: the byte 00H belongs to no text"),
}


@pytest.mark.parametrize("name", BAD_DUMPS)
def test_bad_dumps(name: str) -> None:
    expect(*BAD_DUMPS[name], "format=hex")


def expect(data: bytes, message: str, *settings: str) -> None:
    """A ProgramError of one printable line that says so."""
    with pytest.raises(ProgramError) as caught:
        read(data, *settings)
    assert message in str(caught.value)
    assert len(str(caught.value)) < 300
    assert str(caught.value).isprintable()


def test_text_in_other_hands() -> None:
    """Blank lines, comments, blanks and each kind of line end are taken."""
    plain = rows(read(LISTING, "format=listing"))
    loose = b"; part 7\r\n\r  X+1.25\tY-0.0  T2 Z-3.75 T000 \rEND\r\n \n; done\n"
    assert rows(read(loose, "format=listing")) == plain
    no_comments = b"".join(line.split(b";")[0].rstrip() + b"\r\n" for line in DUMP.splitlines())
    assert rows(read(no_comments.lower(), "format=hex")) == plain
    assert rows(read(b"0000 " + ONE.hex(" ").encode() + b"\n", "format=hex")) == plain


def test_distances_that_are_no_steps_are_rounded_and_counted() -> None:
    path = read(b"X+1.0060 Y+1.0005 T0 Z-0.0070 T0\nEND\n", "format=listing")
    assert rows(path)[-1][1:4] == (80, 80, -1)
    (finding,) = path.findings
    assert (finding.code, finding.measured) == (ProgramCode.VALUE_ROUNDED, pytest.approx(0.48))
    assert finding.message.startswith("2 distances")


@pytest.mark.parametrize("form", EXAMPLES)
def test_cut_anywhere(form: str) -> None:
    whole = rows(read(EXAMPLES[form], f"format={form}"))
    for length in range(len(EXAMPLES[form])):
        try:
            path = read(EXAMPLES[form][:length], f"format={form}")
        except ProgramError:
            continue
        # Only the end of the last line may be missing, and only where END already says it all.
        assert form == "listing"
        assert length == len(LISTING) - 1
        assert rows(path) == whole


@pytest.mark.parametrize("form", EXAMPLES)
@given(data=st.binary(max_size=60))
def test_noise(form: str, data: bytes) -> None:
    target = loaded(f"format={form}")
    for noise in (data, EXAMPLES[form][:20] + data, data + EXAMPLES[form]):
        read_or_refused(target, noise)


def read_or_refused(target: LoadedTarget, data: bytes) -> Toolpath | None:
    """The moves, or None after a ProgramError of one printable line."""
    try:
        path: Toolpath = target.target.read(data, target.machine)
    except ProgramError as error:
        message = str(error)
    else:
        return path
    assert message.isprintable()
    return None


@pytest.mark.parametrize("form", EXAMPLES)
@given(
    at=st.integers(0, 400), byte=st.integers(0, 255), how=st.sampled_from(["set", "insert", "cut"])
)
def test_one_wrong_byte(form: str, at: int, byte: int, how: str) -> None:
    target = loaded(f"format={form}")
    data = bytearray(EXAMPLES[form])
    at %= len(data)
    if how == "insert":
        data.insert(at, byte)
    elif how == "set":
        data[at] = byte
    else:
        del data[at]
    path = read_or_refused(target, bytes(data))
    assert path is None or path.kind[-1] == Kind.END


@pytest.mark.parametrize("form", EXAMPLES)
@pytest.mark.parametrize(
    "line",
    [
        b"X" * 10_000_000,
        b"0" * 10_000_000,
        b"0000" + b" 00" * 3_300_000,
        b" " * 10_000_000,
        b"0000 00" + b" " * 10_000_000 + b"!",
        b"\x13" + STILL * 1_000_000,
    ],
    ids=["letters", "digits", "bytes", "blanks", "gap", "records"],
)
def test_ten_megabytes_on_a_line(form: str, line: bytes) -> None:
    expect(line, "", f"format={form}")


@pytest.mark.parametrize("option", OPTIONS)
def test_noise_under_every_option(option: str) -> None:
    target = loaded(option)
    for length in range(len(ONE)):
        with pytest.raises(ProgramError):
            target.target.read(ONE[:length], target.machine)


def test_the_reader_starts_at_part_zero() -> None:
    assert read(ONE).start.tolist() == ToolpathBuilder().finish().start.tolist()


def test_records_that_move_nothing() -> None:
    path = read(b"\x13" + STILL * 2 + b"\x45\x54")
    assert rows(path) == [("END", 0, 0, 0, None, 2)]


MOTORS = st.one_of(
    st.just(b"\x05"),
    st.tuples(st.sampled_from(b"\x03\x04"), st.integers(0, 2), st.integers(0, 255)).map(bytes),
)
RECORDS = st.tuples(MOTORS, MOTORS, st.integers(0, 255), MOTORS, st.integers(0, 1))
PIECES = st.lists(
    st.one_of(
        st.lists(RECORDS, min_size=1, max_size=5), st.binary(min_size=0, max_size=3), st.none()
    ),
    max_size=8,
)


def stream(pieces: list[object], mark: int, *, keys: bool) -> bytes:
    """Packets, and among them anything."""
    data = b"\x13"
    for number, piece in enumerate(pieces):
        if isinstance(piece, bytes):
            data += piece
        elif piece is None:
            data = data[:-1]
        else:
            data += b"\x13" if keys and number else b""
            for x, y, before, z, after in piece:  # type: ignore[attr-defined]
                data += b"\x01" + x + b"\x02" + y + bytes([mark, before])
                data += b"\x03" + z + bytes([mark, after])
            data += b"\x45"
    return data + b"\x54"


@given(
    PIECES,
    st.sampled_from(["plus_backward=xz", "key=each-packet", "dwell_mark=30H", "high_byte='255'"]),
    st.sampled_from(["first_pulse=moves", "first_pulse=repeats"]),
    st.integers(1, 6),
)
def test_packets_are_read_as_one_record_at_a_time(
    pieces: list[object], setting: str, pulse: str, at_once: int
) -> None:
    machine = loaded(setting, pulse).machine
    keys, mark = setting == "key=each-packet", machine.dialect.dwell_mark_byte
    data = stream(pieces, mark, keys=keys)

    def outcome(reader: type) -> object:
        try:
            return reader(data, machine.dialect).read()
        except reading.ByteFault as fault:
            return fault.offset, fault.record, fault.message, fault.mend

    wanted = outcome(i8751_packets.PacketReader)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(reading, "RECORDS_AT_ONCE", at_once)
        found = outcome(reading.PacketReader)
    if isinstance(found, reading.Decoded):
        assert np.column_stack([found.steps, found.waits]).tolist() == [
            list(record)
            for record in wanted  # type: ignore[attr-defined]
        ]
    else:
        assert found == wanted


@given(st.lists(st.lists(RECORDS, min_size=1, max_size=5), min_size=1), st.integers(1, 6))
def test_rows_do_not_depend_on_how_many_records_are_read_together(
    pieces: list[object], at_once: int
) -> None:
    data = stream(pieces, 0, keys=False).replace(b"\x03\x00\x00", b"\x03\x00\x01")
    data = data.replace(b"\x04\x00\x00", b"\x04\x00\x01")
    whole = read(data)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(reading, "RECORDS_AT_ONCE", at_once)
        parts = read(data)
    assert parts.findings == whole.findings
    for name in COLUMNS:
        assert np.array_equal(getattr(parts, name), getattr(whole, name), equal_nan=True)
