//! Verbs that read a finished or unfinished run.

use std::path::PathBuf;

use clap::{ArgGroup, Args, ValueEnum};
use refraxel_data::Part;

use super::renderer::RendererArgs;
use super::values::{factor, frame_rate, index, size, words};
use super::work::WorkArgs;

/// A part of the dataset.
const PARTS: [(&str, &str, Part); 3] = [
    ("train", "The training images", Part::Train),
    ("val", "The images that are scored during training", Part::Val),
    ("test", "The held-out images", Part::Test),
];

/// `refraxel eval`
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  refraxel eval run
  refraxel eval run --split train --json
  refraxel eval run --index-from data/scene.json

Writes RUN/eval/SPLIT/NAME.png, where NAME is that of the photograph, and RUN/eval/SPLIT/metrics.json. With --index-from, \
the files go into RUN/eval/SPLIT-index/.")]
pub struct EvalArgs {
    /// The run's folder
    #[arg(value_name = "RUN")]
    pub run: PathBuf,
    /// The images to evaluate
    #[arg(long, value_parser = words(&PARTS), default_value = "test", value_name = "SPLIT")]
    pub split: Part,
    /// Bend the rays by this index instead of the run's own: a scene.json, an index volume, or a mesh
    ///
    /// Shows how good the run would be with this index and the same colours. The index is sampled on a fine grid (192 nodes
    /// along the longest edge). A mesh gets the index that the run has found. The run itself is not changed.
    #[arg(long, value_name = "FILE")]
    pub index_from: Option<PathBuf>,
    /// What renders.
    #[command(flatten)]
    pub renderer: RendererArgs,
    /// Threads, progress, JSON.
    #[command(flatten)]
    pub work: WorkArgs,
}

/// A picture of each view.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, ValueEnum)]
pub enum Layer {
    /// The colours that the camera sees
    Colour,
    /// Length of the ray to the point where half of the opacity is reached
    Depth,
    /// The share of the backdrop that the scene hides
    Opacity,
    /// Only the light that surfaces mirror
    Reflection,
    /// The colours without the light that surfaces mirror
    Transmission,
    /// The index of refraction along the ray that differs most from 1
    Index,
    /// The normal of the first refractive surface, as a normal map with opacity
    Normal,
    /// Length of the ray to the first refractive surface
    SurfaceDepth,
}

impl Layer {
    /// Its name on the command line.
    pub fn name(self) -> String {
        self.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
    }
}

/// `refraxel render`
#[derive(Args, Debug)]
#[command(group = ArgGroup::new("views").args(["orbit", "spiral", "cameras", "camera_path", "keyframes"]))]
#[command(group = ArgGroup::new("what").required(true).multiple(true)
    .args(["orbit", "spiral", "cameras", "camera_path", "keyframes", "slices", "paths"]))]
#[command(after_help = "Examples:
  refraxel render run --orbit 60 --out orbit
  refraxel render run --orbit 120 --out film.mp4
  refraxel render run --spiral 90 --out film.gif --fps 15 --size 320x320
  refraxel render run --camera-path camera_path.json --out film.webm
  refraxel render run --keyframes corners/transforms.json --frames 150 --out film.mp4
  refraxel render run --cameras path/transforms.json --out views --outputs colour,depth,index,normal,surface-depth
  refraxel render run --slices --paths 40 --out inside
  refraxel render run --orbit 60 --set-index 1.33 --out as_water
  refraxel render run --orbit 60 --scale-index 0.5 --out half_the_power

A name that ends in .mp4, .webm or .gif is a film. ffmpeg makes .mp4 and .webm; a GIF needs no other program. `refraxel view` writes camera \
paths. DIR/render_files.txt lists the files of the render. A folder that holds an earlier render is refused without --overwrite. \
Files that no render wrote are never replaced or removed.")]
pub struct RenderArgs {
    /// The run's folder
    #[arg(value_name = "RUN")]
    pub run: PathBuf,
    /// Render N views on a circle around the scene
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub orbit: Option<u32>,
    /// Render N views on a spiral around the scene, or before it, where the photographs are
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub spiral: Option<u32>,
    /// Render the cameras of a dataset or of a transforms.json
    #[arg(long, value_name = "FILE")]
    pub cameras: Option<PathBuf>,
    /// Render a camera_path.json, of `refraxel view` or of nerfstudio
    ///
    /// Its world is that of the dataset; for one that nerfstudio has moved and scaled, give --path-transform, too.
    #[arg(long, value_name = "FILE")]
    pub camera_path: Option<PathBuf>,
    /// The dataparser_transforms.json of the nerfstudio run that the camera path belongs to
    #[arg(long, value_name = "FILE", requires = "camera_path", conflicts_with_all = ["orbit", "spiral", "cameras", "keyframes"])]
    pub path_transform: Option<PathBuf>,
    /// Render a smooth path through the cameras of a dataset or of a transforms.json, in their order
    #[arg(long, value_name = "FILE")]
    pub keyframes: Option<PathBuf>,
    /// Views on the path through the keyframes [default: 24 from each keyframe to the next]
    #[arg(long, value_name = "N", requires = "keyframes", value_parser = clap::value_parser!(u32).range(1..))]
    #[arg(conflicts_with_all = ["orbit", "spiral", "cameras", "camera_path"])]
    pub frames: Option<u32>,
    /// Folder for the images, or the name of a film: .mp4, .webm or .gif
    #[arg(long, value_name = "OUT")]
    pub out: PathBuf,
    /// Frames per second of a film [default: those of the camera path, else 24]
    #[arg(long, value_name = "F", value_parser = frame_rate)]
    pub fps: Option<f64>,
    /// Size of the images in pixels, such as 800x600; all that a camera sees stays in the picture
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub size: Option<[u32; 2]>,
    /// Replace the film, or remove the files of an earlier render from the folder first; all other files stay
    #[arg(long)]
    pub overwrite: bool,
    /// Layers to write of each view, separated by commas
    #[arg(long, value_enum, value_delimiter = ',', default_value = "colour", value_name = "LAYERS")]
    pub outputs: Vec<Layer>,
    /// Draw slices of the index of refraction through each region, beside the truth where it is known
    #[arg(long)]
    pub slices: bool,
    /// Draw N bent rays of the first view through each region, and write them as polylines
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub paths: Option<u32>,
    /// Multiply n - 1 of every refractive region by S: 0 gives straight rays, 2 twice the contrast; the run is not changed
    #[arg(long, value_name = "S", value_parser = factor, conflicts_with = "set_index")]
    pub scale_index: Option<f64>,
    /// Give every refractive region the index N, such as 1.33 for water; the run is not changed
    ///
    /// Where the index varies, n - 1 is multiplied by a factor. The median of n, weighted by (n - 1)^2, becomes N.
    #[arg(long, value_name = "N", value_parser = index)]
    pub set_index: Option<f64>,
    /// What renders.
    #[command(flatten)]
    pub renderer: RendererArgs,
    /// Threads, progress, JSON.
    #[command(flatten)]
    pub work: WorkArgs,
}

