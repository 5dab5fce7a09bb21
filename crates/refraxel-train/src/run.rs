//! What a run stores: one self-contained checkpoint with everything needed to render it or to go on training.

mod clearcoat;
mod mirrors;
mod probes;

use crate::backend::Backend;
use crate::checkpoint::{CheckpointError, DataView, Tensor, TensorData, TensorFile, TensorView, save};
use crate::cpu::{AdamMoments, CpuBackend, IndexMoments, Moments};
use crate::initial::Gate;
use crate::model::{Plan, bounds_of};
use crate::options::Options;
use crate::polyhedron::{Plane, Polyhedron};
use crate::refraction::{Refraction, RegionState};
use crate::schedule::Phase;
use clearcoat::{StoredClearcoat, clearcoat_tensors, restore_clearcoat, stored_clearcoat};
use mirrors::{StoredReflection, reflection_tensors, restore_reflection, stored_reflection};
use refraxel_core::{
    AlignedVec, Background, BrickMap, Domain, EnvironmentMap, Extent, IndexGrid, LevelSet, Medium, ShDegree,
    VoxelField,
};
use refraxel_data::Backdrop;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Name of the checkpoint in the folder of a run.
pub const CHECKPOINT: &str = "checkpoint.safetensors";

/// Where a run stands. The random numbers are a function of the seed and the step, so this is all their state.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct State {
    /// Steps done.
    pub step: u64,
    /// Stage of the schedule.
    pub stage: u32,
    /// What the run is busy with.
    #[serde(default, alias = "act")]
    pub phase: Phase,
    /// Share of the run after which rays bent, once they do.
    #[serde(default)]
    pub bends_since: Option<f64>,
    /// Seconds spent training.
    pub seconds: f64,
    /// Validation scores recorded.
    pub validations: u32,
    /// Factor on the learning rates after overflows.
    #[serde(alias = "caution")]
    pub rate_scale: f32,
    /// Overflows since the last good state.
    pub rollbacks: u32,
}

impl Default for State {
    fn default() -> Self {
        Self {
            step: 0,
            stage: 0,
            phase: Phase::Straight,
            bends_since: None,
            seconds: 0.0,
            validations: 0,
            rate_scale: 1.0,
            rollbacks: 0,
        }
    }
}

/// Which data a run was trained on, and how they were read.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Source {
    /// Folder or file of the dataset, as given.
    pub path: PathBuf,
    /// `--holdout`.
    pub holdout: Option<usize>,
    /// `--mask-meaning`: "refractive", "keep" or "ignore".
    pub mask_meaning: Option<String>,
    /// `--allow-outside`.
    pub allow_outside: bool,
    /// Names of the views trained on and of those held out.
    pub train: Vec<String>,
    /// Names of the views held out.
    pub test: Vec<String>,
}

/// A run read back from its checkpoint.
pub struct Loaded {
    /// Its options.
    pub options: Options,
    /// Its plan.
    pub plan: Plan,
    /// Where it stands.
    pub state: State,
    /// What it was trained on.
    pub source: Source,
    /// Its parameters.
    pub backend: CpuBackend,
}

#[derive(Serialize, Deserialize)]
struct Header {
    program: String,
    #[serde(alias = "config")]
    options: Options,
    state: State,
    source: Source,
    bounds: [[f32; 3]; 2],
    contracted: bool,
    resolution: [u32; 3],
    finest_resolution: [u32; 3],
    sh_degree: u8,
    near: f32,
    backdrop: StoredBackdrop,
    background: StoredBackground,
    /// Refractive regions; their tensors are called `index.K`, K from 0.
    #[serde(default)]
    regions: Vec<StoredRegion>,
    /// What their surfaces mirror; tensors `reflection.K.outer` and `.inner`, K as in the regions.
    #[serde(default)]
    reflection: StoredReflection,
    /// The clearcoat of opaque things; tensors `clearcoat.strength` and `clearcoat.radiance`.
    #[serde(default, alias = "gloss", skip_serializing_if = "Option::is_none")]
    clearcoat: Option<StoredClearcoat>,
    /// Parameters are in the coordinates of the user's data; nothing was moved or scaled.
    world_from_model: String,
}

#[derive(Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum StoredBackdrop {
    Transparent,
    Color([f32; 3]),
    Surroundings,
}

