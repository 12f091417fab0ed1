"""The report as a person sees it: in a browser, wide and narrow, light and dark, and on paper."""

from __future__ import annotations

import re

import pytest

WIDTHS = (1280, 400)

# Share of a canvas's pixels that something was drawn on.
INKED = """
[...document.querySelectorAll('.plot canvas')].map((canvas) => {
  const { width, height } = canvas;
  const { data } = canvas.getContext('2d').getImageData(0, 0, width, height);
  let inked = 0;
  for (let i = 3; i < data.length; i += 4) inked += data[i] > 0;
  return inked / (width * height);
})
"""
# Elements that stick out on the right, but for those inside a box that scrolls by itself.
STICKING_OUT = """
[...document.querySelectorAll('body *')]
  .filter((e) => e.getBoundingClientRect().right > document.documentElement.clientWidth + 1)
  .filter((e) => !e.closest('.scroll, .uplot, select, svg'))
  .map((e) => e.tagName + '.' + e.className)
"""
# WCAG contrast of text against the nearest background behind it; the smallest of all visible texts.
LOWEST_CONTRAST = """
(() => {
  const channel = (v) => (v /= 255) <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4;
  const light = ([r, g, b]) => 0.2126 * channel(r) + 0.7152 * channel(g) + 0.0722 * channel(b);
  const parse = (text) => text.match(/[\\d.]+/g).map(Number);
  const behind = (e) => {
    for (; e; e = e.parentElement) {
      const c = parse(getComputedStyle(e).backgroundColor);
      if (c.length < 4 || c[3] === 1) return c;
    }
    return [255, 255, 255];
  };
  let worst = [99, ''];
  const texts = 'h1, h2, h3, p, td, th, dd, dt, li, figcaption, summary, label, span';
  for (const e of document.querySelectorAll(texts)) {
    if (![...e.childNodes].some((n) => n.nodeType === 3 && n.data.trim())) continue;
    const a = light(parse(getComputedStyle(e).color));
    const b = light(behind(e));
    const ratio = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
    if (ratio < worst[0]) worst = [ratio, e.tagName + ': ' + e.textContent.trim().slice(0, 40)];
  }
  return worst;
})()
"""


def open_all(browser) -> None:
    browser.evaluate("document.querySelectorAll('details').forEach((d) => (d.open = true))")


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("dark", [False, True], ids=("light", "dark"))
def test_loads_without_errors_and_without_network(browser, report, width, dark):
    browser.open(report, width, dark)
    assert browser.errors == []
    assert browser.requests == [report.resolve().as_uri()]


@pytest.mark.parametrize("width", WIDTHS)
def test_nothing_sticks_out_sideways(browser, report, width):
    browser.open(report, width)
    open_all(browser)
    shown = browser.evaluate("document.documentElement.clientWidth")
    assert browser.evaluate("document.documentElement.scrollWidth") <= shown
    assert browser.evaluate(STICKING_OUT) == []


@pytest.mark.parametrize("width", WIDTHS)
def test_plots_over_time_are_drawn(browser, report, width):
    browser.open(report, width)
    shares = browser.evaluate(INKED)
    assert len(shares) == 2
    assert all(share > 0.005 for share in shares), shares
    fits = (
        "[...document.querySelectorAll('.plot')].every((p) => p.scrollWidth <= p.clientWidth + 1)"
    )
    assert browser.evaluate(fits)


def test_first_screen_tells_the_story(browser, report):
    browser.open(report, 1280)
    for selector in ("h1", ".badge", ".lead", "svg.robot", ".figures"):
        box = f"document.querySelector({selector!r}).getBoundingClientRect()"
        top, height = browser.evaluate(f"[{box}.top, {box}.height]")
        assert top < 900, f"{selector} starts {top} px down"
        assert height > 0, selector
    headline = browser.evaluate("document.querySelector('h1').textContent")
    assert re.search(r"missing", headline), headline


def test_residual_picture_and_signature_have_content(browser, report):
    browser.open(report, 1280)
    boxes = browser.evaluate(
        "[...document.querySelectorAll('.cellbox')]"
        ".map((b) => [b.clientHeight, b.querySelectorAll('path').length])"
    )
    assert boxes
    assert all(height > 20 and paths > 0 for height, paths in boxes), boxes
    signatures = browser.evaluate(
        "[...document.querySelectorAll('svg.signature')].map((s) =>"
        " [s.querySelector('.cloud').getAttribute('d').length, s.querySelectorAll('.law').length])"
    )
    for points, laws in signatures:
        assert points > 0
        assert laws == 1


