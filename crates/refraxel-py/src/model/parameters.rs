//! The parameters of a model by their names.

use crate::arrays::{Array, grid, shaped, values};
use crate::errors::refused;
use crate::index_parameters::{indices, one_index};
use numpy::PyUntypedArrayMethods;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use refraxel_core::grid::BRICK_VOXELS;
use refraxel_core::sh::ShDegree;
use refraxel_core::{Background, IndexGrid};
use refraxel_train::Model;

/// One array of parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Parameter {
    /// θ of each stored voxel; its density is `density_scale` · softplus(θ).
    RawDensity,
    /// SH coefficients of each stored voxel.
    Sh,
    /// Texels of the panorama.
    Background,
    /// The index of a region: one number, or control values n.
    Index(usize),
    /// The coefficients of the level set of a region.
    Surface(usize),
    /// What a region absorbs.
    Absorption(usize),
}

/// Values of a parameter, away from the interpreter.
pub struct Values {
    flat: Vec<f32>,
    shape: Vec<usize>,
    /// Indexed [x, y, z] by Python, while x is fastest here.
    is_grid: bool,
}

impl Values {
    /// As an array.
    pub fn into_array(self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        match self.shape[..] {
            [x, y, z] if self.is_grid => grid(py, self.flat, [x as u32, y as u32, z as u32]),
            _ => shaped(py, self.flat, &self.shape),
        }
    }
}

/// What Python gives for a parameter: its name, and an array with the last axis fastest.
pub struct Given {
    /// The name of the parameter.
    pub name: String,
    shape: Vec<usize>,
    rows: Vec<f32>,
}

impl Given {
    /// One value.
    pub fn new(name: String, array: &Array<'_, f32>) -> Self {
        Self { name, shape: array.shape().to_vec(), rows: values(array) }
    }

    /// The values of a dictionary by name.
    pub fn all(given: &Bound<'_, PyDict>) -> PyResult<Vec<Self>> {
        given.iter().map(|(name, value)| Ok(Self::new(name.extract()?, &value.extract()?))).collect()
    }

    /// The same numbers with x fastest.
    fn x_fastest(&self) -> Vec<f32> {
        let [nx, ny, nz] = <[usize; 3]>::try_from(&self.shape[..]).unwrap_or_default();
        let nodes = (0..nx * ny * nz).map(|k| [k % nx, k / nx % ny, k / (nx * ny)]);
        nodes.map(|[x, y, z]| self.rows[(x * ny + y) * nz + z]).collect()
    }
}

/// SH coefficients without the padding of voxels.
pub fn unpadded(degree: ShDegree, padded: &[f32]) -> Vec<f32> {
    padded.chunks_exact(degree.stride()).flat_map(|voxel| &voxel[..3 * degree.basis()]).copied().collect()
}

/// The shape of the panorama of a model.
pub fn panorama_shape(model: &Model) -> [usize; 3] {
    let height = match &model.background {
        Background::Environment(map) => map.height(),
        Background::Constant(_) => 0,
    };
    [height, 2 * height, 3]
}

impl Parameter {
    /// All parameters of a model.
    pub fn all(model: &Model) -> Vec<Self> {
        let mut all = vec![Self::RawDensity, Self::Sh, Self::Background];
        for (k, region) in model.refraction.medium.regions().iter().enumerate() {
            all.push(Self::Index(k));
            // What bounds a body of flat faces is no array of nodes.
            let surface = region.level_set().filter(|level| !level.is_of_planes());
            all.extend(surface.map(|_| Self::Surface(k)));
            all.push(Self::Absorption(k));
        }
        all
    }

    /// What Python calls it.
    pub fn name(&self) -> String {
        match self {
            Self::RawDensity => "raw_density".to_owned(),
            Self::Sh => "sh".to_owned(),
            Self::Background => "background".to_owned(),
            Self::Index(k) => format!("index.{k}"),
            Self::Surface(k) => format!("surface.{k}"),
            Self::Absorption(k) => format!("absorption.{k}"),
        }
    }

    /// The parameter of a name.
    pub fn find(model: &Model, name: &str) -> PyResult<Self> {
        let all = Self::all(model);
        all.iter().find(|p| p.name() == name).copied().ok_or_else(|| {
            let names: Vec<String> = all.iter().map(Self::name).collect();
            refused(format!("the model has no parameter {name:?}; it has {}", names.join(", ")))
        })
    }

