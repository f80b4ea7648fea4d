"""What an SVG file may be made of: encodings, gzip, document types, bombs, damage."""

import gzip
import random
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import DrawingError
from camtool.geometry.drawing import Drawing
from camtool.importers.findings import DrawingCode
from camtool.importers.options import ReadOptions
from camtool.importers.svg import css as svg_css
from camtool.importers.svg import reader as svg_walk
from camtool.importers.svg import tree as svg_data
from camtool.importers.svg.reader import read

NAMES = (
    'xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" '
    'xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape"'
)
PAGE = 'width="100mm" height="100mm" viewBox="0 0 100 100"'
LINE = '<line x1="1" y1="2" x2="4" y2="6"/>'


def svg(body: str, page: str = PAGE) -> str:
    return f"<svg {NAMES} {page}>{body}</svg>"


def read_in(data: bytes) -> Drawing:
    return read(data, "part.svg", ReadOptions(tolerance_mm=0.05))


# ---- encodings and packing


@pytest.mark.parametrize(
    ("named", "codec", "layer"),
    [("UTF-8", "utf-8", "é切"), ("utf8", "utf-8-sig", "é切"), ("UTF-16", "utf-16", "é切"),
     ("UTF-16", "utf-16-le", "é切"), ("UTF-16", "utf-16-be", "é切"),
     ("ISO-8859-1", "latin-1", "é"), ("windows-1252", "cp1252", "é€"),
     ("Shift_JIS", "shift_jis", "切断"), ("GB2312", "gb2312", "切"), ("big5", "big5", "切"),
     ("koi8-r", "koi8-r", "рез"), ("us-ascii", "ascii", "cut")],
)  # fmt: skip
def test_encodings(named: str, codec: str, layer: str) -> None:
    text = f'<?xml version="1.0" encoding="{named}"?>' + svg(f'<g id="{layer}">{LINE}</g>')
    assert read_in(text.encode(codec)).layers == (layer,)


def test_utf_16_without_a_declaration_is_known_by_its_mark() -> None:
    assert read_in(svg(f'<g id="é">{LINE}</g>').encode("utf-16")).layers == ("é",)


@pytest.mark.parametrize(
    ("named", "codec"),
    [("utf-8", "cp1252"), ("shift_jis", "latin-1"), ("base64", "utf-8"), ("idna", "utf-8"),
     ("utf-7", "utf-8"), ("unicode_escape", "utf-8"), ("klingon", "utf-8"), ("rot13", "utf-8")],
)  # fmt: skip
def test_a_wrong_encoding_is_an_error(named: str, codec: str) -> None:
    text = f'<?xml version="1.0" encoding="{named}"?>' + svg(f'<g id="é\xff">{LINE}</g>')
    with pytest.raises(DrawingError, match=r"^part\.svg: ") as caught:
        read_in(text.encode(codec))
    assert "\n" not in str(caught.value)


def test_gzip_is_unpacked() -> None:
    packed = gzip.compress(svg(LINE).encode())
    assert len(read_in(packed).paths) == 1
    for broken in (packed[:40], packed[:20] + b"xx" + packed[22:], packed[:2], packed[:-6]):
        with pytest.raises(DrawingError, match="broken gzip"):
            read_in(broken)


