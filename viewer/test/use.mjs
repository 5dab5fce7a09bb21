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
const shown = (page, selector) =>
  page.waitForFunction((selector) => !document.querySelector(selector).hidden, {}, selector);
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
  await distance(page, tools);
  await crop(page, tools);
  await overlays(page, tools);
  await comparison(page, tools);
  await zoom(page, tools);
  await views(page, tools);
  await keyboard(page, tools);
  await contrast(page, tools);
  await stillness(page, tools);
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

/** Pixels that are drawn over the picture. */
const drawn = () => {
  const canvas = document.querySelector("#lines");
  const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  return data.filter((a, k) => k % 4 === 3 && a > 0).length;
};

/** Lines around what the grid stores, and on the hull of what refracts, where there is one. */
export async function overlays(page, { check, shoot }) {
  const before = await page.evaluate(drawn);
  for (const name of ["grid", "hull"]) {
    const [label] = await page.$$(`xpath/.//label[.="${name}" and not(@hidden)]`);
    if (!label) {
      console.log(`not shown: this scene has no ${name}`);
      continue;
    }
    await label.click();
    await page.waitForFunction(`(${drawn})() > ${before + 500}`);
    check(`the ${name} is drawn`, true, `${(await page.evaluate(drawn)) - before} pixels more`);
    await shoot(page, `overlay_${name}`);
    await label.click();
    const after = await page.evaluate(drawn);
    check("and taken away", after === before, `${after} pixels, before ${before}`);
  }
}

/** A box hides what is outside of it. */
async function crop(page, { check, act, difference, slide, shoot }) {
  const toggle = () => page.evaluate(() => document.querySelector('label[title*="only inside a box"] input').click());
  const whole = await act(page, toggle);
  const before = await act(page, toggle); // the best picture, whatever was asked for last
  check(
    "a box around the scene hides nothing of it",
    difference(before, whole) < 0.5,
    difference(before, whole).toFixed(2),
  );
  await act(page, toggle);
  const half = await act(page, () => slide(page, "z from", 0.5));
  check("half of it hides much", difference(before, half) > 3, difference(before, half).toFixed(2));
  await shoot(page, "crop");
  const again = await act(page, toggle);
  check("and it can be taken back", difference(before, again) < 0.5, difference(before, again).toFixed(2));
}

/** Two clicks choose the ends of a distance. */
async function distance(page, { check, shoot }) {
  const says = (text) => page.waitForFunction((text) => document.body.textContent.includes(text), {}, text);
  await page.keyboard.press("t");
  const [x, y] = await middleOf(page);
  await page.mouse.click(x, y);
  await says("Click its other end.");
  await page.mouse.click(x + 40, y + 60);
  await says(" scene units, from (");
  const text = await page.evaluate(
    () => /\d[\d.e-]* scene units, from \([^)]*\) to \([^)]*\)/.exec(document.body.textContent)[0],
  );
  const numbers = text.match(/-?[\d.]+(e-?\d+)?/g).map(Number);
  const [length, from, to] = [numbers[0], numbers.slice(1, 4), numbers.slice(4)];
  const expected = Math.hypot(...from.map((a, k) => a - to[k]));
  // The places are told with four digits.
  check("a distance is that of its ends", Math.abs(length - expected) < 0.01 * length + 1e-3, text);
  const ray = await page.evaluate(() => document.querySelector("#ray").hidden);
  check("and no ray is shown meanwhile", ray);
  const drawn = await page.evaluate(() => {
    const { width, height } = document.querySelector("#lines");
    const data = document.querySelector("#lines").getContext("2d").getImageData(0, 0, width, height).data;
    let count = 0;
    for (let k = 0; k < data.length; k += 4)
      if (Math.hypot(data[k] - 103, data[k + 1] - 65, data[k + 2] - 217) < 30 && data[k + 3] > 200) count++;
    return count;
  });
  check("its line is drawn", drawn > 40, `${drawn} pixels`);
  await shoot(page, "distance");
  await page.keyboard.press("t");
  await page.keyboard.press("Escape");
  const gone = await page.evaluate(() => !document.body.textContent.includes(" scene units, from ("));
  check("Esc takes it away", gone);
}

