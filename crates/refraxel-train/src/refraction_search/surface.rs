//! The surface of a body before it learns, and what is known of its form.

use super::shapes::{Ellipsoid, Side};
use crate::model::axis::Axis;
use crate::model::polyhedron::{Plane, Polyhedron};
use crate::model::{Gate, RegionState};
use refraxel_core::{LevelSet, Vec3};
use std::sync::OnceLock;

/// The surface of a body.
pub(super) struct Surface {
    pub form: Form,
    /// Signed distance from it, negative inside [scene unit].
    pub level: LevelSet<f32>,
    /// φ at the nodes [scene unit].
    pub distance: Vec<f32>,
    /// Which straight rays meet it.
    pub shadow: Gate,
    /// How it stands; absent where nobody knows which way is up.
    pub stand: Option<Stand>,
}

/// What is known of the form of a body.
#[derive(Clone)]
pub(super) enum Form {
    /// Nothing more: a visual hull, a box, or the shape from a file.
    Free,
    /// The ellipsoid that its silhouettes show.
    Ellipsoid(Ellipsoid),
    /// All of it is planes.
    Polyhedron(Polyhedron),
    /// It is turned about an axis.
    Revolution(Axis),
}

/// How a body stands.
pub(super) struct Stand {
    /// Unit vector away from what it stands on, or upwards in the pictures.
    pub up: Vec3<f32>,
    /// How far it reaches into what it stands on [scene unit]; 0 where nothing is known of that.
    pub sunk: f32,
    /// Its side as an open vessel, made when a hypothesis first asks for it: that takes as long as the surface itself.
    side: OnceLock<Option<Side>>,
}

impl Stand {
    pub(super) fn new(up: Vec3<f32>, sunk: f32) -> Self {
        Self { up, sunk, side: OnceLock::new() }
    }
}

impl Surface {
    pub(super) fn new(form: Form, level: LevelSet<f32>) -> Self {
        let nodes = level.coefficients().len();
        let distance: Vec<f32> = (0..nodes).map(|j| level.value(level.position(j))).collect();
        let shadow = Gate::new(*level.domain(), &shares(&distance, level.voxel()));
        Self { form, level, distance, shadow, stand: None }
    }

    /// The same surface on a grid of fewer nodes.
    pub(super) fn coarser(&self, resolution: [u32; 3]) -> Self {
        let bounds = self.level.domain().bounds;
        let level = LevelSet::from_samples(bounds, resolution, |x| self.level.value(x));
        let stand = self.stand.as_ref().map(|s| Stand::new(s.up, s.sunk));
        Self { stand, ..Self::new(self.form.clone(), level) }
    }

    /// The planes that are all of it, if it has no other faces.
    pub(super) fn planes(&self) -> Option<&Polyhedron> {
        if let Form::Polyhedron(planes) = &self.form { Some(planes) } else { None }
    }

    /// The axis that it is turned about, if it is.
    pub(super) fn axis(&self) -> Option<Axis> {
        if let Form::Revolution(axis) = self.form { Some(axis) } else { None }
    }

    /// Share of each node's voxel inside, 0 to 1.
    pub(super) fn shares(&self) -> Vec<f32> {
        shares(&self.distance, self.level.voxel())
    }

    /// Depth of its deepest point [scene unit].
    pub(super) fn depth(&self) -> f32 {
        -self.distance.iter().copied().fold(0.0, f32::min)
    }

    /// Inside, or within a voxel of it.
    pub(super) fn is_inside(&self, x: Vec3<f32>) -> bool {
        self.level.domain().bounds.contains(x) && self.level.value(x) < self.level.voxel()
    }

    /// It goes on below a plane.
    pub(super) fn reaches_below(&self, ground: &Plane) -> bool {
        let below = |j: usize| ground.height(self.level.position(j)) < -0.5 * self.level.voxel();
        self.level.parameters().any(|j| below(j) && self.distance[j] < 0.0)
    }

    /// Its side, if it is a vessel that is open at the top: of flat walls where `planes` says so.
    pub(super) fn side(&self, planes: Option<&Polyhedron>) -> Option<&Side> {
        let stand = self.stand.as_ref()?;
        let outer = || {
            let domain = self.level.domain();
            planes.map_or_else(|| self.level.clone(), |p| p.level_set(domain.bounds, domain.resolution))
        };
        let of = || Some(Side::new(outer(), stand.up)?.of_planes(planes));
        stand.side.get_or_init(of).as_ref()
    }

    /// What goes with a field that fills it and varies smoothly. Only rays bend that would meet the surface on a straight line: those
    /// that miss a sharp surface do not bend anyway.
    pub(super) fn smooth_state(&self) -> RegionState {
        let reach = 2.0 * self.level.voxel();
        let trainable = self.distance.iter().map(|&d| d < reach).collect();
        RegionState { trainable, gate: Some(self.shadow.clone()), ..RegionState::default() }
    }
}

/// Share of each node's voxel inside, were the surface a plane through it: ½ − φ/voxel, 0 to 1.
fn shares(distance: &[f32], voxel: f32) -> Vec<f32> {
    distance.iter().map(|d| (0.5 - d / voxel).clamp(0.0, 1.0)).collect()
}
