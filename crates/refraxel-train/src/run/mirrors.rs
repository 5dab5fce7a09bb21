//! What a checkpoint keeps of the mirrors.

use super::probes;
use crate::checkpoint::{CheckpointError, Tensor};
use crate::cpu::{CpuBackend, MirrorMoments};
use crate::reflection::{Mirror, MirrorSource, Reflection};
use crate::refraction::Refraction;
use refraxel_core::radiance::ProbeGrid;
use serde::{Deserialize, Serialize};

#[derive(Default, Serialize, Deserialize)]
pub(super) struct StoredReflection {
    source: MirrorSource,
    mirrors: Vec<StoredMirror>,
}

/// Both caches fill the box of their region.
#[derive(Serialize, Deserialize)]
struct StoredMirror {
    strength: f32,
    strength_moment: f32,
    resolution: [u32; 3],
    degree: u8,
}

/// Tensors of a mirror: both caches, and the moments of their probes.
const NAMES: [&str; 4] = ["outer", "inner", "outer_moment", "inner_moment"];

fn names(region: usize) -> [String; 4] {
    NAMES.map(|part| format!("reflection.{region}.{part}"))
}

pub(super) fn stored_reflection(backend: &CpuBackend) -> StoredReflection {
    let mirrors = backend.reflection().mirrors.iter().zip(&backend.moments().reflection);
    let stored = |(mirror, moments): (&Mirror, &MirrorMoments)| StoredMirror {
        strength: mirror.strength,
        strength_moment: moments.strength,
        resolution: mirror.outer.resolution(),
        degree: mirror.outer.degree().get(),
    };
    StoredReflection { source: backend.reflection().source, mirrors: mirrors.map(stored).collect() }
}

pub(super) fn reflection_tensors(backend: &CpuBackend) -> Vec<(String, Tensor)> {
    let mirrors = backend.reflection().mirrors.iter().zip(&backend.moments().reflection).enumerate();
    let of = |(k, (mirror, moments)): (usize, (&Mirror, &MirrorMoments))| {
        let (outer, inner) = (&mirror.outer.coefficients, &mirror.inner.coefficients);
        let values = [outer, inner, &moments.outer, &moments.inner];
        probes::tensors(names(k), values)
    };
    mirrors.flat_map(of).collect()
}

/// The mirrors of a checkpoint, and their moments; `read` takes a tensor by name and length.
pub(super) fn restore_reflection(
    stored: &StoredReflection,
    refraction: &Refraction,
    mut read: impl FnMut(&str, usize) -> Result<Vec<f32>, CheckpointError>,
    wrong: impl Fn(&str) -> CheckpointError,
) -> Result<(Reflection, Vec<MirrorMoments>), CheckpointError> {
    let regions = refraction.medium.regions();
    if !stored.mirrors.is_empty() && stored.mirrors.len() != regions.len() {
        return Err(wrong("it has not as many mirrors as refractive regions"));
    }
    let (mut reflection, mut moments) =
        (Reflection { source: stored.source, mirrors: Vec::new() }, Vec::new());
    for (k, (s, region)) in stored.mirrors.iter().zip(regions).enumerate() {
        let degree = probes::degree(s.degree, s.resolution);
        let degree = degree.ok_or_else(|| wrong("a radiance cache has no valid degree or resolution"))?;
        if !(0.0..=1.0).contains(&s.strength) {
            return Err(wrong("a mirror's strength is not 0 to 1"));
        }
        let grey = ProbeGrid::grey(region.domain().bounds, s.resolution, degree);
        let (coefficients, count) = (grey.coefficients.len(), grey.probes());
        let lengths = [coefficients, coefficients, count, count];
        let [outer, inner, outer_moment, inner_moment] =
            probes::read_tensors((names(k), lengths), &mut read)?;
        let cache = |values| {
            let cache = grey.clone().with_coefficients(values);
            cache.ok_or_else(|| wrong("a radiance cache is not finite"))
        };
        let (outer, inner) = (cache(outer)?, cache(inner)?);
        reflection.mirrors.push(Mirror { strength: s.strength, outer, inner });
        moments.push(MirrorMoments { strength: s.strength_moment, outer: outer_moment, inner: inner_moment });
    }
    Ok((reflection, moments))
}
