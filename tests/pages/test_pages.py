"""The pages of `inspect`, `diff` and `measure`, in a real browser."""

import io

import pytest
from conftest import HOSTILE
from PIL import Image

PAGES = ["inspect_page", "diff_page", "measure_page", "table_page"]
COLUMN = "[...document.querySelector('table').tBodies[0].rows].map(row => row.cells[%d].%s)"
"""What stands in a column of the first table."""


@pytest.fixture(params=PAGES)
def page(request):
    return request.getfixturevalue(request.param)


def click(browser, heading: str) -> str:
    """Clicks a heading with the mouse, and says how the table is sorted then."""
    button = f"[...document.querySelectorAll('th button')].find(b => b.textContent === '{heading}')"
    browser.run(f"{button}.scrollIntoView({{block: 'center'}})")
    x, y = browser.run(f"(({{x, y, width, height}}) => [x + width / 2, y + height / 2])({button}.getBoundingClientRect())")
    for what in ("mousePressed", "mouseReleased"):
        browser.call("Input.dispatchMouseEvent", type=what, x=x, y=y, button="left", clickCount=1)
    return browser.run(f"{button}.parentElement.getAttribute('aria-sort')")


def test_it_loads_without_complaint_and_asks_for_nothing(browser, page):
    browser.open(page)
    assert not browser.happened("Runtime.exceptionThrown")
    assert not browser.happened("Runtime.consoleAPICalled")
    assert not browser.happened("Log.entryAdded")
    urls = [event["request"]["url"] for event in browser.happened("Network.requestWillBeSent")]
    assert [url for url in urls if not url.startswith("data:")] == [page.resolve().as_uri()]


@pytest.mark.parametrize("name", ["inspect_page", "diff_page"])
def test_hostile_names_are_inert(browser, request, name):
    browser.open(request.getfixturevalue(name))
    assert HOSTILE in browser.run("document.querySelector('table').textContent")
    assert browser.run("document.scripts.length") == 1
    assert browser.run("document.querySelectorAll('[onerror], [src=x]').length") == 0
    assert browser.run("document.title") != "broken"


def test_even_a_script_that_got_in_would_not_run(browser, page):
    browser.open(page)
    browser.run("document.body.append(Object.assign(document.createElement('script'), {text: 'window.ran = 1'}))")
    browser.run("document.body.insertAdjacentHTML('beforeend', '<a id=trap onclick=\"window.ran = 1\">x</a>')")
    browser.run("document.getElementById('trap').click()")
    browser.run("fetch('https://example.org').catch(() => 0)")
    assert browser.run("window.ran === undefined")
    refused = {event["request"]["url"] for event in browser.happened("Network.requestWillBeSent")}
    assert not any(url.startswith("https:") for url in refused)


@pytest.mark.parametrize(("name", "heading"), [("inspect_page", "energy, cd"), ("diff_page", "after")])
def test_a_click_sorts_numbers_and_another_turns_them_round(browser, request, name, heading):
    browser.open(request.getfixturevalue(name))
    headings = browser.run("[...document.querySelectorAll('table')[0].tHead.rows[0].cells].map(h => h.innerText)")
    column = next(i for i, text in enumerate(headings) if text.startswith(heading))
    values = lambda: [float(v or "-inf") for v in browser.run(COLUMN % (column, "dataset.value ?? ''"))]  # noqa: E731
    assert click(browser, "path") == "ascending"
    assert values() not in (sorted(values()), sorted(values(), reverse=True))
    assert click(browser, heading) == "descending"
    assert values() == sorted(values(), reverse=True)
    assert click(browser, heading) == "ascending"
    assert values() == sorted(values())
    assert browser.run("document.querySelectorAll('[aria-sort]').length") == 1


