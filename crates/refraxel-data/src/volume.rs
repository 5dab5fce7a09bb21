//! Volumes of the refractive index: the `index.npz` of synthetic scenes, and `.npy` arrays of other tools.

use crate::formats::{npy, npz};
use crate::origin::Placed;
use crate::{DataError, limits};
use refraxel_core::{Aabb, Vec3};
use std::path::Path;

/// Indices of refraction that matter has. One below 1 is relative to what is around: air in water has 0.75.
pub const INDICES: [f64; 2] = [0.25, 5.0];

/// The refractive index in the cells of a box.
#[derive(Clone, Debug, PartialEq)]
pub struct IndexVolume {
    bounds: Aabb<f64>,
    cells: [usize; 3],
    values: Vec<f32>,
}

const SHAPE: &str = "three dimensions n[x, y, z], none of them empty";
const INDEX: &str = "numbers from 0.25 to 5";
const CORNER: &str = "three finite numbers, each of max above that of min";

impl IndexVolume {
    /// A volume of `cells` per axis in a box, z fastest and x slowest; `None` unless there is one value per cell, all are
    /// [indices of matter](INDICES), and the box is not empty.
    pub fn new(bounds: Aabb<f64>, cells: [usize; 3], values: Vec<f32>) -> Option<Self> {
        let count = cells.iter().try_fold(1_usize, |n, &c| n.checked_mul(c))?;
        let fits = count > 0 && count == values.len() && values.iter().all(is_index) && is_box(&bounds);
        fits.then_some(Self { bounds, cells, values })
    }

    /// Reads `n[x, y, z]` at the centres of the cells of a box from an `.npz` with the arrays `n`, `min` and `max` as
    /// `refraxel synth` writes it, or from an `.npy`, which needs `bounds`. `bounds`, where given, replace those of the file.
    pub fn read(path: &Path, bounds: Option<Aabb<f64>>) -> Result<Self, DataError> {
        let content = limits::read(path, limits::BINARY_BYTES)?;
        let fault = |key: &str, found: String, expected| DataError::Value {
            path: path.to_owned(),
            key: key.into(),
            found,
            expected,
        };
        let archive = if npz::is_archive(&content) { Some(npz::entries(path, &content)?) } else { None };
        let array = |name: &'static str| match &archive {
            None => npy::array(path, &content),
            Some(entries) => {
                let entry = entries.iter().find(|e| e.0 == format!("{name}.npy"));
                let entry = entry.ok_or_else(|| {
                    let names: Vec<&str> = entries.iter().map(|e| e.0.as_str()).collect();
                    fault("the list of arrays", names.join(", "), "arrays n, min and max")
                })?;
                npy::array(path, entry.1)
            }
        };
        let stated = |name| {
            let corner = array(name)?;
            let corner: Result<[f64; 3], _> = corner.values.try_into();
            corner.map(Vec3::from).map_err(|v: Vec<f64>| fault(name, format!("{} numbers", v.len()), CORNER))
        };
        let bounds = match (bounds, &archive) {
            (Some(bounds), _) => bounds,
            (None, Some(_)) => Aabb::new(stated("min")?, stated("max")?),
            (None, None) => {
                return Err(fault(
                    "the box",
                    "missing in an .npy file".into(),
                    "a box beside the file, or an .npz with min and max",
                ));
            }
        };
        if !is_box(&bounds) {
            return Err(fault(
                "the box",
                format!("{:?} to {:?}", bounds.min.to_array(), bounds.max.to_array()),
                CORNER,
            ));
        }
        let n = array("n")?;
        let cells: [usize; 3] =
            n.shape.try_into().map_err(|s: Vec<usize>| fault("the shape", format!("{s:?}"), SHAPE))?;
        let values: Vec<f32> = n.values.into_iter().map(|v| v as f32).collect();
        let wrong = values.iter().find(|v| !is_index(v)).copied();
        let volume = Self::new(bounds, cells, values).ok_or_else(|| match wrong {
            Some(v) => fault("the index", v.to_string(), INDEX),
            None => fault("the shape", format!("{cells:?}"), SHAPE),
        })?;
        if volume.values.iter().all(|v| *v == 1.0) {
            return Err(fault("the index", "1 everywhere".into(), "values other than 1: nothing bends rays"));
        }
        Ok(volume)
    }

    /// The box.
    pub fn bounds(&self) -> &Aabb<f64> {
        &self.bounds
    }
    /// Cells per axis.
    pub fn cells(&self) -> [usize; 3] {
        self.cells
    }

    /// n at a world point: trilinear between the centres of cells, constant from the outermost centres to the faces of the
    /// box, 1 outside.
    pub fn index(&self, x: Vec3<f64>) -> f64 {
        if !self.bounds.contains(x) {
            return 1.0;
        }
        let (e, mut low, mut f) = (self.bounds.extent(), [0; 3], [0.0; 3]);
        for a in 0..3 {
            let last = self.cells[a] - 1;
            let g = ((x[a] - self.bounds.min[a]) / e[a] * self.cells[a] as f64 - 0.5).clamp(0.0, last as f64);
            low[a] = (g as usize).min(last.saturating_sub(1));
            f[a] = g - low[a] as f64;
        }
        let weights = refraxel_core::grid::trilinear::weights(Vec3::from(f));
        let at = |k: usize| {
            let i: [usize; 3] = std::array::from_fn(|a| (low[a] + (k >> a & 1)).min(self.cells[a] - 1));
            f64::from(self.values[(i[0] * self.cells[1] + i[1]) * self.cells[2] + i[2]])
        };
        weights.iter().enumerate().map(|(k, w)| w * at(k)).sum()
    }
}