#[derive(Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum StoredBackground {
    Constant([f32; 3]),
    EnvironmentRows(usize),
}

#[derive(Serialize, Deserialize)]
struct StoredRegion {
    bounds: [[f32; 3]; 2],
    resolution: [u32; 3],
    /// Nodes of its level set, where it has a surface.
    surface_resolution: Option<[u32; 3]>,
    /// The index that a search found.
    searched: Option<f32>,
    /// The planes of its faces, where all are flat.
    #[serde(default)]
    solid: Option<Polyhedron>,
    /// Steps that the moments of its index and of its surface saw.
    moment_steps: [u32; 2],
}

/// Save a run, atomically.
pub fn save_run(
    folder: &Path,
    options: &Options,
    plan: &Plan,
    state: &State,
    source: &Source,
    backend: &CpuBackend,
) -> Result<(), CheckpointError> {
    let (field, moments) = (backend.field(), backend.moments());
    let (texels, background) = match backend.background() {
        Background::Constant(c) => (&[][..], StoredBackground::Constant(*c)),
        Background::Environment(map) => {
            (map.texels.as_flattened(), StoredBackground::EnvironmentRows(map.height()))
        }
    };
    let header = Header {
        program: concat!("refraxel ", env!("CARGO_PKG_VERSION")).to_owned(),
        options: options.clone(),
        state: state.clone(),
        source: source.clone(),
        bounds: [field.domain.bounds.min.to_array(), field.domain.bounds.max.to_array()],
        contracted: field.domain.extent == Extent::Contracted,
        resolution: field.domain.resolution,
        finest_resolution: plan.finest.resolution,
        sh_degree: field.degree.get(),
        near: plan.near,
        backdrop: match plan.backdrop {
            Backdrop::Transparent => StoredBackdrop::Transparent,
            Backdrop::Color(c) => StoredBackdrop::Color(c),
            Backdrop::Surroundings => StoredBackdrop::Surroundings,
        },
        background,
        regions: stored_regions(backend),
        reflection: stored_reflection(backend),
        clearcoat: backend.clearcoat().map(stored_clearcoat),
        world_from_model: "identity".to_owned(),
    };
    let header = serde_json::to_value(header).map_err(|e| foreign(folder, &e.to_string()))?;
    let (voxels, stride) = (field.map.voxels(), field.degree.stride());
    let (bricks, per_voxel, per_channel) = ([field.map.bricks().len(), 3], [voxels], [voxels, stride]);
    let texel_shape = [texels.len() / 3, 3];
    let slots = [field.map.slots()];
    let of_index = [index_tensors(backend), reflection_tensors(backend), clearcoat_tensors(backend)].concat();
    let mut tensors = vec![
        ("bricks", TensorView::new(&bricks, DataView::U32(field.map.bricks().as_flattened()))),
        ("occupied", TensorView::new(&slots, DataView::U64(backend.occupied()))),
        ("density", TensorView::new(&per_voxel, DataView::F32(&field.density))),
        ("colour", TensorView::new(&per_channel, DataView::F32(&field.colour))),
        ("density_moment", TensorView::new(&per_voxel, DataView::F32(&moments.density))),
        ("colour_moment", TensorView::new(&per_voxel, DataView::F32(&moments.colour))),
        ("background", TensorView::new(&texel_shape, DataView::F32(texels))),
        (
            "background_moment",
            TensorView::new(&texel_shape, DataView::F32(moments.background.as_flattened())),
        ),
    ];
    tensors.extend(of_index.iter().map(|(name, tensor)| (name.as_str(), tensor.view())));
    save(&folder.join(CHECKPOINT), &header, &tensors)
}

fn stored_regions(backend: &CpuBackend) -> Vec<StoredRegion> {
    let refraction = backend.refraction();
    let stored = backend.moments().index.iter().enumerate().map(|(k, moments)| {
        let region = &refraction.medium.regions()[k];
        let Domain { bounds, resolution, .. } = *region.domain();
        let bounds = [bounds.min.to_array(), bounds.max.to_array()];
        let surface_resolution = region.level_set().map(|l| l.domain().resolution);
        let moment_steps = [moments.index.steps, moments.surface.steps];
        let states = refraction.states.get(k);
        let searched = states.and_then(|e| e.searched);
        let solid = states.and_then(|e| e.solid.clone());
        StoredRegion { bounds, resolution, surface_resolution, searched, solid, moment_steps }
    });
    stored.collect()
}