def test_size_in_blocks_of_time_has_a_point_for_each(browser, report):
    browser.open(report, 400)
    pictures = browser.evaluate(
        "[...document.querySelectorAll('svg.blocks')].map((s) => {"
        " const right = (t) => t.getBoundingClientRect().right;"
        " const texts = [...s.querySelectorAll('text')];"
        " return [s.querySelectorAll('.mean').length, Math.max(...texts.map(right))]; })"
    )
    nothing = "no_missing_effect" in browser.evaluate("document.querySelector('.badge').className")
    assert bool(pictures) != nothing
    assert all(points > 1 and right <= 400 for points, right in pictures), pictures


def test_named_places_are_marked_in_the_drawing(browser, report):
    browser.open(report, 1280)
    found = browser.evaluate("document.querySelector('.badge').className")
    marks = browser.evaluate("document.querySelectorAll('.robot .marked, .robot .force').length")
    if "no_missing_effect" in found:
        assert marks == 0
    else:
        assert marks > 0


def test_channel_trial_and_zoom_controls_work(browser, report):
    browser.open(report, 1280)
    shown = "document.querySelector('#plot-values canvas').toDataURL()"
    whole = browser.evaluate(shown)

    def press(how: str) -> str:
        browser.evaluate(f"document.querySelector('[data-zoom={how}]').click()")
        browser.settle()
        return browser.evaluate(shown)

    closer = press("in")
    assert closer != whole, "zooming in changes the plot"
    assert press("right") != closer, "moving on changes the plot"
    press("all")
    assert browser.evaluate(shown) == whole, "`all` shows the whole trial again"

    def choose(box: str) -> None:
        browser.evaluate(
            f"(() => {{ const b = document.getElementById('{box}');"
            " b.selectedIndex = (b.selectedIndex + 1) % b.options.length;"
            " b.dispatchEvent(new Event('change')); })()"
        )
        browser.settle()

    if browser.evaluate("document.getElementById('channel').options.length") > 1:
        choose("channel")
        assert browser.evaluate(shown) != whole, "another channel is another plot"
    if browser.evaluate("document.getElementById('trial').options.length") > 1:
        choose("trial")
        assert all(share > 0.005 for share in browser.evaluate(INKED))
    assert browser.errors == []


def test_pointer_reads_the_residual_picture(browser, report):
    browser.open(report, 1280)
    browser.evaluate(
        "(() => { const box = document.querySelector('.cellbox');"
        " const { left, top } = box.getBoundingClientRect();"
        " const at = { clientX: left + 9, clientY: top + 9 };"
        " box.dispatchEvent(new PointerEvent('pointermove', at)); })()"
    )
    text = browser.evaluate("document.getElementById('heat-value').textContent")
    assert re.search(r"to [\d.]+ s, (before|after): ", text), text


@pytest.mark.parametrize("dark", [False, True], ids=("light", "dark"))
def test_text_has_contrast(browser, report, dark):
    browser.open(report, 1280, dark)
    open_all(browser)
    ratio, where = browser.evaluate(LOWEST_CONTRAST)
    assert ratio >= 4.5, where


def test_dark_page_is_dark(browser, report):
    background = "getComputedStyle(document.body).backgroundColor"
    browser.open(report, 1280, dark=True)
    assert sum(map(int, re.findall(r"\d+", browser.evaluate(background))[:3])) < 150
    browser.open(report, 1280, dark=False)
    assert sum(map(int, re.findall(r"\d+", browser.evaluate(background))[:3])) > 700


def test_prints_light_unfolded_and_within_the_page(browser, report):
    browser.open(report, 1280, dark=True, media="print")
    assert (
        browser.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    )
    assert browser.evaluate("document.querySelectorAll('details:not([open])').length") == 0
    assert all(share > 0.005 for share in browser.evaluate(INKED))
    widths = browser.evaluate(
        "[...document.querySelectorAll('.plot canvas')].map((c) => c.clientWidth)"
    )
    assert all(0 < width <= 690 for width in widths), widths
    paper = browser.pdf()
    assert paper.startswith(b"%PDF")
    pages = len(re.findall(rb"/Type\s*/Page\b", paper))
    assert 2 <= pages <= 15, pages
    assert browser.errors == []
