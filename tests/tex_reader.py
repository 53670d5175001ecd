"""Reads text and tables back from LaTeX, as far as `bench.report.latex` uses it."""

from __future__ import annotations

import re
import unicodedata

_COMMANDS = {
    "textbackslash": "\\",
    "textasciicircum": "^",
    "textasciitilde": "~",
    "textless": "<",
    "textgreater": ">",
    "textbar": "|",
    "textasciigrave": "`",
    "textquotesingle": "'",
    "char34": '"',
    "allowbreak": "",
}

_ACCENTS = dict(
    zip(
        "`'^~=u.\"rHvc",
        "\u0300\u0301\u0302\u0303\u0304\u0306\u0307\u0308\u030a\u030b\u030c\u0327",
        strict=True,
    )
)

_TOKEN = re.compile(
    r"""\\(?P<accent>[`'^~=u."rHvc])\{(?P<letter>[A-Za-z])\}
    | \\texttt\{(?P<name>(?:\{-\}|\\[`'^~=u."rHvc]\{\w\}|\\[a-z0-9]+\{\}|\\.|[^{}\\])*)\}
    | \\(?P<command>[a-z]+(?:34)?)\{\}
    | \\(?P<escaped>[#$%&_{}\ ])
    | (?P<hyphen>\{-\})
    | (?P<minus>\$-\$)
    | (?P<spread>\$\\pm\$)
    | (?P<dash>--)
    | (?P<unknown>\[U\+(?P<code>[0-9A-F]{4,6})\])
    | (?P<plain>[^#$%&_{}\\^~"<>|])""",
    re.VERBOSE,
)


def plain(tex: str) -> str:
    """What a reader sees.

    Raises:
        AssertionError: something means another thing to LaTeX, or is not known here.
    """
    seen, place = [], 0
    while place < len(tex):
        found = _TOKEN.match(tex, place)
        assert found, f"not understood: {tex[place:]!r}"
        seen.append(_seen(found))
        place = found.end()
    return "".join(seen)


def _seen(found: re.Match[str]) -> str:
    if found["accent"]:
        return unicodedata.normalize("NFC", found["letter"] + _ACCENTS[found["accent"]])
    if found["name"] is not None:
        return plain(found["name"])
    if found["command"]:
        return _COMMANDS[found["command"]]
    if found["code"]:
        return chr(int(found["code"], 16))
    signs = {"hyphen": "-", "minus": "-", "spread": "±", "dash": "-"}
    for kind, sign in signs.items():
        if found[kind]:
            return sign
    return found["escaped"] or found["plain"]


def tables(tex: str) -> dict[str, list[dict[str, str]]]:
    """The rows of each table, by its label: titles to what a reader sees, `env` among them."""
    read = {}
    for label, body in re.findall(
        r"\\label\{tab:(\w+)\}.*?\\toprule\n(.*?)\\bottomrule", tex, re.DOTALL
    ):
        head, *lines = [line for line in body.splitlines() if line != r"\midrule"]
        titles, rows, env = _cells(head), [], ""
        for line in lines:
            heading = re.fullmatch(r"\\multicolumn\{\d+\}\{l\}\{(.*)\} \\\\", line)
            if heading:
                env = plain(heading[1])
            else:
                rows.append({"env": env, **dict(zip(titles, _cells(line), strict=True))})
        read[label] = rows
    return read


def _cells(line: str) -> list[str]:
    assert line.endswith(r" \\"), line
    return [plain(cell) for cell in line[:-3].split(" & ")]
