"""The rules of `<style>` elements: which declarations hold for an element, in their order.

Selectors are made of types, classes, ids and attributes, and of ancestors and parents:
`path`, `.cut`, `#outline`, `path.cut[id]`, `g.layer > path`. Rules with others (`p + q`, `:hover`)
and blocks for other media are left out and counted.

Source: Cascading Style Sheets 2.1, chapters 4.1 (syntax), 5 (selectors) and 6.4 (cascade)."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable

from msgspec import Struct, field

from camtool.errors import DrawingError
from camtool.importers.svg.tree import Node

MAX_MATCHES = 1_000_000
"""At most this many comparisons of a rule with an element; a file of rules alone could need
billions."""

MAX_COMPOUNDS = 8
"""A selector of more steps than this is not applied."""

Declarations = dict[str, tuple[str, bool]]
"""For each property its value, and True if it is !important."""

_CHAIN_COST = 100
_ATTRIBUTE = r"""\[\s*([\w-]+)\s*(?:([~|^$*]?=)\s*("[^"]*"|'[^']*'|[\w-]+)\s*)?\]"""
_SIMPLE = re.compile(rf"([#.]?)([\w-]+)|(\*)|{_ATTRIBUTE}")
_IMPORTANT = re.compile(r"!\s*important$", re.IGNORECASE)
_BRACE = re.compile(r"[{}]")
_Test = tuple[str, str, str]


class _Compound(Struct, frozen=True):
    """The conditions on an element: tag ("" any), ids, classes and tests of attributes."""

    tag: str = ""
    ids: tuple[str, ...] = ()
    classes: tuple[str, ...] = ()
    tests: tuple[_Test, ...] = ()

    def matches(self, node: Node) -> bool:
        return (
            self.tag in ("", node.tag)
            and all(name == node.get("id") for name in self.ids)
            and (not self.classes or set(self.classes) <= set(node.get("class").split()))
            and all(_passes_test(node, test) for test in self.tests)
        )


class _Rule(Struct, frozen=True):
    """A rule for one selector: its compounds as steps from the element outwards, and its
    declarations.

    `child[i]` is true if step i + 1 must be the parent of step i, false for any ancestor."""

    steps: tuple[_Compound, ...]
    child: tuple[bool, ...]
    declarations: Declarations
    order: int

    @property
    def weight(self) -> tuple[int, int, int, int]:
        """Sort key of the cascade: counts of ids, classes and types, and then the order, so that
        the later rule wins."""
        return (
            sum(len(step.ids) for step in self.steps),
            sum(len(step.classes) + len(step.tests) for step in self.steps),
            sum(bool(step.tag) for step in self.steps),
            self.order,
        )

    @property
    def cost(self) -> int:
        """Estimated work of a match."""
        return 1 if len(self.steps) == 1 else _CHAIN_COST

    def matches(self, node: Node) -> bool:
        """Return True if the rule applies to the element; its steps are matched from the element
        outwards."""
        places = [node] if self.steps[0].matches(node) else []
        for child, step in zip(self.child, self.steps[1:], strict=True):
            if not places:
                return False
            if child:
                parents = [place.parent for place in places if place.parent is not None]
            else:
                # The ancestors of the innermost place include those of all others.
                parents = _ancestors(places[0])
            places = [place for place in parents if step.matches(place)]
        return bool(places)


class CssRules(Struct):
    """The rules of all sheets, indexed by an id, class or tag that their element must have;
    `left_out` counts rules that are not understood."""

    left_out: int = 0
    _by_id: dict[str, list[_Rule]] = field(default_factory=lambda: defaultdict(list))
    _by_class: dict[str, list[_Rule]] = field(default_factory=lambda: defaultdict(list))
    _by_tag: dict[str, list[_Rule]] = field(default_factory=lambda: defaultdict(list))
    _count: int = 0
    _matches: int = 0

    def read(self, text: str, properties: Iterable[str]) -> None:
        """Add the rules of a style sheet that declare at least one of these properties."""
        kept_properties = frozenset(properties)
        for selectors, body in self._blocks(_without_comments(text)):
            declarations = parse_declarations(body, kept_properties)
            if not declarations:
                continue
            for selector in selectors.split(","):
                self._add(selector.strip(), declarations)

    def holding(self, node: Node) -> list[Declarations]:
        """Return the declarations that apply to an element, the strongest last.

        DrawingError when the sheets would take too long to apply."""
        if not self._count:
            return []
        lists = [self._by_tag[""], self._by_tag.get(node.tag, []), self._by_id.get(node.get("id"))]
        lists += [self._by_class.get(name) for name in dict.fromkeys(node.get("class").split())]
        rules_found: list[_Rule] = []
        for rules in lists:
            if rules:
                self._matches += sum(rule.cost for rule in rules)
                if self._matches > MAX_MATCHES:
                    raise DrawingError("its style sheets have too many rules", mend="simplify it")
                rules_found += [rule for rule in rules if rule.matches(node)]
        rules_found.sort(key=lambda rule: rule.weight)
        return [rule.declarations for rule in rules_found]

    def _blocks(self, text: str) -> Iterable[tuple[str, str]]:
        """Yield the selectors and the body of each rule of a sheet; @-blocks are skipped, those of
        @media counted."""
        offset = 0
        while (begin := text.find("{", offset)) >= 0:
            selectors = text[offset:begin].rpartition(";")[2].strip()
            end = text.find("}", begin)
            if selectors.startswith("@"):
                offset = _block_end(text, begin)
                self.left_out += selectors.startswith("@media")
            elif end < 0:
                return
            else:
                yield selectors, text[begin + 1 : end]
                offset = end + 1

    def _add(self, selector: str, declarations: Declarations) -> None:
        parsed = _parse_selector(selector)
        if parsed is None:
            self.left_out += 1
            return
        rule = _Rule(*parsed, declarations, self._count)
        self._count += 1
        last = rule.steps[0]
        if last.ids:
            self._by_id[last.ids[0]].append(rule)
        elif last.classes:
            self._by_class[last.classes[0]].append(rule)
        else:
            self._by_tag[last.tag].append(rule)


def parse_declarations(text: str, properties: frozenset[str]) -> Declarations:
    """Return those declarations "name: value; ..." whose name is in `properties`; of two for one
    property the later wins, or the important one."""
    declarations: Declarations = {}
    for item in text.split(";"):
        name, colon, value = item.partition(":")
        name = name.strip().lower()
        if not colon or name not in properties:
            continue
        content, important = _IMPORTANT.subn("", value.strip())
        if content.strip() and (important or not declarations.get(name, ("", False))[1]):
            declarations[name] = content.strip(), bool(important)
    return declarations


def _parse_selector(selector: str) -> tuple[tuple[_Compound, ...], tuple[bool, ...]] | None:
    """Return the steps of a selector from the element outwards, and for each but the first True if
    it must be the parent of the step before, False for any ancestor.

    None for a selector with other signs (`+`, `:hover`)."""
    words = selector.replace(">", " > ").split()
    steps: list[_Compound] = []
    child: list[bool] = []
    linked = True
    for word in words:
        if word == ">":
            if linked:
                return None
            child[-1] = linked = True
            continue
        step = _compound(word)
        if step is None or len(steps) == MAX_COMPOUNDS:
            return None
        steps.append(step)
        child.append(False)
        linked = False
    if linked:
        return None
    return tuple(reversed(steps)), tuple(reversed(child[:-1]))


def _compound(word: str) -> _Compound | None:
    tag = ""
    parts: dict[str, list[str]] = {"#": [], ".": []}
    tests: list[_Test] = []
    offset = 0
    while offset < len(word):
        match = _SIMPLE.match(word, offset)
        if match is None or (offset > 0 and not match[1] and not match[4]):
            return None
        if match[4]:
            tests.append((match[4], match[5] or "", (match[6] or "").strip("\"'")))
        elif match[1]:
            parts[match[1]].append(match[2])
        else:
            tag = match[2] or ""
        offset = match.end()
    return _Compound(tag, tuple(parts["#"]), tuple(parts["."]), tuple(tests))


def _passes_test(node: Node, test: _Test) -> bool:
    """Return True if the element passes a test of an attribute: [name], [name=value],
    [name~=value] …"""
    name, sign, value = test
    content = node.attributes.get(name)
    if content is None or not sign:
        return content is not None
    if sign == "=":
        return content == value
    if sign == "~=":
        return value in content.split()
    if sign == "|=":
        return content == value or content.startswith(value + "-")
    if not value:
        return False
    if sign == "^=":
        return content.startswith(value)
    return content.endswith(value) if sign == "$=" else value in content


def _ancestors(node: Node) -> list[Node]:
    """Return the parent of an element, its parent and so on up to the root."""
    ancestors: list[Node] = []
    while node.parent is not None:
        node = node.parent
        ancestors.append(node)
    return ancestors


def _block_end(text: str, begin: int) -> int:
    """Return the index behind the brace that closes the one at `begin`."""
    depth = 0
    for match in _BRACE.finditer(text, begin):
        depth += 1 if match[0] == "{" else -1
        if depth == 0:
            return match.end()
    return len(text)


def _without_comments(text: str) -> str:
    """Return the text without `/* ... */` and the marks of old `<!-- ... -->`."""
    parts: list[str] = []
    offset = 0
    while (begin := text.find("/*", offset)) >= 0:
        parts.append(text[offset:begin])
        end = text.find("*/", begin + 2)
        offset = len(text) if end < 0 else end + 2
    return " ".join([*parts, text[offset:]]).replace("<!--", " ").replace("-->", " ")
