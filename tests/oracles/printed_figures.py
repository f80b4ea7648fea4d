"""The printed forms of a report, read as a person reads them: summary, Markdown, HTML, picture.

Shares no code with the report. Each form becomes lines of (name, value) and tables; each number
must be that of the JSON report, rounded to as many places as are shown. A line that nobody here
can read is a fault too: so no figure is printed that is not looked at.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from html import unescape
from html.parser import HTMLParser
from typing import Any

Json = dict[str, Any]
NUMBER = r"(?<![A-Za-z\d.])[-−+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?"
HALF = 0.5000001
"""Rounding is off by so much of the last place."""


@dataclass
class Form:
    """One printed form: its `lines` of a name and a value, and its tables: head and rows."""

    lines: list[tuple[str, str]] = field(default_factory=list)
    tables: list[tuple[list[str], list[list[str]]]] = field(default_factory=list)

    def values(self, name: str) -> list[str]:
        """All values of lines of this name."""
        return [value for key, value in self.lines if key == name]


def read_summary(text: str) -> Form:
    """The summary on a terminal: a name of up to ten letters, then its value."""
    form = Form()
    for line in text.splitlines():
        if found := re.fullmatch(r"([a-z][a-z ]{0,9}?) {1,10}(\S.*)", line):
            if line[10:11] == " ":
                form.lines.append((line[:10].strip(), line[11:]))
            elif found[1].endswith(":") is False:
                form.lines.append((found[1], found[2]))
    return form


def read_markdown(text: str) -> Form:
    """A page in Markdown."""
    form = Form()
    rows: list[list[str]] = []
    for line in [*text.splitlines(), ""]:
        if line.startswith("|"):
            cells = re.split(r"(?<!\\)\|", line)[1:-1]
            rows.append([_plain(cell) for cell in cells])
            continue
        if rows:
            form.tables.append((rows[0], rows[2:]))
            rows = []
        if found := re.fullmatch(r"- \*\*(.+?):\*\* (.*)", line):
            form.lines.append((found[1], _plain(found[2])))
    return form


def _plain(words: str) -> str:
    words = words.replace("<!-- -->", "")
    return re.sub(r"\\(.)", r"\1", words).strip()


class _Tables(HTMLParser):
    """The tables of a page: those with a head, and those of names and values."""

    def __init__(self) -> None:
        super().__init__()
        self.rows: list[list[str]] = []
        self.form, self.cell, self.has_head = Form(), "", False
        self.depth = 0

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """A table, a row or a cell begins."""
        if tag == "table":
            self.rows, self.has_head = [], False
        elif tag == "tr":
            self.rows.append([])
        elif tag == "thead":
            self.has_head = True
        elif tag in ("td", "th"):
            self.cell = ""

    def handle_data(self, data: str) -> None:
        """Text of a cell."""
        self.cell += data

    def handle_endtag(self, tag: str) -> None:
        """A cell or a table ends."""
        if tag in ("td", "th"):
            self.rows[-1].append(self.cell.strip())
        elif tag == "table" and self.has_head:
            self.form.tables.append((self.rows[0], self.rows[1:]))
        elif tag == "table":
            self.form.lines += [(row[0], row[1]) for row in self.rows if len(row) == 2]


def read_html(text: str) -> Form:
    """A page in HTML."""
    parser = _Tables()
    parser.feed(text)
    return parser.form


def read_picture(text: str) -> Form:
    """The labels of a picture, in its order: they are strokes, with their words as titles."""
    return Form([("label", unescape(each)) for each in re.findall(r"<title>(.*?)</title>", text)])


def numbers(words: str) -> list[tuple[float, int]]:
    """The numbers in a text, and how many decimals each shows; −1 for a power of ten."""
    found = []
    for each in re.findall(NUMBER, words):
        mantissa = each.replace("−", "-")
        places = len(mantissa.partition(".")[2]) if "e" not in mantissa else -1
        found.append((float(mantissa), places))
    return found


def differ(words: str, values: Sequence[float | None], significant: int | None = None) -> str:
    """Describe the numbers of a text that differ from these; "–" stands for none."""
    shown = re.findall(NUMBER + "|–", words)
    if len(shown) != len(values):
        return f"{words!r} shows {len(shown)} numbers instead of {len(values)}"
    for each, value in zip(shown, values, strict=True):
        if (each == "–") != (value is None):
            return f"{words!r} shows {each} for {value}"
        if value is None:
            continue
        (got, places), *_ = numbers(each)
        if significant is not None and value:
            places = min(places, 30)
            unit = 10.0 ** (math.floor(math.log10(abs(value))) + 1 - significant)
        else:
            unit = 10.0**-places
        if abs(got - value) > HALF * unit + 1e-12:
            return f"{words!r} shows {each} for {value}"
        if each.startswith("-") or (got == 0.0 and each[0] in "−-"):
            return f"{words!r} shows {each}"
    return ""


# The lines of a summary.


def _clock(words: str) -> float:
    hours, minutes, seconds = (int(each) for each in words.split(":"))
    if minutes > 59 or seconds > 59:
        return math.nan
    return 3600.0 * hours + 60.0 * minutes + seconds


def _in_words(words: str) -> float:
    """Seconds of "1 h 2 min 5 s"."""
    each = {"h": 3600.0, "min": 60.0, "s": 1.0}
    found = re.findall(r"(\d+) (h|min|s)\b", words)
    return sum(int(count) * each[unit] for count, unit in found) if found else math.nan


def _times(words: str, values: Sequence[float]) -> str:
    shown = re.findall(r"\d+:\d\d:\d\d", words)
    if len(shown) != len(values):
        return f"{words!r} shows {len(shown)} times instead of {len(values)}"
    off = [abs(_clock(one) - value) for one, value in zip(shown, values, strict=True)]
    return "" if max(off) <= HALF else f"{words!r} is not {list(values)} s"


def _target(report: Json, words: str) -> str:
    return "" if words.startswith(report["target"]) else f"target {words!r}"


def _size(report: Json, words: str) -> str:
    x, y = report["dimensions"][:2]
    centre = "centre" in (x["of"], y["of"])
    if centre != (" of the tool's centre" in words):
        return f"{words!r} is of {x['of']}, {y['of']}"
    shape = NUMBER.join(["", " × ", " mm.*; predicted error X ", " %, Y ", " %"])
    if not re.fullmatch(shape, words) and "–" not in words:
        return f"{words!r} is no size"
    values = [item[key] for key in ("nominal_mm", "error_percent") for item in (x, y)]
    return differ(words, values)


def _travel(report: Json, words: str) -> str:
    values = [limit for axis in "xyz" for limit in report["extents_mm"][axis]]
    return differ(words, values)


def _program(report: Json, words: str) -> str:
    keys = [key for key in ("contours", "moves", "blocks", "bytes") if report[key] is not None]
    if re.findall(r"[a-z]+", words) != keys:
        return f"{words!r} does not name {keys}"
    return differ(words, [report[key] for key in keys])


def _time(report: Json, words: str) -> str:
    split = report["time_split_s"]
    values = [report["time_s"]]
    values += [split["cutting"]] if "cutting" in words else []
    return _times(words, [*values, split["link"]] if "line" in words else values)


def _steps(report: Json, words: str) -> str:
    return differ(words, [report["steps"][axis] for axis in "xyz"])


def _reversals(report: Json, words: str) -> str:
    found = report["reversals"]
    return differ(words, [*(found[axis] for axis in "xyz"), *(found["cutting"][k] for k in "xy")])


def _rapids(report: Json, words: str) -> str:
    planned = report["planned"]
    return differ(words, [planned["rapid_mm"], planned["rapid_drawn_mm"]])


def _error(report: Json, words: str) -> str:
    total = report["error_um"]["total"]
    remark = "no drawing is known" in words
    if remark != (report["against"] == "program"):
        return f"{words!r} against {report['against']}"
    figures, _, gouges = words.partition("; gouges of ")
    if bool(gouges) and all(each["code"] != "GOUGE" for each in report["findings"]):
        return f"{words!r} and no finding of it"
    return differ(figures.partition(";")[0], [total["max"], total["rms"], total["p95"]])


def gouges_mm(form: Form) -> float:
    """The gouges that come on top of the error, 0.0 where none are told, mm."""
    found = re.search(rf"; gouges of ({NUMBER}) mm", " ".join(form.values("error")))
    return float(found[1]) if found else 0.0


def _source(report: Json, words: str) -> str:
    error = report["error_um"]
    named = ["fit", "rounding", "interpolation", "mechanics"]
    if re.findall(r"[a-z]+", words) != [*named, "m"][: len(re.findall(r"[a-z]+", words))]:
        return f"{words!r} names other sources"
    return differ(words, [error[name]["max"] for name in named])


def _depth(report: Json, words: str) -> str:
    return differ(words, [report["error_um"]["depth_max"]])


def _closure(report: Json, words: str) -> str:
    return differ(words, [report["closure_um"]])


def _ends(report: Json, words: str) -> str:
    return differ(words, [report["unreached"]["moves"], report["unreached"]["max_um"]])


def _shape(report: Json, words: str) -> str:
    shape = report["shape"]
    keys = ("overcut_um", "overcut_mm2", "undercut_um", "undercut_mm2")
    body, _, tool = words.rpartition("(tool ")
    body = body.replace("mm²", "")
    wrong = differ(body, [shape[key] for key in keys])
    return wrong or differ(tool, [shape["tool_diameter_mm"]], significant=6)


LINES: dict[str, Callable[[Json, str], str]] = {
    "target": _target,
    "size": _size,
    "travel": _travel,
    "program": _program,
    "time": _time,
    "steps": _steps,
    "reversals": _reversals,
    "rapids": _rapids,
    "error": _error,
    "by source": _source,
    "depth": _depth,
    "closure": _closure,
    "ends": _ends,
    "shape": _shape,
}
PROSE = (
    "blank",
    "by hand",
    "clamps",
    "cut",
    "machine",
    "stock",
    "zero",
    "mounted",
    "program",
    "not known",
    "dimension",
)


def _cut(operation: Json, words: str) -> str:
    """`pocket: tool 2 mm, …, feed 500 mm/min, plunge 500 mm/min, 3 mm deep in 3 passes …`."""
    name = operation["name"] or operation["kind"]
    if not words.startswith(f"{name}: "):
        return f"{words!r} is not of {name!r}"
    parts = {
        "tool_diameter_mm": rf"tool.*? ({NUMBER}) mm,",
        "feed_mm_min": rf"feed ({NUMBER}) mm/min",
        "plunge_mm_min": rf"plunge ({NUMBER}) mm/min",
        "depth_mm": rf"({NUMBER}) mm deep",
        "passes": r" in (\d+) pass",
        "deepest_pass_mm": rf"passes of ({NUMBER}) at most",
        "spindle_rpm": rf"spindle ({NUMBER})",
    }
    for key, pattern in parts.items():
        value, found = operation[key], re.search(pattern, words[len(name) + 2 :])
        if key == "deepest_pass_mm" and operation["passes"] == 1:
            continue
        if value in (None, 0.0) and found is None:
            continue
        if found is None or value is None:
            return f"{words!r} does not say {key} {value}"
        if wrong := differ(found[1], [value], significant=4 if key.endswith("mm") else 6):
            return f"{key}: {wrong}"
    return ""


def wrong_lines(report: Json, form: Form) -> Iterator[str]:
    """Return the lines of a form that differ from the report."""
    cuts = form.values("cut")
    operations = report["planned"]["operations"] if report["planned"] else []
    if len(cuts) != len(operations):
        yield f"{len(cuts)} lines of {len(operations)} operations"
    for operation, words in zip(operations, cuts, strict=False):
        if wrong := _cut(operation, words):
            yield wrong
    seen = set[str]()
    for name, words in form.lines:
        if name in LINES and not words.startswith("digest"):
            seen.add(name)
            if wrong := LINES[name](report, words):
                yield f"{name}: {wrong}"
        elif name not in LINES and name not in PROSE and not re.search(r"^--|\.", name):
            yield f"a line that is not known here: {name}: {words}"
    for name in ("target", "travel", "program", "time", "steps", "reversals", "error"):
        if name not in seen:
            yield f"no line of {name}"
    if bool(report["dimensions"]) != ("size" in seen):
        yield "a size and no line of it, or the other way round"


def wrong_picture(report: Json, form: Form) -> Iterator[str]:
    """Return the words in a picture's margin and scale of errors that differ from the report."""
    labels = form.values("label")
    words = " ".join(labels)
    total = report["error_um"]["total"]
    error = re.search(r"predicted error (.*?) µm at most, rms (.*?) µm", words)
    if error is None:
        yield "picture: no error"
    elif wrong := differ(f"{error[1]} {error[2]}", [total["max"], total["rms"]]):
        yield f"picture: {wrong}"
    head = re.search(rf"{report['target']}: ([\dhmins ]+), (\d+) reversals", words)
    turns = report["reversals"]["cutting"]
    if head is None:
        yield "picture: no time"
    elif (
        abs(_in_words(head[1]) - report["time_s"]) > HALF
        or int(head[2]) != turns["x"] + turns["y"]
    ):
        yield f"picture: {head[0]} of {report['time_s']} s and {turns}"
    if "error (µm)" in labels and total["max"]:
        top = labels[labels.index("error (µm)") - 1]
        shown = numbers(top)
        if not shown or shown[0][0] < total["max"] - HALF * 10.0 ** -shown[0][1]:
            yield f"picture: a scale up to {top} µm for {total['max']}"


