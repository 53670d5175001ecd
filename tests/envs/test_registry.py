"""Specs, entries and what is said of misspelt ones."""

from __future__ import annotations

import contextlib
import logging
from importlib.metadata import EntryPoint
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

import envs
import planners
from envs import InputError, Registry, Spec
from envs.registry.arguments import split_entries, typed_arguments


class Thing:
    """What the registry under test holds."""

    def __init__(
        self, fixed: str, size: int = 1, ratio: float = 0.5, fast: bool = False, name: str = "x"
    ) -> None:
        self.values = (fixed, size, ratio, fast, name)


class Anything:
    def __init__(self, **parameters: Any) -> None:
        self.parameters = parameters


def registry() -> Registry[Thing]:
    here = Thing.__module__
    return Registry(
        "thing",
        [
            Spec("thing", f"{here}:Thing", "a thing", {"fixed": "f"}, aliases=("th*",)),
            Spec("other", f"{here}:Thing", "another", {"fixed": "g"}, groups=("few",)),
            Spec("real", f"{here}:Thing", "one", in_all=False, without={"name": "other"}),
            Spec("any", f"{here}:Anything", "takes anything"),
            Spec("broken", "no.such.module:Thing", "cannot be imported"),
        ],
        "no.such.group",
    )


def test_arguments_are_typed_by_the_constructor() -> None:
    made = registry().make("thing:size=3,ratio=1e-2,fast=true,name=a.b/c")
    assert made.values == ("f", 3, 0.01, True, "a.b/c")


@pytest.mark.parametrize(
    ("words", "value"),
    [("true True TRUE 1 on On yes", True), ("false False 0 off OFF no", False)],
)
def test_flags_are_understood_in_the_words_that_people_use(words: str, value: bool) -> None:
    made = [registry().make(f"thing:fast={word}").values[3] for word in words.split()]
    assert made == [value] * len(made)


def test_the_canonical_id_leaves_defaults_out_and_sorts() -> None:
    entry = registry().entry("th*:size=2,ratio=0.5,fast=1,name=x")
    assert entry.id == "thing:fast=True,size=2"
    assert registry().entry("thing:size=1").id == "thing"


def test_a_stand_in_has_its_own_name() -> None:
    assert registry().entry("real:name=q,size=2").id == "real:name=q,size=2"
    assert registry().entry("real").id == "other"
    assert registry().entry("real:size=2").id == "other:size=2"
    assert [e.id for e in registry().entries("real,other,real:name=q")] == ["other", "real:name=q"]
    with pytest.raises(InputError, match=r"did you mean 'size'.*real without name= is other"):
        registry().entry("real:sice=2")


@pytest.mark.slow
@given(
    size=st.integers(),
    ratio=st.floats(allow_nan=False),
    fast=st.booleans(),
    name=st.text("abc./_-", min_size=1),
)
def test_canonical_ids_name_the_same_entry(size: int, ratio: float, fast: bool, name: str) -> None:
    text = f"thing:size={size},ratio={ratio!r},fast={fast},name={name}"
    entry = registry().entry(text)
    again = registry().entry(entry.id)
    assert again == entry
    assert again.make().values == ("f", size, ratio, fast, name)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("thingy", "did you mean 'thing'"),
        ("zzz", "choose from"),
        ("thing:sice=3", "did you mean 'size'"),
        ("thing:fixed=3", "no argument 'fixed'"),
        ("any2", "did you mean 'any'"),
        ("thing:size=3.5", "not of type int"),
        ("thing:ratio=nan", "not of type float"),
        ("thing:fast=maybe", "not of type bool; say true or false"),
        ("thing:size", "key=value"),
        ("thing:=3", "key=value"),
        ("thing:size=1,size=2", "given twice"),
        ("broken:size=1", "cannot be loaded"),
        ("", "no thing named"),
        (",,", "no thing named"),
    ],
)
def test_mistakes_are_one_clear_line(text: str, said: str) -> None:
    with pytest.raises(InputError) as caught:
        registry().entries(text)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("all", "'all' names several things, of which one is asked for here: thing, other, any"),
        ("few", "'few' names several things, of which one is asked for here: other"),
        ("fex", "unknown thing 'fex'; choose from: any, broken, other, real, th*, thing"),
    ],
)
def test_where_one_is_asked_for_groups_are_not_suggested(text: str, said: str) -> None:
    with pytest.raises(InputError) as caught:
        registry().entry(text)
    assert str(caught.value).startswith(said)
    if text == "fex":
        with pytest.raises(InputError, match="did you mean 'few'"):
            registry().entries(text)


@given(st.text(max_size=60))
def test_any_text_is_an_entry_or_an_input_error(text: str) -> None:
    for known in (registry(), envs.REGISTRY, planners.REGISTRY):
        with contextlib.suppress(InputError):
            assert known.entries(text)