async function comparison(page, { check, act, shoot }) {
  await act(page, () => page.keyboard.press("n"));
  await act(page, () => page.keyboard.press("c"));
  const ratio = await page.evaluate(
    () => document.querySelector("#picture").width / document.querySelector("#picture").height,
  );
  check("side by side there are two pictures", Math.abs(ratio - 2) < 0.05, `${ratio.toFixed(2)} times as wide as tall`);
  await page.waitForFunction(() =>
    document.querySelector("#lines").getAttribute("aria-label").startsWith("Photograph"),
  );

  const saved = await screenshot(page);
  check(
    "a screenshot holds both",
    saved.size[0] / saved.size[1] === ratio && saved.levels.every((n) => n > 20),
    `${saved.size}, ${saved.levels} levels`,
  );
  await shoot(page, "side_labels");

  const [x, y] = await middleOf(page);
  await act(page, async () => {
    await page.mouse.move(x, y);
    await page.mouse.down();
    await page.mouse.move(x + 10, y, { steps: 2 });
    await page.mouse.up();
  });
  check(
    "a drag that ends a comparison says so",
    (await inSight(page, "#message")) && /comparison has ended/.test(await textOf(page, "#message")),
    await textOf(page, "#message"),
  );
  await shoot(page, "left");
  await act(page, () => page.click("#message button"));
  const state = () =>
    page.evaluate(() =>
      [
        document.querySelector("select").value,
        document.querySelector('[aria-label="Comparison"] [aria-pressed=true]').textContent,
      ].join(),
    );
  check("and leads back to it", (await state()) === "0,side", await state());

  await act(page, () => page.keyboard.press("c"));
  check(
    "the wipe names its sides",
    /on the left of the boundary; Rendering/.test(
      await page.evaluate(() => document.querySelector("#lines").getAttribute("aria-label")),
    ),
  );
  const [left, right] = await corners(page);
  check("in the picture, too", left > 200 && right > 200, `${left} and ${right} pixels`);
  for (const [name, words] of [
    ["difference", "× 4"],
    ["error", "mean error"],
  ]) {
    await act(page, () => page.keyboard.press("c"));
    const label = await page.evaluate(() => document.querySelector("#lines").getAttribute("aria-label"));
    check(`the ${name} has a name and a scale`, label.includes(words) && /, 0 to ≥ \d+$/.test(label), label);
    await shoot(page, `${name}_legend`);
  }
  await act(page, () => page.keyboard.press("r"));
  await act(page, () => page.keyboard.press("2"));
  const label = await page.evaluate(() => document.querySelector("#lines").getAttribute("aria-label"));
  check(
    "depth has a name, a unit and a scale",
    /distance along the ray \[scene unit\], [\d.]+ to [\d.]+$/.test(label),
    label,
  );
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
  check(
    "far out the scene is still there, and nothing is refused",
    levels > 8 && quiet,
    `${levels} levels, ${await textOf(page, "#message")}`,
  );
  await shoot(page, "far");
  await act(page, async () => {
    for (let k = 0; k < 60; k++) await page.mouse.wheel({ deltaY: -1000 });
  });
  await best(page);
  check("nor near by", await page.evaluate(() => document.querySelector("#message").hidden));
  await act(page, () => page.keyboard.press("r"));
}

