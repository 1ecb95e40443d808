"""The studio as a person sees it, in a real Chromium."""

import io
import os
import time
import urllib.error
import urllib.request
from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import expect

from armdesign.runs.folder import RESULT

SCENE = {"x": 0, "y": 0, "width": 800, "height": 800}


def tab(page, name):
    page.get_by_role("tab", name=name, exact=True).click()


def focus(page, words):
    """Press Tab until something with these words has the focus."""
    for _ in range(60):
        page.keyboard.press("Tab")
        if words in page.evaluate("() => { const e = document.activeElement; return e.value || e.innerText }"):
            return
    raise AssertionError(f"the keyboard does not get to {words!r}")


def begin_search(page, *, thorough=False):
    """Search an arm of 4 joints, by the keyboard alone but for how thorough it is to be."""
    focus(page, "search it")
    page.keyboard.press("Enter")
    page.get_by_role("button", name="Search the arm").wait_for()
    focus(page, "as few as do it")
    page.keyboard.press("Enter")
    page.get_by_role("option", name="4", exact=True).wait_for()
    for _ in range(9):
        page.keyboard.press("ArrowDown")
        if page.locator("[role=option][data-combobox-selected]").inner_text() == "4":
            break
    page.keyboard.press("Enter")
    expect(page.get_by_label("Joints", exact=True)).to_have_value("4")
    if thorough:
        page.get_by_label("How thorough", exact=True).click()
        page.get_by_role("option", name="thorough").click()
    focus(page, "Search the arm")
    page.keyboard.press("Enter")
    page.get_by_role("heading", name="Searching").wait_for(timeout=240_000)


def colours(page):
    """How many colours the scene has."""
    picture = Image.open(io.BytesIO(page.screenshot(clip=SCENE))).convert("RGB")
    return len(np.unique(np.asarray(picture).reshape(-1, 3), axis=0))


def test_the_page_is_for_who_has_the_address_and_shows_a_take(studio, open_page, take):
    address, folder = studio()
    plain = address.split("?")[0]
    for refused in (plain, f"{plain}?token=guess"):
        with pytest.raises(urllib.error.HTTPError) as caught:
            urllib.request.urlopen(refused)
        assert caught.value.code == 403
    page, faults = open_page(address)
    page.locator("input[type=file]").first.set_input_files(take)
    page.get_by_text("What cleaning did").wait_for()
    assert (folder / "takes" / take.name).read_bytes() == take.read_bytes()
    bad = {"name": "bad.c3d", "mimeType": "", "buffer": b"not a recording"}
    page.locator("input[type=file]").first.set_input_files(bad)
    page.get_by_text("takes/bad.c3d is not a recording").first.wait_for()  # the sentence of the command line
    assert page.get_by_text("Traceback").count() == 0
    page.wait_for_timeout(500)
    assert colours(page) > 50
    page.set_viewport_size({"width": 390, "height": 844})  # a phone: the panels have its width, the scene is above them
    page.wait_for_timeout(1000)
    panels = page.locator(".mantine-Paper-root:has(.ad)").first.bounding_box()  # the window, not a folder in it
    assert (panels["x"], panels["width"]) == (0, 390)
    assert page.locator("canvas").first.bounding_box()["height"] <= panels["y"] + 1
    assert faults == []


@pytest.mark.slow
def test_from_a_c3d_to_a_urdf(studio, open_page, take):
    address, folder = studio(take)
    page, faults = open_page(address)
    begin_search(page)
    page.reload()  # in mid-search
    page.get_by_text("armdesign studio").first.wait_for()
    tab(page, "Search")
    page.get_by_role("heading", name="The search has ended").wait_for(timeout=400_000)
    (run,) = (each for each in (folder / "runs").iterdir() if each.is_dir())
    assert (run / RESULT).is_file()
    before = colours(page)
    page.locator("svg[data-start]").first.click(position={"x": 250, "y": 60})
    page.wait_for_timeout(1000)
    assert colours(page) > 50 < before
    tab(page, "Redesign")
    slider = page.get_by_role("slider").nth(4)
    slider.focus()
    slider.press("ArrowRight")  # by the keyboard alone
    page.get_by_text("against the arm before").wait_for(timeout=120_000)
    tab(page, "Parts")
    with page.expect_download(timeout=120_000) as download:
        page.get_by_role("button", name="Download the robot file").click()
    assert download.value.suggested_filename == f"{run.name}-changed-4-joints-0.5-kg-arm.urdf"
    joints = ElementTree.parse(download.value.path()).getroot().findall("joint[@type='revolute']")
    assert len(joints) == 4
    assert faults == []


@pytest.mark.slow
def test_closing_the_page_stops_nothing_and_a_stopped_search_goes_on(studio, open_page, take):
    address, folder = studio(take)
    page, _ = open_page(address)
    begin_search(page, thorough=True)
    page.close()
    (run,) = (each for each in (folder / "runs").iterdir() if each.is_dir())
    before = os.stat(run / "state.npz").st_mtime_ns
    time.sleep(3.0)
    assert (run / RESULT).exists() or os.stat(run / "state.npz").st_mtime_ns > before
    page, faults = open_page(address)
    tab(page, "Search")
    page.get_by_role("button", name="Stop").click()
    page.get_by_role("button", name="Go on with this search").click()
    page.get_by_role("heading", name="Searching").wait_for()
    assert page.get_by_text("failed").count() == 0
    assert faults == []
