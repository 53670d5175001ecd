"""Arguments by the annotations of constructors: read from text, written as text, refused."""

from __future__ import annotations

import collections.abc as abc
import decimal
import enum
import fractions
import json
import typing
from collections.abc import Callable
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any, Literal, NewType, Optional, Union

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from envs import InputError, Registry, Spec
from envs.registry import Entry
from envs.registry.text_values import quoted, split, unquoted

if TYPE_CHECKING:
    from nowhere import Nothing  # type: ignore[import-not-found]


class Speed(enum.Enum):
    FAST = "quick"
    SLOW = 2


Metres = NewType("Metres", float)


class Typed:
    """An argument for each annotation that people write."""

    def __init__(
        self,
        *,
        size: Optional[int] = 3,  # noqa: UP045
        other: int | None = None,
        ratio: Union[float, None] = 0.5,  # noqa: UP007
        flag: bool = False,
        flag_or_none: bool | None = None,
        mode: Literal["fast", "Slow", 7] = "fast",
        maybe: Literal["a", "b"] | None = None,
        auto: Literal["auto", True, False] = "auto",
        file: Path = Path("a"),
        perhaps: Path | None = None,
        pure: PurePath = PurePath("b"),  # noqa: B008
        text: str = "",
        text_or_none: str | None = "x",
        sizes: list[int] = [1, 2],  # noqa: B006
        names: tuple[str, ...] = (),
        files: list[Path] | None = None,
        pair: tuple[int, str] = (1, "x"),
        several: abc.Sequence[float] = (),
        some: set[int] = frozenset(),  # type: ignore[assignment]
        nested: list[list[int]] = [],  # noqa: B006
        bare: list = [],  # type: ignore[type-arg]  # noqa: B006
        listed: typing.List[int] = [],  # noqa: B006, UP006
        number: int | float = 1,
        either: int | str = 1,
        one_or_more: str | list[str] = "x",
        speed: Speed = Speed.FAST,
        length: Metres = Metres(1.0),
        wide: np.int64 = np.int64(1),  # noqa: B008
        exact: decimal.Decimal = decimal.Decimal(1),
        part: fractions.Fraction = fractions.Fraction(1, 2),
        anything: Any = None,
        hook: Callable[[int], int] | None = None,
        call: Callable[[int], int] = abs,
        array: np.ndarray = np.zeros(2),  # type: ignore[type-arg]  # noqa: B008
        table: dict[str, int] = {},  # noqa: B006
        hidden: Nothing | None = None,
        plain=3,  # type: ignore[no-untyped-def]
        plain_flag=True,
        plain_text="x",
    ) -> None:
        self.given = {key: value for key, value in locals().items() if key != "self"}


class Untyped:
    """Without a constructor."""


REGISTRY: Registry[Any] = Registry(
    "thing",
    [Spec("typed", f"{__name__}:Typed", ""), Spec("untyped", f"{__name__}:Untyped", "")],
    "no.such.group",
)

GOOD = [
    ("size=5", 5),
    ("size=none", None),
    ("size=None", None),
    ("other=5", 5),
    ("ratio=2", 2.0),
    ("flag=on", True),
    ("flag_or_none=off", False),
    ("mode=slow", "Slow"),
    ("mode=Slow", "Slow"),
    ("mode=7", 7),
    ("maybe=b", "b"),
    ("auto=true", True),
    ("auto=off", False),
    ("file=some/where", Path("some/where")),
    ('file="a, b"', Path("a, b")),
    ("perhaps=x", Path("x")),
    ("pure=x", PurePath("x")),
    ("text='a,''b'", "a,'b"),
    ("text=C:\\a=b", "C:\\a=b"),
    ("text_or_none=none", None),
    ('sizes="3,4"', [3, 4]),
    ("sizes=3", [3]),
    ('sizes=" 3 , 4 "', [3, 4]),
    ('sizes=""', []),
    ('names="a,b"', ("a", "b")),
    ("names='\"a, b\",c'", ("a, b", "c")),
    ('files="a,b/c"', [Path("a"), Path("b/c")]),
    ('pair="2,y"', (2, "y")),
    ('several="1,2.5"', [1.0, 2.5]),
    ('some="3,2,3"', {2, 3}),
    ("nested=\"'1,2',3\"", [[1, 2], [3]]),
    ('bare="a,b"', ["a", "b"]),
    ('listed="5,6"', [5, 6]),
    ("number=4", 4),
    ("number=4.5", 4.5),
    ("either=4", 4),
    ("either=four", "four"),
    ("one_or_more=a", "a"),
    ('one_or_more="a,b"', ["a", "b"]),
    ("speed=SLOW", Speed.SLOW),
    ("speed=slow", Speed.SLOW),
    ("speed=2", Speed.SLOW),
    ("length=2.5", 2.5),
    ("wide=4", np.int64(4)),
    ("exact=0.10", decimal.Decimal("0.10")),
    ("part=2/3", fractions.Fraction(2, 3)),
    ("anything=1", "1"),
    ("plain=4", 4),
    ("plain=4.5", 4.5),
    ("plain_flag=off", False),
    ("plain_text=4", "4"),
]


