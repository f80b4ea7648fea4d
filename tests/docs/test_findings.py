"""docs/findings.md explains every code and lists every sentence, as the catalogues have them.

The tables are made from the code; `pytest --bless tests/docs/test_findings.py` writes them anew
behind the page's own text.
"""

import ast
import importlib
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from string import Formatter

from camtool.findings import Code, Finding, Sentence, Severity, TargetCode

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "findings.md"
SHORTEST_MEANING = 10
GIVEN = {"where", "measured", "limit", "severity"}


ROOMS = ("geometry", "importers", "planning", "toolpath", "verification", "inspection", "stock")
"""The rooms that have codes and sentences, in the order of the page."""
HUNDREDS = (1, 2, 3, 4, 5, 6)
"""Drawing, planning, program, motion and result, inspection, stock."""


def modules() -> dict[str, list[str]]:
    """Return the modules of codes and sentences by machine; those of camtool's rooms by ""."""
    rooms = sorted(path.parent.name for path in ROOT.glob("camtool/*/findings.py"))
    assert rooms == sorted(ROOMS)
    machines = sorted(path.parent.name for path in ROOT.glob("postprocessors/*/findings.py"))
    return {"": [f"camtool.{room}.findings" for room in ROOMS]} | {
        machine: [f"camtool_postprocessors.{machine}.findings"] for machine in machines
    }


def catalogues() -> dict[str, dict[str, Sentence]]:
    """Return the sentences by name, of camtool ("") and of each machine that has some."""
    return {
        machine: {
            name: value
            for module in names
            for name, value in vars(importlib.import_module(module)).items()
            if isinstance(value, Sentence)
        }
        for machine, names in modules().items()
    }


def codes() -> list[Code]:
    """Return all numbered codes of all rooms, by number."""
    enums = [
        value
        for names in modules().values()
        for module in names
        for value in vars(importlib.import_module(module)).values()
        if isinstance(value, type) and issubclass(value, Code) and value is not Code
    ]
    return sorted(code for enum in dict.fromkeys(enums) for code in enum)


@cache
def sources() -> dict[str, ast.Module]:
    """Yield all files of the code except the catalogues."""
    files = [*ROOT.glob("camtool/**/*.py"), *ROOT.glob("postprocessors/**/*.py")]
    return {
        str(path.relative_to(ROOT)): ast.parse(path.read_text(encoding="utf-8"))
        for path in files
        if path.name != "findings.py"
    }


def tables() -> str:
    """Return the tables of codes and of sentences in Markdown."""
    made = (
        "\n## Codes\n\n| number | code | severity | means | what to do |\n|---|---|---|---|---|\n"
    )
    for code in codes():
        grave = _listed([severity.name.lower() for severity in code.severities])
        made += f"| {int(code)} | `{code.name}` | {grave} | {code.means} | {code.mend} |\n"
    for machine, sentences in catalogues().items():
        title = f"Sentences of `{machine}` alone" if machine else "Sentences"
        made += f"\n## {title}\n\n| code | severity | sentence | unit |\n|---|---|---|---|\n"
        rows = sorted(sentences.values(), key=lambda each: (_place(each.code), each.code.name))
        for each in rows:
            made += f"| `{each.code.name}` | {_grave(each)} | {_readable(each)} | {each.unit} |\n"
    return made


def _place(code: Code | TargetCode) -> int:
    return int(code) if isinstance(code, Code) else 0


def _listed(words: list[str]) -> str:
    return " or ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)


def _grave(sentence: Sentence) -> str:
    said = sentence.code.severities if sentence.severity is None else (sentence.severity,)
    return _listed([severity.name.lower() for severity in said])


def _readable(sentence: Sentence) -> str:
    """Return the sentence with … in place of each value."""
    made = ""
    for text, name, spec, _ in Formatter().parse(sentence.text):
        made += text
        if name is not None:
            made += (spec or "").rpartition("|")[2].replace("#", "…") if "|" in spec else "…"
    return made.replace("|", "\\|").replace("<", "\\<").replace("*", "\\*")


def test_the_page_has_every_code_and_every_sentence(bless: bool) -> None:
    page = PAGE.read_text(encoding="utf-8")
    own = page.partition("\n## ")[0].rstrip("\n") + "\n"
    if bless:
        PAGE.write_text(own + tables(), encoding="utf-8")
        return
    assert page == own + tables(), "pytest --bless tests/docs/test_findings.py writes it anew"


