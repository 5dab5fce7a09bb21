//! What a checkpoint keeps of the coat of opaque things.

use super::probes;
use crate::checkpoint::{CheckpointError, Tensor};
use crate::cpu::{CpuBackend, GlossMoments};
use refraxel_core::radiance::{ProbeGrid, gloss::Gloss};
use refraxel_core::{Aabb, ShDegree};
use serde::{Deserialize, Serialize};

/// Both grids of probes fill the box of the scene.
#[derive(Serialize, Deserialize)]
pub(super) struct StoredGloss {
    ior: f32,
    resolution: [u32; 3],
    degree: u8,
}

/// Tensors of the coat, and the moments of its probes.
const NAMES: [&str; 4] =
    ["gloss.strength", "gloss.radiance", "gloss.strength_moment", "gloss.radiance_moment"];

pub(super) fn stored_gloss(gloss: &Gloss<f32>) -> StoredGloss {
    let (resolution, degree) = (gloss.radiance.resolution(), gloss.radiance.degree().get());
    StoredGloss { ior: gloss.ior, resolution, degree }
}

pub(super) fn gloss_tensors(backend: &CpuBackend) -> Vec<(String, Tensor)> {
    let Some(gloss) = backend.gloss() else { return Vec::new() };
    let moments = &backend.moments().gloss;
    let (strength, radiance) = (&gloss.strength.coefficients, &gloss.radiance.coefficients);
    let values = [strength, radiance, &moments.strength, &moments.radiance];
    probes::tensors(NAMES.map(str::to_owned), values).into()
}

/// The coat of a checkpoint, and its moments; `read` takes a tensor by name and length.
pub(super) fn restore_gloss(
    stored: &Option<StoredGloss>,
    bounds: Aabb<f32>,
    read: impl FnMut(&str, usize) -> Result<Vec<f32>, CheckpointError>,
    wrong: impl Fn(&str) -> CheckpointError,
) -> Result<(Option<Gloss<f32>>, GlossMoments), CheckpointError> {
    let Some(s) = stored else { return Ok((None, GlossMoments::default())) };
    let degree = probes::degree(s.degree, s.resolution);
    let degree = degree.ok_or_else(|| wrong("its coat has no valid degree or resolution"))?;
    if !(1.0..=4.0).contains(&s.ior) {
        return Err(wrong("the index of its coat is not 1 to 4"));
    }
    let strength = ProbeGrid::grey(bounds, s.resolution, ShDegree::new(0).unwrap_or_default());
    let radiance = ProbeGrid::grey(bounds, s.resolution, degree);
    let count = strength.probes();
    let lengths = [strength.coefficients.len(), radiance.coefficients.len(), count, count];
    let [of_strength, of_radiance, strength_moment, radiance_moment] =
        probes::read_tensors((NAMES.map(str::to_owned), lengths), read)?;
    let filled = |grid: ProbeGrid<f32>, values| {
        grid.with_coefficients(values).ok_or_else(|| wrong("its coat is not finite"))
    };
    let (strength, radiance) = (filled(strength, of_strength)?, filled(radiance, of_radiance)?);
    let moments = GlossMoments { strength: strength_moment, radiance: radiance_moment };
    Ok((Some(Gloss { ior: s.ior, strength, radiance }), moments))
}