@pytest.mark.parametrize(("text", "value"), GOOD)
def test_arguments_are_of_the_type_of_their_annotation(text: str, value: object) -> None:
    key = text.partition("=")[0]
    entry = REGISTRY.entry(f"typed:{text}")
    made = entry.make().given[key]
    assert made == value
    assert type(made) is type(value)
    assert entry.arguments == {key: value}
    # By its id, and as another process is told of it.
    assert REGISTRY.entry(entry.id) == entry
    assert REGISTRY.entries(f"{entry.id},untyped,{entry.id}") == [entry, REGISTRY.entry("untyped")]
    told = json.loads(json.dumps(entry.description))
    again = Entry.described(told).make().given[key]
    assert again == value
    assert type(again) is type(value)


@pytest.mark.parametrize(
    "text",
    [
        *("size=3", "other=none", "ratio=.5", "flag=off", "mode=FAST", "file=a", 'sizes="1,2"'),
        *('pair="1,x"', 'several=""', 'some=""', "speed=quick", "length=1", "wide=1", "exact=1"),
        *("part=1/2", "plain=3", "plain_flag=yes", "text_or_none=x", "anything=None", "auto=AUTO"),
    ],
)
def test_what_equals_a_default_is_left_out(text: str) -> None:
    assert REGISTRY.entry(f"typed:{text}").id == "typed"


BAD = {
    "size=x": "typed:size=x: 'x' is not of type int or none",
    "other=2.5": "of type int or none",
    "ratio=nan": "of type float or none",
    "flag=perhaps": "of type bool; say true or false",
    "flag_or_none=2": "say true or false or none",
    "mode=fas": "did you mean 'fast'?",
    "mode=zzz": "choose from: 7, Slow, fast",
    "maybe=c": "choose from: a, b, none",
    "speed=FASTER": "did you mean 'FAST'?",
    "sizes=x": "values with commas between and quotes about all of them, each of type int",
    'sizes="1,,2"': "each of type int",
    'pair="1"': "2 values with commas between",
    'pair="x,1"': "of type int, a text",
    'some="1,x"': "each of type int",
    "number=x": "of type int or of type float",
    "exact=x": "of type Decimal",
    "part=1/0": "of type Fraction",
    "wide=99999999999999999999": "of type int64",
    "call=1": "typed:call: no text stands for a",
    "array=1": "typed:array: no text stands for a ndarray; leave it out",
    "table=1": "typed:table: no text stands for a",
    "hook=1": "typed:hook=1: '1' is none of its values; choose from: none",
    "hidden=1": "hidden: NameError: name 'Nothing' is not defined",
    "plain=x": "typed:plain=x: 'x' is not of type int or of type float",
    "plain_flag=2": "say true or false",
    "text='a": "text: 'a begins with a quote that does not end it",
    'text="a"b': "begins with a quote that does not end it",
    "text": "is not of the form key=value",
}


@pytest.mark.parametrize("text", BAD)
def test_what_cannot_be_converted_is_refused_in_one_line(text: str) -> None:
    with pytest.raises(InputError) as caught:
        REGISTRY.entry(f"typed:{text}")
    assert BAD[text] in str(caught.value)
    assert "\n" not in str(caught.value)
    assert "is not is" not in str(caught.value)


def test_types_that_are_not_asked_for_need_not_be_there() -> None:
    assert REGISTRY.make("typed:size=4").given["size"] == 4


def test_a_class_without_a_constructor_has_no_arguments() -> None:
    with pytest.raises(InputError, match="untyped has no argument 'size'"):
        REGISTRY.entry("untyped:size=3")


VALUES = {
    "text": st.text(),
    "names": st.lists(st.text(), max_size=4).map(tuple),
    "sizes": st.lists(st.integers(), max_size=4),
    "nested": st.lists(st.lists(st.integers(), max_size=3), max_size=3),
    "file": st.text(st.characters(exclude_characters="\0"), min_size=1).map(Path),
    "several": st.lists(st.floats(allow_nan=False), max_size=3),
    "some": st.sets(st.integers(), max_size=3),
    "speed": st.sampled_from(Speed),
    "other": st.integers(),
}


@given(st.fixed_dictionaries({}, optional=VALUES))
def test_ids_name_the_same_entry(chosen: dict[str, Any]) -> None:
    spec = REGISTRY.entry("typed").spec
    id = Entry[Any](spec, chosen).id
    alone = REGISTRY.entry(id)
    assert {**_defaults(chosen), **alone.arguments} == chosen
    assert REGISTRY.entries(f" {id} , untyped") == [alone, REGISTRY.entry("untyped")]


def _defaults(chosen: dict[str, Any]) -> dict[str, Any]:
    """Those of what was chosen, in the types in which they are chosen."""
    defaults = {key: Typed().given[key] for key in chosen}
    several = {key for key, value in chosen.items() if isinstance(value, list | set)}
    return {
        key: type(chosen[key])(value or ()) if key in several else value
        for key, value in defaults.items()
    }


@given(st.lists(st.text(st.sampled_from("a,'\" =:\n")), min_size=1))
def test_lists_of_quoted_texts_are_split_again(texts: list[str]) -> None:
    assert [unquoted(item) for item in split(",".join(map(quoted, texts)))] == texts
