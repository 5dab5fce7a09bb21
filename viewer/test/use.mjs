// The page as people use it, by hand, by keyboard, on a desk and on a phone; `browser.mjs` calls this with its tools.

/** A telephone held upright. */
const PHONE = { width: 390, height: 760, deviceScaleFactor: 2, isMobile: true, hasTouch: true };

/** Whether an element is on the screen, and nothing over it. */
const inSight = (page, selector) =>
  page.evaluate((selector) => {
    const element = document.querySelector(selector);
    const { left, right, top, bottom, width, height } = element.getBoundingClientRect();
    if (width === 0 || left < 0 || top < 0 || right > innerWidth || bottom > innerHeight) return false;
    const at = document.elementFromPoint(left + width / 2, top + height / 2);
    return element.contains(at);
  }, selector);

const textOf = (page, selector) => page.evaluate((selector) => document.querySelector(selector).textContent, selector);
const shown = (page, selector) => page.waitForFunction((selector) => !document.querySelector(selector).hidden, {}, selector);
const middleOf = async (page) => {
  const box = await (await page.$("#stage")).boundingBox();
  return [box.x + box.width / 2, box.y + box.height / 2];
};

export async function use(browser, url, tools) {
  const { check, newPage, best } = tools;
  const { page, errors } = await newPage(browser, url);
  await best(page);
  await shortcuts(page, tools);
  await answers(page, tools);
  await comparison(page, tools);
  await zoom(page, tools);
  check("the page has reported no errors while it was used", errors.length === 0, errors.join("; "));
  await page.close();
  await sharpness(browser, url, tools);
  await phone(browser, url, tools);
}

async function shortcuts(page, { check, act, picture, difference, press }) {
  const before = await picture(page);
  await page.focus('input[aria-label="n"]');
  const straight = await act(page, () => page.keyboard.press("b"));
  check("B works while a slider has the focus", difference(before, straight) > 0.3);
  await act(page, () => page.keyboard.press("b"));
  const index = () => page.evaluate(() => document.querySelector('input[aria-label="n"]').value);
  const learned = await index();
  await act(page, () => page.keyboard.press("ArrowRight"));
  check("and arrows move the slider", (await index()) > learned, `${learned} to ${await index()}`);
  await act(page, () => press(page, "learned"));
  await page.focus('select[aria-label="Photograph"]');
  const chosen = () => page.evaluate(() => document.querySelector("select").value);
  await act(page, () => page.keyboard.press("n"));
  check("N works while the list of photographs has the focus", (await chosen()) === "0", await chosen());
  const depth = await act(page, () => page.keyboard.press("2"));
  check("and so do digits", difference(before, depth) > 3 && (await chosen()) === "0");
  await act(page, () => page.keyboard.press("1"));
  await act(page, () => page.keyboard.press("r"));
}

async function answers(page, { check, shoot }) {
  await page.evaluate(() => (document.querySelector("#panel").scrollTop = 0));
  await page.mouse.click(...(await middleOf(page)));
  await shown(page, "#ray");
  check("a ray's numbers are in sight", await inSight(page, "#ray"), await textOf(page, "#ray"));
  check("and their details in the panel", await inSight(page, "#panel table"));
  await shoot(page, "answers");
  await page.keyboard.press("h");
  check("also where the panel is hidden", await inSight(page, "#ray"));
  await page.keyboard.press("h");
  await page.keyboard.press("Escape");
  check("Esc takes them away", await page.evaluate(() => document.querySelector("#ray").hidden));
  await page.keyboard.press("Space");
  await shown(page, "#message");
  check("a message is in sight", await inSight(page, "#message"), await textOf(page, "#message"));
}

async function comparison(page, { check, act, shoot }) {
  await act(page, () => page.keyboard.press("n"));
  await act(page, () => page.keyboard.press("c"));
  const ratio = await page.evaluate(() => document.querySelector("#picture").width / document.querySelector("#picture").height);
  check("side by side there are two pictures", Math.abs(ratio - 2) < 0.05, `${ratio.toFixed(2)} times as wide as tall`);
  await page.waitForFunction(() => document.querySelector("#lines").getAttribute("aria-label").startsWith("Photograph"));

  const saved = await screenshot(page);
  check("a screenshot holds both", saved.size[0] / saved.size[1] === ratio && saved.levels.every((n) => n > 20), `${saved.size}, ${saved.levels} levels`);
  await shoot(page, "side_labels");

  const [x, y] = await middleOf(page);
  await act(page, async () => {
    await page.mouse.move(x, y);
    await page.mouse.down();
    await page.mouse.move(x + 10, y, { steps: 2 });
    await page.mouse.up();
  });
  check("a drag that ends a comparison says so", (await inSight(page, "#message")) && /comparison has ended/.test(await textOf(page, "#message")), await textOf(page, "#message"));
  await shoot(page, "left");
  await act(page, () => page.click("#message button"));
  const state = () => page.evaluate(() => [document.querySelector("select").value, document.querySelector('[aria-label="Comparison"] [aria-pressed=true]').textContent].join());
  check("and leads back to it", (await state()) === "0,side", await state());

  await act(page, () => page.keyboard.press("c"));
  check("the wipe names its sides", /on the left of the boundary; Rendering/.test(await page.evaluate(() => document.querySelector("#lines").getAttribute("aria-label"))));
  const [left, right] = await corners(page);
  check("in the picture, too", left > 200 && right > 200, `${left} and ${right} pixels`);
  for (const [name, words] of [["difference", "× 4"], ["error", "mean error"]]) {
    await act(page, () => page.keyboard.press("c"));
    const label = await page.evaluate(() => document.querySelector("#lines").getAttribute("aria-label"));
    check(`the ${name} has a name and a scale`, label.includes(words) && /, 0 to ≥ \d+$/.test(label), label);
    await shoot(page, `${name}_legend`);
  }
  await act(page, () => page.keyboard.press("r"));
  await act(page, () => page.keyboard.press("2"));
  const label = await page.evaluate(() => document.querySelector("#lines").getAttribute("aria-label"));
  check("depth has a name, a unit and a scale", /distance along the ray \[scene unit\], [\d.]+ to [\d.]+$/.test(label), label);
  await shoot(page, "depth_legend");
  await act(page, () => page.keyboard.press("1"));
}

