//! What a checkpoint keeps of the index of refraction: per region its grid, its surface, and what belongs to them.

use super::boxes::{bounds_of, is_box};
use super::tensors::{Tensors, row};
use crate::checkpoint::{CheckpointError, Tensor, TensorData};
use crate::model::polyhedron::{Plane, Polyhedron, cut_by};
use crate::model::{AdamMoments, Gate, IndexMoments, Model, Optimiser, Refraction, RegionState};
use crate::options::Options;
use refraxel_core::{Domain, Extent, IndexGrid, Interpolation, LevelSet, Medium};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

#[derive(Serialize, Deserialize)]
pub(super) struct StoredRegion {
    bounds: [[f32; 3]; 2],
    resolution: [u32; 3],
    /// Nodes of its level set, where it has a surface.
    surface_resolution: Option<[u32; 3]>,
    /// The index that a search found.
    searched: Option<f32>,
    /// Its index does not learn.
    #[serde(default)]
    fixed_index: bool,
    /// Its surface does not learn.
    #[serde(default)]
    fixed_surface: bool,
    /// The planes of its faces, where all are flat.
    #[serde(default)]
    solid: Option<Polyhedron>,
    /// The planes that cut it, where it has other faces, too.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    cuts: Vec<Plane>,
    /// Steps that the moments of its index and of its surface saw.
    moment_steps: [u32; 2],
    /// What it absorbs; absent in files of earlier versions, whose bodies are clear.
    #[serde(default)]
    absorption: StoredAbsorption,
}

/// The absorption coefficients of a region [1 / scene unit], and their moments.
#[derive(Clone, Default, Serialize, Deserialize)]
struct StoredAbsorption {
    coefficients: [f32; 3],
    first_moment: [f32; 3],
    second_moment: [f32; 3],
    steps: u32,
}

impl StoredAbsorption {
    fn of(coefficients: [f32; 3], moments: &AdamMoments) -> Self {
        let three = |values: &[f32]| std::array::from_fn(|c| values[c]);
        let (first_moment, second_moment) = (three(&moments.first), three(&moments.second));
        Self { coefficients, first_moment, second_moment, steps: moments.steps }
    }

    /// True unless a number is not finite or light is amplified.
    fn is_valid(&self) -> bool {
        let moments = self.first_moment.iter().chain(&self.second_moment);
        self.coefficients.iter().all(|a| a.is_finite() && *a >= 0.0)
            && moments.into_iter().all(|m| m.is_finite())
    }

    fn moments(&self) -> AdamMoments {
        let Self { first_moment, second_moment, steps, .. } = self;
        AdamMoments { first: first_moment.to_vec(), second: second_moment.to_vec(), steps: *steps }
    }
}

pub(super) fn stored(model: &Model, optimiser: &Optimiser) -> Vec<StoredRegion> {
    let refraction = &model.refraction;
    let regions = refraction.medium.regions().iter().zip(&optimiser.index).enumerate();
    let stored = regions.map(|(k, (region, moments))| {
        let Domain { bounds, resolution, .. } = *region.domain();
        let state = refraction.states.get(k);
        StoredRegion {
            bounds: bounds.to_arrays(),
            resolution,
            surface_resolution: region.level_set().map(|l| l.domain().resolution),
            searched: state.and_then(|s| s.searched),
            fixed_index: state.is_some_and(|s| s.fixed_index),
            fixed_surface: state.is_some_and(|s| s.fixed_surface),
            solid: state.and_then(|s| s.solid.clone()),
            cuts: state.map_or(Vec::new(), |s| s.cuts.clone()),
            moment_steps: [moments.index.steps, moments.surface.steps],
            absorption: StoredAbsorption::of(region.absorption(), &moments.absorption),
        }
    });
    stored.collect()
}

/// No index is larger.
const LARGEST: f32 = 10.0;

