// The page in a real browser: `node test/browser.mjs REFRAXEL RUN [SCREENSHOTS]`.
//
// REFRAXEL is the program, RUN a run with at least one refractive region and readable photographs. Ends with a line per check; the
// first one that fails ends the test with exit code 1. With SCREENSHOTS, pictures of the page are left in that folder.

import { spawnSync } from "node:child_process";
import { mkdtemp, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import {
  POLL,
  act,
  best,
  check,
  difference,
  newPage,
  picture,
  press,
  run as runTests,
  shoot as shootInto,
  turnAndReturn,
  view,
} from "./harness.mjs";
import { use } from "./use.mjs";

const [program, run, screenshots] = process.argv.slice(2);
if (!program || !run) {
  console.error("usage: node test/browser.mjs REFRAXEL RUN [SCREENSHOTS]");
  process.exit(2);
}
const shoot = (page, name) => shootInto(page, screenshots, name);

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

async function tests(browser, viewer) {
  const url = await viewer.url;
  const { page, errors } = await newPage(browser, url);
  await best(page);
  const first = await picture(page);
  check("the page shows the scene", new Set(first).size > 20, `${new Set(first).size} levels`);
  await shoot(page, "start");

  const box = await (await page.$("#stage")).boundingBox();
  const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
  const back = await turnAndReturn(page, first, [x, y]);

  const water = await act(page, () => slide(page, "n", 1.33));
  check("the index slider changes the picture", difference(back, water) > 0.3, difference(back, water).toFixed(2));
  await shoot(page, "water");
  const learned = await act(page, () => press(page, "learned"));
  check(
    "and the index that was learned brings it back",
    difference(back, learned) < 0.5,
    difference(back, learned).toFixed(2),
  );
  const straight = await act(page, () => page.keyboard.press("b"));
  check("straight rays show another picture", difference(back, straight) > 0.3, difference(back, straight).toFixed(2));
  await act(page, () => page.keyboard.press("b"));

  const layers = await page.$$eval('[aria-label="Layer"] button', (all) =>
    all.filter((b) => !b.hidden).map((b) => b.textContent),
  );
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
    for (let k = 0; k < data.length; k += 4)
      if (data[k] > 200 && data[k + 1] < 140 && data[k + 2] < 60 && data[k + 3] > 200) count++;
    return count;
  });
  check("the bent ray is drawn in space", orange > 50, `${orange} pixels`);
  await shoot(page, "ray");
  await page.keyboard.press("Escape");

  await act(page, () => page.keyboard.press("n"));
  await page.keyboard.press("c");
  await page.waitForFunction(() =>
    document.querySelector("#lines").getAttribute("aria-label").startsWith("Photograph"),
  );
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
  await page.evaluate(() =>
    document
      .querySelectorAll(".check input")
      .forEach((box) => box.parentElement.textContent.match(/cameras|boxes/) && box.click()),
  );
  await shoot(page, "overlays");
  await page.keyboard.press("g");
  await page.waitForFunction(() => {
    const canvas = document.querySelector("#lines");
    const data = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
    let count = 0;
    for (let k = 0; k < data.length; k += 4)
      if (data[k] < 60 && data[k + 1] > 90 && data[k + 2] > 80 && data[k + 1] > data[k + 2] && data[k + 3] > 150)
        count++;
    return count > 200;
  });
  check("lines are drawn on the glass", true);
  await shoot(page, "surfaces");

  const other = await newPage(browser, url);
  await best(other.page);
  check("two pages are open at once", difference(first, await picture(other.page)) < 0.5);
  await other.page.close();

  await use(browser, url, {
    check,
    newPage,
    best,
    picture,
    difference,
    act,
    shoot,
    slide,
    press,
    again: () => view(program, run),
  });
  await cameraPath(page);
  check("the page has reported no errors", errors.length === 0, errors.join("; "));
}

/** Clicks places around the middle until a ray meets a surface; what the page says of it. */
async function findGlass(page, box) {
  for (const [u, v] of [
    [0.5, 0.5],
    [0.5, 0.6],
    [0.45, 0.5],
    [0.55, 0.5],
    [0.5, 0.4],
    [0.42, 0.6],
    [0.58, 0.6],
  ]) {
    await page.evaluate(() => document.querySelector(".facts dt")?.remove());
    await page.mouse.click(box.x + u * box.width, box.y + v * box.height);
    await page.waitForFunction(() =>
      [...document.querySelectorAll(".facts dt")].some((t) => t.textContent === "turned by"),
    );
    const rows = await page.evaluate(() => document.querySelectorAll("table tr").length);
    if (rows > 2) return `${rows - 1} surfaces at ${u}, ${v}`;
  }
  return null;
}

/** A path of two keyframes is saved, and rendered as a film: by the program alone, and from the page, where it can be stopped. */
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
  check(
    "the program renders the camera path that the page saves",
    made.status === 0 && JSON.parse(made.stdout).film.frames === 24,
    made.stderr.trim().split("\n").pop(),
  );
  await rm(folder, { recursive: true });
  await paths(page);
  await filmFromPage(page);
}

const pathNames = (page) => page.$$eval('[aria-label="Path"] option', (all) => all.map((o) => o.textContent).join());
const keyframes = (page) => page.$eval("#panel", (panel) => /(\d+) keyframes?/.exec(panel.textContent)?.[1] ?? "0");

/** Several paths have names, and are there when the page is loaded again. */
async function paths(page) {
  await page.$eval('[aria-label="Name of the path"]', (input) => {
    input.value = "past the glass";
    input.dispatchEvent(new Event("change"));
  });
  await press(page, "New");
  check("a new path has no keyframes", (await keyframes(page)) === "0", await pathNames(page));
  // Few pixels, so that its film is soon rendered.
  await page.setViewport({ width: 360, height: 180 });
  await act(page, () => page.keyboard.press("r"));
  await page.keyboard.press("k");
  await act(page, () => page.keyboard.press("Numpad7"));
  await page.keyboard.press("k");
  await page.reload();
  await best(page);
  check("paths are kept by their names", (await pathNames(page)) === "past the glass,path 2", await pathNames(page));
  await page.select('[aria-label="Path"]', "1");
  check("with their keyframes", (await keyframes(page)) === "2");
}

async function filmFromPage(page) {
  const says = (text) =>
    page.waitForFunction((text) => document.querySelector(".film").textContent.includes(text), POLL, text);
  await press(page, "GIF");
  await slide(page, "seconds", 1);
  await slide(page, "frames per second", 10);
  await press(page, "Render film");
  await says("Save the film");
  const film = await page.evaluate(async () => {
    const link = document.querySelector(".film a");
    const bytes = new Uint8Array(await (await fetch(link.href)).arrayBuffer());
    return [link.download, bytes.length, String.fromCharCode(...bytes.slice(0, 6))];
  });
  check("a film is rendered from the page and fetched", film[0] === "path_2.gif" && film[2] === "GIF89a", film.join());
  await slide(page, "seconds", 60);
  await slide(page, "frames per second", 50); // a GIF has no more
  await press(page, "Render film");
  await page.waitForFunction(() => document.querySelector(".film progress").position >= 0, POLL);
  await shoot(page, "film");
  await press(page, "Stop film");
  await says("was stopped");
  check("and can be stopped", true);
  await page.setViewport({ width: 900, height: 560 });
}

await runTests(async (browser) => {
  const viewer = view(program, run);
  try {
    await tests(browser, viewer);
  } finally {
    viewer.child.kill();
  }
});
