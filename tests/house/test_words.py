"""Plain words: docstrings that begin with a verb, one name for one class, MAX_ and MIN_.

The bounds are what the code has today. They only go down: whoever improves the code lowers them.
"""

import ast
import functools
import io
import re
import tokenize
from collections import Counter
from pathlib import Path

import pytest

pytestmark = pytest.mark.xdist_group("words")
"""One worker parses all files, once."""

ROOT = Path(__file__).parents[2]
QUESTION = re.compile(r"\s*(?:What|Whether|How|Some|One|Which|Where)\b")
SUPERLATIVE = re.compile(
    r"_?(?:MOST|LARGEST|LEAST|SMALLEST|FEWEST|GREATEST|HIGHEST|LOWEST|LONGEST|SHORTEST)(?:_|$)"
)
FUNCTION = ast.FunctionDef | ast.AsyncFunctionDef
CYTHON_DOCSTRING = re.compile(
    r"^ *(?:def|cdef|cpdef) (?!class|enum)[^\n=]*?(\w+)\((?:[^\n]*(?<!:)\n)*?[^\n]*:\n"
    r' *r?"""(.*?)"""',
    re.MULTILINE | re.DOTALL,
)
"""The header of a function ends with the first line that ends with a colon."""
CYTHON_FUNCTION = re.compile(r" {0,4}(?:def|cdef|cpdef) (?!class|enum)[^=]*?(\w+)\(")
CYTHON_CONSTANT = re.compile(r"^(?:cdef )?(?:[\w ]+ )?([A-Z_]+)\s*=", re.MULTILINE)

MAX_WITHOUT_VERB = 0
MAX_SHARED_CLASS_NAMES = 0
MAX_SUPERLATIVES = 0
MAX_RIDDLES = 0

VERBS = frozenset(Path(__file__).with_name("verbs.txt").read_text(encoding="utf-8").split())
"""First words of docstrings of functions; the list grows with the code. Many are nouns too, and
count as such before "of" ("Name of the target")."""

RIDDLE = re.compile(
    r"_*(?:found|made|way|most|asked|kept|held|said|apart|whole|mine|theirs|taken|known|about|on|left"
    r"|told|wanted|given|here|there|those|many|much|least|beside|beyond|upto|past|again|once|twice"
    r"|nearby|seen|moved|ended|begun|going|coming|gone|alone|still|done)_*"
)
"""Prepositions, participles and pronouns that do not say what a value is; `left` beside `right` is
a side, and does."""


@functools.cache
def nodes_of(source: str) -> list[ast.AST]:
    """Return all nodes of a module's syntax tree."""
    return list(ast.walk(ast.parse(source)))


@functools.cache
def sources() -> dict[str, str]:
    """Return the text of each module of the product, by its path."""
    found = sorted([*ROOT.glob("camtool/**/*.py*"), *ROOT.glob("postprocessors/**/*.py*")])
    texts = {
        path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8")
        for path in found
        if path.suffix in (".py", ".pyx")
    }
    assert len(texts) > 100
    return texts


def without_verb(path: str, source: str) -> list[str]:
    """Return the functions whose docstrings begin with none of VERBS, with the first line of each.

    Properties, and groups of commands, whose docstrings are pages of help, may begin with a noun,
    but not with a question.
    """
    if path.endswith(".pyx"):
        texts = [(name, text, False) for name, text in CYTHON_DOCSTRING.findall(source)]
    else:
        functions = [node for node in nodes_of(source) if isinstance(node, FUNCTION)]
        texts = [(each.name, ast.get_docstring(each), is_noun(each)) for each in functions]
    return [
        f"{path}: {name}: {text.splitlines()[0]}"
        for name, text, may_be_noun in texts
        if text and not (QUESTION.match(text) is None if may_be_noun else begins_with_verb(text))
    ]


def begins_with_verb(text: str) -> bool:
    """Return True if a text begins with one of VERBS, used as a verb."""
    words = text.split()
    return words[0].rstrip(".,:;") in VERBS and words[1:2] != ["of"]


def is_noun(function: ast.FunctionDef | ast.AsyncFunctionDef) -> bool:
    """Return True for a property and for a group of commands."""
    decorators = [ast.unparse(each) for each in function.decorator_list]
    return any(re.search(r"property\b|\.group\b", each) for each in decorators)


