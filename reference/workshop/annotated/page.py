"""The annotated paper: one HTML page of the code, the tests and `annotations.toml`.

place  "Alg. 2:13", "Eq. 3", "Tab. I", "Fig. 4";  key  a place or a clause
"""

import re
from collections.abc import Iterable, Iterator, Sequence
from html import escape
from pathlib import Path
from string import Template

import reference
from reference.building import Building
from reference.paper import TABLE_I, TABLE_II
from reference.workshop import drawing
from reference.workshop.annotated.index import (
    Citation,
    MarkedTest,
    beside,
    code_of,
    kinds_of,
    marked_tests,
    marked_with,
    read_at,
    reasons,
)
from reference.workshop.annotated.source import Symbol, boards, snippet, symbol
from reference.workshop.annotated.words import CLAUSES, KINDS, PLACES, WORDS
from reference.workshop.drawing.annotated import formula, inline, snapping
from reference.workshop.drawing.ruler import curve

LONGEST = 45  # lines of a symbol that are shown
MOST = 4  # places where a setting is read
WIDEST = 40  # letters of a value


def page(building: Building) -> str:
    """Write the page; the figures show a building. Raises InputError without tests."""
    marked_tests()
    here = Path(__file__).parent
    parts = {
        "contents": _contents(),
        "kinds": map(_kind, KINDS),
        "algorithms": map(_algorithm, WORDS["algorithms"]),
        "equations": map(_equation, WORDS["equations"]),
        "tables": _tables(),
        "figures": (_figure(building, place) for place in WORDS["figures"]),
        "filters": map(_filter, ("all", *KINDS)),
        "clauses": map(_clause, CLAUSES),
        "glossary": map(_term, WORDS["glossary"]),
    }
    return Template((here / "page.html").read_text(encoding="utf-8")).substitute(
        {name: "\n".join(part) for name, part in parts.items()},
        style=(here / "page.css").read_text(encoding="utf-8"),
        version=reference.__version__,
    )


# -- Pieces -------------------------------------------------------------------------


def tag(name: str, *inner: str, **attributes: str) -> str:
    """An HTML element; attributes that are empty are left out."""
    told = "".join(
        f' {key.strip("_").replace("_", "-")}="{escape(value)}"'
        for key, value in attributes.items()
        if value
    )
    return f"<{name}{told}>{''.join(inner)}</{name}>"


def folded(summary: str, *inner: str, opened: bool = False) -> str:
    """Something that a click opens."""
    return tag("details", tag("summary", summary), *inner, open="open" * opened)


def anchor(key: str) -> str:
    """The id of a key's place on the page: "Alg. 2:13" -> alg-2-13."""
    return re.sub(r"\W+", "-", key).lower() if key in PLACES else key


def _links(keys: Iterable[str], short: bool = False) -> str:
    """Links to clauses and places; short: without "Eq."."""
    return " ".join(
        tag(
            "a",
            key.split(" ")[-1] if short else key,
            class_="key",
            href=f"#{anchor(key)}",
            title=PLACES.get(key) or CLAUSES[key][1],
        )
        for key in keys
    )


def _badge(kind: str) -> str:
    return tag("span", kind, class_=f"badge {kind}")


def _text(text: str) -> str:
    """Words as HTML: with `code`, and links to places."""
    html = re.sub(r"`([^`]+)`", r"<code>\1</code>", escape(text, quote=False))
    return re.sub(
        r"\b(Alg\. \d:\d+|Eq\. \d|Tab\. I+|Fig\. \d)\b",
        lambda found: _links({found[1]} & PLACES.keys()) or found[1],
        html,
    )


def _where(where: str) -> str:
    return tag("code", where.replace("/", "/<wbr>"), class_="where")


def _told(found: Symbol | MarkedTest) -> str:
    """The name, the sentence and the place of a symbol or a test."""
    return f"<b>{found.title}</b> {_text(found.sentence)} {_where(found.where)}"


def _list(what: str, found: Sequence[Symbol | MarkedTest]) -> str:
    """Symbols or tests, folded."""
    rows = (tag("li", _told(each)) for each in found)
    return folded(f"{what}: {len(found)}", tag("ul", *rows))


def _lines(path: Path, first: int, last: int) -> str:
    return tag("pre", tag("code", snippet(path, first, last)))


def _source(found: Symbol, opened: bool = False) -> str:
    """A symbol, and by a click its source."""
    last = min(found.last, found.first + LONGEST - 1)
    more = "…" * (last < found.last)
    return folded(
        _told(found), _lines(found.path, found.first, last), more, opened=opened
    )


