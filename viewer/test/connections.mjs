// How a page gets its connection, keeps it and loses it:
// `node test/connections.mjs REFRAXEL RUN DATA TWO [SCREENSHOTS]`.
//
// REFRAXEL is the program, RUN a run, DATA a dataset that is trained on, TWO a run with two refractive regions.

import { createServer as createHttpServer } from "node:http";
import { createServer, connect } from "node:net";
import { mkdtemp, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { WebSocket } from "ws";
import { act, best, check, difference, newPage, picture, press, start, view } from "./harness.mjs";
import { POLL, run as runTests, shoot as shootInto } from "./harness.mjs";

const [program, run, data, two, screenshots] = process.argv.slice(2);
if (!two) {
  console.error("usage: node test/connections.mjs REFRAXEL RUN DATA TWO [SCREENSHOTS]");
  process.exit(2);
}
const shoot = (page, name) => shootInto(page, screenshots, name);

const token = (url) => url.split("/")[3];
/** The notice over the picture, once it says this. */
const noticed = async (page, text) => {
  const says = (text) => document.querySelector("#notice:not([hidden])")?.textContent.includes(text);
  await page.waitForFunction(says, POLL, text);
  return page.$eval("#notice", (notice) => notice.textContent);
};
/** Texts or labels of the controls that are on. */
const controls = (page) =>
  page.$$eval("#panel button, #panel select, #panel input", (all) =>
    all
      .filter((c) => !c.disabled && c.offsetParent)
      .map((c) => c.textContent || c.ariaLabel || c.parentElement.textContent),
  );
/** What acts without the program. */
const ALONE = ["?", "cameras", "boxes", "path 1", "New", "×", "Name of the path", "Save", "Clear", "Screenshot"];

async function isOff(page, when) {
  const on = await controls(page);
  const areOff = on.length > 0 && on.every((name) => ALONE.includes(name));
  check(`${when}, controls that cannot act are off`, areOff, on.join(", "));
}

/** The address loses its token, and nobody gets in by less. */
async function letIn(browser, viewer) {
  const url = await viewer.url;
  const { page, errors } = await newPage(browser, url);
  await best(page);
  check("the token is not in the address bar", page.url() === `http://${new URL(url).host}/`, page.url());
  await page.goto("about:blank");
  const history = await page.createCDPSession().then((session) => session.send("Page.getNavigationHistory"));
  const entries = history.entries.map((entry) => entry.url);
  check("nor in the history", !entries.some((entry) => entry.includes(token(url))), entries.join(" "));
  await page.goBack();
  await best(page);
  check("whose page still shows the scene", true);
  const cookies = await page.createCDPSession().then((session) => session.send("Network.getAllCookies"));
  const cookie = cookies.cookies.find((c) => c.value === token(url));
  const isKept = cookie.httpOnly && cookie.sameSite === "Strict";
  check("the cookie is kept from scripts and other sites", isKept, cookie.name);
  await linked(browser, url);
  const stranger = await browser.newPage();
  const wrong = await stranger.goto(url.replace(token(url), "0".repeat(32)));
  const says = await wrong.text();
  const isRefused = wrong.status() === 404 && says.includes("whole address");
  check("a wrong token finds nothing, and learns what to open", isRefused);
  // A page of another origin: about:blank sends "null".
  await stranger.goto("about:blank");
  const opened = await stranger.evaluate(
    (address) =>
      new Promise((resolve) => {
        const socket = new WebSocket(address);
        socket.onopen = () => resolve("open");
        socket.onerror = () => resolve("refused");
      }),
    `ws://${new URL(url).host}/socket`,
  );
  check("a foreign page gets no connection", opened === "refused", opened);
  await stranger.close();
  check("the page has reported no errors", errors.length === 0, errors.join("; "));
  return page;
}

/** A link on a page of another site leads to the scene, too. */
async function linked(browser, url) {
  const server = createHttpServer((_, answer) => {
    answer.setHeader("Content-Type", "text/html");
    answer.end(`<a href="${url}">the scene</a>`);
  });
  await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
  const { page } = await newPage(browser, `http://localhost:${server.address().port}/`);
  await page.click("a");
  await best(page);
  const history = await page.createCDPSession().then((session) => session.send("Page.getNavigationHistory"));
  const entries = history.entries.map((entry) => entry.url);
  const isLeft = entries.some((entry) => entry.includes(token(url)));
  check("a link on another site leads to the scene, and leaves no token", !isLeft, entries.join(" "));
  await page.close();
  server.close();
}

/** A port of another number leads to the viewer, as `ssh -L` makes it. */
async function forwarded(browser, viewer) {
  const url = new URL(await viewer.url);
  const open = new Set();
  const server = createServer((near) => {
    const far = connect(Number(url.port), "127.0.0.1");
    open.add(near).add(far);
    near.pipe(far).pipe(near);
    for (const end of [near, far]) end.on("error", () => [near, far].forEach((other) => other.destroy()));
  });
  await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
  const { page } = await newPage(browser, `http://localhost:${server.address().port}${url.pathname}`);
  await best(page);
  check("a forwarded port of another number shows the scene", true, page.url());
  for (const end of open) end.destroy();
  await new Promise((resolve) => server.close(resolve));
  const said = await noticed(page, "No answer");
  check("a tunnel that breaks is not taken for the end of the program", said.includes("Trying again"), said);
  await page.close();
}

/** Two viewers on one host; of one, the seventeenth page. */
async function several(browser, viewer, page) {
  const other = view(program, two);
  try {
    const second = await newPage(browser, await other.url);
    await best(second.page);
    for (const reloaded of [page, second.page]) {
      // A tab in the background paints nothing, and asks for no picture.
      await reloaded.bringToFront();
      await reloaded.reload();
      await best(reloaded);
    }
    check("two viewers on one host do not take each other's cookies", true);
    await regions(second.page);
    await second.page.close();
  } finally {
    other.child.kill();
  }
  const url = new URL(await viewer.url);
  const answer = await fetch(url, { redirect: "manual" });
  const cookie = answer.headers.get("set-cookie").split(";")[0];
  const sockets = [];
  for (let k = 0; k < 15; k++) {
    const socket = new WebSocket(`ws://${url.host}/socket`, { headers: { Cookie: cookie }, origin: url.origin });
    await new Promise((resolve) => socket.once("message", resolve));
    sockets.push(socket);
  }
  const late = await newPage(browser, url.href);
  const said = await noticed(late.page, "16 pages");
  check("the seventeenth page says that there are too many", said.includes("Close one"), said);
  await shoot(late.page, "seventeenth");
  sockets.pop().close();
  await best(late.page);
  check("and is shown once one is closed", await late.page.$eval("#notice", (notice) => notice.hidden));
  for (const socket of sockets) socket.close();
  await late.page.close();
}

/** Each of two regions is cut and becomes another glass. */
async function regions(page) {
  const choose = (label, k) => page.$$eval(`[aria-label="${label}"] button`, (all, k) => all[k].click(), k);
  const before = await picture(page);
  await choose("Glass of region", 2);
  const second = await act(page, () => press(page, "diamond"));
  const sliders = 'input[type=range][aria-label^="region"]';
  const values = await page.$$eval(sliders, (all) => all.map((input) => input.valueAsNumber));
  const isOne = values[0] < 2 && values[1] === 2.42 && difference(before, second) > 0.05;
  check("one of two regions becomes diamond", isOne, values.join(", "));
  await act(page, () => press(page, "learned"));
  const cut = () => page.$eval('canvas[aria-label^="Index in the plane"]', (canvas) => canvas.toDataURL());
  await choose("Axis across", 2);
  await page.waitForFunction(() => document.querySelector('canvas[aria-label^="Index in the plane"]').width > 16);
  const first = await cut();
  await choose("Region to cut", 1);
  await page.waitForFunction(
    (first) => document.querySelector('canvas[aria-label^="Index in the plane"]').toDataURL() !== first,
    {},
    first,
  );
  check("a slice reaches the second region", true);
  await shoot(page, "regions");
}

/** The viewer ends by a word, by none, and another one takes its port. */
async function endings(browser, viewer, page) {
  const url = await viewer.url;
  viewer.child.kill("SIGKILL");
  const silent = await noticed(page, "No answer");
  check("a program that has ended without a word is said to", silent.includes("terminal"), silent);
  await isOff(page, "without the program");
  const again = view(program, run, new URL(url).port);
  try {
    const address = await again.url;
    check("a new start has a new address", address !== url);
    const said = await noticed(page, "Another viewer");
    check("a page of an earlier viewer says that another one has its port", true, said);
    await shoot(page, "another");
    const fresh = await newPage(browser, address);
    await best(fresh.page);
    again.child.kill("SIGINT");
    const ended = await noticed(fresh.page, "ended in its terminal");
    check("a viewer that is ended says so", (await again.ended) === 0, ended);
    await isOff(fresh.page, "after the end");
    await shoot(fresh.page, "ended");
    await fresh.page.close();
  } finally {
    again.child.kill();
  }
}

/** A training: its steps, and what stays when it has finished. */
async function training(browser) {
  const folder = await mkdtemp(join(tmpdir(), "refraxel-training-"));
  const words = ["train", data, "--out", join(folder, "run"), "--refraction", "off", "--view"];
  const options = ["--set", "run.steps=800", "--set", "grid.resolution=48"];
  const trained = start(program, [...words, ...options], "stderr");
  try {
    const { page } = await newPage(browser, await trained.url);
    await page.waitForFunction(() => /step \d+ of 800/.test(document.querySelector("#panel").textContent));
    check("steps are counted in steps", true);
    check("a training can be paused", (await controls(page)).includes("Pause"));
    await shoot(page, "training");
    const said = await noticed(page, "finished after 800 steps");
    check("a training that has finished says so", (await trained.ended) === 0, said);
    await isOff(page, "after the training");
    const step = await page.$eval("#panel", (panel) => /The picture is of step \d+/.exec(panel.textContent)[0]);
    check("the last picture is of the finished scene", step.endsWith(" 800"), step);
    await shoot(page, "finished");
    await page.close();
  } finally {
    trained.child.kill();
    await trained.ended;
    await rm(folder, { recursive: true });
  }
}

await runTests(async (browser) => {
  const viewer = view(program, run);
  try {
    const page = await letIn(browser, viewer);
    await forwarded(browser, viewer);
    await several(browser, viewer, page);
    await endings(browser, viewer, page);
    await training(browser);
  } finally {
    viewer.child.kill();
  }
});