/// Per region: coefficients of w, both moments, the same of the surface, what is trainable and gated, and of a
/// field without a surface which cells rays march; the first two of these are empty
/// where there is none.
pub(super) fn tensors<'a>(model: &'a Model, optimiser: &'a Optimiser) -> Vec<(String, Tensor<'a>)> {
    let mut out = Vec::new();
    let regions = model.refraction.medium.regions().iter().zip(&optimiser.index).enumerate();
    for (k, (region, moments)) in regions {
        let name = |part: &str| format!("index.{k}{part}");
        let mut put = |part: &str, values: &'a [f32]| out.push(row(name(part), values));
        put("", region.coefficients());
        put(".first_moment", &moments.index.first);
        put(".second_moment", &moments.index.second);
        if let Some(level) = region.level_set() {
            put(".surface", level.coefficients());
            put(".surface_first_moment", &moments.surface.first);
            put(".surface_second_moment", &moments.surface.second);
        } else {
            out.push(row(name(".largest"), vec![region.largest_index()]));
        }
        let state = model.refraction.states.get(k);
        let flags = |all: &[bool]| all.iter().map(|&is| u8::from(is)).collect::<Cow<[u8]>>();
        let trainable = state.map_or(Cow::default(), |s| flags(&s.trainable));
        let gate = state.and_then(|s| s.gate.as_ref()).map_or(&[][..], Gate::values);
        let marched = region.level_set().is_none().then(|| (".marched", flags(&region.marched_cells())));
        for (part, bytes) in [(".free", trainable), (".gate", gate.into())].into_iter().chain(marched) {
            out.push((name(part), Tensor::new(vec![bytes.len()], TensorData::U8(bytes))));
        }
    }
    out
}

/// The refraction of a checkpoint, and the moments of its index.
pub(super) fn restore(
    regions: &[StoredRegion],
    options: &Options,
    file: &mut Tensors,
) -> Result<(Refraction, Vec<IndexMoments>), CheckpointError> {
    let interpolation = options.index.interpolation.into();
    let (mut grids, mut moments, mut states) = (Vec::new(), Vec::new(), Vec::new());
    for (k, stored) in regions.iter().enumerate() {
        let mut region = RegionFile { stored, k, file };
        let (mut grid, of_region) = region.grid(interpolation)?;
        grid.set_absorption(stored.absorption.coefficients);
        states.push(region.state(of_region.surface.first.len())?);
        grids.push(grid);
        moments.push(of_region);
    }
    let medium = Medium::new(grids).map_err(|e| file.wrong(&e.to_string()))?;
    let mut refraction = Refraction { medium, optics: options.optics(), states };
    refraction.find_flat_cells();
    for (k, stored) in regions.iter().enumerate() {
        RegionFile { stored, k, file }.restore_marched(refraction.medium.region_mut(k))?;
    }
    Ok((refraction, moments))
}

/// One region and where its tensors are.
struct RegionFile<'a> {
    stored: &'a StoredRegion,
    k: usize,
    file: &'a mut Tensors,
}

fn count(resolution: [u32; 3]) -> usize {
    resolution.map(|n| n as usize).iter().product()
}

fn is_valid(resolution: [u32; 3]) -> bool {
    resolution.iter().all(|n| (7..=2048).contains(n))
}

