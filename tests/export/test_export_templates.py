"""Where templates are looked for, and what filling them in refuses."""

from __future__ import annotations

import pytest

from armdesign.errors import ArmDesignError
from armdesign.export.templates import FOLDER, render, template_path


def put(folder, text):
    (folder / FOLDER).mkdir(parents=True)
    (folder / FOLDER / "t.j2").write_text(text)
    return folder


def test_a_checkout_has_its_templates_beside_the_package(tmp_path):
    put(tmp_path, "beside")
    assert render("t.j2", {}, tmp_path / "armdesign") == "beside"


def test_a_wheel_has_them_inside_and_that_comes_first(tmp_path):
    put(tmp_path, "beside")
    put(tmp_path / "armdesign", "inside")
    assert render("t.j2", {}, tmp_path / "armdesign") == "inside"


def test_the_arm_template_is_there():
    assert template_path("arm.urdf.j2").is_file()


def test_a_missing_template_names_both_places_and_the_way_out(tmp_path):
    with pytest.raises(ArmDesignError, match="reinstall") as caught:
        template_path("t.j2", tmp_path / "armdesign")
    assert str(tmp_path / "armdesign" / FOLDER) in str(caught.value)
    assert str(tmp_path / FOLDER) in str(caught.value)


def test_markup_in_values_is_escaped(tmp_path):
    put(tmp_path, '<a b="{{ value }}"/>')
    assert render("t.j2", {"value": '"<&'}, tmp_path / "armdesign") == '<a b="&#34;&lt;&amp;"/>'


@pytest.mark.parametrize("text", ["{{ nothing }}", "line\n{% if %}"])
def test_a_template_that_cannot_be_filled_in_is_named(tmp_path, text):
    put(tmp_path, text)
    with pytest.raises(ArmDesignError, match=r"t\.j2"):
        render("t.j2", {}, tmp_path / "armdesign")
