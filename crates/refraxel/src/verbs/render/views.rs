//! Renders views and writes their layers.

use super::depth::{Depth, opaque};
use super::film::Film;
use super::folder::RenderFolder;
use super::refractive::{INDEX_STEPS, Refractive};
use crate::canvas::write_png;
use crate::cli::Layer;
use crate::colour_map::ColourMap;
use crate::device::ModelViewer;
use crate::exit::{Exit, Failure};
use crate::progress::{Progress, Show};
use crate::verbs::interrupts::cancel;
use crate::verbs::loaded::Loaded;
use image::ExtendedColorType;
use refraxel_core::Camera;
use refraxel_data::{NamedCamera, quantize};
use refraxel_train::backend::Marching;
use refraxel_train::cancel::Cancelled;
use refraxel_train::device::DeviceChoice;
use refraxel_train::evaluation::{Light, Rendering, render_by};
use refraxel_train::model::index_edit::index_range;
use refraxel_train::schedule::rendering_marching;
use refraxel_train::{Backend, CpuBackend};
use serde_json::{Value, json};

/// The views of a render.
pub struct Views<'a> {
    /// What is rendered; nothing when only slices or paths are asked for.
    pub cameras: &'a [NamedCamera],
    /// What is written of each camera.
    pub layers: &'a [Layer],
    /// How depths are written.
    pub depth: Depth,
    /// What renders.
    pub device: DeviceChoice,
}

/// The depth scales of a render: for opaque things, and for refractive surfaces.
struct Depths {
    seen: Depth,
    surface: Depth,
}

/// What a camera sees, and the refractive things that its rays meet.
struct Seen<'a> {
    name: &'a str,
    camera: &'a Camera,
    view: View<'a>,
    rendering: Rendering,
    refractive: Option<Refractive>,
    index_range: [f32; 2],
}

/// What renders the cameras of a run.
#[derive(Clone, Copy)]
struct View<'a> {
    viewer: &'a ModelViewer,
    backend: &'a CpuBackend,
    marching: &'a Marching,
}

impl View<'_> {
    fn of(&self, camera: &Camera, light: Light) -> Result<Rendering, Failure> {
        let Self { viewer, backend, marching } = self;
        let seen = render_by(*backend, camera, &cancel(), |rays| {
            light.of(rays, |rays, layers| viewer.render(backend, rays, marching, layers))
        });
        seen.map_err(stopped)
    }
}

/// True for the layers that need bent rays.
pub fn is_refractive(layer: Layer) -> bool {
    matches!(layer, Layer::Index | Layer::Normal | Layer::SurfaceDepth)
}

/// The folders that hold a layer, relative to the folder of the render; colours lie in that folder itself.
fn folders(layer: Layer) -> Vec<String> {
    if layer == Layer::Colour {
        return vec![String::new()];
    }
    let name = layer.name().replace('-', "_");
    let has_preview = matches!(layer, Layer::Depth | Layer::Index | Layer::SurfaceDepth);
    let preview = has_preview.then(|| format!("{name}_preview/"));
    [format!("{name}/")].into_iter().chain(preview).collect()
}

impl Views<'_> {
    /// The size of all views, which the frames of a film need to have.
    pub fn common_size(&self) -> Result<[u32; 2], Failure> {
        let size = |c: &NamedCamera| [c.camera.width, c.camera.height];
        let first = self
            .cameras
            .first()
            .map(size)
            .ok_or_else(|| Exit::BadInput.because("there are no cameras for a film"))?;
        match self.cameras.iter().find(|c| size(c) != first) {
            None => Ok(first),
            Some(other) => Err(Exit::BadInput.because(format!(
                "the cameras of a film need one size; found {first:?} and, of {}, {:?} pixels; give --size WxH",
                other.name,
                size(other)
            ))),
        }
    }

    /// The pictures that [`render_all`] will write, relative to the folder of the render.
    pub fn pictures(&self) -> impl Iterator<Item = String> {
        let folders = || self.layers.iter().flat_map(|&layer| folders(layer));
        self.cameras.iter().flat_map(move |c| folders().map(move |folder| format!("{folder}{}.png", c.name)))
    }
}

/// Renders the cameras and writes their layers.
pub fn render_all(
    run: &mut Loaded,
    views: &Views<'_>,
    folder: &mut RenderFolder,
    show: Show,
) -> Result<(), Failure> {
    see_all(run, views, show, |seen, depths| {
        views.layers.iter().try_for_each(|&layer| seen.write(layer, depths, folder))
    })
}

/// Renders the cameras and adds their first layer to a film.
pub fn film_all(run: &mut Loaded, views: &Views<'_>, film: &mut Film, show: Show) -> Result<(), Failure> {
    see_all(run, views, show, |seen, depths| {
        views
            .layers
            .iter()
            .take(1)
            .try_for_each(|&layer| film.add(seen.colours(layer, depths)?.into_flattened()))
    })
}