/// What a run is written as.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ExportFormat {
    /// Everything solid as meshes in one binary PLY: opaque things with colours as region 0, glass as the regions from 1 on,
    /// which train --index-from reads
    Ply,
    /// The same as Wavefront OBJ, with colours behind the positions of vertices, and one object per region
    Obj,
    /// The same as binary glTF 2.0 (.glb) for Blender and others: glass with index, transmission and absorption; and cameras
    #[value(aliases = ["glb", "blender"])]
    Gltf,
    /// What the photographs' cameras see as coloured points, binary PLY
    Points,
    /// The radiance field as 3D Gaussians, in the PLY layout of Gaussian splatting, or compressed where --out ends in .spz
    Splats,
    /// One page to share, which renders the scene in the browser with the same bent rays (WebGPU)
    Html,
    /// transforms.json of all photographs, in the layout of nerfstudio, with poses and lenses as learned
    Cameras,
}

/// `refraxel export`
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  refraxel export run --format ply
  refraxel export run --format gltf --out scene.glb --detail 2
  refraxel export run --format splats --points 1000000 --out scene.spz
  refraxel export run --format html --out scene.html
  refraxel export run --format cameras --out photos/learned.json
  refraxel train photos --out again --index-from run/surface.ply

Meshes are closed triangle meshes in the world coordinates of the dataset. The surface of glass lies where the index jumps; where the index \
changes smoothly, it lies half-way in n between vacuum and the inside. The surface of opaque things lies where the light of the photographs comes from; \
its colours are those that the cameras see most directly, past the glass. In glTF, a node above all others turns the upward \
direction of the world to +y. Gaussians stand at every voxel that gives a camera enough light; they bend no rays. An HTML page holds the whole scene \
in one file and loads nothing; browsers without WebGPU show a picture. RUN/checkpoint.safetensors holds all parameters of \
the run; any safetensors library can open it.")]
pub struct ExportArgs {
    /// The run's folder
    #[arg(value_name = "RUN")]
    pub run: PathBuf,
    /// File format
    #[arg(long, value_enum, value_name = "FORMAT")]
    pub format: ExportFormat,
    /// The file to write [default in RUN: surface.ply, surface.obj, scene.glb, points.ply, splats.ply, scene.html or
    /// transforms.json]
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Most points, or Gaussians [default: 200000 points, 500000 Gaussians, and no points in glTF, which may have some beside
    /// its meshes]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(..=10_000_000))]
    pub points: Option<u32>,
    /// Mesh edges per voxel; a finer mesh resolves thinner parts
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=16))]
    pub detail: u32,
    /// Print the result as JSON on standard output, and nothing else there
    #[arg(long)]
    pub json: bool,
}

/// `refraxel compare`
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  refraxel compare straight bent --truth --out comparison
  refraxel compare straight bent --wipe wipe.gif
  refraxel compare runs/* --json

Pictures begin with the view in which the runs differ most: inside the masks, where there are any.")]
pub struct CompareArgs {
    /// Folders of runs that were evaluated on one dataset
    #[arg(value_name = "RUN", required = true)]
    pub runs: Vec<PathBuf>,
    /// Also show the photographs and each run's error
    #[arg(long)]
    pub truth: bool,
    /// Folder for the pictures; without it only the table is printed
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Also write an animated GIF of two runs, one wiped over the other
    #[arg(long, value_name = "FILE")]
    pub wipe: Option<PathBuf>,
    /// The view of the wipe, by its file name [default: the one in which the runs differ most]
    #[arg(long, value_name = "NAME", requires = "wipe")]
    pub view: Option<String>,
    /// Print the table as JSON on standard output, and nothing else there
    #[arg(long)]
    pub json: bool,
}