# The tables of a page.


def _row(*values: float | None) -> list[float | None]:
    return list(values)


def _dimension_rows(report: Json) -> list[list[float | None]]:
    keys = ("nominal_mm", "predicted_mm", "error_percent")
    return [[item[key] for key in keys] for item in report["dimensions"]]


def _source_rows(report: Json) -> list[list[float | None]]:
    names = ("fit", "rounding", "interpolation", "mechanics", "total")
    error = report["error_um"]
    return [[error[name].get(key) for key in ("max", "rms", "p95")] for name in names]


def _circle_rows(report: Json) -> list[list[float | None]]:
    keys = ("radius_mm", "G_um", "Fmax_um", "Fmin_um", "D_um", "fit_um")
    return [[item[key] for key in keys] for item in report["circles"]]


def _contour_rows(report: Json) -> list[list[float | None]]:
    keys = ("max_um", "rms_um", "mean_um", "fit_um", "interpolation_um", "mechanics_um")
    ordered = sorted(report["contour_errors"], key=lambda item: -item["max_um"])
    return [[item[key] for key in keys] for item in ordered]


def _worst_rows(report: Json) -> list[list[float | None]]:
    keys = ("total_um", "fit_um", "interpolation_um", "mechanics_um")
    return [[item[key] for key in keys] for item in report["worst"]]