def superlatives(path: str, source: str) -> list[str]:
    """Return the constants of a module or class whose names begin with a superlative."""
    names: list[str] = []
    if path.endswith(".pyx"):
        names = CYTHON_CONSTANT.findall(source)
    else:
        for node in nodes_of(source):
            match node:
                case ast.Assign(targets=[ast.Name(name)]) | ast.AnnAssign(target=ast.Name(name)):
                    names.append(name)
    return [f"{path}: {name}" for name in names if SUPERLATIVE.match(name)]


def riddles(path: str, source: str) -> list[str]:
    """Return the parameters and locals of functions, each once, that do not say what they are."""
    if path.endswith(".pyx"):
        return cython_riddles(path, source)
    names = set()
    for function in (node for node in nodes_of(source) if isinstance(node, FUNCTION)):
        for node in ast.walk(function):
            match node:
                case ast.arg(arg=name) | ast.Name(id=name, ctx=ast.Store()):
                    names.add((function.name, name))
    return listed_riddles(path, names)


def listed_riddles(path: str, names: set[tuple[str, str]]) -> list[str]:
    """Return the riddles among (function, name) pairs as lines."""
    return sorted(
        f"{path}: {function}: {name}"
        for function, name in names
        if RIDDLE.fullmatch(name) and not (name == "left" and (function, "right") in names)
    )


def cython_riddles(path: str, source: str) -> list[str]:
    """Return the same of Cython, whose source Python splits into tokens but cannot parse."""
    names, function, before = set(), "", ""
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if header := CYTHON_FUNCTION.match(token.line):
            function = header[1]
        if token.type == tokenize.NAME and before != ".":
            names.add((function, token.string))
        before = token.string
    return listed_riddles(path, names)


def shared_class_names(texts: dict[str, str]) -> list[str]:
    """Return the names that two public classes or more have."""
    counts = Counter(
        node.name
        for path, source in texts.items()
        if path.endswith(".py")
        for node in nodes_of(source)
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_")
    )
    return [name for name, count in counts.items() if count > 1]


def test_docstrings_of_functions_begin_with_a_verb() -> None:
    found = [line for each in sources().items() for line in without_verb(*each)]
    message = "begin the docstring with a verb; new verbs go into tests/house/verbs.txt:"
    assert len(found) <= MAX_WITHOUT_VERB, "\n".join([message, *found])


def test_no_two_public_classes_share_a_name() -> None:
    found = shared_class_names(sources())
    assert len(found) <= MAX_SHARED_CLASS_NAMES, found


def test_bounds_are_called_max_and_min() -> None:
    found = [line for each in sources().items() for line in superlatives(*each)]
    assert len(found) <= MAX_SUPERLATIVES, "\n".join(found)


def test_names_of_values_are_nouns() -> None:
    found = [line for each in sources().items() for line in riddles(*each)]
    assert len(found) <= MAX_RIDDLES, "\n".join(found)


def test_the_rules_can_be_broken() -> None:
    text = 'def f(a, b):\n    """Which one."""\n\n\ndef g(a):\n    """Return one."""\n'
    assert without_verb("a.py", text) == ["a.py: f: Which one."]
    assert without_verb("a.py", "@property\n" + text) == ["a.py: f: Which one."]
    assert without_verb("a.py", "@property\n" + text.replace("Which", "The")) == []
    text = text.replace("(a, b)", "(\n    int[::1] a, b\n)").replace("def", "cdef int")
    assert without_verb("a.pyx", 'cdef int x\nclass A:\n    """Both."""\n' + text) == [
        "a.pyx: f: Which one."
    ]
    text = "MOST_MM = 1\nMAX_MM = 1\n_LEAST: int = 2\nLEASTWISE = 3\n"
    assert superlatives("a.py", text) == ["a.py: MOST_MM", "a.py: _LEAST"]
    assert superlatives("a.pyx", "cdef double MOST_MM = 1\n") == ["a.pyx: MOST_MM"]
    text = "def f(way, x):\n    left, y = x\n    return [found for found in y]\n"
    assert riddles("a.py", text) == ["a.py: f: found", "a.py: f: left", "a.py: f: way"]
    text = "cdef int f(int way) noexcept:\n    cdef int k = a.way\n    return way\n"
    assert riddles("a.pyx", text) == ["a.pyx: f: way"]
    assert riddles("a.py", "def f(box):\n    left, right = box\n") == []
    same = "class A:\n    pass\n\n\nclass _B:\n    pass\n"
    assert shared_class_names({"a.py": same, "b.py": same}) == ["A"]