/// Per region: coefficients of w, both moments, and what is free and gated; the last two are empty where there is none.
fn index_tensors(backend: &CpuBackend) -> Vec<(String, Tensor)> {
    let refraction = backend.refraction();
    let mut out = Vec::new();
    for (k, moments) in backend.moments().index.iter().enumerate() {
        let region = &refraction.medium.regions()[k];
        let mut put = |name: &str, data: TensorData, len: usize| {
            out.push((format!("index.{k}{name}"), Tensor { shape: vec![len], data }));
        };
        let n = region.coefficients().len();
        put("", TensorData::F32(region.coefficients().to_vec()), n);
        put(".first_moment", TensorData::F32(moments.index.first.clone()), n);
        put(".second_moment", TensorData::F32(moments.index.second.clone()), n);
        if let Some(level) = region.level_set() {
            let n = level.coefficients().len();
            put(".surface", TensorData::F32(level.coefficients().to_vec()), n);
            put(".surface_first_moment", TensorData::F32(moments.surface.first.clone()), n);
            put(".surface_second_moment", TensorData::F32(moments.surface.second.clone()), n);
        }
        let states = refraction.states.get(k);
        let free: Vec<u8> = states.map_or(Vec::new(), |e| e.free.iter().map(|&f| u8::from(f)).collect());
        let gate = states.and_then(|e| e.gate.as_ref()).map_or(Vec::new(), |g| g.values().to_vec());
        let (free_len, gate_len) = (free.len(), gate.len());
        put(".free", TensorData::U8(free), free_len);
        put(".gate", TensorData::U8(gate), gate_len);
    }
    out
}

/// The refraction of a checkpoint, and the moments of its index.
fn restore_refraction(
    path: &Path,
    h: &Header,
    file: &mut TensorFile,
) -> Result<(Refraction, Vec<IndexMoments>), CheckpointError> {
    let optics = h.options.optics();
    let (mut grids, mut moments, mut states) = (Vec::new(), Vec::new(), Vec::new());
    for (k, region) in h.regions.iter().enumerate() {
        let wrong = |what: &str| foreign(path, &format!("refractive region {k} {what}"));
        if !region.resolution.iter().all(|n| (7..=2048).contains(n)) || !is_box(region.bounds) {
            return Err(wrong("has no valid box or resolution"));
        }
        let domain = Domain {
            bounds: bounds_of(region.bounds),
            extent: Extent::Bounded,
            resolution: region.resolution,
        };
        let count = |n: [u32; 3]| n.map(|n| n as usize).iter().product::<usize>();
        let name = |part: &str| format!("index.{k}{part}");
        let mut values = |part: &str, n: usize| f32s(path, file, &name(part), n).map(|v| v.to_vec());
        let nodes = count(region.resolution);
        let coefficients = values("", nodes)?;
        let adam = |first, second, steps| AdamMoments { first, second, steps };
        let index =
            adam(values(".first_moment", nodes)?, values(".second_moment", nodes)?, region.moment_steps[0]);
        let interpolation = h.options.index.interpolation.into();
        let (grid, surface) = match region.surface_resolution {
            None => {
                let grid = IndexGrid::from_coefficients(
                    domain.bounds,
                    domain.resolution,
                    interpolation,
                    coefficients,
                );
                (
                    grid.ok_or_else(|| wrong("has an index that is not finite, or not 1 at its border"))?,
                    AdamMoments::default(),
                )
            }
            Some(resolution) => {
                if !resolution.iter().all(|n| (7..=2048).contains(n))
                    || !coefficients.iter().all(|c| *c > 0.0)
                {
                    return Err(wrong("has a surface of no valid resolution, or an index below 0"));
                }
                let n = count(resolution);
                let level = LevelSet::from_coefficients(domain.bounds, resolution, values(".surface", n)?);
                let level = level.ok_or_else(|| wrong("has a surface that is not finite"))?;
                let grid = IndexGrid::vacuum(domain.bounds, domain.resolution, interpolation);
                let mut grid = grid.with_level_set(level);
                grid.coefficients_mut().copy_from_slice(&coefficients);
                grid.find_flat_cells(None);
                let moments = (values(".surface_first_moment", n)?, values(".surface_second_moment", n)?);
                (grid, adam(moments.0, moments.1, region.moment_steps[1]))
            }
        };
        let surface_nodes = surface.first.len();
        grids.push(grid);
        moments.push(IndexMoments { index, surface });
        let free: Vec<bool> = u8s(path, file, &name(".free"))?.into_iter().map(|f| f > 0).collect();
        let gate = Some(u8s(path, file, &name(".gate"))?).filter(|g| !g.is_empty());
        let gate =
            gate.map(|g| Gate::from_values(domain, g).ok_or_else(|| wrong("has a gate of another size")));
        if !free.is_empty() && free.len() != nodes {
            return Err(wrong("has a list of free nodes of another size"));
        }
        let solid = region.solid.clone();
        let is_unit = |p: &Plane| (p.normal().length() - 1.0).abs() < 1e-3 && p.offset().is_finite();
        if !solid.iter().flat_map(Polyhedron::planes).all(is_unit) {
            return Err(wrong("has faces that are no planes"));
        }
        if solid.as_ref().is_some_and(|s| s.parameters() > surface_nodes) {
            return Err(wrong("has more faces than its surface has room for"));
        }
        let searched = region.searched;
        states.push(RegionState { free, gate: gate.transpose()?, searched, solid });
    }
    let medium = Medium::new(grids).map_err(|e| foreign(path, &e.to_string()))?;
    let mut refraction = Refraction { medium, optics, states };
    refraction.find_flat_cells();
    Ok((refraction, moments))
}

