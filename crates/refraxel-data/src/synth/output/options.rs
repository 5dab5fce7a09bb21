//! The options of a run that writes a dataset.

use super::files::io;
use crate::synth::cameras::CameraSet;
use crate::synth::dataset::{DatasetOptions, ViewCounts};
use crate::synth::elevations::Elevations;
use crate::synth::error::SynthError;
use crate::synth::photographic::Imperfections;
use crate::synth::render::Sampling;
use crate::synth::scene::Scene;
use crate::synth::scenes::{Room, SceneInfo, SceneOptions, room, room_list, scene, scene_list};
use crate::synth::shape::TriangleMesh;
use crate::synth::trace::{Limits, Reflection};
use crate::synth::truth::refractive_json;
use serde_json::{Value, json};
use std::path::PathBuf;

/// The options of `refraxel synth`.
#[derive(Clone, Debug)]
pub struct SynthOptions {
    /// Name of the scene, see [`scene_list`](crate::synth::scene_list).
    pub scene: String,
    /// Folder of the dataset; created when missing.
    pub out: PathBuf,
    /// Width of the pictures [pixel]; they are square, photographs 4 : 3.
    pub size: u32,
    /// Views per split.
    pub views: ViewCounts,
    /// Choice of textures, cameras and jitter.
    pub seed: u64,
    /// Index of the main refractive body; `None`: the scene's default.
    pub ior: Option<f64>,
    /// Whether interfaces reflect.
    pub reflection: Reflection,
    /// From where the scene is seen.
    pub cameras: CameraSet,
    /// Samples per pixel, rounded up to a square number.
    pub spp: u32,
    /// Samples per pixel where the first ones differ; 0 or at most `spp`: none.
    pub detail_spp: u32,
    /// Also write linear float pictures.
    pub exr: bool,
    /// Cells along the longest edge of the index field; 0: no field.
    pub index_resolution: u32,
    /// Wavefront OBJ file whose mesh takes the place of the knot in `glass_mesh`.
    pub mesh: Option<PathBuf>,
    /// Photographs of a [`room`](crate::synth::room) with these imperfections instead of exact renderings of a scene. `cameras`,
    /// `exr` and `mesh` are not used then.
    pub photographic: Option<Imperfections>,
    /// Threads; `None`: those of the current rayon pool.
    pub threads: Option<usize>,
}

impl SynthOptions {
    /// The usual dataset of a scene: 100 + 10 + 40 views of 200² from the upper hemisphere.
    pub fn new(scene: &str, out: impl Into<PathBuf>) -> SynthOptions {
        SynthOptions {
            scene: scene.into(),
            out: out.into(),
            size: 200,
            views: ViewCounts::default(),
            seed: 0,
            ior: None,
            reflection: Reflection::On,
            cameras: CameraSet::Upper,
            spp: 16,
            detail_spp: 64,
            exr: false,
            index_resolution: 128,
            mesh: None,
            photographic: None,
            threads: None,
        }
    }

    /// The usual photographs of a room: 60 + 16 of 480 × 360 with all imperfections.
    pub fn photographs(room: &str, out: impl Into<PathBuf>) -> SynthOptions {
        SynthOptions {
            size: 480,
            views: ViewCounts { train: 60, val: 0, test: 16 },
            spp: 4,
            detail_spp: 0,
            photographic: Some(Imperfections::ALL),
            ..SynthOptions::new(room, out)
        }
    }

    /// Width and height of the pictures [pixel].
    pub fn picture_size(&self) -> [u32; 2] {
        let height = if self.photographic.is_some() { (3 * self.size).div_ceil(4) } else { self.size };
        [self.size, height]
    }

    /// The same without files.
    pub(super) fn dataset(&self) -> DatasetOptions {
        DatasetOptions {
            size: self.picture_size(),
            views: self.views,
            cameras: self.cameras,
            sampling: Sampling {
                spp: self.spp,
                detail_spp: self.detail_spp,
                seed: self.seed,
                limits: Limits { reflection: self.reflection, ..Limits::default() },
            },
        }
    }