def _symbols(key: str) -> list[Symbol]:
    return list(dict.fromkeys(cited.symbol for cited in code_of(key)))


def _tests(key: str, opened: int = 0) -> str:
    """The tests of a key, with boards and code; so many of them open."""
    rows = (_test(test, k < opened) for k, test in enumerate(marked_with(key)))
    return tag("ul", *(tag("li", row) for row in rows), class_="tests")


def _test(test: MarkedTest, opened: bool) -> str:
    drawn = boards(test.path, test.node)
    several = len({when for when, _ in drawn}) > 1
    figures = (
        tag("figure", tag("figcaption", when * several), _board(rows))
        for when, rows in drawn
    )
    code = _lines(test.path, test.first, test.node.end_lineno or test.first)
    return folded(
        _told(test), tag("div", *figures, class_="boards"), code, opened=opened
    )


def _board(rows: str) -> str:
    """A board; each kind of sign has its class."""
    kinds = {"E": "E", "+": "D", "R": "R", "*": "F", "#": "W"}
    kinds |= dict.fromkeys("ABCD", "S") | dict.fromkeys("pqrstuvwxyz", "P")
    signs = r"E+|\++|R+|\*+|#+|[A-D]+|[p-z]+"
    inked = re.sub(signs, lambda s: f"<i class={kinds[s[0][0]]}>{s[0]}</i>", rows)
    return tag("pre", inked, class_="board")


# -- Contents and kinds -------------------------------------------------------------


def _contents() -> Iterator[str]:
    for name in ("algorithms", "equations", "tables", "figures"):
        title = tag("a", name.capitalize(), href=f"#{name}")
        yield tag("li", title, " ", _links(WORDS[name], short=True))
    for letter, name in WORDS["appendices"].items():
        title = tag("a", f"Appendix {letter}: {name}", href=f"#appendix-{letter}")
        yield tag("li", title, " ", _links(c for c in CLAUSES if c[0] == letter))
    yield tag("li", tag("a", "Glossary", href="#glossary"))


def _kind(kind: str) -> str:
    meaning = tag("dd", escape(WORDS["kinds"][kind]))
    return tag("div", tag("dt", _badge(kind)), meaning)


def _filter(kind: str) -> str:
    """A choice of what is shown; the style sheet hides the rest."""
    shown = [c for c in CLAUSES if kind == "all" or kind in kinds_of(c)]
    state = " checked" * (kind == "all")
    button = f'<input type="radio" name="kind" id="only-{kind}"{state}> '
    return tag("label", button, _badge(kind), str(len(shown)))


# -- Algorithms ---------------------------------------------------------------------


def _algorithm(name: str) -> str:
    title, *lines = WORDS["algorithms"][name]
    places = [place for place in PLACES if place.startswith(f"{name}:")]
    clauses = dict.fromkeys(c for place in places for c in beside(place, CLAUSES))
    head = f"Algorithm {name[-1]}: {title} {_links(clauses)}"
    return "".join(
        [
            tag("h3", head, id=anchor(name)),
            *map(_source, _symbols(name)),
            tag("ol", *map(_line, places, lines), class_="lines"),
        ]
    )


def _line(place: str, text: str) -> str:
    """One line: our words, its code, its tests; of an "end" only the word."""
    words, number = text.strip(), place.split(":")[1]
    label = tag("a", number, href=f"#{anchor(place)}", class_="number")
    depth = f"--depth:{(len(text) - len(words)) // 4}"
    said = tag("p", label, tag("span", escape(words)), class_="said", style=depth)
    if words == "end":
        return tag("li", said, id=anchor(place), class_="end")
    carried = map(_carried, code_of(place))
    return tag("li", said, *carried, _tests(place), id=anchor(place))


def _carried(cited: Citation) -> str:
    """The line of code beside which a number or a citation stands; else its symbol."""
    if not cited.beside_code:
        return _source(cited.symbol)
    return _where(cited.where) + _lines(cited.path, cited.line, cited.line)


# -- Equations, tables and figures --------------------------------------------------


def _equation(place: str) -> str:
    told, pictures = WORDS["equations"][place], {"Eq. 3": snapping, "Eq. 4": curve}
    head, read = f"{place}: {escape(told['title'])} ", _formula(told["read"])
    if "printed" in told:
        head += _badge("erratum")
        printed = tag("p", "As printed", class_="as"), _formula(told["printed"])
        read = "".join([*printed, tag("p", "As we read it", class_="as"), read])
    code = (_source(each, k == 0) for k, each in enumerate(_symbols(place)))
    picture = inline(pictures[place]()) if place in pictures else ""
    return tag(
        "article",
        tag("h3", head, _links(beside(place, CLAUSES))),
        read,
        tag("p", _text(told["note"])),
        *code,
        f'<img class="small" src="{picture}" alt="{place}, drawn">' if picture else "",
        _tests(place, opened=1),
        id=anchor(place),
    )


