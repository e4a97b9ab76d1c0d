"""The annotated paper: one HTML page of the code, the tests and `annotations.toml`.

`page.html` is its template; here is what it asks for.

place  "Alg. 2:13", "Eq. 3", "Tab. I", "Fig. 4";  key  a place or a clause
"""

import re
import tomllib
from collections.abc import Callable
from html import escape
from itertools import groupby
from os.path import relpath
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from pygments import lex
from pygments.lexers import PythonLexer
from pygments.token import Comment, Keyword, Number, Operator, String

import reference
from reference import paper
from reference.building import Building
from reference.workshop import drawing
from reference.workshop.annotated import index
from reference.workshop.annotated.words import ANNOTATIONS, TITLES
from reference.workshop.drawing.annotated import board, data_uri, formula, snapping
from reference.workshop.drawing.ruler import curve

LONGEST_SNIPPET = 45  # lines of code that are shown together
LEXER = PythonLexer(stripnl=False, ensurenl=False)
TOKEN_CLASSES = {
    Keyword: "k",
    Operator.Word: "k",
    Comment: "c",
    String: "s",
    Number: "n",
}


def annotated_page(building: Building, folder: Path) -> str:
    """Write the page for a folder, from where its links lead to the files.

    The figures show a building. Raises InputError without tests.
    """
    index.marked_tests()
    shelf = Environment(
        loader=FileSystemLoader(Path(__file__).parent),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    for make in (anchor, prose, snippet, formula, pictures_of_boards()):
        shelf.filters[make.__name__] = make
    presets = index.PACKAGE / "workshop" / "training" / "presets.toml"
    return shelf.get_template("page.html").render(
        index=index,
        words=ANNOTATIONS,
        titles=TITLES,
        tables=(paper.TABLE_I, paper.TABLE_II),
        read_at=readers_of_setting,
        pictures=_pictures(building),
        version=reference.__version__,
        laptop=tomllib.loads(presets.read_text("utf-8"))["laptop"],
        root=relpath(index.ROOT, folder.resolve()),
    )


def _pictures(building: Building) -> dict[str, str]:
    """Data URIs of the six figures, and of two equations."""
    figures = {"Eq. 3": snapping(), "Eq. 4": curve()}
    for number, place in enumerate(ANNOTATIONS["figures"], 1):
        draw = getattr(drawing, index.symbols_of(place)[0].name)
        floor = {"floor": number - 4} if number > 3 else {}  # Figs. 4-6 show one each
        figures[place] = draw(building, **floor)
    return {place: data_uri(figure) for place, figure in figures.items()}


def readers_of_setting(setting: str) -> list[str]:
    """Where trainers and trainings read a setting, as file:line; the first four."""
    read = re.compile(rf"\b(s|settings|robots|fire|made)\.{setting}\b")
    return [
        f"{path.relative_to(index.ROOT)}:{number}"
        for folder in ("learning", "workshop/training")
        for path in sorted((index.PACKAGE / folder).glob("*.py"))
        for number, line in enumerate(index.lines_of(path), 1)
        if read.search(line)
    ][:4]


# -- Filters of the template: all but `anchor` make HTML ----------------------------


def anchor(key: str) -> str:
    """The id of a key on the page: "Alg. 2:13" -> alg-2-13."""
    return re.sub(r"\W+", "-", key).lower()


def prose(text: str) -> str:
    """Words as HTML: with `code`, and links to places."""
    html = re.sub(r"`([^`]+)`", r"<code>\1</code>", escape(text, quote=False))
    place = r"\b(Alg\. \d:\d+|Eq\. \d|Tab\. I+|Fig\. \d)\b"
    return re.sub(place, lambda m: f'<a href="#{anchor(m[0])}">{m[0]}</a>', html)


def walled(rows: list[str]) -> list[str]:
    """Put a floor of one row between two walls, as tests/movies builds it."""
    floors = [floor.split("\n") for floor in "\n".join(rows).split("\n\n")]
    for floor in floors:
        if len(floor) == 1 and len(floor[0]) > 5:
            floor[:] = ["#" * len(floor[0]), *floor, "#" * len(floor[0])]
    return [row for floor in floors for row in [*floor, ""]][:-1]


def pictures_of_boards() -> Callable[[str], str]:
    """Make the filter that draws a text's boards; one drawn before is used again."""
    known: dict[str, str] = {}

    def pictured(text: str) -> str:
        """The boards of a text as pictures, each with its caption."""
        html = ""
        for caption, rows in index.captioned_boards(text):
            rows = walled(rows)
            wide = max(map(len, rows))
            shapes = board(rows)
            if shapes in known:
                inner = f'<use href="#{known[shapes]}"/>'
            else:
                known[shapes] = f"board-{len(known)}"
                inner = f'<g id="{known[shapes]}">{shapes}</g>'
            size = f'viewBox="0 0 {wide} {len(rows)}" width="{15 * wide}"'
            said = f"<figcaption>{escape(caption)}</figcaption>" if caption else ""
            html += f"<figure><svg {size}>{inner}</svg>{said}</figure>"
        return html

    return pictured


def snippet(code: str) -> str:
    """Code as HTML: keywords are of class k, strings s, numbers n, comments c."""
    lines = code.split("\n")
    more = ["…"] if len(lines) > LONGEST_SNIPPET else []
    text = "\n".join(lines[:LONGEST_SNIPPET] + more)
    html = ""
    for ink, tokens in groupby(lex(text, LEXER), lambda token: _token_class(token[0])):
        words = escape("".join(word for _, word in tokens), quote=False)
        html += f"<i class='{ink}'>{words}</i>" if ink else words
    return f"<pre><code>{html}</code></pre>"


def _token_class(kind: Any) -> str | None:
    return next((ink for inked, ink in TOKEN_CLASSES.items() if kind in inked), None)
