//! `refraxel eval`: render a split of a run and score it.

use super::{create_folder, interrupted, load_photos, reopen, set_threads, watch_for_interrupts};
use crate::cli::{EvalArgs, SplitName};
use crate::console::Console;
use crate::exit::{Exit, Failure, OrExit};
use crate::picture::{Comparison, Content, Panel};
use crate::progress::{Progress, Show};
use anyhow::{Context, anyhow};
use refraxel_data::{Backdrop, Dataset};
use refraxel_train::checkpoint::write_atomic;
use refraxel_train::evaluate::{Rendering, render, score, truth};
use refraxel_train::metrics::{ImageScore, Rgb8, Scores};
use refraxel_train::run::{Loaded, load_run};
use refraxel_train::schedule::rendering_marching;
use std::path::{Path, PathBuf};

/// Rows of the picture that `eval` draws.
const PICTURED: usize = 6;
/// Error, in 8-bit steps, that gets the brightest colour.
const FULL_ERROR: u8 = 64;

/// The verb.
pub fn run(args: &EvalArgs) -> Result<(), Failure> {
    set_threads(&args.work)?;
    watch_for_interrupts()?;
    let show = Show::suited(args.work.quiet || args.work.json);
    evaluate(&args.run, args.split, Console::new(args.work.json), show)
}

/// The name of a split in files.
pub fn split_name(split: SplitName) -> &'static str {
    match split {
        SplitName::Train => "train",
        SplitName::Val => "val",
        SplitName::Test => "test",
    }
}

/// The views of a split.
pub fn split_views(data: &Dataset, split: SplitName) -> &[usize] {
    match split {
        SplitName::Train => &data.split.train,
        SplitName::Val => &data.split.val,
        SplitName::Test => &data.split.test,
    }
}

/// Render and score a split of a run; write pictures and metrics; print the result.
pub fn evaluate(run_folder: &Path, split: SplitName, console: Console, show: Show) -> Result<(), Failure> {
    let mut run = load_run(run_folder)?;
    let data = reopen(&run)?;
    let indices = split_views(&data, split).to_vec();
    if indices.is_empty() {
        let error = anyhow!(
            "{} has no {} images to evaluate; hold some out with --holdout, or evaluate --split train",
            run.source.path.display(),
            split_name(split)
        );
        return Err(Failure::new(Exit::BadInput, error));
    }
    let out = run_folder.join("eval").join(split_name(split));
    create_folder(&out)?;
    let scores = render_and_score(&mut run, &data, &indices, &out, show)?;
    let text = serde_json::to_string_pretty(&scores).or_exit(Exit::Io)?;
    write_atomic(&out.join("metrics.json"), |f| f.write_all(text.as_bytes()))?;
    console.result(&summary(&scores, split, &out), &scores).or_exit(Exit::Io)
}

fn render_and_score(
    run: &mut Loaded,
    data: &Dataset,
    indices: &[usize],
    out: &Path,
    show: Show,
) -> Result<Scores, Failure> {
    let marching = rendering_marching(&run.config, run.plan.near);
    run.backend.refresh_occupancy(&marching);
    let photos = load_photos(data, indices, show)?;
    let mut progress = Progress::new(show, "rendering", indices.len() as u64);
    let (mut scores, mut rows): (Vec<ImageScore>, Vec<(Rendering, Vec<[u8; 3]>)>) = Default::default();
    for (k, (&i, photo)) in indices.iter().zip(&photos).enumerate() {
        if interrupted() {
            return Err(Failure::new(Exit::Interrupted, anyhow!("stopped before all images were rendered")));
        }
        let view = &data.views[i];
        let rendering = render(&run.backend, &view.camera, &marching);
        scores.push(score(&rendering, view, photo, run.plan.backdrop)?);
        save_image(&png_path(out, &view.name), &rendering)?;
        if k % indices.len().div_ceil(PICTURED) == 0 {
            rows.push((rendering, truth(photo, run.plan.backdrop)));
        }
        progress.set(k as u64 + 1, &format!("{:.2} dB", scores[k].psnr));
    }
    draw_comparison(&rows, &scores, indices.len().div_ceil(PICTURED), out)?;
    progress.finish("");
    Ok(Scores::new(scores))
}

/// Truth, rendering and error side by side, for a few images.
fn draw_comparison(
    rows: &[(Rendering, Vec<[u8; 3]>)],
    scores: &[ImageScore],
    stride: usize,
    out: &Path,
) -> Result<(), Failure> {
    let panels = rows.iter().enumerate().map(|(k, (r, truth))| {
        let size = (r.width as usize, r.height as usize);
        let (truth, mine) = (Rgb8::new(truth, size.0, size.1), Rgb8::new(&r.colour, size.0, size.1));
        let s = &scores[k * stride];
        vec![
            Panel { content: Content::Image(truth), note: s.name.clone() },
            Panel { content: Content::Image(mine), note: format!("{:.2} dB", s.psnr) },
            Panel { content: Content::Error(mine, truth), note: String::new() },
        ]
    });
    let picture = Comparison {
        title: String::new(),
        columns: ["truth", "rendering", "error"].map(str::to_owned).to_vec(),
        rows: panels.collect(),
        full_error: FULL_ERROR,
    };
    let path = out.with_file_name(format!("{}.png", out.file_name().unwrap_or_default().to_string_lossy()));
    picture
        .draw()
        .save_png(&path)
        .with_context(|| format!("cannot write {}", path.display()))
        .or_exit(Exit::Io)
}

/// `r_0.png` for `r_0.png`, `IMG_1.png` for `IMG_1.jpg`.
pub fn png_path(folder: &Path, name: &str) -> PathBuf {
    folder.join(name).with_extension("png")
}

/// Write a rendering as PNG, atomically.
pub fn save_image(path: &Path, r: &Rendering) -> Result<(), Failure> {
    save_png(path, r.colour.as_flattened(), [r.width, r.height], image::ExtendedColorType::Rgb8)
}

/// Write pixels as PNG, atomically.
pub fn save_png(
    path: &Path,
    pixels: &[u8],
    [width, height]: [u32; 2],
    colour: image::ExtendedColorType,
) -> Result<(), Failure> {
    use image::ImageEncoder;
    Ok(write_atomic(path, |f| {
        let encoder = image::codecs::png::PngEncoder::new(f);
        encoder.write_image(pixels, width, height, colour).map_err(std::io::Error::other)
    })?)
}

fn summary(s: &Scores, split: SplitName, out: &Path) -> String {
    let optional = |name: &str, v: Option<f64>| v.map_or(String::new(), |v| format!("  {name} {v:.2} dB"));
    let ssim = s.ssim.map_or(String::new(), |v| format!("  SSIM {v:.4}"));
    format!(
        "{} {} images: PSNR {:.2} dB{}{ssim}{}{}\n{}\npictures: {}, scores: {}",
        s.images,
        split_name(split),
        s.psnr.unwrap_or(f64::INFINITY),
        String::new(),
        optional("inside masks", s.psnr_inside),
        optional("outside", s.psnr_outside),
        s.protocol,
        out.with_extension("png").display(),
        out.join("metrics.json").display(),
    )
}

/// What was behind the pictures, for people.
pub fn backdrop_name(backdrop: Backdrop) -> &'static str {
    match backdrop {
        Backdrop::Transparent => "transparent (evaluated on white)",
        Backdrop::Color(_) => "one colour",
        Backdrop::Surroundings => "surroundings, learned",
    }
}
