"""The annotated paper: one HTML page of the code, the tests and `annotations.toml`.

place  "Alg. 2:13", "Eq. 3", "Tab. I", "Fig. 4";  key  a place or a clause
"""

import re
from collections.abc import Iterable, Iterator
from html import escape
from keyword import kwlist
from pathlib import Path
from string import Template

import reference
from reference.building import Building
from reference.paper import TABLE_I, TABLE_II
from reference.workshop import drawing
from reference.workshop.annotated import index
from reference.workshop.annotated.index import Symbol
from reference.workshop.annotated.words import CLAUSES, KINDS, LINES, TITLES, WORDS
from reference.workshop.drawing.annotated import formula, inline, snapping
from reference.workshop.drawing.ruler import curve

LONGEST = 45  # lines of a symbol that are shown
MOST = 4  # places where a setting is read


def page(building: Building) -> str:
    """Write the page; the figures show a building. Raises InputError without tests."""
    index.marked_tests()
    parts = {
        "kinds": (
            f"<div><dt>{_badge(kind)}</dt><dd>{meaning}</dd></div>"
            for kind, meaning in WORDS["kinds"].items()
        ),
        "contents": _contents(),
        "algorithms": map(_algorithm, WORDS["algorithms"]),
        "equations": map(_equation, WORDS["equations"]),
        "tables": map(_table, WORDS["tables"]),
        "rows": map(_row, WORDS["rows"]),
        "figures": (_figure(building, place) for place in WORDS["figures"]),
        "filters": map(_filter, ("all", *KINDS)),
        "clauses": map(_clause, CLAUSES),
        "glossary": map(_term, WORDS["glossary"]),
        "version": [reference.__version__],
        "style": [_beside_me("page.css")],
    }
    joined = {name: "\n".join(part) for name, part in parts.items()}
    return Template(_beside_me("page.html")).substitute(joined)


def _beside_me(name: str) -> str:
    return Path(__file__).with_name(name).read_text(encoding="utf-8")


# -- Pieces -------------------------------------------------------------------------


def anchor(key: str) -> str:
    """The id of a key on the page: "Alg. 2:13" -> alg-2-13."""
    return re.sub(r"\W+", "-", key).lower()


def _links(keys: Iterable[str]) -> str:
    return " ".join(
        f'<a class="key" href="#{anchor(key)}" title="{escape(TITLES[key])}">{key}</a>'
        for key in keys
    )


def _badge(kind: str) -> str:
    return f'<span class="badge {kind}">{kind}</span>'


def _prose(text: str) -> str:
    """Words as HTML: with `code`, and links to places."""
    html = re.sub(r"`([^`]+)`", r"<code>\1</code>", escape(text, quote=False))
    place = r"\b(Alg\. \d:\d+|Eq\. \d|Tab\. I+|Fig\. \d)\b"
    return re.sub(place, lambda m: _links([m[0]]) if m[0] in TITLES else m[0], html)


def _where(where: str) -> str:
    return f'<code class="where">{where.replace("/", "/<wbr>")}</code>'


def _folded(summary: str, inner: str, opened: bool = False) -> str:
    """Something that a click opens."""
    state = " open" * opened
    return f"<details{state}><summary>{summary}</summary>{inner}</details>"


def _told(found: Symbol) -> str:
    """The name, the sentence and the place of a symbol or a test."""
    return f"<b>{found.title}</b> {_prose(found.sentence)} {_where(found.where)}"


def _list(what: str, found: list[Symbol]) -> str:
    """Symbols or tests, folded."""
    rows = "".join(f"<li>{_told(each)}</li>" for each in found)
    return _folded(f"{what}: {len(found)}", f"<ul>{rows}</ul>")


def _source(found: Symbol, opened: bool = False) -> str:
    """A symbol, and by a click its source, as far as LONGEST."""
    lines = found.source.split("\n")
    more = ["…"] * (len(lines) > LONGEST)
    return _folded(_told(found), snippet("\n".join(lines[:LONGEST] + more)), opened)


def _tests(key: str, opened: bool = False) -> str:
    """The tests of a key, each with the boards it names; the first may be open."""
    rows = []
    for k, test in enumerate(index.marked_with(key)):
        code = "".join(snippet(s.source) for s in (*index.boards_of(test), test))
        rows.append(f"<li>{_folded(_told(test), code, opened and k == 0)}</li>")
    return f'<ul class="tests">{"".join(rows)}</ul>'