TABLES: dict[str, Callable[[Json], list[list[float | None]]]] = {
    "dimension": _dimension_rows,
    "error by source": _source_rows,
    "circle at mm": _circle_rows,
    "contour": _contour_rows,
    "worst moves": _worst_rows,
}
UNITS = {"mm": "_mm", "µm": "_um"}


def wrong_tables(report: Json, form: Form, most: int) -> Iterator[str]:
    """Return the cells of a page's tables that differ from the report; `most` rows are shown."""
    heads = {head[0]: (head, rows) for head, rows in form.tables}
    for name, rows_of in TABLES.items():
        wanted = rows_of(report)
        if not wanted and name not in heads:
            continue
        if name not in heads:
            yield f"no table of {name}"
            continue
        _, rows = heads[name]
        if len(rows) != min(len(wanted), most):
            yield f"{name}: {len(rows)} rows of {len(wanted)}"
        for row, values in zip(rows, wanted, strict=False):
            cells = row[-len(values) :]
            for cell, value in zip(cells, values, strict=True):
                if wrong := differ(cell, [value]):
                    yield f"{name}: {wrong}"
    if "operation" in heads:
        yield from _wrong_operations(report, *heads["operation"])


OPERATION_COLUMNS = {
    "depth mm": "depth_mm",
    "leaves mm": "leaves_mm",
    "m/min": "surface_speed_m_min",
    "feed mm/min": "feed_mm_min",
    "mm per tooth": "chip_load_mm",
    "plunge mm/min": "plunge_mm_min",
}


