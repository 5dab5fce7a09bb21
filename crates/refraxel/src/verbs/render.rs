//! `refraxel render`: new views of a run.

mod cameras;
mod depth;

use super::sheet::{save_image, save_png};
use super::{create_folder, interrupted, set_threads, watch_for_interrupts};
use crate::cli::{Layer, RenderArgs};
use crate::console::Console;
use crate::exit::{Exit, Failure, OrExit};
use crate::progress::{Progress, Show};
use anyhow::anyhow;
use cameras::{export, orbit, read};
use depth::Depth;
use image::ExtendedColorType;
use refraxel_data::NamedCamera;
use refraxel_train::checkpoint::write_atomic;
use refraxel_train::evaluate::{Rendering, render};
use refraxel_train::run::{Loaded, load_run};
use refraxel_train::schedule::rendering_marching;
use serde::Serialize;
use std::path::{Path, PathBuf};

#[derive(Serialize)]
struct Report {
    out: PathBuf,
    views: usize,
    layers: Vec<&'static str>,
    /// Poses, intrinsics and the unit of depth.
    cameras: PathBuf,
}

/// The verb.
pub fn run(args: &RenderArgs) -> Result<(), Failure> {
    refuse_films(&args.out)?;
    set_threads(&args.work)?;
    watch_for_interrupts()?;
    let mut run = load_run(&args.run)?;
    let cameras = match (&args.cameras, args.orbit) {
        (Some(file), _) => read(file)?,
        (None, count) => orbit(&run, count.unwrap_or(1) as usize)?,
    };
    create_folder(&args.out)?;
    let show = Show::suited(args.work.quiet || args.work.json);
    let depth = Depth::for_views(&cameras, &run.plan.finest);
    render_all(&mut run, &cameras, (&args.out, &args.outputs), depth, show)?;
    let sidecar = args.out.join("transforms.json");
    let text = serde_json::to_string_pretty(&export(&cameras, depth.unit)).or_exit(Exit::Io)?;
    write_atomic(&sidecar, |f| f.write_all(text.as_bytes()))?;
    let layers = args.outputs.iter().map(|&l| layer_name(l)).collect();
    let report = Report { out: args.out.clone(), views: cameras.len(), layers, cameras: sidecar };
    Console::new(args.work.json).result(&report.text(), &report).or_exit(Exit::Io)
}

fn refuse_films(out: &Path) -> Result<(), Failure> {
    let Some(extension) = out.extension().and_then(|e| e.to_str()) else { return Ok(()) };
    if !["mp4", "gif", "webm", "mov", "mkv", "avi"].contains(&extension.to_lowercase().as_str()) {
        return Ok(());
    }
    let error = anyhow!(
        "--out {}: pictures are written to a folder, not to a film; give a folder such as `{}`, and make the film from its \
         pictures, for example with `ffmpeg -i {}/%04d.png {}`",
        out.display(),
        out.with_extension("").display(),
        out.with_extension("").display(),
        out.display(),
    );
    Err(Failure::new(Exit::Usage, error))
}

fn render_all(
    run: &mut Loaded,
    cameras: &[NamedCamera],
    (out, layers): (&Path, &[Layer]),
    mut depth: Depth,
    show: Show,
) -> Result<(), Failure> {
    let marching = rendering_marching(&run.config, run.plan.near);
    run.backend.refresh_occupancy(&marching);
    let mut progress = Progress::new(show, "rendering", cameras.len() as u64);
    for (k, named) in cameras.iter().enumerate() {
        if interrupted() {
            let error = anyhow!("stopped after {k} of {} views; those are written", cameras.len());
            return Err(Failure::new(Exit::Interrupted, error));
        }
        let rendering = render(&run.backend, &named.camera, &marching);
        depth.choose_range(&rendering);
        for &layer in layers {
            write_layer(layer, &rendering, out, &named.name, &depth)?;
        }
        progress.set(k as u64 + 1, &named.name);
    }
    progress.finish("");
    Ok(())
}

/// Colours lie in the folder itself, every other layer in a folder of its own.
fn write_layer(layer: Layer, r: &Rendering, out: &Path, name: &str, depth: &Depth) -> Result<(), Failure> {
    let size = [r.width, r.height];
    let path = |folder: &str| -> Result<PathBuf, Failure> {
        create_folder(&out.join(folder))?;
        Ok(out.join(folder).join(format!("{name}.png")))
    };
    match layer {
        Layer::Colour => save_image(&out.join(format!("{name}.png")), r),
        Layer::Opacity => {
            let grey: Vec<u8> = r.opacity.iter().map(|&a| refraxel_train::metrics::quantize(a)).collect();
            save_png(&path("opacity")?, &grey, size, ExtendedColorType::L8)
        }
        Layer::Depth => {
            save_png(&path("depth")?, &depth.samples(r), size, ExtendedColorType::L16)?;
            save_png(&path("depth_preview")?, depth.colours(r).as_flattened(), size, ExtendedColorType::Rgb8)
        }
    }
}

fn layer_name(layer: Layer) -> &'static str {
    match layer {
        Layer::Colour => "colour",
        Layer::Depth => "depth",
        Layer::Opacity => "opacity",
    }
}

impl Report {
    fn text(&self) -> String {
        let (views, layers) = (self.views, self.layers.join(", "));
        format!("{views} views ({layers}) in {}; cameras: {}", self.out.display(), self.cameras.display())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn films_are_refused_with_the_way_to_make_one() {
        let failure = refuse_films(Path::new("x/orbit.mp4")).unwrap_err();
        assert_eq!(failure.exit, Exit::Usage);
        assert!(
            failure.report().contains("`ffmpeg -i x/orbit/%04d.png x/orbit.mp4`"),
            "{}",
            failure.report()
        );
        assert!(refuse_films(Path::new("views.d")).is_ok() && refuse_films(Path::new("views")).is_ok());
    }
}