def test_names_sort_by_the_numbers_in_them(browser, inspect_page):
    browser.open(inspect_page)
    click(browser, "path")
    lamps = [path for path in browser.run(COLUMN % (0, "textContent")) if "lamp" in path]
    assert lamps == [f"/lamp_{i}" for i in range(50)]


def test_a_heading_can_be_used_by_key(browser, page):
    browser.open(page)
    browser.run("document.querySelector('th button').focus()")
    for what in ("keyDown", "keyUp"):
        browser.call("Input.dispatchKeyEvent", type=what, key="Enter", code="Enter", windowsVirtualKeyCode=13, text="\r")
    assert browser.run("document.querySelector('th').getAttribute('aria-sort')") == "ascending"


def test_both_views_show_every_light_that_is_there(browser, inspect_page, diff_page):
    browser.open(inspect_page)
    assert browser.run("document.querySelectorAll('svg circle').length") == 2 * 51
    browser.open(diff_page)
    colours = {"green": 1, "red": 1, "orange": 3, "violet": 1, "grey": 46}
    for colour, count in colours.items():
        assert browser.run(f"document.querySelectorAll('svg circle.{colour}').length") == 2 * count
    # Of those that changed, one moved.
    assert browser.run("document.querySelectorAll('svg .trace').length") == 2


def test_the_slider_leafs_through_the_levels(browser, inspect_page):
    browser.open(inspect_page)
    visible = "[...document.querySelectorAll('svg .boxes')].filter(p => p.checkVisibility()).map(p => p.dataset.level)"
    last = browser.run("document.querySelector('input').max")
    for level in ("0", last):
        browser.run(f"(s => {{ s.value = {level}; s.dispatchEvent(new Event('input')); }})(document.querySelector('input'))")
        assert browser.run(visible) == [level, level]
    boxes = "document.querySelector(`svg .boxes[data-level='%s']`).getAttribute('d').match(/z/g).length"
    assert browser.run(boxes % 0) == 1 < browser.run(boxes % last)


def pixels_of(browser, image: str) -> list[tuple[int, int, int, int]]:
    """The pixels of an image that a script finds."""
    draw = f"""(async () => {{
        const image = {image};
        await image.decode();
        const canvas = document.createElement('canvas');
        [canvas.width, canvas.height] = [image.naturalWidth, image.naturalHeight];
        const context = canvas.getContext('2d');
        context.drawImage(image, 0, 0);
        return [...context.getImageData(0, 0, canvas.width, canvas.height).data];
    }})()"""
    data = browser.run(draw)
    return list(zip(data[::4], data[1::4], data[2::4], data[3::4]))


def test_the_heat_map_shows_where_it_is_brighter(browser, diff_page):
    browser.open(diff_page)
    pixels = pixels_of(browser, "document.querySelector('.heat img')")
    assert any(a == 255 and r > b + 40 for r, g, b, a in pixels), "somewhere it is brighter"
    assert any(a == 255 and b > r + 40 for r, g, b, a in pixels), "somewhere it is darker"


def test_cells_are_dark_where_light_is_hidden(browser, table_page):
    browser.open(table_page)
    plan = "Object.assign(new Image(), {src: document.querySelectorAll('svg image')[0].href.baseVal})"
    pixels = pixels_of(browser, plan)
    assert any(a == 255 and r > b + 60 for r, g, b, a in pixels), "somewhere all is seen"
    assert any(a == 255 and b > r for r, g, b, a in pixels), "somewhere it is hidden"
    assert browser.run("document.querySelectorAll('.plan .key img').length") == 1


