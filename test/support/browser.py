"""A real browser for tests of pages: headless Chromium, driven by Playwright."""

from contextlib import contextmanager
import shutil
import time

import pytest

_PROGRAMS = ('chromium', 'chromium-browser', 'google-chrome')
_ARGUMENTS = ('--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader')
_WINDOW = {'width': 1000, 'height': 480}  # the fewer pixels the faster
_SCENE = {
    'x': 460,
    'y': 180,
    'width': 200,
    'height': 300,
}  # between panels and messages
_TIMEOUT = 20.0  # s; software draws slowly on a busy machine


@contextmanager
def running_tab():
    """Run Chromium with one tab, or skip the test with what is missing."""
    playwright = pytest.importorskip('playwright.sync_api')
    programs = [program for program in map(shutil.which, _PROGRAMS) if program]
    if not programs:
        pytest.skip('needs Chromium')
    with playwright.sync_playwright() as running:
        browser = running.chromium.launch(executable_path=programs[0], args=_ARGUMENTS)
        tab = browser.new_page(viewport=_WINDOW)
        tab.set_default_timeout(1000 * _TIMEOUT)
        yield tab
        browser.close()


def show_page(tab, address):
    """Let a tab show a page of viser, if it does not yet, and return it."""
    if not tab.url.startswith(address):
        tab.goto(
            f'{address}?fixedDpr=1'
        )  # else viser draws fewer pixels while it is slow
        tab.get_by_role('tab', name='Poses').wait_for()
    return tab


def slider(page, name):
    """Return the slider that has a name as its label."""
    label = page.locator('label').get_by_text(name, exact=True)
    return page.locator(f'[id="{label.get_attribute("for")}"]').get_by_role('slider')


def copied_texts(page):
    """Return the texts of a page that can be copied."""
    return page.locator('pre').all_inner_texts()


def wait_until(page, is_so):
    """Wait for something to be so in a page."""
    deadline = time.monotonic() + _TIMEOUT
    while not is_so():
        assert time.monotonic() < deadline
        page.wait_for_timeout(50)


def still_picture(page, other_than=b''):
    """Return a picture of the scene once it has settled and differs from another."""
    pictures = [b'', b'']

    def has_settled():
        pictures[0], pictures[1] = pictures[1], page.screenshot(clip=_SCENE)
        return pictures[0] == pictures[1] != other_than

    wait_until(page, has_settled)
    return pictures[1]
