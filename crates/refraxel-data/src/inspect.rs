//! A summary of a dataset for people and scripts: what was read, and what is wrong with it.

use crate::region::quantile;
use crate::synth::IndexTruth;
use crate::{Dataset, Format, Region, Severity, scene_region};
use refraxel_core::{Aabb, Camera, Lens};
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};

/// What [`report`] found. Lengths are in the scene's own units.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Inspection {
    /// The dataset's folder; `None` for a dataset in memory.
    pub root: Option<String>,
    /// File format, or `memory`.
    pub format: &'static str,
    /// How many views, in which part.
    pub views: ViewCounts,
    /// The rule that made the split.
    pub split_rule: String,
    /// Names of the held-out views.
    pub test_names: Vec<String>,
    /// Image sizes and how often they occur, most frequent first.
    pub image_sizes: Vec<SizeCount>,
    /// Sum of all images [pixel].
    pub pixels: u64,
    /// Intrinsics and positions.
    pub cameras: CameraSummary,
    /// What lies behind the scene: `transparent`, `#rrggbb` or `surroundings`.
    pub backdrop: String,
    /// Masks, where there are any.
    pub masks: Option<MaskSummary>,
    /// The box that the dataset states: smallest and largest corner.
    pub stated_box: Option<[[f64; 3]; 2]>,
    /// The box that would be reconstructed.
    pub region: [[f64; 3]; 2],
    /// Mean upward direction of the cameras.
    pub up: [f64; 3],
    /// True when the photographs show more than the box.
    pub unbounded: bool,
    /// Sparse points that came with the cameras.
    pub points: usize,
    /// Number of refractive objects whose truth is known.
    pub known_refractive_objects: usize,
    /// Notes and warnings in the order found.
    pub problems: Vec<Finding>,
}

/// Views per part.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ViewCounts {
    /// All usable views.
    pub total: usize,
    /// Training views.
    pub train: usize,
    /// Validation views.
    pub val: usize,
    /// Held-out views.
    pub test: usize,
}

/// An image size and its frequency.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct SizeCount {
    /// Width [pixel].
    pub width: u32,
    /// Height [pixel].
    pub height: u32,
    /// Images of this size.
    pub count: usize,
}

/// Summary of the cameras.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CameraSummary {
    /// Lens models that occur.
    pub lenses: Vec<&'static str>,
    /// Smallest and largest focal length [pixel].
    pub focal: [f64; 2],
    /// Smallest and largest horizontal angle between the left and right border [degree], where the lens reaches them.
    pub field_of_view: Option<[f64; 2]>,
    /// Smallest, median and largest distance from the middle of the region.
    pub distance: [f64; 3],
}

/// Summary of the masks.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct MaskSummary {
    /// `refractive`, `keep` or `ignore`: what white means.
    pub meaning: &'static str,
    /// Views that have a mask.
    pub count: usize,
}

/// One problem.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// `note` or `warning`.
    pub severity: &'static str,
    /// The sentence.
    pub message: String,
}

/// Summarises a dataset without decoding pixels.
pub fn report(data: &Dataset) -> Inspection {
    let region = scene_region(data);
    let split = &data.split;
    let corners = |b: Aabb<f64>| data.origin.to_world(b).to_arrays();
    Inspection {
        root: data.root.as_ref().map(|folder| folder.display().to_string()),
        format: data.format.name(),
        views: ViewCounts {
            total: data.views.len(),
            train: split.train.len(),
            val: split.val.len(),
            test: split.test.len(),
        },
        split_rule: split.rule.clone(),
        test_names: split.test.iter().filter_map(|&i| data.views.get(i)).map(|v| v.name.clone()).collect(),
        image_sizes: image_sizes(data),
        pixels: data.views.iter().map(|v| u64::from(v.camera.width) * u64::from(v.camera.height)).sum(),
        cameras: cameras(data, &region),
        backdrop: data.backdrop.to_string(),
        masks: masks(data),
        stated_box: data.stated_box.map(corners),
        region: corners(region.bounds),
        up: region.up.to_array(),
        unbounded: region.unbounded,
        points: data.points.len(),
        known_refractive_objects: data.truth.as_ref().map_or(0, IndexTruth::listed),
        problems: data
            .problems
            .iter()
            .map(|p| Finding { severity: p.severity.name(), message: p.message.clone() })
            .collect(),
    }
}