def test_commas_separate_entries_and_arguments() -> None:
    assert split_entries("a,b:x=1,y=2,c") == ["a", "b:x=1,y=2", "c"]
    assert split_entries("a:f=C:/d,e:g=1") == ["a:f=C:/d", "e:g=1"]
    assert [e.id for e in registry().entries("thing:size=2,name=q,other,th*:name=q,size=2")] == [
        "thing:name=q,size=2",
        "other",
    ]


NAMES = (
    *(
        "my room, v2.obj",
        "a=b, c=d.obj",
        'it\'s "one", x',
        "'q'",
        '"',
        "'",
        ",",
        " a ",
        "a:b,c:d=1",
    ),
    *("C:\\rooms, old\\a.obj", "[1, 2]", "", "x\ny, z", "100 %, {x}", "ä, 部屋.obj"),
)


@pytest.mark.parametrize("name", NAMES)
def test_any_name_can_be_given_in_quotes(name: str) -> None:
    for quote in "'\"":
        text = f"name={quote}{name.replace(quote, 2 * quote)}{quote}"
        entry = registry().entry(f"thing:size=2,{text}")
        assert entry.make().values == ("f", 2, 0.5, False, name)
        assert registry().entry(entry.id) == entry
        ids = [e.id for e in registry().entries(f"other, thing:{text} ,size=2,other:{text}")]
        assert ids == ["other", entry.id, entry.id.replace("thing", "other").replace(",size=2", "")]


def test_names_without_commas_need_no_quotes() -> None:
    for name in ("a b.obj", "a=b:c.obj", "it's", 'in"ch', "C:\\a.obj", "ä.obj"):
        entry = registry().entry(f"thing:name={name}")
        assert entry.id == f"thing:name={name}"
        assert entry.arguments == {"name": name}


@pytest.mark.parametrize(
    ("text", "better"),
    [
        ("thing:name=my room, v2.obj", 'thing:name="my room, v2.obj"'),
        ("other,thing:size=2,name=a,b.obj,other", 'name="a,b.obj"'),
        ("thing:name=a,b,ratio=2", 'thing:name="a,b"'),
    ],
)
def test_of_a_comma_without_quotes_the_message_says_how_they_are_put(
    text: str, better: str
) -> None:
    with pytest.raises(InputError, match="a value with a comma in it") as caught:
        registry().entries(text)
    assert str(caught.value).endswith(f"here '{better}'")


def test_of_one_entry_too() -> None:
    with pytest.raises(InputError, match=r"here 'name=\"my room, v2\.obj\"'$"):
        registry().entry("thing:name=my room, v2.obj")


def test_types_that_cannot_be_looked_up_are_an_input_error() -> None:
    class Odd:
        def __init__(self, size: Nowhere = None) -> None:  # noqa: F821
            pass

    with pytest.raises(InputError, match=r"odd: the types .* 'Nowhere' is not defined"):
        typed_arguments("odd", Odd, (), {"size": "3"})


def test_groups() -> None:
    assert [e.id for e in registry().entries("few")] == ["other"]
    assert [e.id for e in registry().entries("all", wanted=lambda e: e.id != "thing")] == [
        "other",
        "any",
        "broken",
    ]


def test_what_keeps_out_of_all_is_still_found_by_name_and_group() -> None:
    made = registry()
    here = "tests.envs.test_registry"
    made.register(Spec("rare", f"{here}:Thing", "seldom", groups=("rare ones",), in_all=False))
    assert "rare" not in [entry.id for entry in made.entries("all")]
    assert made.entry("rare").id == "rare"
    assert [entry.id for entry in made.entries("rare ones")] == ["rare"]


def test_constructors_that_take_anything_get_text() -> None:
    assert registry().make("any:p=1,q=two").parameters == {"p": "1", "q": "two"}


def test_taken_and_malformed_names_are_refused() -> None:
    for id in ("thing", "th*", "a,b", "a:b", "../x", "", "all"):
        with pytest.raises(InputError):
            registry().register(Spec(id, "m:C", ""))


def test_plugins_are_read_and_broken_ones_are_named_and_skipped(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    module = test_plugins_are_read_and_broken_ones_are_named_and_skipped.__module__
    monkeypatch.setattr(
        "importlib.metadata.entry_points",
        lambda group: [
            EntryPoint("good", f"{module}:PLUGIN", group),
            EntryPoint("bad", "no.such.plugin:SPEC", group),
            EntryPoint("odd", f"{module}:Thing", group),
        ],
    )
    with caplog.at_level(logging.WARNING):
        ids = [spec.id for spec in registry().specs()]
    assert ids == ["thing", "other", "real", "any", "broken", "plugged-in"]
    assert "'bad' is skipped" in caplog.text
    assert "'odd' is skipped" in caplog.text


PLUGIN = Spec("plugged-in", "m:C", "from elsewhere")
