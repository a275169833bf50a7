"""A real browser for tests, which is Chromium without a window, driven by selenium."""
import contextlib
import os
import pathlib
import shutil
import signal
import socket
import tempfile
import threading
import time
from inspect import signature

try:
    from selenium import webdriver
    from selenium.common.exceptions import WebDriverException
    from selenium.webdriver.chrome.service import Service
    from selenium.webdriver.common.action_chains import ActionChains
    from selenium.webdriver.common.by import By
except ModuleNotFoundError:
    webdriver = None

from tb3_labs.ros.clocks import wait_until

CHROMIUM, DRIVER = shutil.which('chromium'), shutil.which('chromedriver')
#: The reason why the tests have no browser, or ''.
MISSING = '' if webdriver and CHROMIUM and DRIVER else (
    'no browser: sudo apt install chromium chromium-driver python3-selenium')
#: The browser looks up nothing in the network, and has no sandbox, since root and containers have none.
FLAGS = ('--headless=new', '--no-sandbox', '--disable-gpu', '--in-process-gpu', '--disable-quic', '--no-first-run',
         '--disable-background-networking', '--disable-component-update', '--disable-sync',
         '--disable-dev-shm-usage', '--disable-extensions',
         '--disable-features=PreloadTopChromeWebUI,InitialWebUI,SpareRendererForSitePerProcess,OptimizationHints',
         '--window-size=900,700')
#: Time between two questions to the page [s]. Each question costs as much as a picture.
PERIOD = 0.2
#: On a busy machine a new browser answers no question for half a minute and more [s].
SLOWEST = 200.0
#: A map that has not moved for this long rests [s].
STEADY = 0.3
#: A gamepad with the browsers' standard layout; `window.testPad` has its axes and buttons.
GAMEPAD = """
window.testPad = null;
navigator.getGamepads = () => window.testPad ? [window.testPad] : [];
window.makeTestPad = (axes, pressed) => {
  const isNew = !window.testPad;
  const button = on => ({pressed: on, touched: on, value: on ? 1 : 0});
  window.testPad = {id: 'test pad', index: 0, connected: true, mapping: 'standard',
    timestamp: performance.now(), axes: axes,
    buttons: Array.from({length: 17}, (_, number) => button(pressed.includes(number)))};
  if (isNew) dispatchEvent(new Event('gamepadconnected'));
};
"""


class Cable:
    """A cable to a port of this computer. As with TCP, bytes that are sent while the cable is unplugged arrive when the
    cable is plugged in again."""

    def __init__(self, port):
        self._port, self._plugged = port, threading.Event()
        self.plug()
        self._listener = socket.create_server(('localhost', 0))
        threading.Thread(target=self._connect, daemon=True).start()

    def address(self, address):
        """Returns the address of a page by this cable."""
        assert str(self._port) in address, 'the panel has another port: ' + address
        return address.replace(str(self._port), str(self._listener.getsockname()[1]))

    def pull(self):
        self._plugged.clear()

    def plug(self):
        self._plugged.set()

    def _connect(self):
        while True:
            page, _ = self._listener.accept()
            try:
                panel = socket.create_connection(('localhost', self._port))
            except OSError:
                page.close()
                continue
            for one, other in ((page, panel), (panel, page)):
                threading.Thread(target=self._carry, args=(one, other), daemon=True).start()

    def _carry(self, one, other):
        data = b'-'
        while data:
            try:
                data = one.recv(65536)
                self._plugged.wait()
                other.sendall(data)
            except OSError:
                break
        for end in (one, other):
            with contextlib.suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)


