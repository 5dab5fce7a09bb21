// The page in a real browser: `node test/browser.mjs REFRAXEL RUN [SCREENSHOTS]`.
//
// REFRAXEL is the program, RUN a run with at least one refractive region and readable photographs. Ends with a line per check; the
// first one that fails ends the test with exit code 1. With SCREENSHOTS, pictures of the page are left in that folder.

import { spawn, spawnSync } from "node:child_process";
import { mkdtemp, mkdir, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import puppeteer from "puppeteer-core";
import { use } from "./use.mjs";

const [program, run, screenshots] = process.argv.slice(2);
if (!program || !run) {
  console.error("usage: node test/browser.mjs REFRAXEL RUN [SCREENSHOTS]");
  process.exit(2);
}
const CHROMIUM = process.env.CHROMIUM ?? "/usr/bin/chromium";
const FLAGS = [
  "--no-sandbox",
  "--disable-gpu",
  "--disable-quic",
  "--disable-dev-shm-usage",
  "--no-first-run",
  "--disable-background-networking",
  "--disable-component-update",
  "--disable-sync",
  "--force-color-profile=srgb",
];
const PATIENCE = Number(process.env.PATIENCE ?? 60_000);

/** Starts the viewer and returns its address. */
function start(port) {
  const child = spawn(program, ["view", run, "--json", ...(port ? ["--port", port] : [])], { stdio: ["ignore", "pipe", "inherit"] });
  const url = new Promise((resolve, reject) => {
    let text = "";
    child.stdout.on("data", (part) => {
      text += part;
      const found = /"url": *"([^"]+)"/.exec(text);
      if (found) resolve(found[1]);
    });
    child.on("exit", () => reject(new Error(`the viewer ended: ${text}`)));
  });
  return { child, url };
}

function check(claim, holds, found) {
  console.log(`${holds ? "ok" : "FAILED"}: ${claim}${found === undefined ? "" : ` (${found})`}`);
  if (!holds) throw new Error(claim);
}

async function newPage(browser, url) {
  const page = await browser.newPage();
  page.setDefaultTimeout(PATIENCE);
  const errors = [];
  page.on("pageerror", (error) => errors.push(String(error)));
  page.on("console", (message) => message.type() === "error" && errors.push(message.text()));
  await page.setViewport({ width: 900, height: 560 });
  await page.goto(url);
  return { page, errors };
}

/** Waits for the best picture of a look that begins after `frame`. */
const best = (page, frame = 0) =>
  page.waitForFunction((f) => Number(document.body.dataset.frame) > f && document.body.dataset.last === "true" && document.body.dataset.rays !== "0", {}, frame);
const frame = (page) => page.evaluate(() => Number(document.body.dataset.frame ?? 0));

/** Mean colours of the picture in 8 × 8 fields. */
const picture = (page) =>
  page.evaluate(() => {
    const small = document.createElement("canvas");
    [small.width, small.height] = [64, 64];
    const ctx = small.getContext("2d");
    ctx.drawImage(document.querySelector("#picture"), 0, 0, 64, 64);
    return [...ctx.getImageData(0, 0, 64, 64).data];
  });
const difference = (a, b) => a.reduce((sum, x, k) => sum + Math.abs(x - b[k]), 0) / a.length;

async function act(page, action) {
  const before = await frame(page);
  await action();
  await best(page, before);
  return picture(page);
}

async function shoot(page, name) {
  if (!screenshots) return;
  await mkdir(screenshots, { recursive: true });
  await page.screenshot({ path: join(screenshots, `${name}.png`) });
}

/** Sets a slider as a hand would: its value and the event. */
const slide = (page, label, value) =>
  page.evaluate(
    ([label, value]) => {
      const input = document.querySelector(`input[type=range][aria-label="${label}"]`);
      input.value = String(value);
      input.dispatchEvent(new Event("input", { bubbles: true }));
    },
    [label, value],
  );

const press = (page, text) =>
  page.evaluate((text) => [...document.querySelectorAll("button")].find((b) => b.textContent === text).click(), text);