/** Size of the PNG file that X saves, and how many levels each half has. */
async function screenshot(page) {
  await page.evaluate(() => {
    const make = URL.createObjectURL;
    URL.createObjectURL = (blob) => {
      URL.createObjectURL = make;
      window.shot = createImageBitmap(blob);
      return make.call(URL, blob);
    };
  });
  await page.keyboard.press("x");
  await page.waitForFunction(() => window.shot);
  return page.evaluate(async () => {
    const bitmap = await window.shot;
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [bitmap.width, bitmap.height];
    const ctx = canvas.getContext("2d");
    ctx.drawImage(bitmap, 0, 0);
    const half = bitmap.width / 2;
    const levels = [0, half].map((x) => new Set(ctx.getImageData(x, bitmap.height / 2, half, 1).data).size);
    return { size: [bitmap.width, bitmap.height], levels };
  });
}

/** Pixels drawn in the upper corners of the overlay. */
const corners = (page) =>
  page.evaluate(() => {
    const canvas = document.querySelector("#lines");
    const ctx = canvas.getContext("2d");
    const count = (x) => ctx.getImageData(x, 0, 90, 40).data.filter((a, k) => k % 4 === 3 && a > 100).length;
    return [count(0), count(canvas.width - 90)];
  });

async function zoom(page, { check, act, best, picture, shoot }) {
  const [x, y] = await middleOf(page);
  await page.mouse.move(x, y);
  await page.evaluate(() => (document.querySelector("#message").hidden = true));
  await act(page, async () => {
    for (let k = 0; k < 60; k++) await page.mouse.wheel({ deltaY: 1000 });
  });
  const levels = new Set(await picture(page)).size;
  const quiet = await page.evaluate(() => document.querySelector("#message").hidden);
  check("far out the scene is still there, and nothing is refused", levels > 8 && quiet, `${levels} levels, ${await textOf(page, "#message")}`);
  await shoot(page, "far");
  await act(page, async () => {
    for (let k = 0; k < 60; k++) await page.mouse.wheel({ deltaY: -1000 });
  });
  await best(page);
  check("nor near by", await page.evaluate(() => document.querySelector("#message").hidden));
  await act(page, () => page.keyboard.press("r"));
}

/** The size of the picture as the panel tells it [pixel]. */
const sizeOf = (page) =>
  page.evaluate(() => {
    const row = [...document.querySelectorAll(".facts dt")].find((dt) => dt.textContent === "picture");
    return /(\d+) × (\d+)/.exec(row.nextElementSibling.textContent).slice(1).map(Number);
  });

async function sharpness(browser, url, { check, newPage, best, act, press, start }) {
  const { page } = await newPage(browser, url);
  await page.setViewport({ width: 800, height: 360, deviceScaleFactor: 2 });
  await page.reload();
  await best(page);
  const [width, height] = await page.evaluate(() => [2 * document.querySelector("#stage").clientWidth, 2 * document.querySelector("#stage").clientHeight]);
  const size = await sizeOf(page);
  check("a picture has the pixels of a dense screen", size[0] === width && size[1] === height, `${size} of ${[width, height]}`);
  const [x, y] = await middleOf(page);
  const moved = await act(page, async () => {
    await page.mouse.move(x, y);
    await page.mouse.down();
    for (let k = 0; k < 20; k++) await page.mouse.move(x + 4 * k, y);
    await page.mouse.up();
  });
  check("also after it has moved", moved && (await sizeOf(page))[0] === width, String(await sizeOf(page)));

  await act(page, () => press(page, "640"));
  check("a size can be chosen", Math.max(...(await sizeOf(page))) === 640, String(await sizeOf(page)));
  await page.keyboard.press("h");
  await page.goto("about:blank");
  const other = start();
  try {
    await page.goto(await other.url);
    await best(page);
    const kept = await page.evaluate(() => [document.querySelector('[aria-label="Longest edge"] [aria-pressed=true]').textContent, document.body.className].join());
    check("another start of the viewer has the settings of the last", kept === "640,alone", kept);
    await page.goto("about:blank");
    await page.setCookie({ name: "refraxel_settings", value: "%7Bnonsense", domain: "127.0.0.1", path: "/" });
    await page.goto(await other.url);
    await best(page);
    check("settings that make no sense are forgotten", (await page.evaluate(() => document.body.className)) === "");
  } finally {
    other.child.removeAllListeners("exit");
    other.child.kill();
  }
  await page.deleteCookie(...(await page.cookies()));
  await page.close();
}

async function phone(browser, url, { check, newPage, best, shoot }) {
  const { page } = await newPage(browser, url);
  await page.setViewport(PHONE);
  await page.reload();
  await best(page);
  await page.touchscreen.tap(...(await middleOf(page)));
  await shown(page, "#ray");
  check("on a phone a ray's numbers are in sight", await inSight(page, "#ray"), await textOf(page, "#ray"));
  await page.keyboard.press("Space");
  await shown(page, "#message");
  check("and so are messages", await inSight(page, "#message"));
  await shoot(page, "phone");
  await page.close();
}