def test_what_is_too_large_is_refused_packed_or_not(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(svg_data, "MAX_BYTES", 10_000)
    large = svg(LINE + " " * 10_000).encode()
    for data in (large, gzip.compress(large)):
        with pytest.raises(DrawingError, match="at most 0 MB"):
            read_in(data)
    assert len(read_in(svg(LINE).encode()).paths) == 1


# ---- document types and entities


def test_short_plain_entities_are_read() -> None:
    text = (
        '<!DOCTYPE svg PUBLIC "-//W3C//DTD SVG 1.1//EN"\n "http://localhost/svg11.dtd" [\n'
        '<!ENTITY ns_svg "http://www.w3.org/2000/svg">\n<!ENTITY far "50">]>\n'
        f'<svg xmlns="&ns_svg;" {PAGE}><line x2="&far;" y2="3"/></svg>'
    )
    drawing = read_in(text.encode())
    assert drawing.paths.vertices[:, 0].max() == 50.0
    assert drawing.sources == ("line at line 5",)


def test_many_references_to_entities_are_refused() -> None:
    text = '<!DOCTYPE svg [<!ENTITY a "aaa">]>' + svg(f'<g id="{"&a;" * 20_000}"/>' + LINE)
    with pytest.raises(DrawingError, match="declares XML entities"):
        read_in(text.encode())
    plain = svg(f"<text>{'&amp;' * 20_000}</text>{LINE}")
    assert len(read_in(plain.encode()).paths) == 1


@pytest.mark.parametrize(
    "kind",
    ['PUBLIC "-//W3C//DTD SVG 1.1//EN" "http://localhost/x.dtd"', "SYSTEM 'http://localhost/x'",
     "SYSTEM 'x' [<!ENTITY b 'x'>]", "[ %outside; ]", ""],
)  # fmt: skip
def test_an_entity_that_nobody_defines_never_vanishes_from_path_data(kind: str) -> None:
    text = f"<!DOCTYPE svg {kind}>" + svg('<path d="M0 0 &more; L5 5"/>')
    with pytest.raises(DrawingError, match=r"undefined entity|refers to"):
        read_in(text.encode())


def test_attribute_defaults_and_lines_survive_a_document_type() -> None:
    text = '<!DOCTYPE svg\nPUBLIC "a"\n"b">\n' + svg(f"{LINE}\n<circle r='x'/>")
    (item,) = read_in(text.encode()).skipped
    assert "circle at line 5" in item.reason


# ---- bombs


@pytest.mark.parametrize(
    "sheet",
    ["a" * 1_000_000, "/*" * 500_000, "@x{" * 100_000, "@x{}" * 50_000, "{" * 300_000,
     "<!--" * 100_000, "a," * 100_000 + "{stroke:red}", "[a" * 100_000 + "{stroke:red}"],
)  # fmt: skip
def test_large_sheets_take_linear_time(sheet: str) -> None:
    assert len(read_in(svg(f"<style><![CDATA[{sheet}]]></style>{LINE}").encode()).paths) == 1


def test_too_many_rules_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(svg_css, "MAX_MATCHES", 100_000)
    rules = "g g g g g line { stroke: red }" * 1000
    body = f"<style>{rules}</style>" + "<g>" * 100 + LINE * 100 + "</g>" * 100
    with pytest.raises(DrawingError, match="too many rules"):
        read_in(svg(body).encode())


def test_large_paths_may_not_be_drawn_over_and_over(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(svg_walk, "MAX_USED", 3000)
    corners = "<path id='p' d='M0 0" + "l1 1" * 20_000 + "'/>"
    curves = "<path id='p' d='M0 0" + "q0 0 1 1" * 1000 + "'/>"
    for path in (corners, curves):
        body = f"<defs>{path}</defs>" + "<use href='#p'/>" * 400
        with pytest.raises(DrawingError, match="drawn through use"):
            read_in(svg(body).encode())


@pytest.mark.parametrize(
    "body",
    ['<path d="M0 0C1e9 0 -5e8 1e9 3 4"/>', '<ellipse rx="9e8" ry="1e8"/>',
     '<path d="M0 0A1e11 1e11 0 0 1 1e10 1e10"/>', '<line x2="1e11"/>'],
)  # fmt: skip
def test_what_reaches_too_far_is_left_out(body: str) -> None:
    drawing = read_in(svg(LINE + body).encode())
    (item,) = drawing.skipped
    assert item.reason.startswith("cannot be drawn (")
    assert "too far to be exact" in item.reason
    assert len(drawing.paths) == 1


def test_a_path_of_many_subpaths_is_read() -> None:
    data = "".join(f"M{i} 0v5q1 1 .4 2z" for i in range(2000))
    assert len(read_in(svg(f'<path d="{data}"/>').encode()).paths) == 2000


# ---- which program wrote it


@pytest.mark.parametrize(
    ("head", "page", "dpi"),
    [("", 'inkscape:version="0.48.4 r9939" width="90" height="90"', "90"),
     ("", 'inkscape:version="0.91 r13725" width="90px" height="90px"', "90"),
     ("", 'inkscape:version="0.92.4" width="90" height="90"', None),
     ("", 'inkscape:version="1.3" width="90" height="90"', None),
     ("", 'inkscape:version="0.48" width="9mm" height="9mm" viewBox="0 0 9 9"', None),
     ("", 'inkscape:version="0.48" width="9mm" height="9mm"', "90"),
     ("<!-- Generator: Adobe Illustrator 24.0 -->", 'width="72" height="72"', "72")],
)  # fmt: skip
def test_programs_with_other_pixels_are_told(head: str, page: str, dpi: str | None) -> None:
    told = [
        finding
        for finding in read_in((head + svg(LINE, page)).encode()).findings
        if finding.code == DrawingCode.UNIT_GUESSED
    ]
    assert len(told) == (dpi is not None)
    assert not told or f"took {dpi} px an inch, and it was read so" in told[0].message
    read_so = read_in((head + svg(LINE, page)).encode())
    asked = read((head + svg(LINE, page)).encode(), "a.svg", ReadOptions(dpi=float(dpi or 96)))
    assert read_so.paths.vertices.tolist() == asked.paths.vertices.tolist()
    assert read_so.units == asked.units
    asked = read((head + svg(LINE, page)).encode(), "a.svg", ReadOptions(dpi=90.0))
    assert not [finding for finding in asked.findings if finding.code == DrawingCode.UNIT_GUESSED]


# ---- damage

WHOLE = f"""<?xml version="1.0" encoding="UTF-8"?>
<!DOCTYPE svg PUBLIC "-//W3C//DTD SVG 1.1//EN" "http://localhost/svg11.dtd" [<!ENTITY n "5">]>
<svg {NAMES} width="100mm" height="80mm" viewBox="0 0 100 80" preserveAspectRatio="xMidYMax slice">
<style>.cut, g > path[id] {{ stroke: rgb(10%, 20%, 30%) !important; clip-path: url(#c) }}
@media print {{ a {{ b: c }} }} #k {{ fill: hsl(3, 4%, 5%) }}</style>
<defs><symbol id="s" viewBox="0 0 10 10"><rect width="10" height="&n;" rx="1"/></symbol></defs>
<g inkscape:groupmode="layer" inkscape:label="CUT" transform="translate(3 4) rotate(30 5 5)">
<path id="p" class="cut" d="M10 10h5v5l-3-3z
m1e1 2C1 1 2 1 3 0S5 1 6 0Q1 1 2 0T4 0a5 3 3 0110 0z"/>
<use xlink:href="#s" x="5" y="5%" width="20"
style="transform: translate(3px, 4px) rotate(.1turn)"/>
<svg x="1" y="1" width="50%" height="20" viewBox="0 0 5 5">
<ellipse cx="2em" rx="1" ry="2ex"/></svg>
</g><switch><foreignObject/><polygon points="1,1 2,2 3,1" systemLanguage="de, en"/></switch>
<circle r="3" visibility="collapse"/><polyline points="0 0 5 5 5 9" stroke="url(#g) red"/>
</svg>"""

ODD = st.sampled_from(
    ["1e308", "-1e308", "NaN", "inf", "0", "-0", "1e-300", "1e12", "999999999", "%", "em", '"',
     "<", "</g>", "<g>", '<use href="#p"/>', "&a;", "\x00", "#s", "none", "matrix(0 0 0 0 0 0)",
     "scale(1e9)", "skewX(90)", "M", "A", "z", "{", "}", "/*", "<!--", "1e9", "1e-12", "\ud800"]
)  # fmt: skip


def test_the_whole_is_read() -> None:
    drawing = read_in(WHOLE.encode())
    assert drawing.used == {"path": 1, "rect": 1, "ellipse": 1, "polygon": 1, "polyline": 1}


def read_or_refused(data: bytes) -> None:
    try:
        read_in(data)
    except DrawingError as error:
        message = str(error)
        assert message.startswith("part.svg: ")
        assert "\n" not in message


@given(st.integers(0, len(WHOLE)))
def test_cut_anywhere(at: int) -> None:
    read_or_refused(WHOLE.encode()[:at])


@given(st.integers(0, WHOLE.count("\n")), st.binary(max_size=40))
def test_any_line_may_be_noise(line: int, noise: bytes) -> None:
    lines = WHOLE.encode().split(b"\n")
    lines[line] = noise
    read_or_refused(b"\n".join(lines))


NUMBER = re.compile(r"-?\d*\.?\d+")


@given(st.lists(st.tuples(st.integers(0, 10_000), ODD), min_size=1, max_size=4))
def test_any_numbers_may_be_wrong(changes: list[tuple[int, str]]) -> None:
    text = WHOLE
    for place, word in changes:
        found = list(NUMBER.finditer(text, text.index("<style>")))
        match = found[place % len(found)]
        text = text[: match.start()] + word + text[match.end() :]
    read_or_refused(text.encode("utf-8", errors="replace"))


@pytest.mark.slow
def test_thousands_of_mutations() -> None:
    seed = 20261121
    chance = random.Random(seed)
    for _ in range(5000):
        data = bytearray(WHOLE.encode())
        for _ in range(chance.choice([1, 1, 2, 4])):
            at = chance.randrange(len(data))
            size = chance.randrange(6)
            data[at : at + size] = bytes(chance.randrange(256) for _ in range(chance.randrange(6)))
        read_or_refused(bytes(data))
