//! How a model comes to bend its rays: find what is refractive, search its index, and clear what straight rays left
//! inside.
//!
//! At this point straight rays have learned everything that is seen beside the refractive things. Then:
//! 1. Views say where refractive things can be (`regions`): the visual hull of the masks, a box, or a file.
//! 2. One index per region is searched by the error of the rays inside the masks (`search`): the scene around is known by
//!    now, so the right index shows it in the right places. The error has one minimum, which a gradient from n = 1 never
//!    finds. The same error says whether the index jumps at the surface or rises towards the middle.
//! 3. Haze that straight rays left inside is cleared.
//!
//! From there shape and index learn by their gradients, first alone and then together with everything else.

mod facets;
mod ground;
mod regions;
mod search;

use crate::backend::Backend;
use crate::cpu::CpuBackend;
use crate::initial::LocateError;
use crate::options::{Options, Switch};
use crate::rays::RaySampler;
use crate::refraction::Refraction;
use crate::schedule::training_marching;
use refraxel_core::Medium;
use regions::Region;
use search::Judge;
use std::path::Path;

/// Why nothing can bend.
#[derive(Debug, thiserror::Error)]
pub enum RecipeError {
    /// Neither masks nor a box.
    #[error(
        "nothing says what is refractive: the dataset has no masks of refractive things; give masks, or a box with \
         --refraction-box x0,y0,z0,x1,y1,z1, or train with --refraction off"
    )]
    Nowhere,
    /// Masks that lead nowhere.
    #[error(transparent)]
    Locate(#[from] LocateError),
    /// A file that gives no index.
    #[error("cannot start from {path}: {problem}")]
    File {
        /// The file.
        path: String,
        /// What is wrong.
        problem: String,
    },
}

/// Finds out before training whether something says what is refractive; `masked`: the dataset has masks of it.
pub fn check(options: &Options, masked: bool) -> Result<(), RecipeError> {
    if options.refraction.bend == Switch::Off {
        return Ok(());
    }
    let named = regions::index_source(options)?.is_some() || options.refraction.aabb().is_some();
    if named || masked { Ok(()) } else { Err(RecipeError::Nowhere) }
}

/// How the index of a region varies, before it learns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Profile {
    /// One index, which jumps at the surface.
    Sharp,
    /// One index, with a transition of some voxels.
    Smooth,
    /// w = n²/2 rises from ½ at the surface to its largest value in the middle, as a parabola of the depth.
    Graded,
}

/// A region with the profile and index that it starts from.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Start {
    profile: Profile,
    index: f32,
    /// Thickness of the wall of a hollow body [its depth]; 1 for a solid one.
    wall: f32,
    /// A search found it; else it is a guess, or known.
    searched: bool,
}

/// Let rays bend from now on; says what was found.
pub fn begin(
    backend: &mut CpuBackend,
    sampler: &RaySampler,
    options: &Options,
    near: f32,
) -> Result<Vec<String>, RecipeError> {
    let regions = regions::find(backend, sampler, options, near)?;
    let mut events: Vec<String> = regions.iter().enumerate().map(|(k, r)| r.describe(k)).collect();
    backend.set_density(options.refraction.contents_density, |x| regions.iter().any(|r| r.is_inside(x)));
    backend.refresh_occupancy(&training_marching(options, near));
    let judge = Judge::new(sampler, options, near);
    let (starts, said) = search::starts(backend, &regions, &judge, options);
    events.extend(said);
    let mut found = refraction(&regions, &starts, options);
    for (k, (region, start)) in regions.iter().zip(&starts).enumerate() {
        let grid = found.medium.region_mut(k);
        if let Some(coarser) = region.for_learning(start, grid, options) {
            *grid = coarser;
        }
    }
    found.find_flat_cells();
    backend.set_refraction(found);
    Ok(events)
}

/// What a file (scene.json, volume, mesh) says of the index, on a grid with about this many nodes along its longest edge. A body
/// of one index has a sharp surface. Of a mesh, the index is `index_guess`.
pub fn stated(path: &Path, nodes: u32, options: &Options) -> Result<Refraction, RecipeError> {
    let (region, start) = regions::stated(path, nodes, options)?;
    let mut stated = refraction(&[region], &[start], options);
    stated.find_flat_cells();
    Ok(stated)
}

/// The refraction that regions start from.
fn refraction(regions: &[Region], starts: &[Start], options: &Options) -> Refraction {
    let grids = regions.iter().zip(starts).map(|(r, s)| r.grid(s, options)).collect();
    let medium = Medium::new(grids).unwrap_or_else(|e| unreachable!("regions were made apart: {e}"));
    let optics = options.optics();
    let states = regions.iter().zip(starts).map(|(r, s)| r.states(s)).collect();
    Refraction { medium, optics, states }
}
