//! What a page needs to know of a scene.

use crate::viewer::page_camera::PageCamera;
use serde::Serialize;

/// A scene, when the page opens and when training has gone on. Places are in the user's world [scene unit].
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct SceneFacts {
    /// What the run is called.
    pub name: String,
    /// Steps of the training.
    pub step: u64,
    /// What was decided about each refractive region, a line each.
    pub verdict: Option<String>,
    /// Lowest corner of its box.
    pub min: [f64; 3],
    /// Highest corner of its box.
    pub max: [f64; 3],
    /// The upward direction.
    pub up: [f64; 3],
    /// Where a page begins.
    pub start: PageCamera,
    /// Its refractive regions.
    pub regions: Vec<RegionFacts>,
    /// There is a hull outside of which no ray bends.
    pub has_hull: bool,
    /// Something mirrors light.
    pub reflects: bool,
    /// Nodes of the grid along each axis.
    pub resolution: [u32; 3],
    /// Voxels that are stored.
    pub voxels: usize,
    /// Its photographs, held-out ones first.
    pub views: Vec<ViewFacts>,
}

/// A refractive region.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct RegionFacts {
    /// Its typical index.
    pub index: f32,
    /// What it absorbs of red, green and blue [1 / scene unit].
    pub absorption: [f32; 3],
    /// It has a sharp surface; else its index changes smoothly.
    pub sharp: bool,
    /// Lowest corner of its box.
    pub min: [f64; 3],
    /// Highest corner of its box.
    pub max: [f64; 3],
}

/// A photograph.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct ViewFacts {
    /// What it is called.
    pub name: String,
    /// The part of the dataset that it belongs to: test, val or train.
    pub split: &'static str,
    /// Where it was taken.
    pub camera: PageCamera,
}