fn is_box([low, high]: [[f32; 3]; 2]) -> bool {
    (0..3).all(|a| low[a] < high[a] && (high[a] - low[a]).is_finite())
}

/// Checkpoints of former versions call the clearcoat "gloss".
fn rename_former_tensors(file: &mut TensorFile) {
    let renamed = std::mem::take(&mut file.tensors).into_iter().map(|(name, tensor)| {
        let now = name.strip_prefix("gloss.").map(|part| format!("clearcoat.{part}"));
        (now.unwrap_or(name), tensor)
    });
    file.tensors = renamed.collect();
}

/// Read a run back.
pub fn load_run(folder: &Path) -> Result<Loaded, CheckpointError> {
    let path = folder.join(CHECKPOINT);
    let mut file = TensorFile::load(&path)?;
    rename_former_tensors(&mut file);
    let header: Header = serde_json::from_value(std::mem::take(&mut file.header))
        .map_err(|e| foreign(&path, &format!("its header does not fit: {e}")))?;
    let options = header.options.clone().checked();
    options.map_err(|e| foreign(&path, &format!("its options make no sense: {e}")))?;
    let (backend, finest) = restore(&path, &header, file)?;
    let backdrop = match header.backdrop {
        StoredBackdrop::Transparent => Backdrop::Transparent,
        StoredBackdrop::Color(c) => Backdrop::Color(c),
        StoredBackdrop::Surroundings => Backdrop::Surroundings,
    };
    let plan = Plan { finest, near: header.near, backdrop };
    Ok(Loaded { options: header.options, plan, state: header.state, source: header.source, backend })
}

