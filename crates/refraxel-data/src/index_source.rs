//! A refractive index that is known: from a file, or from values in memory.

use crate::region::check_scale;
use crate::synth::{IndexTruth, Shape, TriangleMesh};
use crate::{DataError, IndexVolume, OutOfScale, read_mesh};
use refraxel_core::Aabb;
use std::path::{Path, PathBuf};

/// A refractive index, or the shape of a body, that is known before training.
///
/// [`IndexSource::read`] reads one from a file; `From` makes one of a value in memory. Coordinates are those of the
/// dataset's world.
#[derive(Clone, Debug)]
pub enum IndexSource {
    /// The shapes and indices of a `scene.json`.
    Truth(IndexTruth),
    /// The index in the cells of a box.
    Volume(IndexVolume),
    /// A closed shape whose index is not known; from a file, it is a triangle mesh.
    Mesh(Shape),
}

/// A file does not say where the index is.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum IndexSourceError {
    /// The file cannot be read, or is not what its extension says.
    #[error("cannot start from this index of refraction: {0}")]
    Data(#[from] DataError),
    /// The extension is not one of those that are read.
    #[error(
        "cannot start from {path}: expected a scene.json, an index volume (.npz, .npy) or a mesh (.ply, .obj)",
        path = path.display()
    )]
    UnknownKind {
        /// The file.
        path: PathBuf,
    },
}

impl IndexSource {
    /// Reads a file by its extension: `.json` (a `scene.json`), `.npz` and `.npy` (an index volume), `.ply` and `.obj`
    /// (a closed mesh).
    ///
    /// `bounds_of_volume` is the box of a volume, instead of the one that an `.npz` states; an `.npy` needs it. Other
    /// kinds ignore it.
    pub fn read(path: &Path, bounds_of_volume: Option<Aabb<f64>>) -> Result<IndexSource, IndexSourceError> {
        let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_lowercase();
        Ok(match extension.as_str() {
            "json" => IndexTruth::read(path)?.into(),
            "npz" | "npy" => IndexVolume::read(path, bounds_of_volume)?.into(),
            "ply" | "obj" => read_mesh(path)?.into(),
            _ => return Err(IndexSourceError::UnknownKind { path: path.to_owned() }),
        })
    }

    /// Refuses bodies that are out of scale with the scene's box.
    pub fn check_scale(&self, scene: &Aabb<f64>) -> Result<(), OutOfScale> {
        let check = |bounds: &Aabb<f64>| check_scale("a body of the known index", bounds, scene);
        match self {
            Self::Truth(truth) => truth.boxes().try_for_each(|b| check(&b)),
            Self::Volume(_) | Self::Mesh(_) => check(&self.bounds()),
        }
    }

    /// The box outside of which the index is 1.
    pub fn bounds(&self) -> Aabb<f64> {
        match self {
            Self::Truth(truth) => truth.bounding_box(),
            Self::Volume(volume) => *volume.bounds(),
            Self::Mesh(shape) => shape.bounds(),
        }
    }
}

impl From<IndexTruth> for IndexSource {
    fn from(truth: IndexTruth) -> Self {
        Self::Truth(truth)
    }
}

impl From<IndexVolume> for IndexSource {
    fn from(volume: IndexVolume) -> Self {
        Self::Volume(volume)
    }
}

impl From<Shape> for IndexSource {
    fn from(shape: Shape) -> Self {
        Self::Mesh(shape)
    }
}

impl From<TriangleMesh> for IndexSource {
    fn from(mesh: TriangleMesh) -> Self {
        Self::Mesh(Shape::Mesh(mesh))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synth::npz_of_index;
    use refraxel_core::{Vec3, vec3};

    fn read(name: &str, content: impl AsRef<[u8]>) -> Result<IndexSource, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        std::fs::write(&path, content).unwrap();
        IndexSource::read(&path, None).map_err(|e| e.to_string())
    }

    #[test]
    fn each_kind_of_file_gives_its_box() {
        let unit = Aabb::new(Vec3::zero(), vec3(1.0, 1.0, 1.0));
        let scene = r#"{"refractive": [{"shape": "box", "min": [0, 0, 0], "max": [1, 1, 1], "ior": 1.5}]}"#;
        let mesh = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
        let volume = npz_of_index(&unit, [1, 1, 1], &[1.5]);
        let sources = [read("a.json", scene), read("a.OBJ", mesh), read("a.npz", volume)];
        for source in sources.map(Result::unwrap) {
            let found = source.bounds();
            let off = (found.min - unit.min).length().max((found.max - unit.max).length());
            assert!(off < 1e-8, "{found:?}"); // the mesh pads its box by 1e-9
        }
    }

    #[test]
    fn bodies_out_of_scale_with_the_scene_are_refused() {
        let scene = Aabb::cube(1.0);
        let ball = |radius: f64, x: f64| {
            let ball = r#"{"shape": "sphere", "center": [0, 0, 0], "radius": 0.5, "ior": 1.5}"#;
            let other =
                format!(r#"{{"shape": "sphere", "center": [{x}, 0, 0], "radius": {radius}, "ior": 1.3}}"#);
            read("a.json", format!(r#"{{"refractive": [{ball}, {other}]}}"#)).unwrap().check_scale(&scene)
        };
        assert_eq!((ball(0.01, 0.0), ball(20.0, 100.0)), (Ok(()), Ok(())));
        for (radius, x) in [(1e-30, 0.0), (1e30, 0.0), (0.5, 1e6)] {
            let message = ball(radius, x).unwrap_err().to_string();
            assert!(
                message.contains("a body of the known index") && message.contains("unit of length"),
                "{message}"
            );
        }
    }

    #[test]
    fn a_file_that_says_nothing_is_refused_with_its_name() {
        let nothing = read("a.json", "{}").unwrap_err();
        assert!(
            nothing.contains("cannot start from")
                && nothing.contains("refractive is missing; expected a list"),
            "{nothing}"
        );
        let unknown = read("a.stl", "").unwrap_err();
        assert!(unknown.contains("a.stl: expected a scene.json"), "{unknown}");
        let open =
            read("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\n").unwrap_err();
        assert!(open.contains("cannot start from") && open.contains("open at 3 edges"), "{open}");
    }
}
