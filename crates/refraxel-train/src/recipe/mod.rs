//! How a model comes to bend its rays: find what is refractive, search its index, and clear what straight rays left
//! inside.
//!
//! At this point straight rays have learned everything that is seen beside the refractive things. Then:
//! 1. Views say where refractive things can be (`find`): the visual hull of the masks, a box, or a known index.
//! 2. One index per region is searched by the error of the rays inside the masks (`search`): the scene around is known by
//!    now, so the right index shows it in the right places. The error has one minimum, which a gradient from n = 1 never
//!    finds. The same error says whether the index jumps at the surface or rises towards the middle.
//! 3. Haze that straight rays left inside is cleared.
//!
//! From there shape and index learn by their gradients, first alone and then together with everything else.

mod facets;
mod find;
mod ground;
mod hull;
mod known;
mod region;
mod search;
mod silhouettes;

pub use known::known_refraction;

use crate::backend::{Backend, BrickMask};
use crate::cancel::Cancelled;
use crate::events::Watch;
use crate::initial::{LocateError, Profile};
use crate::model::Refraction;
use crate::options::{Options, StartShape, Switch};
use crate::rays::RaySampler;
use crate::schedule::training_marching;
use refraxel_core::Medium;
use refraxel_data::{Dataset, IndexSource, MaskMeaning};
use region::Region;

/// Why nothing can bend.
#[derive(Debug, thiserror::Error)]
pub enum RecipeError {
    /// Neither masks nor a box.
    #[error(
        "nothing says what is refractive: the dataset has no masks of refractive things; give masks, or a box with \
         --refraction-box x0,y0,z0,x1,y1,z1, or train with --refraction off"
    )]
    Nowhere,
    /// The shape is to come from a file, and there is none.
    #[error("option `shape.start` is `file`, but no index is given; name its file with --index-from")]
    NoFile,
    /// Masks that lead nowhere.
    #[error(transparent)]
    Locate(#[from] LocateError),
    /// Somebody wished to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Finds out before training whether something says what is refractive; `masked`: the dataset has masks of it.
pub fn check(options: &Options, masked: bool, index: Option<&IndexSource>) -> Result<(), RecipeError> {
    if options.refraction.bend == Switch::Off {
        return Ok(());
    }
    if options.shape.start == StartShape::File && index.is_none() {
        return Err(RecipeError::NoFile);
    }
    let named = index.is_some() || options.refraction.aabb().is_some();
    if named || masked { Ok(()) } else { Err(RecipeError::Nowhere) }
}

/// Whether some training view has a mask of what is refractive.
pub fn has_masks(data: &Dataset) -> bool {
    let mut views = data.split.train.iter().map(|&i| &data.views[i]);
    views.any(|v| v.has_mask() && v.mask_meaning == MaskMeaning::Refractive)
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

/// What is known when rays begin to bend.
#[derive(Clone, Copy)]
pub struct Known<'a> {
    /// The photographs.
    pub sampler: &'a RaySampler,
    /// The options.
    pub options: &'a Options,
    /// Nothing nearer to a camera is seen [scene unit].
    pub near: f32,
    /// The index, where somebody knows it.
    pub index: Option<&'a IndexSource>,
}

/// Let rays bend from now on. After an error the backend's model is half changed: load it again.
pub fn begin<B: Backend>(backend: &mut B, known: &Known, watch: &mut Watch) -> Result<(), RecipeError> {
    let options = known.options;
    let regions = find::find(backend, known, watch)?;
    regions.iter().enumerate().for_each(|(k, r)| watch.tell(r.found(k)));
    let inside = BrickMask::new(backend.domain(), backend.map(), |x| regions.iter().any(|r| r.is_inside(x)));
    backend.set_density(options.refraction.contents_density, &inside);
    backend.refresh_occupancy(&training_marching(options, known.near));
    let starts = search::starts(backend, &regions, known, watch)?;
    let mut found = refraction(&regions, &starts, options);
    for (k, (region, start)) in regions.iter().zip(&starts).enumerate() {
        let grid = found.medium.region_mut(k);
        if let Some(coarser) = region.for_learning(start, grid, options) {
            *grid = coarser;
        }
    }
    found.find_flat_cells();
    backend.set_medium(found);
    Ok(())
}

/// The refraction that regions start from.
fn refraction(regions: &[Region], starts: &[Start], options: &Options) -> Refraction {
    let grids = regions.iter().zip(starts).map(|(r, s)| r.grid(s, options)).collect();
    let medium = Medium::new(grids).unwrap_or_else(|e| unreachable!("regions were made apart: {e}"));
    let states = regions.iter().zip(starts).map(|(r, s)| r.state(s)).collect();
    Refraction { medium, optics: options.optics(), states }
}