def test_dark_is_dark_and_light_is_light(browser, page):
    def ground(dark: bool) -> float:
        browser.open(page, dark)
        picture = Image.open(io.BytesIO(browser.screenshot(800, 600))).convert("L")
        return sorted(picture.get_flattened_data())[800 * 600 // 2]

    assert ground(False) > 200
    assert ground(True) < 60


def move(browser, x: float, y: float, what: str = "mouseMoved", **more) -> None:
    browser.call("Input.dispatchMouseEvent", type=what, x=x, y=y, **more)


def test_who_points_near_a_dot_of_the_curves_is_told_its_values(browser, measure_page):
    browser.open(measure_page)
    browser.run("document.querySelector('.chart').scrollIntoView({block: 'center'})")
    assert browser.run("document.querySelectorAll('.chart path.curve').length") == 2 * 3
    places = browser.run(
        "[...document.querySelectorAll('.chart circle')].map(dot => {"
        " const {x, y, width, height} = dot.getBoundingClientRect();"
        " return [x + width / 2, y + height / 2, dot.querySelector('title').textContent]; })"
    )
    assert len(places) == 9
    for x, y, label in (places[0], places[4], places[8]):
        move(browser, x + 1, y - 1)
        assert browser.run("document.querySelector('.chart output').textContent") == label
        assert "error" in label and " s," in label and "dB" in label
    assert browser.run("document.querySelectorAll('.chart circle.near').length") == 1
    # Some dot is on the frontier; the broad line goes through all of them.
    marked = browser.run("document.querySelectorAll('.chart circle.marked').length")
    through = browser.run("document.querySelector('.chart .frontier').getAttribute('d').match(/[ML]/g).length")
    assert 0 < marked == through


def test_curves_fall_and_stay_inside_their_frame(browser, measure_page):
    browser.open(measure_page)
    inside = """(() => {
        const box = (e) => e.getBoundingClientRect();
        const frame = box(document.querySelector('.chart .frame'));
        return [...document.querySelectorAll('.chart circle')].every((dot) => {
            const { left, right, top, bottom } = box(dot);
            return left >= frame.left && right <= frame.right && top >= frame.top && bottom <= frame.bottom;
        });
    })()"""
    assert browser.run(inside)
    names = browser.run("[...document.querySelectorAll('.chart .name')].map(name => name.textContent)")
    assert sorted(names) == ["tree", "tree:0", "uniform"]


def test_a_slider_shows_more_of_one_picture_or_of_the_other(browser, measure_page):
    browser.open(measure_page)
    browser.run("document.querySelector('.wipe .stage').scrollIntoView({block: 'center'})")
    x, y, width, height = browser.run(
        "(({x, y, width, height}) => [x, y, width, height])"
        "(document.querySelector('.wipe .stage').getBoundingClientRect())"
    )
    assert width > 300 and 0.5 < height / width < 0.8, "the picture has its shape"
    clip = "document.querySelectorAll('.wipe .stage img')[1].style.clipPath"
    for share in (0.25, 0.75):
        place = {"x": x + share * width, "y": y + 10}
        move(browser, **place, what="mousePressed", button="left", buttons=1, clickCount=1)
        move(browser, **place, what="mouseReleased", button="left", clickCount=1)
        shown = float(browser.run(clip).split()[-1].rstrip("%)"))
        assert abs(shown - 100 * share) < 1, browser.run(clip)
    # The left picture, the right one, and all that can be chosen.
    sources = "[...document.querySelectorAll('.wipe .stage img')].map(image => image.src)"
    left, right = browser.run(sources)
    assert left != right
    chosen = "[...document.querySelectorAll('.wipe select')].map(select => select.selectedOptions[0].text)"
    assert browser.run(chosen)[1] == "the reference"
    browser.run("(s => { s.value = 1; s.dispatchEvent(new Event('input')); })(document.querySelectorAll('.wipe select')[1])")
    assert browser.run(chosen)[1].split("@")[0] in ("tree", "tree:0", "uniform")
    assert browser.run(sources)[0] == left and browser.run(sources)[1] not in (left, right)


def test_maps_of_error_are_not_all_alike(browser, measure_page):
    browser.open(measure_page)
    sources = browser.run("[...document.querySelectorAll('.heat > img')].map(image => image.src)")
    assert len(set(sources)) == 3
