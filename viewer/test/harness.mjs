// What the tests of the page in a real browser share.

import { spawn } from "node:child_process";
import { mkdtemp, mkdir, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import puppeteer from "puppeteer-core";

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

/** How a page is waited for that may be in the background, where no frames of the screen come. */
export const POLL = { polling: 100 };

/** Starts a program that prints the address of its page on one of its streams, and returns that. */
export function start(program, words, stream = "stdout", cwd = undefined) {
  const child = spawn(program, words, { stdio: ["ignore", "pipe", stream === "stderr" ? "pipe" : "inherit"], cwd });
  const url = new Promise((resolve, reject) => {
    let text = "";
    child[stream].on("data", (part) => {
      text += part;
      const found = /(http:\/\/127\.0\.0\.1:\d+\/[0-9a-f]+\/)/.exec(text);
      if (found) resolve(found[1]);
    });
    child.on("exit", () => reject(new Error(`the program ended: ${text}`)));
  });
  const ended = new Promise((resolve) => child.on("exit", resolve));
  url.catch(() => {}); // whoever waits for it is told
  return { child, url, ended };
}

/** Starts the viewer of a run. */
export const view = (program, run, port) => start(program, ["view", run, "--json", ...(port ? ["--port", port] : [])]);

export function check(claim, holds, found) {
  console.log(`${holds ? "ok" : "FAILED"}: ${claim}${found === undefined ? "" : ` (${found})`}`);
  if (!holds) throw new Error(claim);
}

/** A page of this address, and the errors that it reports. */
export async function newPage(browser, url, viewport = { width: 900, height: 560 }) {
  const page = await browser.newPage();
  page.setDefaultTimeout(PATIENCE);
  const errors = [];
  page.on("pageerror", (error) => errors.push(String(error)));
  page.on("console", (message) => message.type() === "error" && errors.push(message.text()));
  if (viewport) await page.setViewport(viewport);
  await page.goto(url);
  return { page, errors };
}

/** What an evaluation ends with where the page goes to another address meanwhile. */
const GONE = /context was destroyed|Cannot find context|frame was detached|Inspected target navigated/;

/** Waits until a function of the page says so. The page's CSP forbids Firefox the function that `waitForFunction` makes from a text. */
export async function until(page, holds, ...values) {
  const says = async () => {
    try {
      return await page.evaluate(holds, ...values);
    } catch (error) {
      if (GONE.test(error.message)) return false; // the next page is asked anew
      throw error;
    }
  };
  for (const end = Date.now() + PATIENCE; !(await says()); ) {
    if (Date.now() > end) throw new Error(`not within ${PATIENCE} ms: ${holds}`);
    await new Promise((resolve) => setTimeout(resolve, POLL.polling));
  }
}

/** Waits for the best picture of a look that begins after `frame`. */
export const best = (page, frame = 0) =>
  until(
    page,
    (frame) => {
      const shown = document.body.dataset;
      return Number(shown.frame) > frame && shown.last === "true" && shown.rays !== "0";
    },
    frame,
  );
export const frame = (page) => page.evaluate(() => Number(document.body.dataset.frame ?? 0));

/** Mean colours of the picture in 8 × 8 fields. */
export const picture = (page) =>
  page.evaluate(() => {
    const small = document.createElement("canvas");
    [small.width, small.height] = [64, 64];
    const ctx = small.getContext("2d");
    ctx.drawImage(document.querySelector("#picture"), 0, 0, 64, 64);
    return [...ctx.getImageData(0, 0, 64, 64).data];
  });
export const difference = (a, b) => a.reduce((sum, x, k) => sum + Math.abs(x - b[k]), 0) / a.length;

/** Does something that changes the picture, and returns the best one after it. */
export async function act(page, action) {
  const before = await frame(page);
  await action();
  await best(page, before);
  return picture(page);
}

/** Leaves a picture of the page in a folder, if there is one. */
export async function shoot(page, folder, name) {
  if (!folder) return;
  await mkdir(folder, { recursive: true });
  await page.screenshot({ path: join(folder, `${name}.png`) });
}

/** Presses the button of this text. */
export const press = (page, text) =>
  page.evaluate((text) => [...document.querySelectorAll("button")].find((b) => b.textContent === text).click(), text);

/** A drag from a place turns the scene that `first` shows, and R goes back to it: the picture after that. */
export async function turnAndReturn(page, first, [x, y]) {
  const turned = await act(page, async () => {
    await page.mouse.move(x, y);
    await page.mouse.down();
    await page.mouse.move(x + 160, y + 30, { steps: 8 });
    await page.mouse.up();
  });
  check("a drag turns the scene", difference(first, turned) > 1, difference(first, turned).toFixed(2));
  const back = await act(page, () => page.keyboard.press("r"));
  check("R goes back", difference(first, back) < 0.5, difference(first, back).toFixed(2));
  return back;
}

const chromium = (profile) =>
  puppeteer.launch({ headless: true, userDataDir: profile, executablePath: CHROMIUM, args: FLAGS });

/** Runs tests in the browser that is launched so, with a folder for its profile, and ends this program with what came of them. */
export async function run(tests, launch = chromium) {
  const profile = await mkdtemp(join(tmpdir(), "refraxel-browser-"));
  const browser = await launch(profile);
  let failed = false;
  try {
    await tests(browser);
  } catch (error) {
    console.error(error);
    failed = true;
  } finally {
    await browser.close();
    await rm(profile, { recursive: true, force: true });
  }
  process.exit(failed ? 1 : 0);
}
