//! Renders views and writes their layers.

use super::depth::{Depth, opaque};
use super::refractive::{INDEX_STEPS, Refractive};
use crate::cli::Layer;
use crate::exit::{Exit, Failure};
use crate::progress::{Progress, Show};
use crate::verbs::sheet::{save_image, save_png};
use crate::verbs::{create_folder, interrupted};
use anyhow::anyhow;
use image::ExtendedColorType;
use refraxel_core::Camera;
use refraxel_data::NamedCamera;
use refraxel_train::backend::Marching;
use refraxel_train::evaluate::{Rendering, render, render_reflection, render_transmission};
use refraxel_train::index_edit::index_range;
use refraxel_train::run::Loaded;
use refraxel_train::schedule::rendering_marching;
use refraxel_train::{Backend, CpuBackend};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// What a camera sees, and what it meets that is refractive.
struct Seen<'a> {
    name: &'a str,
    by: (&'a CpuBackend, &'a Camera, &'a Marching),
    rendering: Rendering,
    refractive: Option<Refractive>,
    index_range: [f32; 2],
}

/// True for the layers that need bent rays.
pub fn is_refractive(layer: Layer) -> bool {
    matches!(layer, Layer::Index | Layer::Normal | Layer::SurfaceDepth)
}

/// Renders the cameras and writes their layers.
pub fn render_all(
    run: &mut Loaded,
    cameras: &[NamedCamera],
    (out, layers): (&Path, &[Layer]),
    depth: Depth,
    show: Show,
) -> Result<(), Failure> {
    let marching = rendering_marching(&run.options, run.plan.near);
    run.backend.refresh_occupancy(&marching);
    let (refraction, domain) = (run.backend.refraction(), &run.backend.field().domain);
    let (with_index, index_range) = (layers.iter().any(|&l| is_refractive(l)), index_range(refraction));
    let (mut depth, mut surface_depth) = (depth, depth);
    let mut progress = Progress::new(show, "rendering", cameras.len() as u64);
    for (k, NamedCamera { name, camera }) in cameras.iter().enumerate() {
        if interrupted() {
            let error = anyhow!("stopped after {k} of {} views; those are written", cameras.len());
            return Err(Failure::new(Exit::Interrupted, error));
        }
        let rendering = render(&run.backend, camera, &marching);
        depth.choose_range(opaque(&rendering));
        let refractive = with_index.then(|| Refractive::of(refraction, domain, run.plan.near, camera));
        let by = (&run.backend, camera, &marching);
        if let Some(met) = &refractive {
            surface_depth.choose_range(met.depths());
        }
        let seen = Seen { name, by, rendering, refractive, index_range };
        for &layer in layers {
            seen.write(layer, out, [&depth, &surface_depth])?;
        }
        progress.set(k as u64 + 1, name);
    }
    progress.finish("");
    Ok(())
}

impl Seen<'_> {
    /// Colours lie in the folder itself, every other layer in a folder of its own. Depths are those of what is seen and of
    /// refractive surfaces.
    fn write(&self, layer: Layer, out: &Path, [depth, surface_depth]: [&Depth; 2]) -> Result<(), Failure> {
        let (backend, camera, marching) = self.by;
        let (r, size) = (&self.rendering, [self.rendering.width, self.rendering.height]);
        let path = |folder: &str| -> Result<PathBuf, Failure> {
            create_folder(&out.join(folder))?;
            Ok(out.join(folder).join(format!("{}.png", self.name)))
        };
        match (layer, &self.refractive) {
            (Layer::Colour, _) => save_image(&out.join(format!("{}.png", self.name)), r),
            (Layer::Opacity, _) => {
                let grey: Vec<u8> = r.opacity.iter().map(|&a| refraxel_train::metrics::quantize(a)).collect();
                save_png(&path("opacity")?, &grey, size, ExtendedColorType::L8)
            }
            (Layer::Depth, _) => {
                let (samples, colours) = (depth.samples(r.depth.iter().copied()), depth.colours(opaque(r)));
                save_png(&path("depth")?, &samples, size, ExtendedColorType::L16)?;
                save_png(&path("depth_preview")?, colours.as_flattened(), size, ExtendedColorType::Rgb8)
            }
            (Layer::Index, Some(met)) => {
                save_png(&path("index")?, &met.index_samples(), size, ExtendedColorType::L16)?;
                let sheet = met.index_sheet(self.name, self.index_range);
                Ok(sheet.draw().save_png(&path("index_preview")?)?)
            }
            (Layer::Normal, Some(met)) => save_png(
                &path("normal")?,
                met.normal_colours().as_flattened(),
                size,
                ExtendedColorType::Rgba8,
            ),
            (Layer::Reflection, _) => {
                save_image(&path("reflection")?, &render_reflection(backend, camera, marching))
            }
            (Layer::Transmission, _) => {
                save_image(&path("transmission")?, &render_transmission(backend, camera, marching))
            }
            (Layer::SurfaceDepth, Some(met)) => {
                let samples = surface_depth.samples(met.depths().map(|d| d.unwrap_or(0.0)));
                let colours = surface_depth.colours(met.depths());
                save_png(&path("surface_depth")?, &samples, size, ExtendedColorType::L16)?;
                let preview = path("surface_depth_preview")?;
                save_png(&preview, colours.as_flattened(), size, ExtendedColorType::Rgb8)
            }
            (Layer::Index | Layer::Normal | Layer::SurfaceDepth, None) => Ok(()), // refused before
        }
    }
}

/// The name of a layer on the command line.
pub fn layer_name(layer: Layer) -> &'static str {
    match layer {
        Layer::Colour => "colour",
        Layer::Depth => "depth",
        Layer::Opacity => "opacity",
        Layer::Reflection => "reflection",
        Layer::Transmission => "transmission",
        Layer::Index => "index",
        Layer::Normal => "normal",
        Layer::SurfaceDepth => "surface-depth",
    }
}

/// What the numbers in the pictures mean, for the file about the cameras.
pub fn units(depth_unit: f64, layers: &[Layer]) -> Vec<(&'static str, Value)> {
    let mut units = vec![(
        "depth",
        json!({
            "unit": depth_unit,
            "meaning": "depth/NAME.png holds 16-bit steps of `unit` scene units along the ray; 0: nothing is seen; \
                        65535: that far or farther",
        }),
    )];
    if layers.contains(&Layer::Index) {
        let meaning = "index/NAME.png holds 16-bit steps of `unit` of the index of refraction that differs most from 1 \
                       along the ray, whatever stands before it; 0: nothing refractive is met";
        units.push(("index", json!({ "unit": 1.0 / f64::from(INDEX_STEPS), "meaning": meaning })));
    }
    if layers.contains(&Layer::Normal) {
        let meaning = "normal/NAME.png holds unit normals of the first refractive surface, whatever stands before it: \
                       red, green, blue = 127.5 (1 + component to the right, upwards, towards the camera); \
                       clear: nothing refractive is met";
        units.push(("normal", json!({ "meaning": meaning })));
    }
    if layers.contains(&Layer::SurfaceDepth) {
        let meaning = "surface_depth/NAME.png holds 16-bit steps of `unit` scene units along the ray to the first refractive \
                       surface, whatever stands before it; 0: nothing refractive is met; 65535: that far or farther";
        units.push(("surface_depth", json!({ "unit": depth_unit, "meaning": meaning })));
    }
    units
}
