//! The scene that is painted: a run with its backend, and the media as a page wishes them.

use super::crop::{self, Crop};
use super::error::SceneError;
use super::page_camera::PageCamera;
use super::photographs::Photographs;
use super::protocol::{Edits, Look, RegionFacts, SceneFacts};
use crate::device::ModelViewer;
use crate::exit::Failure;
use crate::progress::Show;
use crate::sentences::verdict_text;
use refraxel_core::Ray;
use refraxel_core::radiance::Pixel;
use refraxel_core::{Aabb, Camera, Vec3};
use refraxel_data::{Dataset, LocalOrigin, scene_region};
use refraxel_train::backend::{Layers, Marching};
use refraxel_train::device::DeviceChoice;
use refraxel_train::model::Gate;
use refraxel_train::model::index_edit::{IndexEdit, typical_index};
use refraxel_train::run::Run;
use refraxel_train::schedule::rendering_marching;
use refraxel_train::verdict::Verdict;
use refraxel_train::{Backend, CpuBackend, Refraction, plan::Plan};
use std::sync::Arc;

/// The upward direction where no photographs say it.
pub const UP: Vec3<f64> = Vec3 { x: 0.0, y: 0.0, z: 1.0 };
/// Field of view where no photographs say it [rad].
const ANGLE: f64 = 0.7;
/// Size of the first picture where no photographs say it [pixel].
const SIZE: [u32; 2] = [400, 400];
/// Factors on the absorption that a page may ask for; for a clear body, grey optical thicknesses over the shortest edge of its box.
const ABSORPTION: [f32; 2] = [0.0, 20.0];

/// A run that can be looked at.
pub struct Scene {
    name: String,
    plan: Plan,
    step: u64,
    verdict: Option<Verdict>,
    marching: Marching,
    backend: CpuBackend,
    viewer: ModelViewer,
    learned: Refraction,
    /// What was found to be refractive without masks.
    detected: Option<Gate>,
    /// The edits that the medium of the backend has.
    worn: Worn,
    crop: Crop,
    photographs: Arc<Photographs>,
    up: Vec3<f64>,
}

/// What distinguishes a medium from the learned one.
#[derive(Clone, Debug, Default, PartialEq)]
struct Worn {
    edits: Edits,
    straight: bool,
}

impl Scene {
    /// A run and, where they can be read, the photographs that it was trained on; the CPU renders it.
    pub fn new(name: String, run: Run, data: Option<&Dataset>) -> Self {
        let photographs = data.map_or_else(Photographs::default, |d| Photographs::new(d, &run.alignment));
        let up = data.map_or(UP, |d| scene_region(d).up);
        let Run { options, plan, state, model, optimiser, detected, .. } = run;
        let marching = rendering_marching(&options, plan.near);
        let mut backend = CpuBackend::resumed(model, optimiser);
        backend.refresh_occupancy(&marching);
        let learned = backend.medium().clone();
        Self {
            name,
            plan,
            step: state.step,
            verdict: state.verdict,
            marching,
            backend,
            viewer: ModelViewer::default(),
            learned,
            detected,
            worn: Worn::default(),
            crop: Crop::default(),
            photographs: Arc::new(photographs),
            up,
        }
    }

    /// The same scene, rendered by the device that is asked for.
    pub fn on(self, device: DeviceChoice, show: Show) -> Result<Self, Failure> {
        let viewer = ModelViewer::open(device, &self.backend, &self.marching, show)?;
        Ok(Self { viewer, ..self })
    }

    /// The same scene after more training, rendered by the CPU.
    pub fn renew(&mut self, run: Run) {
        let Run { options, plan, state, model, optimiser, detected, .. } = run;
        self.marching = rendering_marching(&options, plan.near);
        (self.plan, self.step, self.verdict, self.detected) = (plan, state.step, state.verdict, detected);
        self.backend.load(model, Some(optimiser));
        self.backend.refresh_occupancy(&self.marching);
        self.viewer = ModelViewer::default();
        self.learned = self.backend.medium().clone();
        (self.worn, self.crop) = (Worn::default(), Crop::default());
    }

    /// What rays show, bent by the medium of the last [`Self::wear`].
    pub fn render(&self, rays: &[Ray<f32>], layers: Layers) -> Vec<Pixel<f32>> {
        if self.crop.is_on() {
            return self.backend.render(rays, &self.marching, layers); // a GPU holds all of the field
        }
        self.viewer.render(&self.backend, rays, &self.marching, layers)
    }

    /// The renderer, whose medium is that of the last [`Self::wear`].
    pub fn backend(&self) -> &CpuBackend {
        &self.backend
    }

    /// How rays are marched.
    pub fn marching(&self) -> &Marching {
        &self.marching
    }

    /// The medium as it was learned.
    pub fn learned(&self) -> &Refraction {
        &self.learned
    }

    /// Hulls outside of which no ray bends: that of the detection, and those of regions whose index changes smoothly.
    pub fn hulls(&self) -> impl Iterator<Item = &Gate> {
        let of_regions = self.learned.states.iter().filter_map(|state| state.gate.as_ref());
        self.detected.iter().chain(of_regions)
    }

