//! What a checkpoint keeps of the clearcoat of opaque things.

use super::tensors::{Tensors, probe_degree, row};
use crate::checkpoint::{CheckpointError, Tensor};
use crate::model::{ClearcoatMoments, Model, Optimiser};
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

impl StoredClearcoat {
    pub(super) fn of(clearcoat: &Clearcoat<f32>) -> Self {
        let (resolution, degree) = (clearcoat.radiance.resolution(), clearcoat.radiance.degree().get());
        Self { ior: clearcoat.ior, resolution, degree }
    }
}

/// Values and moments of both grids.
const PARTS: [&str; 4] = ["strength", "radiance", "strength_moment", "radiance_moment"];

pub(super) fn tensors<'a>(model: &'a Model, optimiser: &'a Optimiser) -> Vec<(String, Tensor<'a>)> {
    let Some(clearcoat) = &model.clearcoat else { return Vec::new() };
    let moments = &optimiser.clearcoat;
    let (strength, radiance) = (&clearcoat.strength.coefficients, &clearcoat.radiance.coefficients);
    let values = [strength, radiance, &moments.strength, &moments.radiance];
    PARTS.iter().zip(values).map(|(part, values)| row(format!("clearcoat.{part}"), values)).collect()
}

/// The clearcoat of a checkpoint whose scene fills `bounds`, and its moments.
pub(super) fn restore(
    stored: Option<&StoredClearcoat>,
    bounds: Aabb<f32>,
    file: &mut Tensors,
) -> Result<(Option<Clearcoat<f32>>, ClearcoatMoments), CheckpointError> {
    let Some(s) = stored else { return Ok((None, ClearcoatMoments::default())) };
    let degree = probe_degree(s.degree, s.resolution);
    let degree = degree.ok_or_else(|| file.wrong("its clearcoat has no valid degree or resolution"))?;
    if !(1.0..=4.0).contains(&s.ior) {
        return Err(file.wrong("the index of its clearcoat is not 1 to 4"));
    }
    let mut values = |part: usize, len| file.f32s(&format!("clearcoat.{}", PARTS[part]), len);
    let strength = ProbeGrid::grey(bounds, s.resolution, ShDegree::new(0).unwrap_or_default());
    let radiance = ProbeGrid::grey(bounds, s.resolution, degree);
    let probes = strength.probes();
    let of_strength = values(0, strength.coefficients.len())?;
    let of_radiance = values(1, radiance.coefficients.len())?;
    let moments = ClearcoatMoments { strength: values(2, probes)?, radiance: values(3, probes)? };
    let filled = |grid: ProbeGrid<f32>, values| {
        grid.with_coefficients(values).ok_or_else(|| file.wrong("its clearcoat is not finite"))
    };
    let (strength, radiance) = (filled(strength, of_strength)?, filled(radiance, of_radiance)?);
    Ok((Some(Clearcoat { ior: s.ior, strength, radiance }), moments))
}
