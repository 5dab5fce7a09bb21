// How long the first picture takes: `node test/first.mjs REFRAXEL RUN [TIMES]`.
//
// From the start of the program, and from the moment at which a browser that stands ready is sent to its address, as the program prints it.

import { run as runTests, until, view } from "./harness.mjs";

const [program, run, times = "5"] = process.argv.slice(2);
if (!run) {
  console.error("usage: node test/first.mjs REFRAXEL RUN [TIMES]");
  process.exit(2);
}
const row = (name, values) =>
  console.log(
    `${name}: ${values.map((v) => v.toFixed(0)).join(", ")} ms, median ${values.sort((a, b) => a - b)[values.length >> 1].toFixed(0)}`,
  );

await runTests(async (browser) => {
  const [address, picture, opened] = [[], [], []];
  for (let k = 0; k < Number(times); k++) {
    const start = performance.now();
    const viewer = view(program, run);
    const url = await viewer.url;
    const printed = performance.now();
    const page = await browser.newPage();
    await page.goto(url);
    await until(page, () => Number(document.body.dataset.frame ?? 0) > 0);
    const shown = performance.now();
    address.push(printed - start);
    picture.push(shown - start);
    opened.push(shown - printed);
    await page.close();
    viewer.child.kill();
    await viewer.ended;
  }
  row("start to address", address);
  row("address to first picture", opened);
  row("start to first picture", picture);
});
