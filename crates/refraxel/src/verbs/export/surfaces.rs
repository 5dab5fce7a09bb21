//! What is solid in a run: the surfaces of what is refractive, and of what is opaque.

use super::eyes::Eyes;
use super::opaque::Opaque;
use crate::exit::{Exit, Failure};
use crate::verbs::loaded::Loaded;
use refraxel_core::{Extent, Mesh, Vec3};
use refraxel_data::{Dataset, LocalOrigin, quantize};
use refraxel_train::model::opaque::MESH_REACH;
use refraxel_train::model::surface::Surface;
use refraxel_train::{Backend, Refraction};
use std::io::{self, Write};

/// One region's surface and its number, from 1.
pub(super) struct Numbered {
    pub(super) region: usize,
    pub(super) surface: Surface,
}

/// The mesh of something solid, as files know it.
pub(super) struct Solid<'a> {
    /// Number of the region, from 1; 0 of what is opaque.
    pub(super) region: usize,
    pub(super) mesh: &'a Mesh,
    /// sRGB-encoded colour of each vertex; none of glass.
    pub(super) colours: Option<&'a [[f32; 3]]>,
    /// Index of refraction of glass.
    pub(super) index: Option<f32>,
}

impl Numbered {
    pub(super) fn solid(&self) -> Solid<'_> {
        let Surface { mesh, index, .. } = &self.surface;
        Solid { region: self.region, mesh, colours: None, index: Some(*index) }
    }
}

impl Solid<'_> {
    /// Three bytes per vertex: glass is white.
    pub(super) fn bytes(&self, vertex: usize) -> [u8; 3] {
        self.colours.map_or([u8::MAX; 3], |colours| colours[vertex].map(quantize))
    }
}

/// Everything solid in a run.
pub(super) struct Solids {
    /// What is refractive.
    pub(super) glass: Vec<Numbered>,
    /// Why there is nothing, where there is nothing.
    pub(super) without_glass: Option<String>,
    /// What is opaque.
    pub(super) opaque: Option<Opaque>,
    /// Why the photographs could not be asked what they show, where they could not.
    pub(super) blind: Option<String>,
    is_contracted: bool,
}

impl Solids {
    /// Those of a run, called `name` in messages, with `detail` cells per voxel. Errors where there are none.
    pub(super) fn of(
        run: &Loaded,
        name: &str,
        data: Result<&Dataset, &Failure>,
        detail: u32,
    ) -> Result<Self, Failure> {
        let glass = surfaces(run.backend.medium(), name, detail)?;
        let eyes = data.map(|data| Eyes::of(run, data));
        let blind = eyes.as_ref().err().map(|failure| format!("{:#}", failure.error));
        let opaque = Opaque::of(eyes.as_ref().ok(), &run.backend.snapshot().model.field, detail)?;
        let (glass, without_glass) = match glass {
            Ok(glass) => (glass, None),
            Err(why) if opaque.is_some() => (Vec::new(), Some(why)),
            Err(why) => {
                return Err(Exit::BadInput.because(format!(
                    "{name} has nothing solid to export: nothing in it is opaque yet, which takes more training; and there is \
                     no glass: {why}"
                )));
            }
        };
        let origin = run.plan.origin;
        let in_world = |mut mesh: Mesh| {
            mesh.vertices.iter_mut().for_each(|x| *x = origin.to_world(*x));
            mesh
        };
        let placed = |n: Numbered| Numbered {
            surface: Surface { mesh: in_world(n.surface.mesh), ..n.surface },
            region: n.region,
        };
        let glass = glass.into_iter().map(placed).collect();
        let opaque = opaque.map(|o| Opaque { mesh: in_world(o.mesh), ..o });
        let is_contracted = run.backend.domain().extent == Extent::Contracted;
        Ok(Self { glass, without_glass, opaque, blind, is_contracted })
    }