impl Format {
    /// Name for people.
    pub fn name(self) -> &'static str {
        match self {
            Format::Blender => "Blender (NeRF-synthetic)",
            Format::Transforms => "transforms.json (nerfstudio, instant-ngp)",
            Format::Colmap => "COLMAP",
            Format::Llff => "LLFF",
            Format::Nsvf => "NSVF",
            Format::OpenSfm => "OpenSfM (OpenDroneMap)",
            Format::Metashape => "Metashape (cameras XML)",
            Format::RealityCapture => "RealityCapture (camera parameters CSV)",
            Format::Record3d => "Record3D",
            Format::Polycam => "Polycam (raw data)",
            Format::GaussianSplatting => "3D Gaussian Splatting (cameras.json)",
            Format::Memory => "memory",
        }
    }
}

impl Severity {
    /// Name for people.
    pub fn name(self) -> &'static str {
        match self {
            Severity::Note => "note",
            Severity::Warning => "warning",
        }
    }
}

fn image_sizes(data: &Dataset) -> Vec<SizeCount> {
    let mut counts = BTreeMap::new();
    for view in &data.views {
        *counts.entry((view.camera.width, view.camera.height)).or_insert(0) += 1;
    }
    let sizes = counts.into_iter().map(|((width, height), count)| SizeCount { width, height, count });
    let mut sizes: Vec<SizeCount> = sizes.collect();
    sizes.sort_by_key(|s| std::cmp::Reverse(s.count));
    sizes
}

fn cameras(data: &Dataset, region: &Region) -> CameraSummary {
    let cameras = || data.views.iter().map(|v| &v.camera);
    let range = |values: &mut dyn Iterator<Item = f64>| {
        values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)])
    };
    let center = region.bounds.center();
    let away = || cameras().map(move |c| (c.world_from_camera.translation - center).length());
    let distance = |q| quantile(away(), q).unwrap_or(0.0);
    let fields = range(&mut cameras().filter_map(field_of_view));
    CameraSummary {
        lenses: cameras().map(|c| lens_name(&c.lens)).collect::<BTreeSet<_>>().into_iter().collect(),
        focal: range(&mut cameras().flat_map(|c| c.focal)),
        field_of_view: fields[0].is_finite().then_some(fields),
        distance: [0.0, 0.5, 1.0].map(distance),
    }
}

/// Angle between the rays of the left and right border [degree], through the axis so that it may exceed 180.
fn field_of_view(camera: &Camera) -> Option<f64> {
    let height = camera.center[1];
    let from_axis = |u: f64| {
        let ray = camera.ray(u, height)?;
        Some(ray.direction.dot(camera.forward()).clamp(-1.0, 1.0).acos().to_degrees())
    };
    Some(from_axis(0.0)? + from_axis(f64::from(camera.width))?)
}

fn lens_name(lens: &Lens) -> &'static str {
    match lens {
        Lens::Pinhole => "pinhole",
        Lens::OpenCv { .. } => "radial and tangential (OPENCV)",
        Lens::FullOpenCv { .. } => "rational (FULL_OPENCV)",
        Lens::Fisheye { .. } => "fisheye (OPENCV_FISHEYE)",
        Lens::Fov { .. } => "field of view (FOV)",
        Lens::ThinPrismFisheye { .. } => "fisheye with thin prism (THIN_PRISM_FISHEYE)",
        Lens::Equirectangular => "panorama (EQUIRECTANGULAR)",
    }
}

/// The meaning of the first mask stands for all; mixed meanings are a problem note of their own.
fn masks(data: &Dataset) -> Option<MaskSummary> {
    let masked = || data.views.iter().filter(|v| v.has_mask());
    let meaning = masked().next()?.mask_meaning.name();
    Some(MaskSummary { meaning, count: masked().count() })
}