    fn region<'a>(&self, model: &'a Model) -> &'a IndexGrid<f32> {
        let (Self::Index(k) | Self::Surface(k) | Self::Absorption(k)) = self else {
            unreachable!("{self:?} belongs to no region")
        };
        &model.refraction.medium.regions()[*k]
    }

    /// Its shape.
    fn shape(&self, model: &Model) -> Vec<usize> {
        let (field, of_grid) = (&model.field, |n: [u32; 3]| n.map(|n| n as usize).to_vec());
        let voxels = field.density.len() - BRICK_VOXELS;
        match self {
            Self::RawDensity => vec![voxels],
            Self::Sh => vec![voxels, 3, field.degree.basis()],
            Self::Background => panorama_shape(model).to_vec(),
            Self::Index(_) if one_index(self.region(model)).is_some() => Vec::new(),
            Self::Index(_) => of_grid(self.region(model).domain().resolution),
            Self::Surface(_) => {
                self.region(model).level_set().map_or(Vec::new(), |l| of_grid(l.domain().resolution))
            }
            Self::Absorption(_) => vec![3],
        }
    }

    /// Whether the array is indexed [x, y, z] while the model has x fastest.
    fn is_grid(&self, model: &Model) -> bool {
        matches!(self, Self::Index(_) | Self::Surface(_)) && self.shape(model).len() == 3
    }

    /// Its values.
    pub fn get(&self, model: &Model) -> Values {
        Values { flat: self.flat(model), shape: self.shape(model), is_grid: self.is_grid(model) }
    }

    /// Its values in the order of the model.
    pub fn flat(&self, model: &Model) -> Vec<f32> {
        let field = &model.field;
        match self {
            Self::RawDensity => field.density[BRICK_VOXELS..].to_vec(),
            Self::Sh => unpadded(field.degree, &field.colour[BRICK_VOXELS * field.degree.stride()..]),
            Self::Background => match &model.background {
                Background::Environment(map) => map.texels.as_flattened().to_vec(),
                Background::Constant(_) => Vec::new(),
            },
            Self::Index(_) => match one_index(self.region(model)) {
                Some(index) => vec![index],
                None => indices(self.region(model)).collect(),
            },
            Self::Surface(_) => {
                self.region(model).level_set().map_or(Vec::new(), |l| l.coefficients().to_vec())
            }
            Self::Absorption(_) => self.region(model).absorption().to_vec(),
        }
    }

    /// New values in the order of the model.
    pub fn checked(&self, model: &Model, given: &Given) -> PyResult<Vec<f32>> {
        let (name, expected) = (self.name(), self.shape(model));
        if given.shape != expected {
            return Err(refused(format!("{name} has the shape {:?}; expected {expected:?}", given.shape)));
        }
        let flat = if self.is_grid(model) { given.x_fastest() } else { given.rows.clone() };
        let (least, range) = match self {
            Self::Index(_) => (f32::MIN_POSITIVE, "n > 0"),
            Self::Absorption(_) => (0.0, "numbers from 0 on"),
            _ => (f32::MIN, "finite numbers"),
        };
        match flat.iter().position(|&v| !v.is_finite() || v < least) {
            Some(k) => Err(refused(format!("{name}: value {k} is {}; expected {range}", flat[k]))),
            None => Ok(flat),
        }
    }

    /// Takes checked values.
    pub fn set(&self, model: &mut Model, flat: &[f32]) {
        match *self {
            Self::RawDensity => model.field.density[BRICK_VOXELS..].copy_from_slice(flat),
            Self::Sh => {
                let (stride, own) = (model.field.degree.stride(), 3 * model.field.degree.basis());
                let padded = model.field.colour[BRICK_VOXELS * stride..].chunks_exact_mut(stride);
                padded.zip(flat.chunks_exact(own)).for_each(|(to, from)| to[..own].copy_from_slice(from));
            }
            Self::Background => {
                if let Background::Environment(map) = &mut model.background {
                    map.texels.as_flattened_mut().copy_from_slice(flat);
                }
            }
            Self::Index(k) => {
                let region = model.refraction.medium.region_mut(k);
                if one_index(region).is_some() {
                    region.set_interior_index(flat[0]);
                } else {
                    let nodes: Vec<usize> = region.parameters().collect();
                    let coefficients = region.coefficients_mut();
                    nodes.into_iter().for_each(|node| coefficients[node] = 0.5 * flat[node] * flat[node]);
                    model.refraction.find_flat_cells();
                }
            }
            Self::Surface(k) => {
                if let Some(level) = model.refraction.medium.region_mut(k).level_set_mut() {
                    level.coefficients_mut().copy_from_slice(flat);
                    level.find_surface();
                }
            }
            Self::Absorption(k) => {
                let tint = [flat[0], flat[1], flat[2]];
                model.refraction.medium.region_mut(k).set_absorption(tint);
            }
        }
    }
}