    /// What is missing, and why.
    pub(super) fn notes(&self) -> Vec<String> {
        let glass = self.without_glass.as_ref().map(|why| format!("no glass: {why}"));
        let opaque = self.opaque.is_none().then(|| "nothing in it is opaque".to_owned());
        let far = self.is_contracted && self.opaque.is_some();
        let far = far.then(|| {
            format!(
                "opaque things beyond {MESH_REACH} times the box are left out; points and splats have them"
            )
        });
        let blind = self.blind.as_ref().map(|why| {
            format!("the photographs cannot be read, so colours are means over all directions: {why}")
        });
        glass.into_iter().chain(opaque).chain(far).chain(blind).collect()
    }

    /// All of them, what is opaque first.
    pub(super) fn all(&self) -> Vec<Solid<'_>> {
        self.opaque.iter().map(Opaque::solid).chain(self.glass.iter().map(Numbered::solid)).collect()
    }
}

/// The surfaces of all regions that have one, or why there are none. Errors where they do not fit into memory.
fn surfaces(
    refraction: &Refraction,
    name: &str,
    detail: u32,
) -> Result<Result<Vec<Numbered>, String>, Failure> {
    if refraction.is_none() {
        let why = "its rays are straight; glass takes refractive masks, --refraction-box or --index-from in training";
        return Ok(Err(why.to_owned()));
    }
    let regions = refraction.medium.regions();
    if !regions.iter().all(|r| Surface::fits(r, detail)) {
        return Err(Exit::BadInput.because(format!(
            "{name} has no surface to export: --detail {detail} needs too much memory; try a smaller one"
        )));
    }
    let all = regions.iter().enumerate();
    let all = all.filter_map(|(k, r)| Some(Numbered { region: k + 1, surface: Surface::of(r, detail)? }));
    // Vacuum has a surface only where it lies in a body.
    let shows = |n: &Numbered| {
        let is_bubble = !refraction.medium.neighbours(n.region - 1).is_empty();
        !n.surface.mesh.triangles.is_empty() && (is_bubble || n.surface.index != 1.0)
    };
    let found: Vec<Numbered> = all.filter(shows).collect();
    if found.is_empty() {
        let why = "its index is 1 everywhere; look at the index with `refraxel render RUN --slices --out DIR`, and train longer \
                   or with better masks";
        return Ok(Err(why.to_owned()));
    }
    Ok(Ok(found))
}

/// The type of coordinates in PLY: of double precision where the scene is far from the origin of the world.
pub(super) fn place_type(origin: LocalOrigin) -> &'static str {
    if origin.is_of_world() { "float" } else { "double" }
}

/// Writes a place as [`place_type`] says.
pub(super) fn write_place(x: Vec3<f64>, origin: LocalOrigin, out: &mut dyn Write) -> io::Result<()> {
    match origin.is_of_world() {
        true => narrow(x).iter().try_for_each(|v| out.write_all(&v.to_le_bytes())),
        false => x.to_array().iter().try_for_each(|v| out.write_all(&v.to_le_bytes())),
    }
}

/// Three numbers in the precision of the files.
pub(super) fn narrow(v: Vec3<f64>) -> [f32; 3] {
    v.cast::<f32>().to_array()
}

/// A ball, and a hollow one beside it.
#[cfg(test)]
pub(super) fn ball_and_shell() -> Vec<Numbered> {
    use refraxel_core::{Aabb, IndexGrid, LevelSet, vec3};
    let body = |center: Vec3<f32>, shell: f32, index: f32| {
        let bounds = Aabb::cube_at(center, 1.0);
        let distance = |x: Vec3<f32>| {
            let d = (x - center).length() - 0.5;
            if shell > 0.0 { d.abs() - shell } else { d }
        };
        let mut grid = IndexGrid::sharp(LevelSet::from_samples(bounds, [33; 3], distance), index);
        grid.set_absorption(if shell > 0.0 { [0.2, 1.6, 6.0] } else { [0.0; 3] });
        Surface::of(&grid, 1).unwrap()
    };
    vec![
        Numbered { region: 1, surface: body(Vec3::zero(), 0.0, 1.5) },
        Numbered { region: 3, surface: body(vec3(4.0, 0.0, 0.0), 0.2, 1.33) },
    ]
}
