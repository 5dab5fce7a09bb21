// Replaces the formulas of built pages by what KaTeX makes of them. A formula that is no TeX fails the build.
// usage: node math.mjs KATEX SITE      KATEX: KaTeX's module; SITE: the folder of the pages
import { readFileSync, readdirSync, writeFileSync } from "node:fs";
import { join, resolve } from "node:path";
import { pathToFileURL } from "node:url";

const [module, site] = process.argv.slice(2);
const { default: katex } = await import(pathToFileURL(resolve(module)));
const MATH = /<(span|div) class="math notranslate nohighlight"([^>]*)>\s*\\[([](.*?)\\[)\]]\s*<\/\1>/gs;
const CHARACTERS = { "&lt;": "<", "&gt;": ">", "&amp;": "&", "&#39;": "'", "&quot;": '"' };

let count = 0;
for (const name of readdirSync(site, { recursive: true }).filter((n) => n.endsWith(".html"))) {
    const path = join(site, name);
    const page = readFileSync(path, "utf8");
    const shown = page.replace(MATH, (_, tag, attributes, text) => {
        const tex = text.replace(/&(lt|gt|amp|#39|quot);/g, (c) => CHARACTERS[c]).trim();
        count += 1;
        try {
            const html = katex.renderToString(tex, { displayMode: tag === "div", throwOnError: true, strict: false });
            return `<${tag} class="math"${attributes}>${html}</${tag}>`;
        } catch (error) {
            throw new Error(`${name}: ${error.message}\n${tex}`);
        }
    });
    const plain = shown.replace(/<script[^>]*unused\.js[^>]*><\/script>/g, "");
    if (plain !== page) writeFileSync(path, plain);
}
console.log(`${count} formulas`);
