// The few calls of puppeteer's that the tests in other browsers make, for WebKit, which puppeteer does not drive: W3C WebDriver
// (https://www.w3.org/TR/webdriver2/), spoken to WebKitGTK's `WebKitWebDriver`. The browser needs a display, such as Xvfb's.

import { spawn } from "node:child_process";
import { writeFile } from "node:fs/promises";
import { createServer } from "node:net";

const DRIVER = process.env.WEBKIT ?? "/usr/bin/WebKitWebDriver";
const STARTS_WITHIN = 30_000; // [ms]

const freePort = () =>
  new Promise((resolve) => {
    const server = createServer().listen(0, "127.0.0.1", () => {
      const { port } = server.address();
      server.close(() => resolve(port));
    });
  });

/** One window of WebKit. `evaluate`, `$eval`, `mouse`, `keyboard` and `screenshot` are those of a page of puppeteer's. */
class Page {
  constructor(send) {
    this.send = send;
    const pointer = (actions) =>
      this.act({ type: "pointer", id: "mouse", parameters: { pointerType: "mouse" }, actions });
    const move = (x, y, duration = 0) => ({
      type: "pointerMove",
      x: Math.round(x),
      y: Math.round(y),
      duration,
      origin: "viewport",
    });
    this.mouse = {
      move: (x, y, { steps = 1 } = {}) => pointer([move(x, y, steps > 1 ? 200 : 0)]),
      down: () => pointer([{ type: "pointerDown", button: 0 }]),
      up: () => pointer([{ type: "pointerUp", button: 0 }]),
      click: (x, y) => pointer([move(x, y), { type: "pointerDown", button: 0 }, { type: "pointerUp", button: 0 }]),
    };
    const key = (value) => [
      { type: "keyDown", value },
      { type: "keyUp", value },
    ];
    this.keyboard = { press: (value) => this.act({ type: "key", id: "keyboard", actions: key(value) }) };
  }

  goto(url) {
    return this.send("POST", "/url", { url });
  }

  act(...actions) {
    return this.send("POST", "/actions", { actions });
  }

  evaluate(does, ...args) {
    return this.send("POST", "/execute/sync", { script: `return (${does}).apply(null, arguments);`, args });
  }

  $eval(selector, does) {
    return this.send("POST", "/execute/sync", {
      script: `return (${does})(document.querySelector(arguments[0]));`,
      args: [selector],
    });
  }

  async screenshot({ path }) {
    await writeFile(path, Buffer.from(await this.send("GET", "/screenshot"), "base64"));
  }
}

/** Starts WebKit. The page is its only one. */
export async function webkit() {
  const port = await freePort();
  const driver = spawn(DRIVER, [`--port=${port}`], { stdio: ["ignore", "inherit", "inherit"] });
  const send = async (method, path, body) => {
    const answer = await fetch(`http://127.0.0.1:${port}${path}`, { method, body: body && JSON.stringify(body) });
    const { value } = await answer.json();
    if (!answer.ok) throw new Error(`${method} ${path}: ${value.error}: ${value.message}`);
    return value;
  };
  const isReady = () =>
    send("GET", "/status").then(
      (status) => status.ready,
      () => false,
    );
  for (const end = Date.now() + STARTS_WITHIN; !(await isReady()); ) {
    if (Date.now() > end) throw new Error(`${DRIVER} does not answer`);
    await new Promise((resolve) => setTimeout(resolve, 100));
  }
  const { sessionId, capabilities } = await send("POST", "/session", { capabilities: { alwaysMatch: {} } });
  const inSession = (method, path, body) => send(method, `/session/${sessionId}${path}`, body);
  const page = new Page(inSession);
  await inSession("POST", "/window/rect", { width: 900, height: 640 }).catch(() => {});
  return {
    page,
    version: `${capabilities.browserName} ${capabilities.browserVersion}`,
    close: async () => {
      await inSession("DELETE", "").catch(() => {});
      driver.kill();
    },
  };
}