async function views(page, { check, act, best, picture, difference, slide, shoot }) {
  const start = await picture(page);
  const wide = await act(page, () => slide(page, "field of view", 90));
  check("the field of view can be chosen", difference(start, wide) > 3, difference(start, wide).toFixed(2));
  await page.keyboard.press("m");
  const glass = await act(page, () => page.keyboard.press("f"));
  check("F fills the picture with the glass", difference(wide, glass) > 3, difference(wide, glass).toFixed(2));
  await shoot(page, "framed");
  const scene = await act(page, () => page.keyboard.press("Home"));
  check("and Home with the scene", difference(scene, glass) > 3, difference(scene, glass).toFixed(2));
  const above = await act(page, () => page.keyboard.press("Numpad7"));
  check("7 of the number pad looks from above", difference(scene, above) > 3, difference(scene, above).toFixed(2));
  await shoot(page, "above");
  await page.reload();
  await best(page);
  const back = await act(page, async () => {
    await page.keyboard.down("Shift");
    await page.keyboard.press("Digit1");
    await page.keyboard.up("Shift");
  });
  check(
    "a bookmark leads back to its view, also after the page was loaded again",
    difference(wide, back) < 0.5,
    difference(wide, back).toFixed(2),
  );
  await page.click('[aria-label="Forgets view 1"]');
  const home = await act(page, () => page.keyboard.press("r"));
  check(
    "R goes back to the start, with its field of view",
    difference(home, start) < 0.5,
    difference(home, start).toFixed(2),
  );
}

/** What has the focus, whether that is seen, and its name. */
const focused = (page) =>
  page.evaluate(() => {
    const at = document.activeElement;
    const styles = [at, ...(at.id === "wipe" ? ["::after"] : [])].map((e) =>
      typeof e === "string" ? getComputedStyle(at, e) : getComputedStyle(e),
    );
    const isSeen = styles.some(
      ({ outlineStyle, outlineWidth }) => outlineStyle !== "none" && parseFloat(outlineWidth) >= 2,
    );
    const name = at.getAttribute("aria-label") ?? (at.labels?.[0]?.textContent || at.textContent);
    const { left, top } = at.getBoundingClientRect();
    return {
      id: at.id || at.tagName.toLowerCase(),
      isSeen,
      name: name.trim(),
      left,
      top: top + document.querySelector("#panel").scrollTop,
    };
  });

async function keyboard(page, { check, act, shoot }) {
  await act(page, () => page.keyboard.press("n"));
  await act(page, () => page.keyboard.press("c"));
  await act(page, () => page.keyboard.press("c"));
  await page.evaluate(() => (document.querySelector("#panel").scrollTop = 0));
  await page.focus("#stage");
  const found = [];
  for (let k = 0; k < 90; k++) {
    await page.keyboard.press("Tab");
    const at = await focused(page);
    if (at.id === "body" || found.some((f) => f.left === at.left && f.top === at.top && f.name === at.name)) break;
    found.push(at);
  }
  check(
    "Tab goes from the picture to the boundary of the wipe and through all controls",
    found[0].id === "wipe" && found.length > 30,
    `${found.length} stops`,
  );
  const hidden = found.filter((at) => !at.isSeen).map((at) => at.name || at.id);
  check("the focus is seen everywhere", hidden.length === 0, hidden.join());
  const nameless = found.filter((at) => !/[a-z0-9]/i.test(at.name)).map((at) => at.id);
  check("everything has a name in words", nameless.length === 0, nameless.join());
  const back = found
    .slice(1)
    .filter((at, k, all) => k > 0 && at.top + 4 < all[k - 1].top)
    .map((at) => at.name);
  check("and nothing comes before what is above it", back.length === 0, back.join());

  await page.focus("#wipe");
  const value = () => page.evaluate(() => Number(document.querySelector("#wipe").getAttribute("aria-valuenow")));
  const steps = [await value()];
  for (const key of ["ArrowRight", "PageDown", "Home", "End"]) {
    await page.keyboard.press(key);
    steps.push(await value());
  }
  check("keys move the boundary of the wipe", steps.join() === "50,52,42,0,100", steps.join());
  await shoot(page, "wipe_focus");
  await page.focus("#stage");
  await page.setViewport({ width: 700, height: 300 });
  await page.keyboard.type("?");
  const top = await page.evaluate(() =>
    [document.querySelector("#help").scrollTop, document.activeElement.textContent].join(),
  );
  check("help opens at its top", top === "0,Keys and gestures", top);
  await shoot(page, "help");
  await page.keyboard.press("Escape");
  await page.setViewport({ width: 900, height: 560 });
  await act(page, () => page.keyboard.press("r"));
}