async function tests(browser, viewer) {
  const url = await viewer.url;
  const { page, errors } = await newPage(browser, url);
  await best(page);
  const first = await picture(page);
  check("the page shows the scene", new Set(first).size > 20, `${new Set(first).size} levels`);
  await shoot(page, "start");

  const box = await (await page.$("#stage")).boundingBox();
  const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
  const turned = await act(page, async () => {
    await page.mouse.move(x, y);
    await page.mouse.down();
    await page.mouse.move(x + 160, y + 30, { steps: 8 });
    await page.mouse.up();
  });
  check("a drag turns the scene", difference(first, turned) > 1, difference(first, turned).toFixed(2));
  const back = await act(page, () => page.keyboard.press("r"));
  check("R goes back", difference(first, back) < 0.5, difference(first, back).toFixed(2));

  const water = await act(page, () => slide(page, "n", 1.33));
  check("the index slider changes the picture", difference(back, water) > 0.3, difference(back, water).toFixed(2));
  await shoot(page, "water");
  const learned = await act(page, () => press(page, "learned"));
  check("and the index that was learned brings it back", difference(back, learned) < 0.5, difference(back, learned).toFixed(2));
  const straight = await act(page, () => page.keyboard.press("b"));
  check("straight rays show another picture", difference(back, straight) > 0.3, difference(back, straight).toFixed(2));
  await act(page, () => page.keyboard.press("b"));

  const layers = await page.$$eval('[aria-label="Layer"] button', (all) => all.filter((b) => !b.hidden).map((b) => b.textContent));
  const names = ["colour", "depth", "opacity", "index", "normal", "reflection", "transmission"];
  check("index and normals are offered where rays bend", layers.includes("index") && layers.includes("normal"));
  for (const [k, layer] of names.slice(1).entries()) {
    if (!layers.includes(layer)) continue;
    const shown = await act(page, () => page.keyboard.press(String(k + 2)));
    check(`the layer ${layer} is shown`, difference(back, shown) > 0.05, difference(back, shown).toFixed(2));
    await shoot(page, layer);
  }
  await act(page, () => page.keyboard.press("1"));

  // The middle of the scene is refractive in the scenes of this test: the ray there bends, and the overlay shows it.
  const glass = await findGlass(page, box);
  check("a click shows the ray of that pixel, with its surfaces", glass !== null, glass);
  await act(page, async () => {
    await page.mouse.move(x, y);
    await page.mouse.down();
    await page.mouse.move(x + 220, y, { steps: 6 });
    await page.mouse.up();
  });
  const orange = await page.evaluate(() => {
    const canvas = document.querySelector("#lines");
    const data = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
    let count = 0;
    for (let k = 0; k < data.length; k += 4) if (data[k] > 200 && data[k + 1] < 140 && data[k + 2] < 60 && data[k + 3] > 200) count++;
    return count;
  });
  check("the bent ray is drawn in space", orange > 50, `${orange} pixels`);
  await shoot(page, "ray");
  await page.keyboard.press("Escape");

  await act(page, () => page.keyboard.press("n"));
  await page.keyboard.press("c");
  await page.waitForFunction(() => document.querySelector("#lines").getAttribute("aria-label").startsWith("Photograph"));
  await best(page);
  await shoot(page, "side");
  await act(page, () => page.keyboard.press("c"));
  check("the wipe has a boundary", await page.evaluate(() => !document.querySelector("#wipe").hidden));
  await shoot(page, "wipe");
  const off = await act(page, () => page.keyboard.press("c"));
  const dark = off.filter((_, k) => k % 4 < 3);
  const mean = dark.reduce((a, b) => a + b, 0) / dark.length;
  check("photograph and rendering of it are alike", mean < 90, `mean of four times the difference: ${mean.toFixed(1)}`);
  await shoot(page, "difference");
  const map = await act(page, () => page.keyboard.press("c"));
  check("the error map has other colours", difference(off, map) > 1, difference(off, map).toFixed(2));
  await shoot(page, "error");
  await act(page, () => page.keyboard.press("r"));

  await page.evaluate(() => document.querySelectorAll('[aria-label="Axis across"] button')[2].click());
  await page.waitForFunction(() => document.querySelector('canvas[aria-label^="Index in the plane"]').width > 16);
  check("a slice of the index is shown", true);
  await page.evaluate(() => document.querySelectorAll(".check input").forEach((box) => box.parentElement.textContent.match(/cameras|boxes/) && box.click()));
  await shoot(page, "overlays");
  await page.keyboard.press("g");
  await page.waitForFunction(() => {
    const canvas = document.querySelector("#lines");
    const data = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
    let count = 0;
    for (let k = 0; k < data.length; k += 4) if (data[k] < 60 && data[k + 1] > 90 && data[k + 2] > 80 && data[k + 1] > data[k + 2] && data[k + 3] > 150) count++;
    return count > 200;
  });
  check("lines are drawn on the glass", true);
  await shoot(page, "surfaces");

  const other = await newPage(browser, url);
  await best(other.page);
  check("two pages are open at once", difference(first, await picture(other.page)) < 0.5);
  await other.page.close();

  await use(browser, url, { check, newPage, best, picture, difference, act, shoot, slide, press, start });
  await cameraPath(page);
  await refusals(browser, url);
  await comesBack(page, viewer, url);
  const real = errors.filter((text) => !/WebSocket connection to|net::ERR_CONNECTION/.test(text));
  check("the page has reported no errors", real.length === 0, real.join("; "));
}

