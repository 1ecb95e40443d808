"""Points as users write them."""

import pytest

from armdesign.demonstration.points.expressions import find_name, nearest, parse, quoted, split_list, unquoted
from armdesign.errors import TaskError

KNOWN = ("Anna:ACRO", "Anna:EPICl", "Anna:EPICm", "box:corner", "a+b", "*110", "x=y", "R.Wrist", "giver_RHand", "c, d")


def terms(text, known=KNOWN):
    return {term.name: term.weight for term in parse(text, known, "here").terms}


def test_a_name_is_a_point():
    assert parse("box:corner", KNOWN, "here").name == "box:corner"
    assert terms("box:corner") == {"box:corner": 1.0}


@pytest.mark.parametrize("name", ["a+b", "*110", "x=y", "c, d"])
def test_a_whole_text_that_is_a_name_is_that_name(name):
    assert parse(f" {name} ", KNOWN, "here").name == name
    assert parse(f"new={name}", KNOWN, "here").single == name


def test_the_prefix_may_be_left_off():
    point = parse("ACRO", KNOWN, "here")
    assert (point.name, point.single) == ("ACRO", "Anna:ACRO")
    assert parse("RHand", KNOWN, "here").single == "giver_RHand"


def test_a_side_is_no_prefix():
    with pytest.raises(TaskError, match="no point 'wrist'"):
        parse("wrist", ("left_wrist", "l_wrist"), "here")


def test_several_subjects_have_to_be_told_apart():
    with pytest.raises(TaskError, match=r"here: 'hand' may be any of 2 points; allowed: Anna:hand, Ben:hand. Give the"):
        parse("x=hand", ("Anna:hand", "Ben:hand", "Ben:arm"), "here")
    assert parse("hand", ("hand", "Ben:hand"), "here").single == "hand"


def test_a_mean():
    point = parse("elbow = EPICl + Anna:EPICm", KNOWN, "here")
    assert point.name == "elbow"
    assert terms("elbow=EPICl+EPICm") == {"Anna:EPICl": 0.5, "Anna:EPICm": 0.5}
    assert parse("EPICl+EPICm", KNOWN, "here").name == "EPICl+EPICm"


def test_weights():
    assert terms("mid=0.25*EPICl+0.75*R.Wrist") == {"Anna:EPICl": 0.25, "R.Wrist": 0.75}
    assert sum(terms("mid=1/3*EPICl+1/3*EPICm+1/3*ACRO").values()) == pytest.approx(1.0)
    assert terms("out=1.5*EPICl+-0.5*EPICm") == {"Anna:EPICl": 1.5, "Anna:EPICm": -0.5}


def test_names_in_quotation_marks():
    assert terms("new='a+b'+\"*110\"") == {"a+b": 0.5, "*110": 0.5}
    assert terms("new=0.5*'a+b'+0.5*'*110'") == {"a+b": 0.5, "*110": 0.5}
    assert parse('"a+b"', KNOWN, "here").name == "a+b"
    assert split_list('"c, d", elbow=EPICl+EPICm,hand') == ['"c, d"', "elbow=EPICl+EPICm", "hand"]
    assert split_list("R'Wrist,L'Wrist") == ["R'Wrist", "L'Wrist"]
    for name in ("plain", *KNOWN, "'q", 'say "a"'):
        assert unquoted(quoted(name)) == name


@pytest.mark.parametrize("text", ["ACRO", "e=EPICl+EPICm", "m=0.25*EPICl+0.75*R.Wrist", "x='a+b'", "*110", '"c, d"'])
def test_an_expression_written_out_reads_the_same(text):
    point = parse(text, KNOWN, "here")
    assert parse(str(point), KNOWN, "here") == point


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("new=0.5*EPICl+0.6*EPICm", "the weights in '0.5.*' sum to 1.1; allowed: a sum of 1"),
        ("new=0.5*EPICl+EPICm", "some points have a weight and some have none. Give all of them one"),
        ("new=half*EPICl+EPICm", "'half' in 'half\\*EPICl' is not a weight; allowed: a number or a fraction"),
        ("new=1/0*EPICl", "'1/0' in .* is not a weight"),
        ("new=EPICl++EPICm", "a \\+ without a point beside it"),
        ("EPICl+", "a \\+ without a point beside it"),
        ("=EPICl", "names no point for the base"),
        ("new=", "names no point"),
        ("", "names no point"),
        ("'EPICl", "the quotation mark ' is not closed"),
        ("elbow=EPICI+EPICm", "no point 'EPICI' for the base; allowed: Anna:EPIC., Anna:EPIC., Anna:ACRO"),
    ],
)
def test_what_is_wrong_is_said(text, message):
    with pytest.raises(TaskError, match=f"here: .*{message}"):
        parse(text, KNOWN, "here", " for the base")


def test_a_long_list_is_cut_and_begins_with_what_is_close():
    known = [f"Anna:point{i:03d}" for i in range(100)] + ["Anna:ELBOW"]
    shown = nearest("elbw", known)
    assert shown[0] == "Anna:ELBOW"
    assert shown[-1] == "and 71 more"
    assert len(shown) == 31
    with pytest.raises(TaskError, match="no point 'elbw'; allowed: Anna:ELBOW, "):
        find_name("elbw", known, "here")