impl Placed for IndexVolume {
    fn moved(self, by: Vec3<f64>) -> Self {
        Self { bounds: self.bounds.moved(by), ..self }
    }
}

fn is_index(n: &f32) -> bool {
    (INDICES[0]..=INDICES[1]).contains(&f64::from(*n))
}

fn is_box(b: &Aabb<f64>) -> bool {
    b.min.is_finite() && b.max.is_finite() && b.extent().min_element() > 0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synth::npz_of_index;
    use refraxel_core::vec3;

    fn unit() -> Aabb<f64> {
        Aabb::new(vec3(-1.0, 0.0, 0.0), vec3(1.0, 1.0, 3.0))
    }

    fn file(name: &str, bytes: &[u8]) -> (tempfile::TempDir, std::path::PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        (folder, path)
    }

    fn values() -> Vec<f32> {
        (0..24).map(|k| 1.0 + k as f32 / 32.0).collect()
    }

    #[test]
    fn what_the_tracer_writes_is_read_back() {
        let (_folder, path) = file("index.npz", &npz_of_index(&unit(), [4, 2, 3], &values()));
        let volume = IndexVolume::read(&path, None).unwrap();
        assert_eq!(volume, IndexVolume::new(unit(), [4, 2, 3], values()).unwrap());
        // Cell (1, 0, 2) has its centre at (−1/4, 1/4, 5/2) and holds the ninth value.
        assert_eq!(volume.index(vec3(-0.25, 0.25, 2.5)), 1.25);
        assert_eq!(volume.index(vec3(-0.25, 0.25, 3.1)), 1.0);
    }

    #[test]
    fn a_bare_array_needs_a_box() {
        let n: Vec<f64> = values().into_iter().map(f64::from).collect();
        let (_folder, path) = file("n.npy", &npy::tests::npy("(4, 2, 3)", &n));
        let error = IndexVolume::read(&path, None).unwrap_err().to_string();
        assert!(error.contains("n.npy") && error.contains("a box beside the file"), "{error}");
        assert_eq!(IndexVolume::read(&path, Some(unit())).unwrap().cells(), [4, 2, 3]);
    }

    #[test]
    fn impossible_volumes_say_what_is_wrong() {
        let mut n = vec![1.0; 24];
        n[5] = -0.5;
        let read = |shape: &str, n: &[f64]| {
            let (_folder, path) = file("n.npy", &npy::tests::npy(shape, n));
            IndexVolume::read(&path, Some(unit())).unwrap_err().to_string()
        };
        assert!(read("(4, 2, 3)", &n).contains("the index is -0.5; expected numbers from 0.25 to 5"));
        assert!(read("(4, 2, 3)", &[1e30; 24]).contains("expected numbers from 0.25 to 5"));
        assert!(read("(4, 2, 3)", &[1.0; 24]).contains("the index is 1 everywhere"));
        assert!(read("(4, 6)", &[1.0; 24]).contains("three dimensions"));
        assert!(read("(0, 2, 3)", &[]).contains("none of them empty"));
        let (_folder, path) = file("other.npz", b"PK\x03\x04 and no more");
        assert!(IndexVolume::read(&path, None).unwrap_err().to_string().contains("numpy.savez"));
    }
}