/** Texts and borders of controls that are too pale for WCAG 2.2 AA: 4.5 to 1 for texts, 3 to 1 for borders. */
const pale = (page) =>
  page.evaluate(() => {
    const channels = (colour) => colour.match(/[\d.]+/g).map(Number);
    const luminance = (colour) => {
      const [r, g, b] = channels(colour).map((c) =>
        c / 255 <= 0.04045 ? c / 255 / 12.92 : ((c / 255 + 0.055) / 1.055) ** 2.4,
      );
      return 0.2126 * r + 0.7152 * g + 0.0722 * b;
    };
    const contrast = (a, b) => (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
    const ground = (element) => {
      const colour = getComputedStyle(element).backgroundColor;
      return (channels(colour)[3] ?? 1) === 1 ? colour : ground(element.parentElement);
    };
    const found = [];
    for (const element of document.querySelectorAll("#panel *, #answers *, #help *, #notice")) {
      const style = getComputedStyle(element);
      const owns = [...element.childNodes].some((n) => n.nodeType === Node.TEXT_NODE && n.textContent.trim());
      const text = contrast(luminance(style.color), luminance(ground(element)));
      if (owns && text < 4.5) found.push(`${element.textContent.trim()}: ${text.toFixed(2)}`);
      const edge = contrast(luminance(style.borderTopColor), luminance(ground(element.parentElement)));
      if (/^(BUTTON|SELECT)$/.test(element.tagName) && edge < 3)
        found.push(`border of ${element.textContent.trim().slice(0, 9)}: ${edge.toFixed(2)}`);
    }
    return found;
  });

async function contrast(page, { check, shoot }) {
  for (const value of ["light", "dark"]) {
    await page.emulateMediaFeatures([{ name: "prefers-color-scheme", value }]);
    const found = await pale(page);
    check(`in ${value} colours all texts and borders have enough contrast`, found.length === 0, found.join("; "));
    await shoot(page, `panel_${value}`);
  }
}

/** Who wants less motion sees the keyframes of a path, and nothing in between. */
async function stillness(page, { check, act, best, slide, press, shoot }) {
  await page.emulateMediaFeatures([{ name: "prefers-reduced-motion", value: "reduce" }]);
  await slide(page, "seconds", 1);
  await page.keyboard.press("k");
  await act(page, async () => {
    await page.keyboard.down("ArrowRight");
    await new Promise((resolve) => setTimeout(resolve, 300));
    await page.keyboard.up("ArrowRight");
  });
  await page.keyboard.press("k");
  await best(page);
  await page.evaluate(() => {
    const send = WebSocket.prototype.send;
    window.eyes = new Set();
    WebSocket.prototype.send = function (text) {
      const ask = JSON.parse(text);
      if (ask.ask === "look") window.eyes.add(ask.camera.eye.map((x) => x.toFixed(6)).join());
      return send.call(this, text);
    };
  });
  await act(page, () => page.keyboard.press("Space"));
  const places = await page.evaluate(() => window.eyes.size);
  check("a path is played without motion where that is asked for", places === 2, `${places} places`);
  await page.emulateMediaFeatures([]);
  await act(page, async () => {
    await page.keyboard.press("Numpad7");
    await page.mouse.move(...(await middleOf(page)));
    await page.mouse.wheel({ deltaY: 1000 });
  });
  const violet = await page.evaluate(() => {
    const { width, height } = document.querySelector("#lines");
    const data = document.querySelector("#lines").getContext("2d").getImageData(0, 0, width, height).data;
    let count = 0;
    for (let k = 0; k < data.length; k += 4)
      if (Math.hypot(data[k] - 176, data[k + 1] - 71, data[k + 2] - 143) < 30 && data[k + 3] > 200) count++;
    return count;
  });
  check("keyframes are drawn in the scene", violet > 50, `${violet} pixels`);
  await shoot(page, "keyframes");
  await press(page, "Clear");
  await act(page, () => page.keyboard.press("r"));
}

/** The size of the picture as the panel tells it [pixel]. */
const sizeOf = (page) =>
  page.evaluate(() => {
    const row = [...document.querySelectorAll(".facts dt")].find((dt) => dt.textContent === "picture");
    return /(\d+) × (\d+)/.exec(row.nextElementSibling.textContent).slice(1).map(Number);
  });

async function sharpness(browser, url, { check, newPage, best, act, press, again }) {
  const { page } = await newPage(browser, url);
  await page.setViewport({ width: 800, height: 360, deviceScaleFactor: 2 });
  await page.reload();
  await best(page);
  const [width, height] = await page.evaluate(() => [
    2 * document.querySelector("#stage").clientWidth,
    2 * document.querySelector("#stage").clientHeight,
  ]);
  const size = await sizeOf(page);
  check(
    "a picture has the pixels of a dense screen",
    size[0] === width && size[1] === height,
    `${size} of ${[width, height]}`,
  );
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
  const other = again();
  try {
    await page.goto(await other.url);
    await best(page);
    const kept = await page.evaluate(() =>
      [
        document.querySelector('[aria-label="Longest edge"] [aria-pressed=true]').textContent,
        document.body.className,
      ].join(),
    );
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
  await page.deleteCookie({ name: "refraxel_settings", domain: "127.0.0.1", path: "/" });
  await page.close();
}

/** Waits until the panel no longer scrolls from a swipe. */
async function settled(page) {
  const place = () => page.evaluate(() => document.querySelector("#panel").scrollTop);
  for (let before = NaN, now = await place(); now !== before; ) {
    await new Promise((resolve) => setTimeout(resolve, 300));
    [before, now] = [now, await place()];
  }
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

  await page.keyboard.press("5");
  await page.waitForFunction(() => document.querySelector("#lines").getAttribute("aria-label").includes("normal"));
  const edge = await page.evaluate(() => {
    const canvas = document.querySelector("#lines");
    const { data } = canvas.getContext("2d").getImageData(canvas.width - 4, 0, 4, canvas.height);
    return data.filter((a, k) => k % 4 === 3 && a > 0).length;
  });
  check("legends fit a narrow picture", edge === 0, `${edge} pixels at its edge`);
  await shoot(page, "phone_legend");
  await page.keyboard.press("1");

  const slider = 'input[aria-label="n"]';
  const value = () => page.evaluate((slider) => document.querySelector(slider).value, slider);
  await page.evaluate((slider) => document.querySelector(slider).scrollIntoView({ block: "center" }), slider);
  const [before, scrolled] = [await value(), await page.evaluate(() => document.querySelector("#panel").scrollTop)];
  const box = await (await page.$(slider)).boundingBox();
  const swipe = async (dx, dy) => {
    const from = [box.x + 0.7 * box.width, box.y + box.height / 2];
    await page.touchscreen.touchStart(...from);
    for (let k = 1; k <= 10; k++) await page.touchscreen.touchMove(from[0] + (dx * k) / 10, from[1] + (dy * k) / 10);
    await page.touchscreen.touchEnd();
  };
  await swipe(4, -70);
  await page.waitForFunction((scrolled) => document.querySelector("#panel").scrollTop !== scrolled, {}, scrolled);
  await settled(page);
  check(
    "a swipe over the slider of the index scrolls, and leaves the index alone",
    (await value()) === before,
    `${before}, then ${await value()}`,
  );
  await page.evaluate((slider) => document.querySelector(slider).scrollIntoView({ block: "center" }), slider);
  const turned = await textOf(page, "#ray");
  const place = async () => (await (await page.$(slider)).boundingBox()).y;
  const at = await place();
  await swipe(40, 0);
  check("a finger along the slider moves it", (await value()) > before, `${before} to ${await value()}`);
  const along = await value();
  await page.waitForFunction((turned) => document.querySelector("#ray").textContent !== turned, {}, turned);
  const moved = (await place()) - at;
  check("the ray follows, and the slider stays under the finger", moved === 0, `${moved} pixels`);
  await page.touchscreen.tap(box.x + 0.3 * box.width, box.y + box.height / 2);
  check("and so does a tap", (await value()) < along, await value());
  await page.close();
}