impl RegionFile<'_> {
    fn wrong(&self, what: &str) -> CheckpointError {
        self.file.wrong(&format!("refractive region {} {what}", self.k))
    }

    fn values(&mut self, part: &str, n: usize) -> Result<Vec<f32>, CheckpointError> {
        self.file.f32s(&format!("index.{}{part}", self.k), n)
    }

    /// The moments of an index or a surface: what they move must stay finite.
    fn moments(&mut self, of: &str, n: usize, steps: u32) -> Result<AdamMoments, CheckpointError> {
        let first = self.values(&format!(".{of}first_moment"), n)?;
        let second = self.values(&format!(".{of}second_moment"), n)?;
        let is_moment = |v: &f32| v.is_finite() && *v >= 0.0;
        if !(first.iter().all(|v| v.is_finite()) && second.iter().all(is_moment)) {
            return Err(self.wrong("has moments that are not finite, or squares below 0"));
        }
        Ok(AdamMoments { first, second, steps })
    }

    fn bytes(&mut self, part: &str) -> Result<Vec<u8>, CheckpointError> {
        self.file.u8s(&format!("index.{}{part}", self.k))
    }

    fn domain(&self) -> Domain<f32> {
        let StoredRegion { bounds, resolution, .. } = *self.stored;
        Domain { bounds: bounds_of(bounds), extent: Extent::Bounded, resolution }
    }

    /// The index, with its surface where it has one, and the moments of both.
    fn grid(
        &mut self,
        interpolation: Interpolation,
    ) -> Result<(IndexGrid<f32>, IndexMoments), CheckpointError> {
        if !is_valid(self.stored.resolution) || !is_box(self.stored.bounds) {
            return Err(self.wrong("has no valid box or resolution"));
        }
        if !self.stored.absorption.is_valid() {
            return Err(self.wrong("has absorption coefficients that are not finite and >= 0"));
        }
        let absorption = self.stored.absorption.moments();
        let (Domain { bounds, resolution, .. }, nodes) = (self.domain(), count(self.stored.resolution));
        let coefficients = self.values("", nodes)?;
        let [steps, surface_steps] = self.stored.moment_steps;
        let index = self.moments("", nodes, steps)?;
        let Some(surface_resolution) = self.stored.surface_resolution else {
            let grid = IndexGrid::from_coefficients(bounds, resolution, interpolation, coefficients);
            let grid =
                grid.ok_or_else(|| self.wrong("has an index that is not finite, or not 1 at its border"))?;
            return Ok((grid, IndexMoments { index, surface: AdamMoments::default(), absorption }));
        };
        if !is_valid(surface_resolution) || !coefficients.iter().all(|c| *c > 0.0) {
            return Err(self.wrong("has a surface of no valid resolution, or an index below 0"));
        }
        let n = count(surface_resolution);
        let level = LevelSet::from_coefficients(bounds, surface_resolution, self.values(".surface", n)?);
        let level = level.ok_or_else(|| self.wrong("has a surface that is not finite"))?;
        let level = match &self.stored.solid {
            Some(solid) => solid.sharpened(level),
            None => cut_by(level, &self.stored.cuts),
        };
        // Bodies with a surface have one index, and the default interpolation whatever the options say.
        let mut grid = IndexGrid::vacuum(bounds, resolution, Interpolation::default()).with_level_set(level);
        grid.coefficients_mut().copy_from_slice(&coefficients);
        grid.find_flat_cells(None);
        let surface = self.moments("surface_", n, surface_steps)?;
        Ok((grid, IndexMoments { index, surface, absorption }))
    }

    /// Which cells rays march, as they did when the run was saved: they are found again every few steps only, so that a run
    /// that goes on would else differ in its last bits. Checkpoints of earlier versions do not tell.
    fn restore_marched(&mut self, grid: &mut IndexGrid<f32>) -> Result<(), CheckpointError> {
        let name = format!("index.{}.marched", self.k);
        if self.stored.surface_resolution.is_some() || !self.file.contains(&name) {
            return Ok(());
        }
        let marched: Vec<bool> = self.bytes(".marched")?.into_iter().map(|m| m > 0).collect();
        let largest = self.values(".largest", 1)?[0];
        if largest > LARGEST || !grid.set_marched_cells(&marched, largest) {
            return Err(self.wrong("has flags of marched cells, or a bound of its index, that do not fit it"));
        }
        Ok(())
    }

    /// What belongs to the region besides its index; its surface has `surface_nodes` nodes.
    fn state(&mut self, surface_nodes: usize) -> Result<RegionState, CheckpointError> {
        let trainable: Vec<bool> = self.bytes(".free")?.into_iter().map(|f| f > 0).collect();
        let gate = Some(self.bytes(".gate")?).filter(|g| !g.is_empty());
        let gate = gate.map(|g| {
            Gate::from_values(self.domain(), g).ok_or_else(|| self.wrong("has a gate of another size"))
        });
        if !trainable.is_empty() && trainable.len() != count(self.stored.resolution) {
            return Err(self.wrong("has trainable nodes of another size"));
        }
        let (solid, cuts) = (self.stored.solid.clone(), self.stored.cuts.clone());
        let is_unit = |p: &Plane| (p.normal().length() - 1.0).abs() < 1e-3 && p.offset().is_finite();
        if !solid.iter().flat_map(Polyhedron::planes).chain(&cuts).all(is_unit) {
            return Err(self.wrong("has faces that are no planes"));
        }
        if solid.as_ref().is_some_and(|s| s.parameters() > surface_nodes) {
            return Err(self.wrong("has more faces than its surface has room for"));
        }
        let StoredRegion { searched, fixed_index, fixed_surface, .. } = *self.stored;
        Ok(RegionState {
            trainable,
            gate: gate.transpose()?,
            searched,
            fixed_index,
            fixed_surface,
            solid,
            cuts,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_region_of_an_earlier_version_is_clear_and_amplified_light_is_refused() {
        let earlier = r#"{"bounds": [[0, 0, 0], [1, 1, 1]], "resolution": [7, 7, 7], "surface_resolution": null,
            "searched": 1.5, "moment_steps": [3, 0]}"#;
        let mut region: StoredRegion = serde_json::from_str(earlier).unwrap();
        assert_eq!(region.absorption.coefficients, [0.0; 3]);
        assert_eq!(region.absorption.moments(), AdamMoments::zero(3));
        assert!(region.absorption.is_valid());
        for wrong in [-0.1, f32::NAN, f32::INFINITY] {
            region.absorption.coefficients[1] = wrong;
            assert!(!region.absorption.is_valid(), "{wrong}");
        }
    }
}
