//! What was written, for people and for programs.

use super::opaque::Opaque;
use super::surfaces::{Numbered, Solids};
use crate::table::{colours, count, decimals};
use refraxel_core::Mesh;
use refraxel_train::model::surface::Boundary;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// What was written.
#[derive(Serialize)]
pub struct Report {
    pub(super) file: PathBuf,
    pub(super) format: &'static str,
    pub(super) regions: Vec<Region>,
    /// The mesh of what is opaque.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) opaque: Option<OpaqueMesh>,
    /// What the file lacks, and why.
    pub(super) notes: Vec<String>,
    /// Points of opaque things, and cameras, in a glTF file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) points: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) cameras: Option<usize>,
    /// The direction in the world that the glTF file turns to +y.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) up: Option<[f64; 3]>,
    /// Why `up` is not the mean upward direction of the cameras.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) up_note: Option<String>,
}

/// The figures of a mesh.
#[derive(Serialize)]
struct Figures {
    vertices: usize,
    faces: usize,
    /// Closed surfaces: two for a hollow ball.
    bodies: usize,
    /// [scene unit²]
    area: f64,
    /// [scene unit³], without cavities.
    volume: f64,
    /// Corners of the box around it [scene unit].
    bounds: [[f64; 3]; 2],
}

impl Figures {
    /// `None` of a mesh without vertices.
    fn of(mesh: &Mesh) -> Option<Self> {
        let bounds = mesh.bounds()?;
        Some(Self {
            vertices: mesh.vertices.len(),
            faces: mesh.triangles.len(),
            bodies: mesh.bodies(),
            area: mesh.area(),
            volume: mesh.volume(),
            bounds: bounds.to_arrays(),
        })
    }

    fn text(&self) -> String {
        let bodies = if self.bodies == 1 { "closed surface" } else { "closed surfaces" };
        let (vertices, faces) = (count(self.vertices as u64), count(self.faces as u64));
        format!("{vertices} vertices, {faces} faces, {} {bodies}", self.bodies)
    }
}

/// The mesh of one region.
#[derive(Serialize)]
pub(super) struct Region {
    /// Number of the region, from 1.
    region: usize,
    /// "jump" or "half-way": where the boundary was drawn.
    boundary: &'static str,
    /// Index of refraction inside.
    index: f32,
    /// Absorption of linear red, green and blue [1 / scene unit].
    absorption: [f32; 3],
    #[serde(flatten)]
    figures: Figures,
}

impl Region {
    fn of(Numbered { region, surface }: &Numbered) -> Option<Self> {
        let figures = Figures::of(&surface.mesh)?;
        Some(Self {
            region: *region,
            boundary: match surface.boundary {
                Boundary::Jump => "jump",
                Boundary::HalfWay => "half-way",
            },
            index: surface.index,
            absorption: surface.absorption,
            figures,
        })
    }

    fn text(&self) -> String {
        let Figures { area, volume, bounds: [low, high], .. } = self.figures;
        let [x, y, z] = [0, 1, 2].map(|a| high[a] - low[a]);
        let d = decimals(x.max(y).max(z), 4);
        format!(
            "region {}: index {:.3}{}, {}, volume {volume:.4e}, area {area:.4e}, box {x:.d$} × {y:.d$} × {z:.d$}",
            self.region,
            self.index,
            self.tint(),
            self.figures.text(),
        )
    }
}

impl Region {
    /// What it absorbs, if it is tinted.
    fn tint(&self) -> String {
        if self.absorption == [0.0; 3] {
            String::new()
        } else {
            format!(", absorbs {}", colours(self.absorption))
        }
    }
}

/// The mesh of what is opaque.
#[derive(Serialize)]
pub(super) struct OpaqueMesh {
    #[serde(flatten)]
    figures: Figures,
    /// Opacity of a voxel at which things begin [1].
    level: f64,
    /// Surfaces left out because they are specks.
    small: usize,
    /// Surfaces left out because no photograph shows them.
    unseen: usize,
    /// Share of the vertices whose colours no photograph shows.
    guessed: f64,
}

impl OpaqueMesh {
    fn of(opaque: &Opaque) -> Option<Self> {
        let figures = Figures::of(&opaque.mesh)?;
        Some(Self {
            figures,
            level: opaque.level,
            small: opaque.small,
            unseen: opaque.unseen,
            guessed: opaque.guessed,
        })
    }

    fn text(&self) -> String {
        format!(
            "opaque: from {:.0} % per voxel on, {}; left out: {} specks, {} that no photograph shows; {:.0} % of the vertices \
             have colours that no photograph shows directly",
            100.0 * self.level,
            self.figures.text(),
            self.small,
            self.unseen,
            100.0 * self.guessed,
        )
    }
}

impl Report {
    pub(super) fn new(file: &Path, format: &'static str, solids: &Solids) -> Self {
        let regions = solids.glass.iter().filter_map(Region::of).collect();
        Self {
            file: file.to_owned(),
            format,
            regions,
            opaque: solids.opaque.as_ref().and_then(OpaqueMesh::of),
            notes: solids.notes(),
            points: None,
            cameras: None,
            up: None,
            up_note: None,
        }
    }

    pub(super) fn text(&self) -> String {
        let lines = self.opaque.iter().map(OpaqueMesh::text).chain(self.regions.iter().map(Region::text));
        let around = self.points.zip(self.cameras).map(|(points, cameras)| {
            format!("around it: {} points of opaque things, {cameras} cameras", count(points as u64))
        });
        let file = format!("file: {} (world coordinates of the dataset)", self.file.display());
        let up = self.up.map(|[x, y, z]| {
            let note = self.up_note.as_deref().unwrap_or("the mean of the cameras");
            format!("up: ({x:.3}, {y:.3}, {z:.3}), which the root node turns to +y; {note}")
        });
        let notes = self.notes.iter().map(|note| format!("note: {note}"));
        lines.chain(around).chain([file]).chain(up).chain(notes).collect::<Vec<_>>().join("\n")
    }
}
