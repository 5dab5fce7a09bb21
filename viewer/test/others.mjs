// The page and the exported page in another browser than Chromium, in short: `node test/others.mjs firefox|webkit REFRAXEL RUN [SCREENSHOTS]`.
//
// REFRAXEL is the program, RUN a run with at least one refractive region. What Chromium shows in `browser.mjs` is not shown again.

import { spawnSync } from "node:child_process";
import { mkdtemp, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import puppeteer from "puppeteer-core";
import {
  act,
  best,
  check,
  difference,
  newPage,
  picture,
  press,
  run as runTests,
  shoot,
  turnAndReturn,
  until,
  view,
} from "./harness.mjs";
import { webkit } from "./webkit.mjs";

const [name, program, run, screenshots] = process.argv.slice(2);

/** How each browser is started: its version, a page of an address with the errors that it reports (WebKit's driver tells none), its end. */
const BROWSERS = {
  async firefox(profile) {
    const browser = await puppeteer.launch({
      browser: "firefox",
      executablePath: process.env.FIREFOX ?? "/usr/bin/firefox-esr",
      userDataDir: profile,
      // Its versions with long-term support cannot be given the size of a page: that is the window's.
      args: ["--width=900", "--height=640"],
      defaultViewport: null,
      timeout: 180_000,
    });
    return {
      version: await browser.version(),
      open: (url) => newPage(browser, url, null),
      close: () => browser.close(),
    };
  },
  async webkit() {
    const { page, version, close } = await webkit();
    const open = async (url) => {
      await page.goto(url);
      return { page };
    };
    return { version, open, close };
  },
};

async function live({ page, errors }) {
  await best(page);
  const first = await picture(page);
  check("the page shows the scene", new Set(first).size > 20, `${new Set(first).size} levels`);
  const [x, y] = await page.$eval("#stage", (stage) => {
    const { left, top, width, height } = stage.getBoundingClientRect();
    return [left + width / 2, top + height / 2];
  });
  const back = await turnAndReturn(page, first, [x, y]);
  const water = await act(page, () => press(page, "water"));
  check("another index shows another picture", difference(back, water) > 0.3, difference(back, water).toFixed(2));
  await page.mouse.click(x, y);
  await until(page, () => !document.querySelector("#ray").hidden);
  await page.keyboard.press("g");
  await shoot(page, screenshots, name);
  check("a click shows the ray of that pixel", true, await page.$eval("#ray", (ray) => ray.textContent));
  if (errors) check("the page has reported no errors", errors.length === 0, errors.join("; "));
}

/** A browser without WebGPU, such as Firefox for Linux, is told so, and shows a picture. */
async function exported({ page, errors }) {
  await until(page, () => document.body.dataset.failed || document.body.dataset.full === "true");
  const [why, note] = await page.evaluate(() => [
    document.body.dataset.failed,
    document.querySelector("#note").textContent,
  ]);
  const still = await page.evaluate(() => document.querySelector("#still").naturalWidth);
  await shoot(page, screenshots, `${name}_share`);
  if (why) check("the exported page says why it is a picture", note.includes("WebGPU") && still > 0, note);
  else check("the exported page renders the scene", true);
  if (errors) check("it has reported no errors", errors.length === 0, errors.join("; "));
}

if (!run || !BROWSERS[name]) {
  console.error("usage: node test/others.mjs firefox|webkit REFRAXEL RUN [SCREENSHOTS]");
  process.exit(2);
}
await runTests(async (browser) => {
  const folder = await mkdtemp(join(tmpdir(), "refraxel-page-"));
  const viewer = view(program, run);
  try {
    const file = join(folder, "scene.html");
    const made = spawnSync(program, ["export", run, "--format", "html", "--out", file], { encoding: "utf8" });
    if (made.status !== 0) throw new Error(made.stderr);
    console.log(browser.version);
    await live(await browser.open(await viewer.url));
    await exported(await browser.open(`file://${file}`));
  } finally {
    viewer.child.kill();
    await rm(folder, { recursive: true });
  }
}, BROWSERS[name]);