    /// Where the coordinates of the renderer begin. Those of pages are the user's.
    pub fn origin(&self) -> LocalOrigin {
        self.plan.origin
    }

    /// Steps of the training.
    pub fn step(&self) -> u64 {
        self.step
    }

    /// The photographs.
    pub fn photographs(&self) -> &Arc<Photographs> {
        &self.photographs
    }

    /// The camera of a look.
    pub fn camera(&self, look: &Look) -> Result<Camera, SceneError> {
        let camera = self.origin().to_local(look.camera.camera().map_err(SceneError::Look)?);
        match look.photo {
            None => Ok(camera),
            Some(view) => Ok(self.photographs.camera(view)?.resized(camera.width, camera.height)),
        }
    }

    /// Gives the renderer the medium of a look.
    pub fn wear(&mut self, look: &Look) -> Result<(), SceneError> {
        let wish = Worn { edits: look.edits.clone(), straight: look.straight };
        if wish != self.worn {
            let bounds = crop::checked(wish.edits.crop, self.origin())?;
            let medium = self.medium(&wish)?;
            self.crop.set(bounds, &mut self.backend, &self.marching);
            self.viewer.set_medium(&medium);
            self.backend.set_medium(medium);
            self.worn = wish;
        }
        Ok(())
    }

    fn medium(&self, wish: &Worn) -> Result<Refraction, SceneError> {
        let mut medium = self.learned.clone();
        let count = medium.medium.regions().len();
        let Edits { index, absorption, .. } = &wish.edits;
        if index.len().max(absorption.len()) > count {
            return Err(SceneError::Region { found: index.len().max(absorption.len()) - 1, count });
        }
        if wish.straight {
            return Ok(Refraction { optics: medium.optics, ..Refraction::none() });
        }
        for (k, n) in index.iter().enumerate().filter_map(|(k, n)| n.map(|n| (k, n))) {
            let edited = IndexEdit::Set(n).apply_to(k, &mut medium);
            edited.map_err(|e| SceneError::Look(format!("edits.index[{k}]: {e}")))?;
        }
        for (k, factor) in absorption.iter().enumerate().filter_map(|(k, f)| f.map(|f| (k, f))) {
            if !(ABSORPTION[0]..=ABSORPTION[1]).contains(&factor) {
                let [low, high] = ABSORPTION;
                let why = format!("edits.absorption[{k}]: found {factor}; expected {low} to {high}");
                return Err(SceneError::Look(why));
            }
            let grid = medium.medium.region_mut(k);
            let shortest = grid.domain().bounds.extent().min_element();
            let is_clear = grid.absorption() == [0.0; 3];
            grid.set_absorption(if is_clear {
                [factor / shortest; 3]
            } else {
                grid.absorption().map(|a| factor * a)
            });
        }
        Ok(medium)
    }

    /// What a page needs to know.
    pub fn describe(&self) -> SceneFacts {
        let bounds = self.bounds();
        let regions = self.learned.medium.regions().iter().map(|region| {
            let bounds = self.origin().to_world(region.domain().bounds.cast::<f64>());
            RegionFacts {
                index: typical_index(region).unwrap_or(1.0),
                absorption: region.absorption(),
                sharp: region.level_set().is_some(),
                min: bounds.min.to_array(),
                max: bounds.max.to_array(),
            }
        });
        SceneFacts {
            name: self.name.clone(),
            step: self.step,
            verdict: self.verdict.as_ref().map(verdict_text),
            min: bounds.min.to_array(),
            max: bounds.max.to_array(),
            up: self.up.to_array(),
            start: self.start(),
            regions: regions.collect(),
            has_hull: self.hulls().next().is_some(),
            reflects: self.backend.mirroring().regions > 0 || self.backend.mirroring().clearcoat,
            resolution: self.backend.domain().resolution,
            voxels: self.backend.map().voxels(),
            views: self.photographs.describe(),
        }
    }

    /// Where a page begins: at the first held-out photograph, if there is one.
    fn start(&self) -> PageCamera {
        let photograph = self.photographs.first().map(|camera| self.origin().to_world(camera));
        start(photograph, self.bounds(), self.up)
    }

    /// The box of the scene in the user's world.
    fn bounds(&self) -> Aabb<f64> {
        self.origin().to_world(self.plan.finest.bounds.cast())
    }
}

/// Where a page begins: at a photograph, or before the box of a scene without any.
pub fn start(photograph: Option<Camera>, bounds: Aabb<f64>, up: Vec3<f64>) -> PageCamera {
    if let Some(camera) = photograph {
        return PageCamera::of(&camera);
    }
    let (middle, size) = (bounds.center(), bounds.extent().length());
    let from = Vec3::new(1.0, 0.6, 0.7).normalized() * (0.6 * size / (0.5 * ANGLE).tan());
    PageCamera::of(&Camera::look_at(middle + from, middle, up, ANGLE, SIZE))
}
