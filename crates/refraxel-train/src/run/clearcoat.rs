//! What a checkpoint keeps of the clearcoat of opaque things.

use super::probes;
use crate::checkpoint::{CheckpointError, Tensor};
use crate::cpu::{ClearcoatMoments, CpuBackend};
use refraxel_core::radiance::{ProbeGrid, clearcoat::Clearcoat};
use refraxel_core::{Aabb, ShDegree};
use serde::{Deserialize, Serialize};

/// Both grids of probes fill the box of the scene.
#[derive(Serialize, Deserialize)]
pub(super) struct StoredClearcoat {
    ior: f32,
    resolution: [u32; 3],
    degree: u8,
}

/// Tensors of the clearcoat, and the moments of its probes.
const NAMES: [&str; 4] =
    ["clearcoat.strength", "clearcoat.radiance", "clearcoat.strength_moment", "clearcoat.radiance_moment"];

pub(super) fn stored_clearcoat(clearcoat: &Clearcoat<f32>) -> StoredClearcoat {
    let (resolution, degree) = (clearcoat.radiance.resolution(), clearcoat.radiance.degree().get());
    StoredClearcoat { ior: clearcoat.ior, resolution, degree }
}

pub(super) fn clearcoat_tensors(backend: &CpuBackend) -> Vec<(String, Tensor)> {
    let Some(clearcoat) = backend.clearcoat() else { return Vec::new() };
    let moments = &backend.moments().clearcoat;
    let (strength, radiance) = (&clearcoat.strength.coefficients, &clearcoat.radiance.coefficients);
    let values = [strength, radiance, &moments.strength, &moments.radiance];
    probes::tensors(NAMES.map(str::to_owned), values).into()
}

/// The clearcoat of a checkpoint, and its moments; `read` takes a tensor by name and length.
pub(super) fn restore_clearcoat(
    stored: &Option<StoredClearcoat>,
    bounds: Aabb<f32>,
    read: impl FnMut(&str, usize) -> Result<Vec<f32>, CheckpointError>,
    wrong: impl Fn(&str) -> CheckpointError,
) -> Result<(Option<Clearcoat<f32>>, ClearcoatMoments), CheckpointError> {
    let Some(s) = stored else { return Ok((None, ClearcoatMoments::default())) };
    let degree = probes::degree(s.degree, s.resolution);
    let degree = degree.ok_or_else(|| wrong("its clearcoat has no valid degree or resolution"))?;
    if !(1.0..=4.0).contains(&s.ior) {
        return Err(wrong("the index of its clearcoat is not 1 to 4"));
    }
    let strength = ProbeGrid::grey(bounds, s.resolution, ShDegree::new(0).unwrap_or_default());
    let radiance = ProbeGrid::grey(bounds, s.resolution, degree);
    let count = strength.probes();
    let lengths = [strength.coefficients.len(), radiance.coefficients.len(), count, count];
    let [of_strength, of_radiance, strength_moment, radiance_moment] =
        probes::read_tensors((NAMES.map(str::to_owned), lengths), read)?;
    let filled = |grid: ProbeGrid<f32>, values| {
        grid.with_coefficients(values).ok_or_else(|| wrong("its clearcoat is not finite"))
    };
    let (strength, radiance) = (filled(strength, of_strength)?, filled(radiance, of_radiance)?);
    let moments = ClearcoatMoments { strength: strength_moment, radiance: radiance_moment };
    Ok((Some(Clearcoat { ior: s.ior, strength, radiance }), moments))
}
