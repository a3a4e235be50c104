"""A headless Chromium, driven through the DevTools protocol with what Bokeh already brings (tornado)."""

import asyncio
import base64
import json
import shutil
import subprocess
import time
from urllib.request import urlopen

from tornado.ioloop import IOLoop
from tornado.websocket import websocket_connect

PROGRAM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome", "chrome"))), None)


class Browser:
    """One page of a browser; ``said`` collects what its console and its network had to say."""

    def __init__(self, folder, width=1366, height=768):
        options = ["--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--hide-scrollbars"]
        options += [f"--window-size={width},{height}", "--remote-debugging-port=0", f"--user-data-dir={folder}"]
        self.process = subprocess.Popen([PROGRAM, *options, "about:blank"], stderr=subprocess.PIPE, text=True)
        self.loop, self.socket, self.count, self.said = IOLoop(make_current=False), None, 0, []
        asyncio.set_event_loop(self.loop.asyncio_loop)  # whatever ran before has left none
        try:
            self.connect()
        except BaseException:
            self.close()
            raise

    def connect(self):
        """Find the one page that is open and speak to it."""
        address = next(line for line in self.process.stderr if "DevTools listening" in line).split("//")[1]
        pages = json.load(urlopen(f"http://{address.split('/')[0]}/json/list"))
        url = next(page["webSocketDebuggerUrl"] for page in pages if page["type"] == "page")
        self.socket = self.loop.run_sync(lambda: websocket_connect(url, max_message_size=2**28))
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")

    def close(self):
        if self.socket is not None:
            self.socket.close()
        self.process.terminate()
        self.process.wait(10)
        self.process.stderr.close()
        self.loop.close()

    def call(self, method, **params):
        """Return the answer of the browser to one command."""
        self.count += 1
        self.socket.write_message(json.dumps({"id": self.count, "method": method, "params": params}))
        while True:
            message = json.loads(self.loop.run_sync(self.socket.read_message, timeout=30))
            if message.get("id") == self.count:
                assert "error" not in message, message["error"]
                return message["result"]
            self.said.append(message)

    def until(self, method):
        """Read what the browser says until it says `method`."""
        while not self.said or self.said[-1].get("method") != method:
            self.said.append(json.loads(self.loop.run_sync(self.socket.read_message, timeout=30)))

    def run(self, script):
        """Return the value of an expression, waited for if it is a promise."""
        found = self.call("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in found, found["exceptionDetails"]
        return found["result"].get("value")

    def wait(self, script, seconds=30.0):
        """Return the value of an expression as soon as it is true."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            found = self.run(script)
            if found:
                return found
            time.sleep(0.05)
        raise AssertionError(f"never came true: {script}")

    def open(self, path):
        """Open a file and wait until every figure is drawn."""
        self.said.clear()
        self.call("Page.navigate", url=path.as_uri())
        self.wait("window.Bokeh && Bokeh.documents.length && Bokeh.documents.every(d => d.is_idle)")

    def visit(self, address):
        """Open an address and wait until it is loaded."""
        self.call("Page.navigate", url="about:blank")
        self.said.clear()
        self.call("Page.navigate", url=address)
        self.wait("document.readyState == 'complete' && location.href != 'about:blank'")

    def screen(self, width, height, *, dark=False, mobile=False):
        """Be a screen of that size and theme."""
        scale = 2 if mobile else 1
        self.call(
            "Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=scale, mobile=mobile
        )
        theme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.call("Emulation.setEmulatedMedia", features=[theme])

    def picture(self, path, whole=False):
        """Write what the screen shows, or the whole page, as PNG."""
        shown = self.call("Page.captureScreenshot", format="png", captureBeyondViewport=whole)
        path.write_bytes(base64.b64decode(shown["data"]))

    def press(self, key, shift=False):
        """Press a key of the keyboard and let go."""
        code = {"Tab": 9, "Enter": 13, "ArrowDown": 40, "ArrowUp": 38, "Home": 36, "End": 35}[key]
        about = {"key": key, "code": key, "windowsVirtualKeyCode": code, "modifiers": 8 * shift}
        text = {"text": "\r"} if key == "Enter" else {}
        self.call("Input.dispatchKeyEvent", type="keyDown", **about, **text)
        self.call("Input.dispatchKeyEvent", type="keyUp", **about)

    def mouse(self, kind, x, y, **more):
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, **more)

    def drag(self, x, y, to_x, to_y):
        """Press the button, move and let go."""
        self.mouse("mouseMoved", x, y)
        self.mouse("mousePressed", x, y, button="left", buttons=1, clickCount=1)
        for share in (0.3, 0.7, 1.0):
            self.mouse("mouseMoved", x + share * (to_x - x), y + share * (to_y - y), button="left", buttons=1)
        self.mouse("mouseReleased", to_x, to_y, button="left", clickCount=1)

    @property
    def errors(self):
        """What the console complained about."""
        found = []
        for message in self.said:
            what, params = message.get("method"), message.get("params", {})
            if what == "Runtime.exceptionThrown":
                found.append(params["exceptionDetails"])
            elif what == "Runtime.consoleAPICalled" and params["type"] in ("error", "warning", "assert"):
                found.append(params["args"])
            elif what == "Log.entryAdded" and params["entry"]["level"] in ("error", "warning"):
                found.append(params["entry"])
        return found

    @property
    def requests(self):
        """Every address that was asked for."""
        sent = (m["params"] for m in self.said if m.get("method") == "Network.requestWillBeSent")
        return [params["request"]["url"] for params in sent]
