//! What goes into the page of a run, and the file.

use super::pack::Pack;
use super::still::{first_camera, still};
use super::template::{evidence, page};
use super::{field, regions};
use crate::exit::{Exit, Failure, OrExit};
use crate::verbs::files::write_text;
use crate::verbs::loaded::Loaded;
use crate::verbs::reopen::reopen;
use crate::verbs::view::name;
use crate::viewer::{PageCamera, UP};
use flate2::{Compression, write::GzEncoder};
use refraxel_data::scene_region;
use refraxel_train::Backend;
use refraxel_train::schedule::rendering_marching;
use serde_json::json;
use std::io::Write;
use std::path::Path;

/// What was put into the page.
pub struct Page {
    /// Voxels of the scene in the page.
    pub voxels: usize,
    /// Size of the file [byte].
    pub bytes: usize,
    /// Those of colours [byte].
    pub colours: usize,
}

/// Writes the page of a run.
pub fn write(run: &mut Loaded, folder: &Path, out: &Path) -> Result<Page, Failure> {
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
    let bounds = run.plan.finest.bounds.cast::<f64>();
    let document = json!({
        "name": name(folder),
        "up": up.to_array(),
        "min": bounds.min.to_array(),
        "max": bounds.max.to_array(),
        "start": PageCamera::of(&camera),
        "constants": field.constants,
        "regions": regions,
        "parts": pack.parts,
        "density": field.density,
        "splines": pack.splines,
    });
    let numbers = compressed(&pack.bytes)?;
    let colours = compressed(pack.part("colours"))?.len().div_ceil(3) * 4;
    let verdict = run.state.verdict.as_ref().map(|verdict| evidence(verdict, folder)).unwrap_or_default();
    let page = page(&name(folder), &document, &numbers, &still, &verdict);
    write_text(out, &page)?;
    Ok(Page { voxels, bytes: page.len(), colours })
}

fn compressed(bytes: &[u8]) -> Result<Vec<u8>, Failure> {
    let mut packed = GzEncoder::new(Vec::new(), Compression::best());
    packed.write_all(bytes).or_exit(Exit::Io)?;
    packed.finish().or_exit(Exit::Io)
}