def _formula(tex: str) -> str:
    svg = formula(tex).replace("<svg", f'<svg role="img" aria-label="{escape(tex)}"', 1)
    return tag("div", svg, class_="formula")


HEADS = ("our field", "Tab. I", "Tab. II", "what it does", "where it is read")


def _tables() -> Iterator[str]:
    for place, title in WORDS["tables"].items():
        head = f"{place}: {title} {_links(beside(place, CLAUSES))}"
        yield tag("h3", head, id=anchor(place))
        yield from map(_source, _symbols(place))
        yield _list("Tests", marked_with(place))
    rows = (tag("tr", *_row(row), id=f"row-{row}") for row in WORDS["rows"])
    top = tag("thead", tag("tr", *(tag("th", head) for head in HEADS)))
    yield tag("table", top, tag("tbody", *rows))


def _row(row: str) -> Iterator[str]:
    """The cells of a row; with what it does, what another value was found to cost."""
    field = symbol(f"learning.settings.TrainerSettings.{row}")
    cost = WORDS["costs"].get(row, "")
    cells = (
        f"{tag('code', row)} {_where(field.where)}",
        _value(TABLE_I[row]),
        _value(TABLE_II[row]),
        _text(WORDS["rows"][row]) + (tag("p", _text(cost)) if cost else ""),
        " ".join(map(_where, (read_at(row) or ["checked only"])[:MOST])),
    )
    return (tag("td", c, data_head=h) for h, c in zip(HEADS, cells, strict=True))


def _value(value: object) -> str:
    return f"{value:,}" if type(value) is int else str(value).lower()


def _figure(building: Building, place: str) -> str:
    """Ours, drawn by the function that cites the paper's."""
    (draw, *_), title = _symbols(place), WORDS["figures"][place]
    floor = int(place[-1]) - 4  # Figs. 4-6 are its floors
    where = {"floor": floor} if floor >= 0 else {}
    how = f"draw paper --view {draw.name}" + f" --floor {floor + 1}" * (floor >= 0)
    picture = inline(getattr(drawing, draw.name)(building, **where))
    return tag(
        "figure",
        tag("figcaption", f"<b>{place}</b>: {title} {_links(beside(place, CLAUSES))} "),
        f'<img src="{picture}" alt="{place}: {title}">',
        tag("code", how),
        _source(draw) + _list("Tests", marked_with(place)),
        id=anchor(place),
    )


# -- Clauses and glossary -----------------------------------------------------------


def _clause(clause: str) -> str:
    """What kind of statement it is, why so, and who carries and holds it."""
    kinds, letter, (_, title) = kinds_of(clause), clause[0], CLAUSES[clause]
    begins = tag(
        "h3", f"{letter}. {WORDS['appendices'][letter]}", id=f"appendix-{letter}"
    )
    link = tag("a", clause, href=f"#{clause}")
    article = tag(
        "article",
        tag("h4", link, f" {_text(title)} ", *map(_badge, kinds)),
        tag("p", _text(WORDS["errata"].get(clause, ""))),
        tag("p", _links(beside(clause, PLACES))),
        *(_reasons(clause, kind) for kind in ("deviation", "chosen")),
        _list("In the code", _symbols(clause)),
        _list("Tests", marked_with(clause)),
        id=clause,
        class_=f"clause {' '.join(kinds)}",
    )
    return begins * (clause[1:] == "1") + article


def _reasons(clause: str, kind: str) -> str:
    """Names and values with their reasons."""
    rows = []
    for text, cited in reasons(clause, kind).items():
        name, value = cited.symbol.title, cited.symbol.value[:WIDEST]
        rows.append(
            tag("dt", tag("code", escape(f"{name}{' = ' * bool(value)}{value}")))
        )
        rows.append(tag("dd", f"{_text(text)} {_where(cited.where)}"))
    return tag("div", _badge(kind), tag("dl", *rows)) if rows else ""


def _term(term: str) -> str:
    dotted, meaning = WORDS["glossary"][term]
    place = f"{tag('code', dotted)} {_where(symbol(dotted).where)}"
    return tag("dt", escape(term)) + tag("dd", f"{_text(meaning)} {place}")
