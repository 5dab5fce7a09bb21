//! What a checkpoint keeps of the mirrors.

use super::tensors::{Tensors, probe_degree, row};
use crate::checkpoint::{CheckpointError, Tensor};
use crate::model::{Mirror, MirrorMoments, MirrorSource, Model, Optimiser, Reflection, Refraction};
use refraxel_core::IndexGrid;
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
const PARTS: [&str; 4] = ["outer", "inner", "outer_moment", "inner_moment"];

fn name(region: usize, part: usize) -> String {
    format!("reflection.{region}.{}", PARTS[part])
}

impl StoredReflection {
    pub(super) fn of(reflection: &Reflection, moments: &[MirrorMoments]) -> Self {
        let stored = |(mirror, moments): (&Mirror, &MirrorMoments)| StoredMirror {
            strength: mirror.strength,
            strength_moment: moments.strength,
            resolution: mirror.outer.resolution(),
            degree: mirror.outer.degree().get(),
        };
        let mirrors = reflection.mirrors.iter().zip(moments).map(stored).collect();
        Self { source: reflection.source, mirrors }
    }
}

pub(super) fn tensors<'a>(model: &'a Model, optimiser: &'a Optimiser) -> Vec<(String, Tensor<'a>)> {
    let mirrors = model.reflection.mirrors.iter().zip(&optimiser.reflection).enumerate();
    let of = |(k, (mirror, moments)): (usize, (&'a Mirror, &'a MirrorMoments))| {
        let (outer, inner) = (&mirror.outer.coefficients, &mirror.inner.coefficients);
        let values = [outer, inner, &moments.outer, &moments.inner];
        (0..PARTS.len()).map(|part| row(name(k, part), values[part])).collect::<Vec<_>>()
    };
    mirrors.flat_map(of).collect()
}

/// The mirrors of a checkpoint, and their moments.
pub(super) fn restore(
    stored: &StoredReflection,
    refraction: &Refraction,
    file: &mut Tensors,
) -> Result<(Reflection, Vec<MirrorMoments>), CheckpointError> {
    let regions = refraction.medium.regions();
    if !stored.mirrors.is_empty() && stored.mirrors.len() != regions.len() {
        return Err(file.wrong("it has not as many mirrors as refractive regions"));
    }
    let (mut mirrors, mut moments) = (Vec::new(), Vec::new());
    for (k, (s, region)) in stored.mirrors.iter().zip(regions).enumerate() {
        let (mirror, of_mirror) = restore_one(s, k, region, file)?;
        mirrors.push(mirror);
        moments.push(of_mirror);
    }
    Ok((Reflection { source: stored.source, mirrors }, moments))
}

fn restore_one(
    s: &StoredMirror,
    k: usize,
    region: &IndexGrid<f32>,
    file: &mut Tensors,
) -> Result<(Mirror, MirrorMoments), CheckpointError> {
    let degree = probe_degree(s.degree, s.resolution);
    let degree = degree.ok_or_else(|| file.wrong("a radiance cache has no valid degree or resolution"))?;
    if !(0.0..=1.0).contains(&s.strength) {
        return Err(file.wrong("a mirror's strength is not 0 to 1"));
    }
    let grey = ProbeGrid::grey(region.domain().bounds, s.resolution, degree);
    let (coefficients, probes) = (grey.coefficients.len(), grey.probes());
    let mut values = |part: usize, len| file.f32s(&name(k, part), len);
    let (outer, inner) = (values(0, coefficients)?, values(1, coefficients)?);
    let moments =
        MirrorMoments { strength: s.strength_moment, outer: values(2, probes)?, inner: values(3, probes)? };
    let cache = |values| {
        let cache: Option<ProbeGrid<f32>> = grey.clone().with_coefficients(values);
        cache.ok_or_else(|| file.wrong("a radiance cache is not finite"))
    };
    Ok((Mirror { strength: s.strength, outer: cache(outer)?, inner: cache(inner)? }, moments))
}
