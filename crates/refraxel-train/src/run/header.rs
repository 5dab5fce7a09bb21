//! The description of a run in the header of its checkpoint.

use super::boxes::bounds_of;
use super::clearcoat::StoredClearcoat;
use super::contents::RunRef;
use super::detected::StoredDetection;
use super::projection::StoredProjection;
use super::reflection::StoredReflection;
use super::refraction::{self, StoredRegion};
use super::source::Source;
use super::state::State;
use super::views::StoredViews;
use crate::options::Options;
use crate::plan::Plan;
use refraxel_core::{Background, Domain, Extent};
use refraxel_data::{Backdrop, LocalOrigin};
use serde::{Deserialize, Serialize};

#[derive(Serialize, Deserialize)]
pub(super) struct Header {
    pub program: String,
    pub options: Options,
    pub state: State,
    pub source: Source,
    pub bounds: [[f32; 3]; 2],
    pub contracted: bool,
    /// The frame of a projective grid.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub projection: Option<StoredProjection>,
    pub resolution: [u32; 3],
    pub finest_resolution: [u32; 3],
    pub sh_degree: u8,
    pub near: f32,
    /// Where their coordinates begin in the world of the user's data; absent: where those do.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub origin: Option<[f64; 3]>,
    pub backdrop: Backdrop,
    pub background: StoredBackground,
    /// Refractive regions; their tensors are called `index.K`, K from 0.
    #[serde(default)]
    pub regions: Vec<StoredRegion>,
    /// What their surfaces mirror; tensors `reflection.K.outer` and `.inner`, K as in the regions.
    #[serde(default)]
    pub reflection: StoredReflection,
    /// The clearcoat of opaque things; tensors `clearcoat.strength` and `clearcoat.radiance`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clearcoat: Option<StoredClearcoat>,
    /// What was found without masks; its tensor is called `detected`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub detected: Option<StoredDetection>,
    /// What the photographs themselves have learned; tensors `poses` and `exposures`.
    #[serde(default)]
    pub views: StoredViews,
    /// "identity", parameters are in the coordinates of the user's data, or "origin", relative to that point of them.
    pub world_from_model: String,
}

#[derive(Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum StoredBackground {
    Constant([f32; 3]),
    EnvironmentRows(usize),
}

impl Header {
    /// What does not change during the run.
    pub(super) fn plan(&self) -> Plan {
        let finest = Domain { resolution: self.finest_resolution, ..self.domain() };
        let origin = self.origin.map_or_else(LocalOrigin::default, |at| LocalOrigin::at(at.into()));
        Plan { finest, near: self.near, origin, backdrop: self.backdrop }
    }

    /// Where the field lies.
    pub(super) fn domain(&self) -> Domain<f32> {
        let extent = match &self.projection {
            Some(frame) => Extent::Projective(frame.projection()),
            None if self.contracted => Extent::Contracted,
            None => Extent::Bounded,
        };
        Domain { bounds: bounds_of(self.bounds), extent, resolution: self.resolution }
    }

    pub(super) fn of(run: &RunRef) -> Self {
        let (field, origin) = (&run.model.field, run.plan.origin);
        Self {
            program: concat!("refraxel ", env!("CARGO_PKG_VERSION")).to_owned(),
            options: run.options.clone(),
            state: run.state.clone(),
            source: run.source.clone(),
            bounds: field.domain.bounds.to_arrays(),
            contracted: field.domain.extent == Extent::Contracted,
            projection: StoredProjection::of(&field.domain.extent),
            resolution: field.domain.resolution,
            finest_resolution: run.plan.finest.resolution,
            sh_degree: field.degree.get(),
            near: run.plan.near,
            origin: (!origin.is_of_world()).then(|| origin.place().to_array()),
            backdrop: run.plan.backdrop,
            background: match &run.model.background {
                Background::Constant(c) => StoredBackground::Constant(*c),
                Background::Environment(map) => StoredBackground::EnvironmentRows(map.height()),
            },
            regions: refraction::stored(run.model, run.optimiser),
            reflection: StoredReflection::of(&run.model.reflection, &run.optimiser.reflection),
            clearcoat: run.model.clearcoat.as_ref().map(StoredClearcoat::of),
            detected: run.detected.map(StoredDetection::of),
            views: StoredViews::of(run.alignment),
            world_from_model: if origin.is_of_world() { "identity" } else { "origin" }.to_owned(),
        }
    }
}