/** Clicks places around the middle until a ray meets a surface; what the page says of it. */
async function findGlass(page, box) {
  for (const [u, v] of [[0.5, 0.5], [0.5, 0.6], [0.45, 0.5], [0.55, 0.5], [0.5, 0.4], [0.42, 0.6], [0.58, 0.6]]) {
    await page.evaluate(() => document.querySelector(".facts dt")?.remove());
    await page.mouse.click(box.x + u * box.width, box.y + v * box.height);
    await page.waitForFunction(() => [...document.querySelectorAll(".facts dt")].some((t) => t.textContent === "turned by"));
    const rows = await page.evaluate(() => document.querySelectorAll("table tr").length);
    if (rows > 2) return `${rows - 1} surfaces at ${u}, ${v}`;
  }
  return null;
}

/** A path of two keyframes is saved, and rendered as a film. */
async function cameraPath(page) {
  await page.evaluate(() => {
    const make = URL.createObjectURL;
    URL.createObjectURL = (blob) => {
      void blob.text().then((text) => (window.saved = text));
      return make.call(URL, blob);
    };
  });
  await slide(page, "seconds", 1);
  await page.keyboard.press("k");
  await act(page, async () => {
    await page.keyboard.down("ArrowRight");
    await new Promise((resolve) => setTimeout(resolve, 300));
    await page.keyboard.up("ArrowRight");
  });
  await page.keyboard.press("k");
  await press(page, "Save");
  await page.waitForFunction(() => window.saved?.includes("camera_path"));
  const folder = await mkdtemp(join(tmpdir(), "refraxel-path-"));
  const [path, film] = [join(folder, "camera_path.json"), join(folder, "film.gif")];
  await writeFile(path, await page.evaluate(() => window.saved));
  const words = ["render", run, "--camera-path", path, "--size", "48x48", "--out", film, "--json"];
  const made = spawnSync(program, words, { encoding: "utf8" });
  check("the program renders the camera path that the page saves", made.status === 0 && JSON.parse(made.stdout).film.frames === 24, made.stderr.trim().split("\n").pop());
  await rm(folder, { recursive: true });
}

async function refusals(browser, url) {
  const wrong = url.replace(/\/[0-9a-f]{32}\//, `/${"0".repeat(32)}/`);
  const page = await browser.newPage();
  check("a wrong token finds nothing", (await page.goto(wrong)).status() === 404);
  // A page of another origin: about:blank sends "null".
  await page.goto("about:blank");
  const opened = await page.evaluate(
    (address) =>
      new Promise((resolve) => {
        const socket = new WebSocket(address);
        socket.onopen = () => resolve("open");
        socket.onerror = () => resolve("refused");
      }),
    `${url.replace("http", "ws")}socket`,
  );
  check("a foreign page gets no connection", opened === "refused", opened);
  await page.close();
}

/** The viewer is killed: the page says so. Another one has another address, so that the old page stays out. */
async function comesBack(page, viewer, url) {
  viewer.child.removeAllListeners("exit");
  viewer.child.kill("SIGKILL");
  await page.waitForFunction(() => !document.querySelector("#notice").hidden);
  check("the page says that the program has ended", true);
  const again = start(new URL(url).port);
  try {
    const address = await again.url;
    check("a new start has a new address", address !== url);
    const fresh = await newPage(page.browser(), address);
    await best(fresh.page);
    check("which shows the scene again", true);
  } finally {
    again.child.removeAllListeners("exit");
    again.child.kill();
  }
}

const profile = await mkdtemp(join(tmpdir(), "refraxel-browser-"));
const viewer = start();
const browser = await puppeteer.launch({ executablePath: CHROMIUM, headless: true, args: FLAGS, userDataDir: profile });
let failed = false;
try {
  await tests(browser, viewer);
} catch (error) {
  console.error(error);
  failed = true;
} finally {
  viewer.child.removeAllListeners("exit");
  viewer.child.kill();
  await browser.close();
  await rm(profile, { recursive: true, force: true });
}
process.exit(failed ? 1 : 0);
