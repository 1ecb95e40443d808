import pytest

from armdesign.errors import SettingsError
from armdesign.experiments.sweep.ranges import seed_numbers, whole_numbers


@pytest.mark.parametrize(
    ("text", "numbers"),
    [
        ("3", (3,)),
        ("3-6", (3, 4, 5, 6)),
        ("3,5", (3, 5)),
        ("1-3,7", (1, 2, 3, 7)),
        (" 2 , 4 - 5 ", (2, 4, 5)),
        ("5,3", (5, 3)),
        ("3,3-4,4", (3, 4)),
        ("7-7", (7,)),
    ],
)
def test_lists_keep_their_order_and_name_each_number_once(text, numbers):
    assert whole_numbers(text, "--dof") == numbers


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "--dof '' has an empty entry; allowed: whole numbers, ranges such as 3-6"),
        ("3,,4", "--dof '3,,4' has an empty entry"),
        ("three", "--dof 'three' has the entry 'three'; allowed: whole numbers"),
        ("3,x-4", "the entry 'x-4'"),
        ("3.5", "the entry '3.5'"),
        ("-3", "the entry '-3'"),
        ("3-", "the entry '3-'"),
        ("3-4-5", "the entry '3-4-5'"),
        ("²", "the entry '²'"),
        ("6-3", "--dof has the range 6-3: its ends are upside down. Write 3-6"),
        ("0-99999", "more than 10000 entries; allowed: up to 10000"),
        ("0-9000,10000-19000", "more than 10000 entries"),
        ("9" * 30, "has the entry '9+'"),
    ],
)
def test_lists_that_are_none_are_refused_with_what_is_allowed(text, message):
    with pytest.raises(SettingsError, match=message):
        whole_numbers(text, "--dof")


@pytest.mark.parametrize(
    ("text", "seeds"),
    [("1", (0,)), ("3", (0, 1, 2)), ("5-7", (5, 6, 7)), ("3,4", (3, 4)), ("7-7", (7,)), ("3,", None), ("0", None)],
)
def test_bare_number_of_seeds_is_a_count(text, seeds):
    if seeds is None:
        with pytest.raises(SettingsError, match="--seeds"):
            seed_numbers(text)
    else:
        assert seed_numbers(text) == seeds


def test_no_seeds_says_how_to_ask_for_one():
    with pytest.raises(SettingsError, match="For the seed 0 alone write --seeds 1; for the seed 7 alone --seeds 7-7"):
        seed_numbers("0")