    /// Refuses numbers out of range.
    pub(super) fn check(&self) -> Result<(), SynthError> {
        let within = |option, value: u64, low: u64, high: u64| {
            let expected = format!("a whole number from {low} to {high}");
            let error = SynthError::Range { option, found: value.to_string(), expected };
            if (low..=high).contains(&value) { Ok(()) } else { Err(error) }
        };
        within("--size", self.size.into(), 1, 8192)?;
        within("--views", self.views.total() as u64, 1, 100_000)?;
        within("--spp", self.spp.into(), 1, 65_536)?;
        within("--detail-spp", self.detail_spp.into(), 0, 65_536)?;
        within("--index-resolution", self.index_resolution.into(), 0, 1024)?;
        within("--threads", self.threads.unwrap_or(1) as u64, 1, 1024)?;
        self.check_kind()?;
        if self.mesh.is_some() && self.scene != "glass_mesh" {
            let expected = format!("nothing: only glass_mesh takes a mesh, not {}", self.scene);
            return Err(SynthError::Range { option: "--mesh", found: "a file".into(), expected });
        }
        Ok(())
    }

    /// Refuses a room without photographs, and photographs of a scene without a room.
    fn check_kind(&self) -> Result<(), SynthError> {
        let is_in = |list: Vec<SceneInfo>| list.iter().any(|info| info.name == self.scene);
        let (found, expected) = match self.photographic {
            None if is_in(room_list()) => ("not given", "it with every room"),
            Some(_) if is_in(scene_list()) => ("given", "it with rooms only, see --list"),
            _ => return Ok(()),
        };
        let expected = format!("{expected}; the scene is {}", self.scene);
        Err(SynthError::Range { option: "--photographic", found: found.into(), expected })
    }

    /// The room of photographs.
    pub(super) fn room(&self) -> Result<Room, SynthError> {
        room(&self.scene, &SceneOptions { seed: self.seed, ior: self.ior, mesh: None })
    }

    /// The scene, with the mesh where one is given; refuses cameras that it is not made for.
    pub(super) fn scene(&self) -> Result<Scene, SynthError> {
        let mesh = match &self.mesh {
            None => None,
            Some(path) => {
                let text = std::fs::read_to_string(path).map_err(io("read", path))?;
                let bad = |source| SynthError::Mesh { path: path.clone(), source };
                Some(TriangleMesh::from_obj(&text).map_err(bad)?)
            }
        };
        let scene = scene(&self.scene, &SceneOptions { seed: self.seed, ior: self.ior, mesh })?;
        if self.cameras == CameraSet::Full && scene.elevations != Elevations::UPPER {
            let [low, high] = scene.elevations.degrees();
            let expected =
                format!("upper: the scene {} is seen from {low:.0}° to {high:.0}° only", self.scene);
            return Err(SynthError::Range { option: "--cameras", found: "full".into(), expected });
        }
        Ok(scene)
    }

    /// Everything that the bytes of the pictures depend on.
    pub(super) fn parameters(&self, scene: &Scene) -> Value {
        let elevations = self.cameras.elevations(scene);
        let cameras = match elevations {
            Elevations::UPPER => json!("upper"),
            Elevations::FULL => json!("full"),
            _ => json!(elevations.degrees()),
        };
        let mut all = json!({
            "program": concat!("refraxel ", env!("CARGO_PKG_VERSION")),
            "scene": self.scene,
            "size": self.size,
            "views": [self.views.train, self.views.val, self.views.test],
            "seed": self.seed,
            "reflection": self.reflection == Reflection::On,
            "cameras": cameras,
            "spp": self.spp,
            "detail_spp": self.detail_spp,
            "exr": self.exr,
            "index_resolution": self.index_resolution,
            "bodies": refractive_json(scene),
        });
        if let Some(with) = self.photographic {
            all["photographic"] = json!(with.names());
        }
        all
    }
}
