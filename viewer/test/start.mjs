// The start page, as a person goes through it: `node test/start.mjs REFRAXEL DATA RUN [SCREENSHOTS]`.
//
// REFRAXEL is the program, DATA a dataset that is trained on for some seconds, RUN a run that is found as a recent one.

import { cp, mkdir, mkdtemp, realpath, rm, stat } from "node:fs/promises";
import { tmpdir } from "node:os";
import { basename, join, resolve } from "node:path";
import { best, check, newPage, POLL, press, run as runTests, shoot as shootInto, start } from "./harness.mjs";

const [program, data, earlier, screenshots] = process.argv.slice(2);
if (!earlier) {
  console.error("usage: node test/start.mjs REFRAXEL DATA RUN [SCREENSHOTS]");
  process.exit(2);
}
const DESK = { width: 1280, height: 800 };
/** Without `isMobile`, for which the page would be loaded again. */
const PHONE = { width: 390, height: 844, deviceScaleFactor: 2 };
/** Minutes of a training that is waited for. */
const SHORT = "0.15";

/** A screenshot of the whole page on a desk and on a phone, which has to show it without scrolling aside. */
async function shoot(page, name) {
  for (const [place, viewport] of Object.entries({ phone: PHONE, desk: DESK })) {
    await page.setViewport(viewport);
    const wide = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
    check(`${name} fits the ${place}`, wide <= 0, `${wide} pixels too wide`);
    await shootInto(page, screenshots, `start_${name}_${place}`);
  }
}

const says = async (page, text) => {
  await page.waitForFunction((text) => document.querySelector("#page").textContent.includes(text), POLL, text);
};
const titled = (page, title) => page.waitForSelector(`section[aria-label="${title}"]`);

/** Goes to a folder by its path, as it is typed or pasted. */
async function goTo(page, path) {
  await page.$eval(".path input", (input, path) => (input.value = path), path);
  await press(page, "Go");
  await page.waitForSelector(".chosen button"); // it is taken away until the folder is shown
}

async function begin(page, folder) {
  await titled(page, "New scene");
  await says(page, "earlier");
  check("recent runs are listed", true);
  await shoot(page, "home");
  await press(page, "Choose photographs or a video");
  await page.waitForFunction((folder) => document.querySelector(".path input")?.value === folder, POLL, folder);
  const names = await page.$$eval(".entry", (all) => all.map((entry) => entry.textContent));
  check(
    "the folders of the current one are listed",
    names.includes("📁earlier") && names.includes("📁nothing"),
    names.join(),
  );
  await page.evaluate(() =>
    [...document.querySelectorAll(".entry")].find((e) => e.textContent.endsWith("nothing")).click(),
  );
  await says(page, "No photographs directly here");
  await shoot(page, "choose");
  await press(page, "Use this folder");
  await titled(page, "The photographs cannot be used as they are");
  const why = await page.$eval(".why", (pre) => pre.textContent);
  check("what cannot be used is said to be so, in full", why.startsWith("error: ") && why.includes("nothing"), why);
  await shoot(page, "error");
  await press(page, "Back to the start");
  await titled(page, "Recent runs");
}

async function look(page) {
  await press(page, "Choose photographs or a video");
  await page.waitForSelector(".chosen button");
  await goTo(page, await realpath(data));
  await press(page, "Use this folder");
  await titled(page, "What is in the photographs");
  const found = await page.$$eval(".found dt", (all) => all.map((dt) => dt.textContent));
  check(
    "what inspect says is shown",
    ["views", "cameras", "training"].every((l) => found.includes(l)),
    found.join(),
  );
  await page.waitForFunction(
    () => [...document.images].every((image) => image.complete && image.naturalWidth > 0),
    POLL,
  );
  check("with the contact sheet and the cameras", (await page.$$("figure img")).length === 2);
  const command = await page.$eval("code", (code) => code.textContent);
  check("and the command that says the same", command.startsWith("refraxel inspect "), command);
  await shoot(page, "inspect");
}

async function train(page, minutes) {
  await page.$eval(
    '[aria-label="Minutes"]',
    (input, minutes) => {
      input.value = minutes;
      input.dispatchEvent(new Event("input"));
    },
    minutes,
  );
  await press(page, "no, straight rays");
  await page.click('form[aria-label="Train"] button.main');
  await titled(page, "Training");
  await page.waitForFunction(
    () => /^training \d+ %, [\d:]+ left$/.test(document.querySelector(".pace")?.textContent),
    POLL,
  );
}

/** A short training leads to its scene, and back. */
async function scene(page) {
  await train(page, SHORT);
  check("a training tells how far it is, and the time left", true, await page.$eval(".pace", (p) => p.textContent));
  const bar = await page.$eval("progress", (progress) => progress.position);
  check("by a bar, too", bar > 0 && bar <= 1, bar);
  check(
    "and can be watched",
    await page.$eval(".progress a", (a) => !a.hidden && a.href.startsWith("http://127.0.0.1:")),
  );
  await shoot(page, "train");
  const before = page.url();
  await page.waitForFunction((before) => location.href !== before, POLL, before);
  await best(page);
  check("the scene is shown when the training has finished", page.url() !== before, page.url());
  await shootInto(page, screenshots, "start_scene_desk");
  await page.goBack();
  await titled(page, "The training has finished");
  await shoot(page, "finished");
  await press(page, "Back to the start");
  const newest = await page
    .waitForSelector('[aria-label="Recent runs"] .entry')
    .then((e) => e.evaluate((e) => e.title));
  check("and its run is the latest", basename(newest) === `${basename(resolve(data))}-run`, newest);
}

/** A training that is stopped is saved. */
async function stop(page, folder) {
  await look(page);
  await train(page, "30");
  await press(page, "Stop");
  await titled(page, "The training was stopped and is saved");
  const run = join(folder, `${basename(resolve(data))}-run-2`, "checkpoint.safetensors");
  check("a training that is stopped is saved", (await stat(run)).size > 0, run);
  const why = await page.$eval(".why", (pre) => pre.textContent);
  check("and it is said how it goes on", why.includes("--resume"), why);
}

await runTests(async (browser) => {
  const folder = await realpath(await mkdtemp(join(tmpdir(), "refraxel-start-")));
  await cp(earlier, join(folder, "earlier"), { recursive: true });
  await mkdir(join(folder, "nothing"));
  const viewer = start(program, ["view", "--json"], "stdout", folder);
  try {
    const { page, errors } = await newPage(browser, await viewer.url);
    await begin(page, folder);
    await look(page);
    await scene(page);
    await stop(page, folder);
    check("the start page has reported no errors", errors.length === 0, errors.join("; "));
    viewer.child.kill("SIGINT");
    await page.waitForFunction(
      () => document.querySelector("#notice").textContent.includes("ended in its terminal"),
      POLL,
    );
    check("its end is said", (await viewer.ended) === 0);
  } finally {
    viewer.child.kill();
    await viewer.ended;
    await rm(folder, { recursive: true });
  }
});