# -- Code in colour ----------------------------------------------------------------

_TOKENS = re.compile(
    r"""(?P<s>[rbf]*(?:\"{3}.*?\"{3}|"(?:\\.|[^"\\\n])*"|'(?:\\.|[^'\\\n])*'))"""
    rf"""|(?P<c>\#[^\n]*)|(?P<n>\b\d[\w.]*)|(?P<k>\b(?:{"|".join(kwlist)})\b)""",
    re.DOTALL,
)


def snippet(code: str) -> str:
    """Code as HTML: keywords are of class k, strings s, numbers n, comments c."""
    text = escape(code, quote=False)
    inked = _TOKENS.sub(lambda m: f"<i class={m.lastgroup}>{m[0]}</i>", text)
    return f"<pre><code>{inked}</code></pre>"


# -- Algorithms ---------------------------------------------------------------------


def _contents() -> Iterator[str]:
    for name in ("algorithms", "equations", "tables", "figures"):
        title = f'<a href="#{name}">{name.capitalize()}</a>'
        yield f"<li>{title} {_links(WORDS[name])}</li>"
    for letter, name in WORDS["appendices"].items():
        title = f'<a href="#appendix-{letter}">Appendix {letter}: {name}</a>'
        yield f"<li>{title} {_links(c for c in CLAUSES if c[0] == letter)}</li>"


def _algorithm(name: str) -> str:
    places = [place for place in LINES if place.startswith(name)]
    head = f"Algorithm {name[-1]}: {TITLES[name]} {_links(index.beside(name))}"
    code = "".join(map(_source, index.symbols_of(name)))
    lines = "".join(map(_line, places))
    return f'<h3 id="{anchor(name)}">{head}</h3>{code}<ol class="lines">{lines}</ol>'


def _line(place: str) -> str:
    """One line: our words, its code, its tests; of an "end" only the word."""
    words, here = TITLES[place], anchor(place)
    depth = (len(LINES[place]) - len(words)) // 4
    number = f'<a class="number" href="#{here}">{place.split(":")[1]}</a>'
    said = f'<p class="said" style="--depth:{depth}">{number}<span>{words}</span></p>'
    if words == "end":
        return f'<li class="end" id="{here}">{said}</li>'
    code = "".join(
        _where(cited.where) + snippet(cited.text.strip())
        if cited.code
        else _source(cited.symbol)
        for cited in index.code_of(place)
    )
    return f'<li id="{here}">{said}{code}{_tests(place)}</li>'


# -- Equations, tables and figures --------------------------------------------------


def _equation(place: str) -> str:
    told, pictures = WORDS["equations"][place], {"Eq. 3": snapping, "Eq. 4": curve}
    head, read = f"{place}: {escape(told['title'])} ", _formula(told["read"])
    if "printed" in told:
        head += _badge("erratum")
        printed = f'<p class="as">As printed</p>{_formula(told["printed"])}'
        read = f'{printed}<p class="as">As we read it</p>{read}'
    code = (_source(each, k == 0) for k, each in enumerate(index.symbols_of(place)))
    picture = ""
    if place in pictures:
        drawn = inline(pictures[place]())
        picture = f'<img class="small" src="{drawn}" alt="{place}, drawn">'
    return (
        f'<article id="{anchor(place)}">'
        f"<h3>{head}{_links(index.beside(place))}</h3>"
        f"{read}<p>{_prose(told['note'])}</p>{''.join(code)}{picture}"
        f"{_tests(place, opened=True)}</article>"
    )


def _formula(tex: str) -> str:
    svg = formula(tex).replace("<svg", f'<svg role="img" aria-label="{escape(tex)}"', 1)
    return f'<div class="formula">{svg}</div>'


def _table(place: str) -> str:
    head = f"{place}: {TITLES[place]} {_links(index.beside(place))}"
    code = "".join(map(_source, index.symbols_of(place)))
    tests = _list("Tests", index.marked_with(place))
    return f'<h3 id="{anchor(place)}">{head}</h3>{code}{tests}'