def test_tables_can_be_wrong() -> None:
    rows = re.findall(r"^\| \d+ \| `\w+` \| (?:info|warning|error)", tables(), re.MULTILINE)
    assert len(rows) == len(codes()) > 70
    assert len(catalogues()[""]) > 100


def test_every_code_is_explained() -> None:
    for code in codes():
        assert len(code.means) > SHORTEST_MEANING, code.name
        assert code.mend, code.name
        assert code.severities, code.name


def test_numbers_and_names_are_taken_once() -> None:
    numbers = [int(code) for code in codes()]
    assert numbers == sorted(set(numbers))
    assert {number // 100 for number in numbers} == set(HUNDREDS)
    assert len({code.name for code in codes()}) == len(numbers)
    rooms = [vars(importlib.import_module(module)) for module in modules()[""]]
    named = [name for room in rooms for name, value in room.items() if isinstance(value, Sentence)]
    assert len(named) == len(set(named)) == len(catalogues()[""])
    for enum in {type(code) for code in codes()}:
        assert len(enum) == len(enum.__members__), "an alias is a second name for one number"


def test_every_code_and_every_sentence_is_said_somewhere() -> None:
    every = [each for catalogue in catalogues().values() for each in catalogue.values()]
    assert [code.name for code in codes() if code not in {each.code for each in every}] == []
    named = {node.id for tree in sources().values() for node in ast.walk(tree) if _is_name(node)}
    unsaid = [name for each in catalogues().values() for name in each if name not in named]
    assert unsaid == []


def test_a_sentence_is_named_after_its_code_and_no_graver_or_milder() -> None:
    for catalogue in catalogues().values():
        for name, each in catalogue.items():
            assert name.startswith(each.code.name.rpartition(".")[2]), name
            assert each.severity is None or each.severity in each.code.severities, name


def _is_name(node: ast.AST) -> bool:
    return isinstance(node, ast.Name)


def calls_of_sentences() -> Iterator[tuple[str, list[Sentence], set[str]]]:
    """Yield place, possible sentences and keywords of each call of a sentence by its name."""
    known = catalogues()
    for file, tree in sources().items():
        parts = Path(file).parts
        here = known[""]
        if parts[0] == "postprocessors":
            here = here | known["gcode"] | known.get(parts[1], {})
        for node in ast.walk(tree):
            names = _called(node.func) if isinstance(node, ast.Call) else []
            if isinstance(node, ast.Call) and names and all(name in here for name in names):
                given = {keyword.arg or "**" for keyword in node.keywords}
                yield f"{file}:{node.lineno}", [here[name] for name in names], given


def _called(node: ast.expr) -> list[str]:
    """Return called names: `A` of `A(...)` and `A.words(...)`, both of `(A if … else B)(...)`."""
    if isinstance(node, ast.IfExp):
        return _called(node.body) + _called(node.orelse)
    if isinstance(node, ast.Attribute) and node.attr == "words":
        return _called(node.value)
    return [node.id] if isinstance(node, ast.Name) else []


def test_callers_give_the_numbers_that_a_sentence_has_places_for() -> None:
    calls = list(calls_of_sentences())
    assert len(calls) > 100
    for place, sentences, given in calls:
        wanted = set[str]()
        for sentence in sentences:
            own = {field for _, field, _, _ in Formatter().parse(sentence.text) if field}
            assert own <= given, f"{place}: {sentence.text!r} wants {own - given}"
            several = len(sentence.code.severities) > 1 and sentence.severity is None
            assert several == ("severity" in given), f"{place}: who says how grave it is?"
            wanted |= own
        assert given <= wanted | GIVEN, f"{place}: {given - wanted - GIVEN} is not said"


def test_nobody_else_writes_sentences() -> None:
    makers = (Finding.__name__, Sentence.__name__, "says")
    made = [
        f"{file}:{node.lineno}"
        for file, tree in sources().items()
        for node in ast.walk(tree)
        if isinstance(node, ast.Call)
        if getattr(node.func, "id", getattr(node.func, "attr", "")) in makers
    ]
    assert made == []


def test_a_target_has_codes_of_its_own() -> None:
    too_hot = TargetCode("mill.TOO_HOT", (Severity.WARNING,), "the spindle is hot", "let it cool")
    hot = too_hot.says("the spindle has {measured:.0f} °C, {limit:.0f} are allowed", "celsius")
    finding = hot(where="block 3", measured=81.2, limit=70)
    assert str(finding) == (
        "warning mill.TOO_HOT [block 3]: the spindle has 81 °C, 70 are allowed"
    )
    assert (finding.measured, finding.limit, finding.unit) == (81.2, 70.0, "celsius")
