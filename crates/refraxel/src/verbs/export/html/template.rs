//! The text of the page, into which its parts are put.

use crate::sentences::verdict_text;
use crate::verbs::train::evidence::EVIDENCE;
use data_encoding::BASE64;
use refraxel_train::verdict::Verdict;
use serde_json::Value;
use std::path::Path;

const SCRIPT: &str = include_str!("../../../../assets/share/page.js");
const STYLE: &str = include_str!("../../../../assets/share/page.css");

/// What was decided about refractive regions, as a part of the page, with the picture that convinced where the run has one.
pub(super) fn evidence(verdict: &Verdict, folder: &Path) -> String {
    let lines: String =
        verdict_text(verdict).lines().map(|line| format!("<p>{}</p>\n", escaped(line))).collect();
    let picture = std::fs::read(folder.join(EVIDENCE)).map(|png| {
        let png = BASE64.encode(&png);
        format!(
            "<img alt=\"Photograph, straight through, and prediction\" src=\"data:image/png;base64,{png}\">\n"
        )
    });
    format!(
        "<details id=\"verdict\">\n<summary>Verdict</summary>\n{lines}{}</details>\n",
        picture.unwrap_or_default()
    )
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;")
}

pub(super) fn page(name: &str, document: &Value, numbers: &[u8], still: &[u8], verdict: &str) -> String {
    let name = escaped(name);
    // Nothing inside may end its element.
    let document = document.to_string().replace('<', "\\u003c");
    let (numbers, still) = (BASE64.encode(numbers), BASE64.encode(still));
    format!(
        r##"<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:">
<meta name="generator" content="refraxel {version}">
<title>{name}</title>
<link rel="icon" href="data:,">
<style>{STYLE}</style>
</head>
<body>
<main id="stage" tabindex="0" role="application" aria-label="The scene. Drag to turn.">
<canvas id="lines" role="img" aria-label="Rendering"></canvas>
<img id="still" alt="A view of {alt}" src="data:image/jpeg;base64,{still}">
</main>
<aside>
<h1>{name}</h1>
<p id="note" role="status">The scene is unpacked.</p>
<details id="panel" hidden>
<summary>Controls</summary>
<div id="controls"></div>
</details>
{verdict}</aside>
<script type="application/json" id="document">{document}</script>
<script type="text/plain" id="numbers">{numbers}</script>
<script type="module">{SCRIPT}</script>
</body>
</html>
"##,
        version = env!("CARGO_PKG_VERSION"),
        alt = name.replace('"', "&quot;"),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn nothing_ends_its_element_too_early_and_nothing_is_loaded() {
        assert!(!SCRIPT.contains("</script") && !STYLE.contains("</style"), "as they are built");
        let page = page("a <b> & \"c\"", &json!({ "name": "</script><script>" }), b"123", b"456", "");
        assert_eq!(page.matches("</script>").count(), 3);
        assert!(page.contains("<title>a &lt;b> &amp; \"c\"</title>") && page.contains("&quot;c&quot;"));
        let without_own = page.replace(SCRIPT, "");
        assert!(!without_own.contains("http://") && !without_own.contains("https://"));
    }
}
