"""Pages in a browser without a window: what it complains of, and what it asks the network for."""

import json
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from selenium import webdriver
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.support.wait import WebDriverWait

NAMES = ("chromium", "chromium-browser", "google-chrome")
FLAGS = (
    "headless", "no-sandbox", "disable-gpu", "disable-quic", "no-first-run",
    "disable-background-networking", "disable-component-update", "disable-sync",
    "force-device-scale-factor=1", "enable-unsafe-swiftshader",
)  # fmt: skip

REMARKS = ("GPU stall due to ReadPixels", "willReadFrequently")
"""On the speed of drawing in space without a graphics card: no complaints of the page."""

PATIENCE = 60.0
"""With a page of some megabytes on a machine that is busy [s]."""


class Browser:
    """A browser that opens pages from files."""

    def __init__(self, driver: webdriver.Chrome) -> None:
        self.driver = driver

    def open(self, page: Path, width: int = 1400, height: int = 1000) -> None:
        """Open a page in a window of this size; what was logged of earlier ones is forgotten."""
        self.complaints(), self.requests()
        self.driver.set_window_size(width, height)
        self.driver.get("about:blank")  # for a page that is open already is not awaited
        self.driver.get(page.as_uri())
        WebDriverWait(self.driver, PATIENCE).until(
            lambda driver: driver.execute_script("return 'ready' in document.body.dataset")
        )

    def run(self, script: str, *arguments: Any) -> Any:
        """What a script that returns gives back."""
        return self.driver.execute_script(script, *arguments)

    def complaints(self) -> list[str]:
        """What the console has logged since it was last asked."""
        said = [entry["message"] for entry in self.driver.get_log("browser")]
        return [message for message in said if not any(remark in message for remark in REMARKS)]

    def requests(self) -> list[str]:
        """Addresses in a network that pages have asked for since it was last asked."""
        events = [json.loads(e["message"])["message"] for e in self.driver.get_log("performance")]
        asked = [
            event["params"]["request"]["url"]
            for event in events
            if event["method"] == "Network.requestWillBeSent"
        ]
        return [url for url in asked if url.startswith(("http", "ws", "ftp"))]


@contextmanager
def started_browser(profile: Path) -> Iterator[Browser]:
    """A browser with a new profile; the test is skipped where there is none.

    With SOFTSIM_BROWSER=required the test fails instead.
    """
    program = next(filter(None, map(shutil.which, NAMES)), None)
    service = shutil.which("chromedriver")
    if program is None or service is None:
        missing = f"no {' or '.join(NAMES)} with chromedriver is installed"
        if os.environ.get("SOFTSIM_BROWSER") == "required":
            pytest.fail(missing)
        pytest.skip(missing)
    options = webdriver.ChromeOptions()
    options.binary_location = program
    for flag in (*FLAGS, f"user-data-dir={profile}"):
        options.add_argument(f"--{flag}")
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    driver = webdriver.Chrome(options=options, service=Service(service))
    try:
        yield Browser(driver)
    finally:
        driver.quit()
