// A page to share in a real browser: `node test/share.mjs REFRAXEL RUN [SCREENSHOTS]`.
//
// RUN has a refractive region, or is a page that was exported before. The page is exported, opened as a file with WebGPU on a software device, and compared with the
// picture that the program has put into it; then it is opened without WebGPU.

import { spawnSync } from "node:child_process";
import { mkdtemp, mkdir, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import puppeteer from "puppeteer-core";

const [program, run, screenshots] = process.argv.slice(2);
if (!program || !run) {
  console.error("usage: node test/share.mjs REFRAXEL RUN [SCREENSHOTS]");
  process.exit(2);
}
const CHROMIUM = process.env.CHROMIUM ?? "/usr/bin/chromium";
const PATIENCE = Number(process.env.PATIENCE ?? 180_000);
const FLAGS = [
  "--no-sandbox",
  "--disable-dev-shm-usage",
  "--disable-quic",
  "--no-first-run",
  "--disable-background-networking",
  "--force-color-profile=srgb",
];
const WEBGPU = [
  "--enable-unsafe-webgpu",
  "--use-webgpu-adapter=swiftshader",
  "--enable-features=Vulkan",
  "--use-vulkan=swiftshader",
  "--use-angle=swiftshader",
];

let failed = false;
function check(claim, holds, found) {
  console.log(`${holds ? "ok" : "FAILED"}: ${claim}${found === undefined ? "" : ` (${found})`}`);
  failed ||= !holds;
}

const folder = await mkdtemp(join(tmpdir(), "refraxel-share-"));
const file = run.endsWith(".html") ? resolve(run) : join(folder, "scene.html");
if (!run.endsWith(".html")) {
  const made = spawnSync(program, ["export", run, "--format", "html", "--out", file, "--json"], { encoding: "utf8" });
  if (made.status !== 0) throw new Error(made.stderr);
  const { bytes, voxels } = JSON.parse(made.stdout);
  check("the page is written", bytes > 1000, `${voxels} voxels, ${(bytes / 1e6).toFixed(1)} MB`);
}

/** Opens the page in a browser of its own. */
async function open(flags, act, prepare = async () => {}) {
  const profile = await mkdtemp(join(tmpdir(), "refraxel-browser-"));
  const options = {
    executablePath: CHROMIUM,
    headless: true,
    args: [...FLAGS, ...flags],
    userDataDir: profile,
    timeout: PATIENCE,
    protocolTimeout: PATIENCE,
  };
  const browser = await puppeteer.launch(options);
  try {
    const page = await browser.newPage();
    page.setDefaultTimeout(PATIENCE);
    const errors = [];
    page.on("pageerror", (error) => errors.push(String(error)));
    page.on("console", (message) => message.type() === "error" && errors.push(message.text()));
    page.on(
      "request",
      (request) => !/^(file|data|blob):/.test(request.url()) && errors.push(`asks for ${request.url()}`),
    );
    await page.setViewport({ width: 240, height: 320 });
    await prepare(page);
    await page.goto(`file://${file}`);
    await act(page);
    check("the page has reported no errors and asked for nothing", errors.length === 0, errors.join("; "));
  } finally {
    await browser.close();
    await rm(profile, { recursive: true, force: true });
  }
}

/** A full picture that comes after number `after`. */
const full = (page, after = 0) =>
  page.waitForFunction(
    (n) =>
      document.body.dataset.failed ||
      (Number(document.body.dataset.picture) > n && document.body.dataset.full === "true"),
    {},
    after,
  );
const number = (page) => page.evaluate(() => Number(document.body.dataset.picture ?? 0));

/** The pixels of the stage, without the panel, and of the picture that the program has made. */
const pixels = (page, what) =>
  page.evaluate(async (what) => {
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [64, 64];
    const ctx = canvas.getContext("2d");
    if (what === "still") ctx.drawImage(document.querySelector("#still"), 0, 0, 64, 64);
    else {
      const image = new Image();
      image.src = what;
      await image.decode();
      ctx.drawImage(image, 0, 0, 64, 64);
    }
    return [...ctx.getImageData(0, 0, 64, 64).data];
  }, what);
/** The square in the middle of the stage, which shows what square photographs show. */
const middle = (page) =>
  page.evaluate(() => {
    const { left, top, width, height } = document.querySelector("#stage").getBoundingClientRect();
    const edge = Math.min(width, height);
    return { x: left + (width - edge) / 2, y: top + (height - edge) / 2, width: edge, height: edge };
  });
async function shown(page) {
  const png = await page.screenshot({ encoding: "base64", clip: await middle(page) });
  return pixels(page, `data:image/png;base64,${png}`);
}
const difference = (a, b) => a.reduce((sum, x, k) => sum + Math.abs(x - b[k]), 0) / a.length;
const act = async (page, change) => {
  const before = await number(page);
  await page.evaluate(change);
  await full(page, before);
  return shown(page);
};
async function shoot(page, name) {
  if (!screenshots) return;
  await mkdir(screenshots, { recursive: true });
  await page.screenshot({ path: join(screenshots, `${name}.png`) });
}

await open(WEBGPU, async (page) => {
  await full(page);
  const why = await page.evaluate(() => document.body.dataset.failed);
  check(
    "the scene is rendered in the browser",
    !why,
    why ?? `${await page.evaluate(() => document.body.dataset.ms)} ms`,
  );
  if (why) return;
  const [bent, still] = [await shown(page), await pixels(page, "still")];
  await shoot(page, "share");
  const off = difference(bent, still);
  check("as the program renders it", off < 4, `mean difference ${off.toFixed(2)} of 255`);
  const straight = await act(page, () => document.querySelector("input[type=checkbox]").click());
  check("straight rays show another picture", difference(bent, straight) > 0.5, difference(bent, straight).toFixed(2));
  await act(page, () => document.querySelector("input[type=checkbox]").click());
  const water = await act(page, () =>
    [...document.querySelectorAll("button")].find((b) => b.textContent === "water").click(),
  );
  check("and so does water", difference(bent, water) > 0.3, difference(bent, water).toFixed(2));
  await shoot(page, "share-water");
  const back = await act(page, () =>
    [...document.querySelectorAll("button")].find((b) => b.textContent === "as learned").click(),
  );
  check("the index that was learned brings it back", difference(bent, back) < 0.3, difference(bent, back).toFixed(2));
  const before = await number(page);
  await page.mouse.move(120, 60);
  await page.mouse.down();
  await page.mouse.move(160, 70, { steps: 3 });
  await page.mouse.up();
  await full(page, before);
  const turned = await shown(page);
  check("a drag turns the scene", difference(bent, turned) > 1, difference(bent, turned).toFixed(2));

  for (const [width, height] of [
    [320, 480],
    [600, 500],
    [700, 500],
    [701, 500],
    [1000, 500],
  ]) {
    await page.setViewport({ width, height });
    await page.evaluate(() => (document.querySelector("#panel").open = true));
    const [stage, aside, scrolls] = await page.evaluate(() => [
      ...["#stage", "aside"].map((s) => document.querySelector(s).getBoundingClientRect().toJSON()),
      document.documentElement.scrollWidth > innerWidth,
    ]);
    const apart = aside.right <= stage.left || aside.top >= stage.bottom;
    check(
      `in a window of ${width} pixels the controls lie beside the picture`,
      apart && stage.width > 250 && stage.height > 250 && !scrolls,
      `picture ${stage.width} × ${stage.height}`,
    );
  }
  await page.setViewport({ width: 240, height: 320 });
  await page.evaluate(() => (document.querySelector("#panel").open = false));
  await shoot(page, "share_narrow");
});

/** Devices are remembered, so that the test can take them away. */
const remember = (page) =>
  page.evaluateOnNewDocument(() => {
    const ask = GPUAdapter.prototype.requestDevice;
    GPUAdapter.prototype.requestDevice = async function (...words) {
      return (window.device = await ask.apply(this, words));
    };
  });

await open(
  WEBGPU,
  async (page) => {
    await full(page);
    const before = await shown(page);
    await page.evaluate(() => window.device.destroy());
    await page.waitForFunction(() => !document.querySelector("#note").hidden);
    const note = await page.evaluate(() => document.querySelector("#note").textContent);
    const isStill = await page.evaluate(() => !document.querySelector("#still").hidden);
    check("a device that goes is told of, and leaves a picture", isStill && /device has gone/.test(note), note);
    await shoot(page, "share_lost");
    const last = await number(page);
    await page.click("#note button");
    await full(page, last);
    const again = await shown(page);
    check(
      "and the scene goes on with another one",
      difference(before, again) < 0.5,
      difference(before, again).toFixed(2),
    );
  },
  remember,
);

await open(["--disable-gpu"], async (page) => {
  await page.waitForFunction(() => document.body.dataset.failed);
  const note = await page.evaluate(() => document.querySelector("#note").textContent);
  check(
    "without WebGPU it says why, and shows a picture",
    note.includes("WebGPU") && (await page.evaluate(() => document.querySelector("#still").naturalWidth > 0)),
    note,
  );
  check(
    "and no controls that do nothing",
    await page.evaluate(() => document.querySelector("#panel").getClientRects().length === 0),
  );
  await shoot(page, "share-still");
});
await rm(folder, { recursive: true, force: true });
process.exit(failed ? 1 : 0);
