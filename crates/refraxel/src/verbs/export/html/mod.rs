//! A page to share: one file with the quantised scene, the renderer of `viewer/share`, and a picture for browsers without WebGPU.

mod field;
mod pack;
mod regions;

use crate::exit::{Exit, Failure, OrExit};
use crate::sentences::verdict_text;
use crate::verbs::interrupts::{cancel, watch_for_interrupts};
use crate::verbs::loaded::Loaded;
use crate::verbs::reopen;
use crate::verbs::train::evidence::EVIDENCE;
use crate::verbs::view::name;
use crate::viewer::{PageCamera, UP, start};
use data_encoding::BASE64;
use flate2::{Compression, write::GzEncoder};
use image::codecs::jpeg::JpegEncoder;
use pack::Pack;
use refraxel_core::Camera;
use refraxel_data::{Dataset, scene_region};
use refraxel_train::Backend;
use refraxel_train::checkpoint::write_atomic;
use refraxel_train::evaluation::render;
use refraxel_train::schedule::rendering_marching;
use refraxel_train::verdict::Verdict;
use serde_json::{Value, json};
use std::io::Write;
use std::path::Path;

/// Longest edge of the picture for browsers without WebGPU [pixel], and its quality, 1 to 100.
const PICTURE: (u32, u8) = (800, 88);
const SCRIPT: &str = include_str!("../../../../assets/share/page.js");
const STYLE: &str = include_str!("../../../../assets/share/page.css");

/// What was put into the page.
pub struct Page {
    /// Voxels of the scene in the page.
    pub voxels: usize,
    /// Size of the file [byte].
    pub bytes: usize,
}

/// Writes the page of a run.
pub fn write(run: &mut Loaded, folder: &Path, out: &Path) -> Result<Page, Failure> {
    watch_for_interrupts()?;
    let marching = rendering_marching(&run.options, run.plan.near);
    run.backend.refresh_occupancy(&marching);
    let data = reopen(run).ok();
    let camera = first_camera(run, data.as_ref());
    let still = still(run, &camera)?;
    let snapshot = run.backend.snapshot();
    let mut pack = Pack::default();
    let (field, voxels) = field::add(&snapshot.model, &snapshot.optimiser, &marching, &mut pack);
    let regions = regions::add(&snapshot.model, &mut pack)?;
    let up = data.as_ref().map_or(UP, |d| scene_region(d).up);
    let document = json!({
        "name": name(folder),
        "up": up.to_array(),
        "middle": run.plan.finest.bounds.cast::<f64>().center().to_array(),
        "start": PageCamera::of(&camera),
        "constants": field.constants,
        "regions": regions,
        "parts": pack.parts,
        "density": field.density,
        "splines": pack.splines,
    });
    let mut packed = GzEncoder::new(Vec::new(), Compression::new(7));
    packed.write_all(&pack.bytes).or_exit(Exit::Io)?;
    let verdict = run.state.verdict.as_ref().map(|verdict| evidence(verdict, folder)).unwrap_or_default();
    let page = page(&name(folder), &document, &packed.finish().or_exit(Exit::Io)?, &still, &verdict);
    write_atomic(out, |f| f.write_all(page.as_bytes()))?;
    Ok(Page { voxels, bytes: page.len() })
}

/// Where the page begins: at the first photograph that was kept aside, or before the box.
fn first_camera(run: &Loaded, data: Option<&Dataset>) -> Camera {
    let view =
        data.and_then(|d| d.split.test.iter().chain(&d.split.train).next().map(|&i| d.views[i].camera));
    let up = data.map_or(UP, |d| scene_region(d).up);
    // The lens of the page has no distortion.
    let camera = start(view, run.plan.finest.bounds.cast(), up).camera();
    camera.unwrap_or_else(|_| unreachable!("a camera that was made here"))
}

/// A JPEG file of what a camera sees.
fn still(run: &Loaded, camera: &Camera) -> Result<Vec<u8>, Failure> {
    let (longest, quality) = PICTURE;
    let factor = (f64::from(longest) / f64::from(camera.width.max(camera.height))).min(1.0);
    let edge = |n: u32| ((f64::from(n) * factor).round() as u32).max(1);
    let camera = camera.resized(edge(camera.width), edge(camera.height));
    let marching = rendering_marching(&run.options, run.plan.near);
    let picture = render(&run.backend, &camera, &marching, &cancel()).or_exit(Exit::Interrupted)?;
    let mut jpeg = Vec::new();
    JpegEncoder::new_with_quality(&mut jpeg, quality)
        .encode(picture.colour.as_flattened(), picture.width, picture.height, image::ExtendedColorType::Rgb8)
        .or_exit(Exit::Io)?;
    Ok(jpeg)
}

/// What was decided about refractive regions, as a part of the page, with the picture that convinced where the run has one.
fn evidence(verdict: &Verdict, folder: &Path) -> String {
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

fn page(name: &str, document: &Value, numbers: &[u8], still: &[u8], verdict: &str) -> String {
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
<main id="stage" tabindex="0" aria-label="The scene. Drag to turn.">
<canvas id="lines"></canvas>
<img id="still" alt="A view of {alt}" src="data:image/jpeg;base64,{still}">
</main>
<aside>
<p id="note" role="status">The scene is unpacked.</p>
<details id="panel" open>
<summary>{name}</summary>
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
