// How fast the viewer is, without a browser: `node test/measure.mjs URL [EDGE]`, with the address that `refraxel view` prints.
//
// A camera moves on a circle, asked for 60 times a second, as the page does. Then a still picture, and both again over a slow link
// (50 ms each way, 1 MB/s), which a proxy imitates.

import net from "node:net";
import { WebSocket } from "ws";

const [address, edge = "400"] = process.argv.slice(2);
if (!address) {
  console.error("usage: node test/measure.mjs URL [EDGE]");
  process.exit(2);
}
const url = new URL(address);
const size = [Number(edge), Number(edge)];
const SECONDS = 8;
/** Between two frames of the screen [ms]. */
const SCREEN = 1000 / 60;
const SLOW = { delay: 50, rate: 1e6 };

/** A proxy that delays and thins out what passes. */
function slowLink() {
  const pass = (from, to) => {
    let free = 0;
    from.on("data", (part) => {
      free = Math.max(free, performance.now()) + (1000 * part.length) / SLOW.rate;
      setTimeout(() => to.writable && to.write(part), free - performance.now() + SLOW.delay);
    });
    from.on("close", () => to.destroy());
    from.on("error", () => to.destroy());
  };
  const server = net.createServer((near) => {
    const far = net.connect(Number(url.port), "127.0.0.1");
    pass(near, far);
    pass(far, near);
  });
  return new Promise((resolve) => server.listen(0, "127.0.0.1", () => resolve(server)));
}

/** What a browser gets for the address, and sends from then on. */
const cookie = (await fetch(address, { redirect: "manual" })).headers.get("set-cookie").split(";")[0];

class Page {
  static async open(port) {
    const page = new Page();
    page.socket = new WebSocket(`ws://127.0.0.1:${port}/socket`, {
      headers: { Host: url.host, Cookie: cookie },
      origin: url.origin,
    });
    page.waiting = [];
    page.socket.on("message", (data, isBinary) => {
      if (isBinary) {
        const header = JSON.parse(data.subarray(4, 4 + data.readUInt32LE(0)).toString());
        page.socket.send(JSON.stringify({ ask: "got", frame: header.frame }));
        page.waiting.shift()?.({ header, bytes: data.length });
      } else if (!page.scene) {
        page.scene = JSON.parse(data);
        page.ready();
      }
    });
    await new Promise((resolve) => (page.ready = resolve));
    return page;
  }

  picture() {
    return new Promise((resolve) => this.waiting.push(resolve));
  }

  look(id, angle, moving) {
    const { min, max, up, start } = this.scene;
    const middle = min.map((x, k) => 0.5 * (x + max[k]));
    const from = start.eye.map((x, k) => x - middle[k]);
    const turn = (v) => {
      const cross = [up[1] * v[2] - up[2] * v[1], up[2] * v[0] - up[0] * v[2], up[0] * v[1] - up[1] * v[0]];
      const along = up[0] * v[0] + up[1] * v[1] + up[2] * v[2];
      const [c, s] = [Math.cos(angle), Math.sin(angle)];
      return v.map((x, k) => x * c + cross[k] * s + up[k] * along * (1 - c));
    };
    const camera = {
      eye: turn(from).map((x, k) => x + middle[k]),
      axes: start.axes.map(turn),
      angle: start.angle,
      size,
    };
    this.socket.send(JSON.stringify({ ask: "look", id, camera, moving }));
  }
}

const median = (x) => [...x].sort((a, b) => a - b)[Math.floor(x.length / 2)];
const worst = (x) => [...x].sort((a, b) => a - b)[Math.floor(0.95 * x.length)];

async function measure(name, port) {
  const page = await Page.open(port);
  const asked = new Map();
  const frames = [];
  const start = performance.now();
  let id = 0;
  // As the page does: a wish per frame of the screen, the newest counts.
  const wishes = setInterval(() => {
    asked.set(++id, performance.now());
    page.look(id, 0.005 * id, true);
  }, SCREEN);
  while (performance.now() - start < 1000 * SECONDS) {
    const { header, bytes } = await page.picture();
    frames.push({ latency: performance.now() - asked.get(header.id), bytes, size: header.size[0], ms: header.ms });
  }
  clearInterval(wishes);
  const rate = (1000 * frames.length) / (performance.now() - start);
  const of = (key) => frames.slice(5).map((frame) => frame[key]);
  const [latency, ms] = [of("latency"), of("ms")];
  const parts = [
    `${rate.toFixed(1)} frames/s`,
    `latency ${median(latency).toFixed(0)} ms (95 %: ${worst(latency).toFixed(0)} ms), of which painting ${median(ms).toFixed(0)} ms`,
    `${median(of("size"))} pixels wide`,
    `${(median(of("bytes")) / 1000).toFixed(1)} kB`,
  ];
  console.log(`${name}, moving: ${parts.join(", ")}`);
  const before = performance.now();
  page.look(++id, 0, false);
  for (;;) {
    const { header, bytes: length } = await page.picture();
    if (header.id !== id) continue;
    console.log(
      `${name}, still: ${header.size[0]} pixels wide, ${header.rays} rays per pixel after ${(performance.now() - before).toFixed(0)} ms, ${(length / 1000).toFixed(1)} kB`,
    );
    if (header.last) break;
  }
  page.socket.close();
}

await measure("loopback", Number(url.port));
const proxy = await slowLink();
await measure("slow link", proxy.address().port);
process.exit(0);