def _wrong_operations(report: Json, head: list[str], rows: list[list[str]]) -> Iterator[str]:
    """Yield the cells that differ; a column that is not there says a dash."""
    for operation, row in zip(report["planned"]["operations"], rows, strict=False):
        cells = dict(zip(head, row, strict=True))
        for name, key in OPERATION_COLUMNS.items():
            cell, value = cells.get(name, "–").partition(" (")[0], operation[key]
            if cell == "–" and not value:
                continue
            digits = {"surface_speed_m_min": 3, "chip_load_mm": 2}.get(key, 4)
            if wrong := differ(cell, [value], significant=digits):
                yield f"operations, {key}: {wrong}"
        passes, rpm, time = cells.get("passes", "–"), cells["rev/min"], cells["time"]
        if passes != ("–" if operation["passes"] is None else str(operation["passes"])):
            yield f"operations: {passes} passes of {operation['passes']}"
        if (rpm == "off") != (operation["spindle_rpm"] is None):
            yield f"operations: spindle {rpm} of {operation['spindle_rpm']}"
        if operation["time_s"] is not None and _times(time, [operation["time_s"]]):
            yield f"operations: {time} of {operation['time_s']} s"


# The report itself: sums, shares and extremes.


def contradictions(report: Json) -> Iterator[str]:
    """Return the contradictions within a report."""
    split = report["time_split_s"]
    total = split["cutting"] + split["air"] + split["dwell"] + split["link"]
    if abs(total - report["time_s"]) > 1e-3:
        yield f"times: {total} s of {report['time_s']} s"
    turns = report["reversals"]
    for axis in "xyz":
        if turns["cutting"][axis] + turns["air"][axis] != turns[axis]:
            yield f"reversals of {axis}"
    for item in report["dimensions"]:
        if item["error_percent"] is not None:
            share = 100.0 * (item["predicted_mm"] / item["nominal_mm"] - 1.0)
            if abs(share - item["error_percent"]) > 1e-4 + 1e-4 / item["nominal_mm"]:
                yield f"{item['name']}: {item['error_percent']} % of {share}"
    error = report["error_um"]
    for name in ("fit", "rounding", "interpolation", "mechanics", "total"):
        each = error[name]
        order = [each.get("rms"), each.get("max")]
        if None not in order and order[0] > order[1] + 1e-6:
            yield f"{name}: rms above the maximum"
        if each.get("p95") is not None and each["p95"] > each["max"] + 1e-6:
            yield f"{name}: p95 above the maximum"
    largest = error["total"]["max"]
    for name, values in (
        ("contours", [item["max_um"] for item in report["contour_errors"]]),
        ("worst moves", [item["total_um"] for item in report["worst"]]),
    ):
        if values and abs(max(values) - largest) > 1e-4:
            yield f"{name}: {max(values)} µm of {largest}"
    inside = [error["interpolation"][key] for key in ("lines_max", "arcs_max")]
    known = [value for value in inside if value is not None]
    if known and abs(max(known) - error["interpolation"]["max"]) > 1e-4:
        yield "interpolation: of lines and arcs"
    for item in report["circles"]:
        if None in (item["G_um"], item["D_um"]):
            continue
        if not item["Fmin_um"] - 1e-3 <= item["D_um"] <= item["Fmax_um"] + 1e-3:
            yield f"circle: D {item['D_um']} beside F {item['Fmin_um']} … {item['Fmax_um']} µm"
        if item["G_um"] > item["Fmax_um"] - item["Fmin_um"] + 1e-3:
            yield f"circle: G {item['G_um']} above F {item['Fmin_um']} … {item['Fmax_um']} µm"
    planned = report["planned"]
    if planned is not None:
        times = [each["time_s"] for each in planned["operations"]]
        if None not in times and times and abs(sum(times) - report["time_s"]) > 1e-3:
            yield f"operations: {sum(times)} s of {report['time_s']} s"
