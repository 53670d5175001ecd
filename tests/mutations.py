"""Texts for fuzzing: good ones with a few of their words changed, and any at all."""

from __future__ import annotations

import random
import re
from collections.abc import Sequence

from hypothesis import strategies as st

_WORD = re.compile(r"\d+(?:\.\d+)?(?:e[+-]?\d+)?|\w+|\s+|.", re.DOTALL)

ODD_NUMBERS = (
    *("nan", "inf", "-inf", ".nan", "-.inf", "NaN", "Infinity", "1e999", "-1", "-0.0", "0"),
    *("1e-320", "1e308", "4294967296", "99999999999999999999", "9" * 400, "9" * 5000),
    *("0x" + "f" * 5000, "0x10", "1_000", "٣", "½", "1:1:1.5", "+", "1.", "true", "null"),
)

ODD_WORDS = (
    *",:=/~*\\\"'#[]{}<>&- \n\t\0\u2028\udcff\ufeffé",
    *("", "\r\n", "\x1b[2J", "../", "%s", "a" * 300, "self", "all", "None", "&lt;", "&x;", "<?x?>"),
    *("[" * 1500, "{" * 1500, "<a>" * 1500 + "</a>" * 1500, "<!-- -->", "<![CDATA[", "&a ", "*a"),
    *("<<: ", "? ", "- ", "!!int ", "!!binary ", "2001-01-01 00:00:00 +23:00"),
)
"""Among them what means something in one of the formats, and half of a pair of surrogates, which
is how a byte that is not UTF-8 comes from a command line."""


def mutated(samples: Sequence[str], most: int = 3) -> st.SearchStrategy[str]:
    """One of `samples` with 1 to so many changes: two texts in three `_gently`, others `_roughly`.

    All is drawn from one seed, which costs Hypothesis a third of what a draw for each would, and
    gives few twice.
    """
    words = sorted({word for text in samples for word in _WORD.findall(text)})
    names = [word for word in words if word.isidentifier()]

    def made(seed: bytes) -> str:
        rng = random.Random(seed)
        text = rng.choice(samples)
        change, others = rng.choice(((_gently, names), (_gently, names), (_roughly, words)))
        for _ in range(rng.randint(1, most)):
            text = change(rng, text, others)
        return text

    return st.binary(min_size=8, max_size=8).map(made)


def texts(samples: Sequence[str]) -> list[st.SearchStrategy[str]]:
    """`mutated` ones, and any text."""
    return [mutated(samples), st.text(st.characters(), max_size=80)]


def contents(samples: Sequence[str]) -> list[st.SearchStrategy[bytes]]:
    """`mutated` ones as bytes of a file, in which halves of pairs of surrogates are not UTF-8; and
    any bytes."""
    written = mutated(samples).map(lambda text: text.encode("utf-8", "surrogatepass"))
    return [written, st.binary(max_size=200)]


def _gently(rng: random.Random, text: str, names: Sequence[str]) -> str:
    """As its grammar mostly allows: an odd number in place of one, another name in place of one, a
    line left out, repeated or moved (what is between commas, where there is one line)."""
    kind = rng.randrange(4)
    if kind == 0:
        mark = "\n" if "\n" in text else ","
        return mark.join(_rearranged(rng, text.split(mark), 1))
    words = _WORD.findall(text)
    known, new = (str.isidentifier, names) if kind == 1 else (_begins_with_digit, ODD_NUMBERS)
    places = [n for n, word in enumerate(words) if known(word)]
    if places:
        words[rng.choice(places)] = rng.choice(new)
    return "".join(words)


def _roughly(rng: random.Random, text: str, others: Sequence[str]) -> str:
    """Words left out, repeated or moved, or others put in, with no regard to grammar."""
    words = _WORD.findall(text)
    if rng.randrange(2):
        return "".join(_rearranged(rng, words, 6))
    at, instead_of = rng.randrange(len(words) + 1), rng.randrange(2)
    word = rng.choice(rng.choice((others, ODD_WORDS, ODD_NUMBERS)))
    return "".join([*words[:at], word, *words[at + instead_of :]])


def _begins_with_digit(word: str) -> bool:
    return word[0].isdigit()


def _rearranged(rng: random.Random, pieces: list[str], most: int) -> list[str]:
    """With a span of at most so many pieces left out, repeated or moved."""
    at, length = rng.randrange(len(pieces) + 1), rng.randint(1, most)
    before, span, after = pieces[:at], pieces[at : at + length], pieces[at + length :]
    kind = rng.randrange(3)
    if kind == 0:
        return before + after
    if kind == 1:
        return before + span * rng.randint(2, 4) + after
    rest = before + after
    to = rng.randrange(len(rest) + 1)
    return rest[:to] + span + rest[to:]
