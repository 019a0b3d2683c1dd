"""A browser without a screen, driven by its DevTools protocol through two pipes."""

import base64
import json
import os
import shutil
import subprocess
import time

NAMES = ("chromium-headless-shell", "chromium")


class Browser:
    """One page in a browser. What its console reports as an error is in `errors`."""

    def __init__(self, downloads):
        program = next(path for name in NAMES if (path := shutil.which(name)))
        (there, self.out), (self.back, here) = os.pipe(), os.pipe()
        command = [program, "--headless", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader",
                   "--enable-unsafe-swiftshader", "--hide-scrollbars", "--remote-debugging-pipe"]  # fmt: skip
        # The protocol: messages come to the browser at file 3 and leave it at 4.
        self.process = subprocess.Popen(["sh", "-c", f'exec "$@" 3<&{there} 4>&{here}', "sh", *command],
                                        pass_fds=(there, here), stderr=subprocess.DEVNULL)  # fmt: skip
        os.close(there), os.close(here)
        self.number, self.rest, self.errors, self.session = 0, b"", [], None
        target = self("Target.createTarget", url="about:blank")["targetId"]
        self.session = self("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log"):
            self(f"{domain}.enable")
        self("Page.setDownloadBehavior", behavior="allow", downloadPath=str(downloads))

    def __enter__(self):
        return self

    def __exit__(self, *_):
        os.close(self.out)  # it ends then
        try:
            self.process.wait(10)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        os.close(self.back)

    def _message(self):
        while b"\0" not in self.rest:
            part = os.read(self.back, 1 << 20)
            if not part:
                raise RuntimeError("the browser has ended")
            self.rest += part
        text, _, self.rest = self.rest.partition(b"\0")
        return json.loads(text)

    def __call__(self, method, **parameters):
        """The answer to a message of the protocol."""
        self.number += 1
        message = {"id": self.number, "method": method, "params": parameters}
        if self.session:
            message["sessionId"] = self.session
        os.write(self.out, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._message()
            if answer.get("method") in ("Runtime.exceptionThrown", "Log.entryAdded"):
                self.errors.append(json.dumps(answer["params"]))
            if answer.get("id") == self.number:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']}")
                return answer["result"]

    def open(self, page, width=1200, height=700, touch=False):
        """A page, by its address, on a screen of that size."""
        self("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=touch)
        self("Emulation.setTouchEmulationEnabled", enabled=touch)
        self("Page.navigate", url="about:blank")  # else only another #place is no other page
        self("Page.navigate", url=page)
        self.wait("document.readyState === 'complete' && document.body.dataset.drawn")

    def value(self, expression):
        return self("Runtime.evaluate", expression=expression, returnByValue=True)["result"].get("value")

    def text(self, element):
        """What an element, given by its #name, says, with ASCII minus signs."""
        return self.value(f"document.querySelector('{element}').textContent").replace("\u2212", "-")

    def wait(self, expression, seconds=60):
        """Until an expression is true."""
        end = time.monotonic() + seconds
        while not self.value(expression):
            if self.errors or time.monotonic() > end:
                raise TimeoutError("\n".join([expression, *self.errors]))
            time.sleep(0.02)

    def middle(self, element):
        """The place of an element, given by its #name, on the screen."""
        self.value(f"document.querySelector('{element}').scrollIntoView({{block: 'nearest'}})")
        left, top, width, height = self.box(element)
        return left + width / 2, top + height / 2

    def box(self, element):
        """Its left, top, width and height on the screen."""
        box = f"document.querySelector('{element}').getBoundingClientRect()"
        return self.value(f"(b => [b.left, b.top, b.width, b.height])({box})")

    def mouse(self, kind, x, y, **more):
        self("Input.dispatchMouseEvent", type=f"mouse{kind}", x=x, y=y, **more)

    def move(self, x, y):
        self.mouse("Moved", x, y)

    def click(self, x, y):
        self.drag((x, y))

    def drag(self, *places):
        """With the left button down from the first place to the last."""
        self.mouse("Pressed", *places[0], button="left", buttons=1, clickCount=1)
        for place in places[1:]:
            self.mouse("Moved", *place, button="left", buttons=1)
        self.mouse("Released", *places[-1], button="left", clickCount=1)

    def touch(self, *steps):
        """Fingers: a list of their places for each step."""
        for kind, places in zip(["touchStart", *["touchMove"] * (len(steps) - 1)], steps):
            points = [{"x": x, "y": y, "id": i} for i, (x, y) in enumerate(places)]
            self("Input.dispatchTouchEvent", type=kind, touchPoints=points)
        self("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])

    def screenshot(self):
        """A PNG picture."""
        return base64.b64decode(self("Page.captureScreenshot", format="png")["data"])