fn restore(
    path: &Path,
    h: &Header,
    mut file: TensorFile,
) -> Result<(CpuBackend, Domain<f32>), CheckpointError> {
    let wrong = |what: &str| foreign(path, what);
    let degree = ShDegree::new(h.sh_degree).ok_or_else(|| wrong("its SH degree is not 0 to 3"))?;
    // 2048³ nodes already need a table of half a gigabyte.
    let valid = |r: &[u32; 3]| r.iter().all(|n| (2..=2048).contains(n));
    if !valid(&h.resolution) || !valid(&h.finest_resolution) {
        return Err(wrong("its resolution is not 2 to 2048 per axis"));
    }
    if !is_box(h.bounds) || !(0.0..f32::MAX).contains(&h.near) {
        return Err(wrong("its box or near limit is not a finite size"));
    }
    let extent = if h.contracted { Extent::Contracted } else { Extent::Bounded };
    let domain = Domain { bounds: bounds_of(h.bounds), extent, resolution: h.resolution };
    let bricks = u32s(path, &mut file, "bricks")?.as_chunks::<3>().0.to_vec();
    let map = BrickMap::with_bricks(h.resolution, bricks)
        .ok_or_else(|| wrong("a brick lies outside the grid or occurs twice"))?;
    let (voxels, channels) = (map.voxels(), map.voxels() * degree.stride());
    let density = f32s(path, &mut file, "density", voxels)?;
    let colour = f32s(path, &mut file, "colour", channels)?;
    let rows = if let StoredBackground::EnvironmentRows(n) = h.background { n } else { 0 };
    if rows > 2048 {
        return Err(wrong("its panorama has more than 2048 rows"));
    }
    let texels = f32s(path, &mut file, "background", 6 * rows * rows)?;
    let texel_moments = f32s(path, &mut file, "background_moment", 6 * rows * rows)?;
    let moments = Moments {
        density: f32s(path, &mut file, "density_moment", voxels)?,
        colour: f32s(path, &mut file, "colour_moment", voxels)?,
        background: texel_moments.as_chunks().0.to_vec(),
        index: Vec::new(),
        reflection: Vec::new(),
        clearcoat: Default::default(),
    };
    let background = match h.background {
        StoredBackground::Constant(c) => Background::Constant(c),
        StoredBackground::EnvironmentRows(n) => {
            let texels = texels.as_chunks().0.to_vec();
            Background::Environment(
                EnvironmentMap::from_texels(n, texels).ok_or_else(|| wrong("its panorama has no rows"))?,
            )
        }
    };
    let field = VoxelField { domain, map, degree, density, colour };
    let finest = Domain { resolution: h.finest_resolution, ..domain };
    let mut backend = CpuBackend::with_moments(field, background, moments);
    let occupied = u64s(path, &mut file, "occupied")?;
    if !backend.restore_occupied(occupied) {
        return Err(wrong("its occupied cells are not those of its bricks"));
    }
    let (refraction, index_moments) = restore_refraction(path, h, &mut file)?;
    backend.restore_refraction(refraction, index_moments);
    let (reflection, mirror_moments) = restore_reflection(
        &h.reflection,
        backend.refraction(),
        |name, n| f32s(path, &mut file, name, n).map(|v| v.to_vec()),
        wrong,
    )?;
    backend.restore_reflection(reflection, mirror_moments);
    let read = |name: &str, n| f32s(path, &mut file, name, n).map(|v| v.to_vec());
    let (clearcoat, clearcoat_moments) = restore_clearcoat(&h.clearcoat, domain.bounds, read, wrong)?;
    backend.restore_clearcoat(clearcoat, clearcoat_moments);
    Ok((backend, finest))
}

fn take(path: &Path, file: &mut TensorFile, name: &str) -> Result<Tensor, CheckpointError> {
    file.tensors.remove(name).ok_or_else(|| foreign(path, &format!("tensor `{name}` is missing")))
}

fn f32s(
    path: &Path,
    file: &mut TensorFile,
    name: &str,
    len: usize,
) -> Result<AlignedVec<f32>, CheckpointError> {
    match take(path, file, name)?.data {
        TensorData::F32(v) if v.len() == len => Ok(AlignedVec::from_slice(&v)),
        TensorData::F32(v) => {
            Err(foreign(path, &format!("tensor `{name}` has {} values, expected {len}", v.len())))
        }
        _ => Err(foreign(path, &format!("tensor `{name}` is not of type F32"))),
    }
}

fn u32s(path: &Path, file: &mut TensorFile, name: &str) -> Result<Vec<u32>, CheckpointError> {
    match take(path, file, name)?.data {
        TensorData::U32(v) if v.len().is_multiple_of(3) => Ok(v),
        _ => Err(foreign(path, &format!("tensor `{name}` is not a list of U32 triples"))),
    }
}

fn u8s(path: &Path, file: &mut TensorFile, name: &str) -> Result<Vec<u8>, CheckpointError> {
    match take(path, file, name)?.data {
        TensorData::U8(v) => Ok(v),
        _ => Err(foreign(path, &format!("tensor `{name}` is not of type U8"))),
    }
}

fn u64s(path: &Path, file: &mut TensorFile, name: &str) -> Result<Vec<u64>, CheckpointError> {
    match take(path, file, name)?.data {
        TensorData::U64(v) => Ok(v),
        _ => Err(foreign(path, &format!("tensor `{name}` is not of type U64"))),
    }
}

fn foreign(path: &Path, found: &str) -> CheckpointError {
    CheckpointError::Foreign { path: path.to_owned(), found: found.to_owned() }
}
