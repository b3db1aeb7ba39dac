"""A real browser without a window, and what its page holds."""

import json
import shutil
from urllib.parse import urlsplit

import numpy as np
import pytest

from tests.patience import HANGS, until

# three.js tells a listener of this name about every scene it makes; it is what its developer tools use
LISTEN = """
window.__scenes = [];
window.__THREE_DEVTOOLS__ = new EventTarget();
window.__THREE_DEVTOOLS__.addEventListener('observe', (event) => window.__scenes.push(event.detail));
"""
SEGMENTS = """
const wanted = arguments[0];
for (const scene of window.__scenes) {
  if (!scene.isScene) continue;
  let found = null;
  scene.traverse((node) => {
    const start = node.geometry && node.geometry.attributes && node.geometry.attributes.instanceStart;
    if (!start) return;
    let shown = true;
    node.traverseAncestors((above) => { shown = shown && above.visible; });
    if (shown && node.visible && start.count === wanted) found = start.data ? start.data.array : start.array;
  });
  if (found) return Array.from(found);
}
return null;
"""
# what never leaves the machine; with "chrome" and its relatives the browser fetches its own pages, a new tab's for one
LOCAL = ("about", "blob", "chrome", "chrome-extension", "chrome-untrusted", "data", "devtools", "file")
FLAGS = (
    "--headless=new --no-sandbox --disable-gpu --enable-unsafe-swiftshader --disable-quic --no-first-run "
    "--disable-background-networking --disable-component-update --disable-sync --disable-dev-shm-usage "
    "--window-size=480,360"
).split()


@pytest.fixture
def coarse(monkeypatch):
    """Bodies of the page in fewer triangles, and no T-matrices."""
    monkeypatch.setattr("creeping.explorer.scene.CELLS", 20)
    monkeypatch.setattr("creeping.explorer.frames.PATIENCE", 0.0)


class Browser:
    """A page of Chromium.

    Parameters
    ----------
    driver : selenium.webdriver.Chrome
    """

    def __init__(self, driver):
        self.driver = driver
        driver.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": LISTEN})

    def open(self, address):
        self.driver.get(address)

    def segments(self, count):
        """Ends of the lines with so many segments (count, 2, 3), once the page has them."""
        held = []

        def there():
            found = self.driver.execute_script(SEGMENTS, count)
            held[:] = [] if found is None else [np.array(found, dtype=float).reshape(-1, 2, 3)]
            return bool(held)

        until(there, lambda: f"no lines of {count} segments: {self.errors()}", pause=0.2)
        return held[0]

    def errors(self):
        """Lines of the console that are errors."""
        return [line for line in self.driver.get_log("browser") if line["level"] == "SEVERE"]

    def requests_outside(self, *hosts):
        """Addresses that the page has asked for over a network, but for those of the hosts (name:port)."""
        events = [json.loads(line["message"])["message"] for line in self.driver.get_log("performance")]
        asked = [e["params"]["request"]["url"] for e in events if e["method"] == "Network.requestWillBeSent"]
        # a socket is no request to the browser, and has an event of its own; sockets of workers are not told
        asked += [e["params"]["url"] for e in events if e["method"] == "Network.webSocketCreated"]
        parts = {address: urlsplit(address) for address in asked}
        return [address for address, at in parts.items() if at.scheme not in LOCAL and at.netloc not in hosts]


@pytest.fixture
def browser(tmp_path):
    """A fresh Chromium, or a skipped test where there is none."""
    selenium = pytest.importorskip("selenium.webdriver")
    chromium, driver = shutil.which("chromium"), shutil.which("chromedriver")
    if not (chromium and driver):
        pytest.skip("chromium and chromedriver are not installed (Debian: chromium chromium-driver)")
    options = selenium.ChromeOptions()
    options.binary_location = chromium
    for flag in (*FLAGS, f"--user-data-dir={tmp_path / 'profile'}"):
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    made = selenium.Chrome(options=options, service=selenium.ChromeService(driver))
    made.set_script_timeout(HANGS)
    yield Browser(made)
    made.quit()