def _row(row: str) -> str:
    """A row of both tables; with what it does, what another value was found to cost."""
    field = index.symbol(f"learning.settings.TrainerSettings.{row}")
    cost = _prose(WORDS["costs"].get(row, ""))
    cells = (
        f"<code>{row}</code> {_where(field.where)}",
        _value(TABLE_I[row]),
        _value(TABLE_II[row]),
        _prose(WORDS["rows"][row]) + f"<p>{cost}</p>" * bool(cost),
        " ".join(map(_where, (_read_at(row) or ["checked only"])[:MOST])),
    )
    return f'<tr id="row-{row}">{"".join(f"<td>{cell}</td>" for cell in cells)}</tr>'


def _value(value: object) -> str:
    return f"{value:,}" if type(value) is int else str(value).lower()


def _read_at(setting: str) -> list[str]:
    """Where trainers and trainings read a setting, as file:line."""
    read = re.compile(rf"\b(s|settings|robots|fire|made)\.{setting}\b")
    return [
        f"{path.relative_to(index.ROOT)}:{number}"
        for folder in ("learning", "workshop/training")
        for path in sorted((index.PACKAGE / folder).glob("*.py"))
        for number, line in enumerate(index.lines_of(path), 1)
        if read.search(line)
    ]


def _figure(building: Building, place: str) -> str:
    """Ours, drawn by the function that cites the paper's."""
    draw, title = index.symbols_of(place)[0], TITLES[place]
    floor = int(place[-1]) - 4  # Figs. 4-6 are its floors
    where = {"floor": floor} if floor >= 0 else {}
    option = f" --floor {floor + 1}" * (floor >= 0)
    drawn = inline(getattr(drawing, draw.name)(building, **where))
    return (
        f'<figure id="{anchor(place)}"><figcaption><b>{place}</b>: {title} '
        f"{_links(index.beside(place))}</figcaption>"
        f'<img src="{drawn}" alt="{place}: {title}">'
        f"<code>draw paper --view {draw.name}{option}</code>"
        f"{_source(draw)}{_list('Tests', index.marked_with(place))}</figure>"
    )


# -- Clauses and glossary -----------------------------------------------------------


def _filter(kind: str) -> str:
    """A choice of what is shown; the style sheet hides the rest."""
    shown = [c for c in CLAUSES if kind == "all" or kind in index.kinds_of(c)]
    state = " checked" * (kind == "all")
    button = f'<input type="radio" name="kind" id="only-{kind}"{state}>'
    return f"<label>{button} {_badge(kind)}{len(shown)}</label>"


def _clause(clause: str) -> str:
    """What kind of statement it is, why so, and who carries and holds it."""
    kinds, letter, here = index.kinds_of(clause), clause[0], anchor(clause)
    title = f"{letter}. {WORDS['appendices'][letter]}"
    begins = f'<h3 id="appendix-{letter}">{title}</h3>' * (clause[1:] == "1")
    return (
        f'{begins}<article id="{here}" class="clause {" ".join(kinds)}">'
        f'<h4><a href="#{here}">{clause}</a> {_prose(TITLES[clause])} '
        f"{''.join(map(_badge, kinds))}</h4>"
        f"<p>{_prose(WORDS['errata'].get(clause, ''))}</p>"
        f"<p>{_links(index.beside(clause))}</p>"
        f"{_reasons(clause, 'deviation')}{_reasons(clause, 'chosen')}"
        f"{_list('In the code', index.symbols_of(clause))}"
        f"{_list('Tests', index.marked_with(clause))}</article>"
    )


def _reasons(clause: str, kind: str) -> str:
    """What the code says where it tags a clause with a kind, each once."""
    found = {c.reason: c for c in index.code_of(clause) if kind in c.kinds}
    rows = (
        f"<dt><code>{escape(cited.code or cited.symbol.title)}</code></dt>"
        f"<dd>{_prose(reason)} {_where(cited.where)}</dd>"
        for reason, cited in found.items()
    )
    return f"<div>{_badge(kind)}<dl>{''.join(rows)}</dl></div>" if found else ""


def _term(term: str) -> str:
    dotted, meaning = WORDS["glossary"][term]
    place = f"<code>{dotted}</code> {_where(index.symbol(dotted).where)}"
    return f"<dt>{escape(term)}</dt><dd>{_prose(meaning)} {place}</dd>"