class Browser:
    """A browser with one page."""

    def __init__(self, address):
        self._folder = tempfile.mkdtemp()
        options = webdriver.ChromeOptions()
        options.binary_location = CHROMIUM
        for flag in FLAGS + ('--user-data-dir=' + self._folder,):
            options.add_argument(flag)
        options.set_capability('goog:loggingPrefs', {'browser': 'ALL'})
        self._driver = webdriver.Chrome(service=Service(DRIVER), options=options)
        self._driver.execute_cdp_cmd('Page.addScriptToEvaluateOnNewDocument',
                                     {'source': GAMEPAD})
        self._driver.set_script_timeout(SLOWEST)
        self._tab = self._driver.current_window_handle
        self._driver.get(address)

    # -- what a person sees

    def picture(self, name):
        """Returns an entry of the picture that the page shows."""
        return self.run('return (window.panel && panel.latest || {})[arguments[0]]', name)

    def text(self, element):
        return self._find(element).text

    def is_shown(self, element):
        return self._find(element).is_displayed()

    def shows_refusal(self):
        """Does the page's message say that the person's last request was refused?"""
        return 'warning' in self._find('message').get_attribute('class').split()

    def wait_until(self, condition, seconds=20.0, what='a condition'):
        """Wait until `condition()` holds. Raises RuntimeError with the page's picture after `seconds`."""
        if not wait_until(condition, seconds, PERIOD):
            raise RuntimeError('waited {:.0f} s in vain for {}; the page: {}; {}; {}'.format(
                seconds, what, self.run('return JSON.stringify(panel.latest)'),
                self.run('return document.getElementById("message").textContent'), self.errors()))

    def wait_for(self, seconds=20.0, **values):
        self.wait_until(lambda: all(self.picture(name) == value for name, value in values.items()),
                        seconds, str(values))

    @property
    def notes(self):
        """The lines of the panel in the page's log."""
        try:
            return [line for line in self.text('log').splitlines() if '/panel' in line]
        except WebDriverException:
            return []

    def errors(self):
        return [entry['message'] for entry in self._driver.get_log('browser')
                if entry['level'] in ('SEVERE', 'WARNING')]

    # -- what a person does

    def run(self, script, *arguments):
        """Returns the value of a script in the page."""
        return self._driver.execute_script(script, *arguments)

    def click(self, element):
        self._find(element).click()

    def type(self, **texts):
        """Replace the texts of fields. field_x='1' types 1 into the field field-x."""
        for name, text in texts.items():
            field = self._find(name.replace('_', '-'))
            field.clear()
            field.send_keys(text)

    def press_key(self, key):
        ActionChains(self._driver).send_keys(key).perform()

    def _actions(self):
        """Returns quick actions. The selenium of Debian 11 has only slow ones."""
        quick = {'duration': 50} if 'duration' in signature(ActionChains).parameters else {}
        return ActionChains(self._driver, **quick)

    def drag_in_local(self, start, end):
        """Drag on the map from `start` to `end`. A point is [x, y] in local [m]."""
        (x0, y0), (x1, y1) = self._steady(lambda: [
            self.run('return panel.pixel(arguments[0], arguments[1])', *point)
            for point in (start, end)])
        actions = self._actions()
        pointer = actions.w3c_actions.pointer_action
        pointer.move_to_location(int(round(x0)), int(round(y0)))
        pointer.pointer_down()
        pointer.move_to_location(int(round(x1)), int(round(y1)))
        pointer.pointer_up()
        actions.perform()

    def take_hold(self, element, across=0.0, up=0.0):
        """Press on the middle of an element, and move from there by parts of its half size.

        The page marks an element that is held. A press has no effect while the element is not ready, or if the page
        moves the element at this moment. Then the person presses again.
        """
        box = self._find(element)

        def is_held():
            half = box.size['width'] / 2.0
            actions = self._actions().move_to_element(box).click_and_hold()
            actions.move_by_offset(int(across * half), int(-up * half)).perform()
            if 'held' in box.get_attribute('class').split():
                return True
            self.let_go()
            return False
        self.wait_until(is_held, 10.0, 'a hold of ' + element)

    def let_go(self):
        self._actions().release().perform()

    def move_pad(self, axes=(0, 0, 0, 0), pressed=()):
        """Set the axes and the pressed buttons of the gamepad at this computer."""
        self.run('makeTestPad(arguments[0], arguments[1])', list(axes), list(pressed))

    def hide(self):
        """Open an empty tab, which hides the page."""
        self._driver.switch_to.new_window('tab')

    def show(self):
        """Close the empty tab, so that the page is visible again."""
        self._driver.close()
        self._driver.switch_to.window(self._tab)

    def freeze(self):
        """Stop all processes of the browser, as on a laptop that is suspended."""
        self._signal(signal.SIGSTOP)

    def thaw(self):
        self._signal(signal.SIGCONT)

    def _signal(self, number):
        """Send a signal to all processes whose command line has this browser's folder."""
        for process in pathlib.Path('/proc').glob('[0-9]*'):
            with contextlib.suppress(OSError):    # it has ended meanwhile
                if self._folder.encode() in (process / 'cmdline').read_bytes():
                    os.kill(int(process.name), number)

    def close(self):
        self._signal(signal.SIGKILL)
        self._driver.service.stop()
        shutil.rmtree(self._folder, ignore_errors=True)

    def _steady(self, places):
        """Waits until the map, which follows the robot, has not moved for STEADY. Returns `places()`."""
        last, since = places(), time.monotonic()
        while time.monotonic() - since < STEADY:
            now = places()
            if now != last:
                last, since = now, time.monotonic()
            time.sleep(PERIOD)
        return last

    def _find(self, element):
        return self._driver.find_element(By.ID, element)
