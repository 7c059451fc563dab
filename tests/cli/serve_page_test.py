"""The artist's page in a headless Chromium: a slider moves and the picture changes, the wipe, layers, the range, settings.

VIRGA_SCREENSHOTS=FOLDER keeps what was seen. Skips by name where there is no Chromium or no selenium.
"""
import os
import shutil
import time
import unittest

import numpy as np

from serving import Server, waitFor
from support import VIRGA, CliTest, street, writeImage

try:
    from selenium import webdriver
    from selenium.webdriver.common.action_chains import ActionChains
    from selenium.webdriver.common.by import By
    from selenium.webdriver.common.keys import Keys
    from selenium.webdriver.support.ui import Select
except ImportError:
    webdriver = None

PLATE = os.environ.get("VIRGA_PAGE_PLATE")  # another plate to look at, by its path
WIDTH, HEIGHT = 160, 90


@unittest.skipUnless(webdriver and shutil.which("chromium") and shutil.which("chromedriver"),
                     "needs chromium, chromium-driver and python3-selenium (scripts/packages.txt)")
class PageTest(CliTest):
    @classmethod
    def makePlates(cls):
        root = cls.folder / "root"
        root.mkdir()
        for frame in range(6):
            writeImage(root / f"shot.{frame:04d}.exr", street(WIDTH, HEIGHT, seed=frame))
        plate = root / "shot.%04d.exr"
        if PLATE:
            shutil.copy(PLATE, root)
            plate = root / os.path.basename(PLATE)
        cls.server = Server(VIRGA, "--root", root, "--listen", 0, "--plate", plate.name, "--no-cache", "--prefetch", 0)
        options = webdriver.ChromeOptions()
        for flag in ("--headless=new", "--no-sandbox", "--disable-gpu", "--window-size=1400,860",
                     f"--user-data-dir={cls.folder / 'browser'}"):
            options.add_argument(flag)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        cls.browser = webdriver.Chrome(options=options,
                                       service=webdriver.ChromeService(shutil.which("chromedriver"))
                                       if hasattr(webdriver, "ChromeService") else
                                       webdriver.chrome.service.Service(shutil.which("chromedriver")))
        cls.browser.get(cls.server.ready["url"])

    @classmethod
    def tearDownClass(cls):
        cls.browser.quit()
        code = cls.server.stop()
        super().tearDownClass()
        assert code == 0, "".join(cls.server.log)

    def setUp(self):
        self.assertTrue(waitFor(lambda: self.turn() > 0, 60), self.problems())
        self.js("for (const p of state.parameters) if (rows[p.name].row.classList.contains('changed'))"
                 " rows[p.name].row.querySelector('.reset').click();")
        self.settle()

    def js(self, *arguments):
        return self.browser.execute_script(*arguments)

    def at(self, name):
        return self.browser.find_element(By.ID, name)

    def turn(self):
        return int(self.at("screen").get_attribute("data-turn") or 0)

    def settle(self):
        """Until everything that was asked for is seen."""
        self.assertTrue(waitFor(lambda: self.js("return !sending && state.shown && state.turn === state.shown.turn"), 60),
                        self.problems())

    def problems(self):
        return f"{self.browser.get_log('browser')}\n{self.at('sentence').get_attribute('data-text')}\n{self.server.log}"

    def pixels(self, canvas="after"):
        values = self.js(f"const c = $('{canvas}'); return Array.from(c.getContext('2d').getImageData(0, 0, c.width,"
                          " c.height).data.filter((v, i) => i % 4 == 1))")
        return np.array(values)

    def look(self, name):
        folder = os.environ.get("VIRGA_SCREENSHOTS")
        if folder:
            self.browser.save_screenshot(os.path.join(folder, name + ".png"))

    def row(self, name):
        return self.browser.find_element(By.CSS_SELECTOR, f".row[data-name='{name}']")

    def slide(self, name, place):
        """What a hand does while it moves."""
        self.js("""
            const slider = rows[arguments[0]].row.querySelector('input[type=range]');
            slider.value = arguments[1];
            slider.dispatchEvent(new Event('input', {bubbles: true}))""", name, place)

    def letGo(self, name):
        self.js("rows[arguments[0]].row.querySelector('input[type=range]').dispatchEvent(new Event('change'))", name)
        self.settle()

    def test_a_slider_changes_the_picture(self):
        before = self.pixels()
        waits, renders = [], []
        for place in (0.2, 0.5, 0.8):
            self.slide("darken", place)
            self.settle()
            waits.append(float(self.at("screen").get_attribute("data-wait")))
            renders.append(float(self.at("screen").get_attribute("data-render")))
        self.letGo("darken")
        after = self.pixels()
        self.assertLess(after.mean(), 0.8 * before.mean())
        self.assertIn("changed", self.row("darken").get_attribute("class"))
        print(f"\nfrom the slider to the picture {sorted(waits)[1]:.0f} ms, of which rendering {sorted(renders)[1]:.0f} ms")
        self.look("slider")
        self.row("darken").find_element(By.CLASS_NAME, "reset").click()
        self.settle()
        np.testing.assert_array_equal(self.pixels(), before)

    def test_every_parameter_has_a_row(self):
        names = self.js("return state.parameters.map(p => p.name)")
        shown = [row.get_attribute("data-name") for row in self.browser.find_elements(By.CSS_SELECTOR, ".row")]
        self.assertEqual(sorted(names), sorted(shown))
        self.assertGreater(len(names), 70)
        titles = self.js("return state.parameters.every(p => rows[p.name].row.title.startsWith(p.help))")
        self.assertTrue(titles)
        # Sliders give back the value that they are put to, at the ends as well.
        worst = self.js("""return Math.max(...state.parameters.filter(p => p.least !== undefined && p.kind !== 'pair' &&
            p.kind !== 'color').map(p => { const s = scaleOf(p); return Math.max(...[0, 0.3, 0.5, 1].map(t =>
            Math.abs(s.toPlace(s.toValue(t)) - t))); }))""")
        self.assertLess(worst, 1e-6)

    def test_a_value_that_is_refused_says_why(self):
        box = self.js("return rows['wind'].row.querySelector('input[type=number]')")
        self.js("const b = arguments[0]; b.value = 1000; b.dispatchEvent(new Event('change'))", box)
        self.assertTrue(waitFor(lambda: "-100 to 100" in (self.at("sentence").get_attribute("data-text") or "")),
                        self.problems())
        self.assertIn("wrong", self.row("wind").get_attribute("class"))
        self.look("refused")

    def test_wipe(self):
        self.slide("darken", 0.9)
        self.letGo("darken")
        self.at("wipe").click()
        self.assertTrue(waitFor(lambda: self.at("wiper").is_displayed()), self.problems())
        self.assertGreater(self.pixels("before").mean(), 1.2 * self.pixels().mean())
        left = self.at("wiper").rect["x"]
        ActionChains(self.browser).drag_and_drop_by_offset(self.at("wiper"), 150, 0).perform()
        self.assertGreater(self.at("wiper").rect["x"], left + 100)
        self.look("wipe")
        self.at("wipe").click()
        self.assertFalse(self.at("before").is_displayed())

    def test_layers(self):
        whole = self.pixels()
        Select(self.at("layer")).select_by_value("rain")
        self.settle()
        rain = self.pixels()
        self.look("rain")
        self.assertGreater(rain.max(), 5)
        self.assertLess(rain.mean(), 0.5 * whole.mean())
        Select(self.at("layer")).select_by_value("beauty")
        self.settle()
        np.testing.assert_array_equal(self.pixels(), whole)

    def test_keys_and_the_range(self):
        body = self.at("screen")
        first = int(self.at("frame").get_attribute("value"))
        body.send_keys(Keys.ARROW_RIGHT)
        self.settle()
        self.assertEqual(int(self.at("frame").get_attribute("value")), first + 1)
        body.send_keys("i")
        self.assertEqual(self.at("first").get_attribute("value"), str(first + 1))
        turn = self.turn()
        body.send_keys(" ")
        self.assertTrue(waitFor(lambda: self.turn() > turn + 6, 60), self.problems())  # over the end, and on
        body.send_keys(" ")
        self.assertTrue(waitFor(lambda: not self.js("return state.isPlaying")))
        self.assertGreater(int(self.at("frame").get_attribute("value")), first)
        self.js(f"setRange({first}, state.session.plate.last)")
        self.js(f"goTo({first})")

    def test_settings_are_saved(self):
        self.slide("rate", 0.7)
        self.letGo("rate")
        rate = self.js("return state.session.settings.rate")
        text = self.js("return ask(`/sessions/${state.id}/settings.toml`).then(a => a.text())")
        self.assertRegex(text, rf"rate = {rate}\D")

    def test_nothing_complains(self):
        self.look("page")
        wrong = [entry for entry in self.browser.get_log("browser") if entry["level"] == "SEVERE" and "400" not in entry["message"]]
        self.assertEqual(wrong, [])


if __name__ == "__main__":
    unittest.main()