/// Renders the cameras one after the other.
fn see_all(
    run: &mut Loaded,
    views: &Views<'_>,
    show: Show,
    mut each: impl FnMut(&Seen<'_>, &Depths) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let marching = rendering_marching(&run.options, run.plan.near);
    run.backend.refresh_occupancy(&marching);
    let viewer = ModelViewer::open(views.device, &run.backend, &marching, show)?;
    let view = View { viewer: &viewer, backend: &run.backend, marching: &marching };
    let (refraction, domain) = (run.backend.medium(), run.backend.domain());
    let with_index = views.layers.iter().any(|&l| is_refractive(l));
    let index_range = index_range(refraction);
    let mut depths = Depths { seen: views.depth, surface: views.depth };
    let count = views.cameras.len();
    let mut progress = Progress::new(show, "rendering", count as u64);
    for (k, NamedCamera { name, camera }) in views.cameras.iter().enumerate() {
        let rendering = view.of(camera, Light::All)?;
        depths.seen.choose_range(opaque(&rendering));
        let refractive = with_index.then(|| Refractive::of(refraction, domain, run.plan.near, camera));
        if let Some(met) = &refractive {
            depths.surface.choose_range(met.depths());
        }
        each(&Seen { name, camera, view, rendering, refractive, index_range }, &depths)?;
        progress.set(k as u64 + 1, name);
    }
    progress.finish("");
    Ok(())
}

fn stopped(_: Cancelled) -> Failure {
    Exit::Interrupted.because(
        "stopped before all views were rendered; finished pictures are written, and the same command with --overwrite starts \
         anew",
    )
}

impl Seen<'_> {
    /// Writes the pictures of a layer, in the order of its [`folders`].
    fn write(&self, layer: Layer, depths: &Depths, folder: &mut RenderFolder) -> Result<(), Failure> {
        let r = &self.rendering;
        let size = [r.width as usize, r.height as usize];
        let mut save = |k: usize, pixels: &[u8], size: [usize; 2], kind: ExtendedColorType| {
            let file = format!("{}{}.png", folders(layer)[k], self.name);
            folder.write(&file, |path| Ok(write_png(path, pixels, size, kind)?)).map(drop)
        };
        match (layer, &self.refractive) {
            (Layer::Colour | Layer::Reflection | Layer::Transmission, _) => {
                save(0, self.colours(layer, depths)?.as_flattened(), size, ExtendedColorType::Rgb8)
            }
            (Layer::Opacity, _) => {
                let grey: Vec<u8> = r.opacity.iter().map(|&a| quantize(a)).collect();
                save(0, &grey, size, ExtendedColorType::L8)
            }
            (Layer::Depth, _) => {
                let samples = depths.seen.samples(r.depth.iter().copied());
                save(0, &samples, size, ExtendedColorType::L16)?;
                save(1, self.colours(layer, depths)?.as_flattened(), size, ExtendedColorType::Rgb8)
            }
            (Layer::Index, Some(met)) => {
                save(0, &met.index_samples(), size, ExtendedColorType::L16)?;
                let page = met.index_sheet(self.name, self.index_range).draw();
                let size = [page.width(), page.height()];
                save(1, page.pixels().as_flattened(), size, ExtendedColorType::Rgb8)
            }
            (Layer::Normal, Some(met)) => {
                save(0, met.normal_colours().as_flattened(), size, ExtendedColorType::Rgba8)
            }
            (Layer::SurfaceDepth, Some(met)) => {
                let samples = depths.surface.samples(met.depths().map(|d| d.unwrap_or(0.0)));
                save(0, &samples, size, ExtendedColorType::L16)?;
                save(1, self.colours(layer, depths)?.as_flattened(), size, ExtendedColorType::Rgb8)
            }
            (Layer::Index | Layer::Normal | Layer::SurfaceDepth, None) => Ok(()), // refused before
        }
    }

    /// The colours of a layer, as people look at it.
    fn colours(&self, layer: Layer, depths: &Depths) -> Result<Vec<[u8; 3]>, Failure> {
        let r = &self.rendering;
        Ok(match (layer, &self.refractive) {
            (Layer::Colour, _) => r.colour.clone(),
            (Layer::Opacity, _) => r.opacity.iter().map(|&a| [quantize(a); 3]).collect(),
            (Layer::Depth, _) => depths.seen.preview(r),
            (Layer::Reflection, _) => self.view.of(self.camera, Light::Reflected)?.colour,
            (Layer::Transmission, _) => self.view.of(self.camera, Light::Transmitted)?.colour,
            (Layer::Index, Some(met)) => {
                let [low, high] = self.index_range;
                let colour = |n: f32| ColourMap::Viridis.at((n - low) / (high - low).max(1e-3));
                met.met().iter().map(|met| met.map_or([255; 3], |met| colour(met.index))).collect()
            }
            (Layer::Normal, Some(met)) => {
                let over_white = |[r, g, b, a]: [u8; 4]| if a == 0 { [255; 3] } else { [r, g, b] };
                met.normal_colours().into_iter().map(over_white).collect()
            }
            (Layer::SurfaceDepth, Some(met)) => depths.surface.colours(met.depths()),
            (Layer::Index | Layer::Normal | Layer::SurfaceDepth, None) => r.colour.clone(), // refused before
        })
    }
}

/// The units of the pictures, for the file about the cameras.
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
                       along the ray, also behind opaque things; 0: no refractive medium is met";
        units.push(("index", json!({ "unit": 1.0 / f64::from(INDEX_STEPS), "meaning": meaning })));
    }
    if layers.contains(&Layer::Normal) {
        let meaning = "normal/NAME.png holds unit normals of the first refractive surface, also behind opaque things: \
                       red, green and blue are 127.5 (1 + component), for the components to the right, upwards and \
                       towards the camera; clear: no refractive medium is met";
        units.push(("normal", json!({ "meaning": meaning })));
    }
    if layers.contains(&Layer::SurfaceDepth) {
        let meaning = "surface_depth/NAME.png holds 16-bit steps of `unit` scene units along the ray to the first refractive \
                       surface, also behind opaque things; 0: no refractive medium is met; 65535: that far or farther";
        units.push(("surface_depth", json!({ "unit": depth_unit, "meaning": meaning })));
    }
    units
}
