//! Files of other programs that are not read, and what can be done with them instead.

use crate::folder::{inside, names};
use crate::{DataError, limits};
use std::io::Read;
use std::path::Path;

/// Bytes of a file that tell of which kind it is.
const HEAD: u64 = 1 << 16;

/// What a program writes.
struct Other {
    /// Names of files: `*` stands for whatever comes before, and `/` at the end for a folder.
    names: &'static [&'static str],
    /// Text at the beginning of such a file, or in the names of files in such a folder; empty where its name says enough.
    text: &'static str,
    /// What it is.
    what: &'static str,
    advice: &'static str,
}

const fn other(
    names: &'static [&'static str],
    text: &'static str,
    what: &'static str,
    advice: &'static str,
) -> Other {
    Other { names, text, what, advice }
}

const COLMAP: &str = "export the cameras from that program in COLMAP's format, or write a transforms.json, or let `refraxel import` compute the \
                      poses of the photographs anew";
const TRANSFORMS: &str = "write a transforms.json: file_path, fl_x, cx, cy and transform_matrix of each frame, from camera to world with the axes \
                          right, up and backwards; or let `refraxel import` compute the poses of the photographs anew";
const REALITY: &str =
    "export the registration as \"Internal/External camera parameters\" (CSV) or in COLMAP's format";
const DATA: &str = "give the photographs and their cameras, from which it was made";

/// Files that say where cameras are.
const CAMERAS: [Other; 23] = [
    other(&["*.out"], "# Bundle file", "a list of cameras of Bundler", COLMAP),
    other(&["*.nvm"], "NVM_V3", "a model of VisualSFM", COLMAP),
    other(&["*.xmp"], "xcr:", "a camera of RealityCapture as XMP", REALITY),
    other(&["*.csv"], "#name,", "this list of cameras of RealityCapture", REALITY),
    other(&["*.rcproj", "*.rsproj", "*.rcalign", "*.rsalign"], "", "a project of RealityCapture", REALITY),
    other(
        &["*.psx", "*.psz"],
        "",
        "a project of Metashape",
        "export its cameras (File, Export, Export Cameras) as XML",
    ),
    other(
        &["*.p4d", "*_calibrated_camera_parameters.txt"],
        "",
        "a project of Pix4D",
        "export it as OPF, and convert that by `opf2colmap` (pyopf)",
    ),
    other(&["*.xml"], "<BlocksExchange", "a block of ContextCapture", COLMAP),
    other(&["*.sfm", "*.mg"], "", "a scene of Meshroom", "convert cameras.sfm by `aliceVision_exportColmap`"),
    other(
        &["sfm_data.json", "sfm_data.bin"],
        "",
        "a scene of OpenMVG",
        "convert it by `openMVG_main_openMVG2Colmap -i sfm_data.bin -o sparse/0`",
    ),
    other(&["*.mvs"], "", "a scene of OpenMVS", COLMAP),
    other(
        &["cameras_sphere.npz", "cameras.npz", "cameras_large.npz"],
        "",
        "the layout of NeuS and IDR (world_mat_0, scale_mat_0, …)",
        "write a transforms.json: cv2.decomposeProjectionMatrix splits (world_mat @ scale_mat)[:3] of an image into its intrinsics, its \
         rotation R from world to camera and its position; transform_matrix is [transpose of R, position] with the second and the third \
         column negated",
    ),
    other(&["*poses.npy", "*poses.npz"], "", "a file of NumPy", TRANSFORMS),
    other(&["*.traj", "traj.txt", "groundtruth.txt", "*_SfM.log"], "", "a trajectory", TRANSFORMS),
    other(
        &["pose/", "poses/"],
        ".txt",
        "a folder of poses without intrinsics",
        "write the 3x3 or 4x4 matrix of the camera into intrinsics.txt beside it; where cameras differ, write a transforms.json",
    ),
    other(&["cams/"], "_cam.txt", "the layout of MVSNet", TRANSFORMS),
    other(&["odometry.csv"], "", "a recording of Stray Scanner", TRANSFORMS),
    other(&["*.json"], "\"cameraPoseARFrame\"", "a camera of 3D Scanner App", TRANSFORMS),
    other(&["metadata.json"], "\"quaternions\"", "a scene of Kubric", TRANSFORMS),
    other(&["meta_data.json"], "\"camtoworld\"", "a scene of SDFStudio", TRANSFORMS),
    other(&["scene_camera.json", "*.hdf5"], "", "a scene of BlenderProc", TRANSFORMS),
    other(&["frame_annotations.jgz"], "", "a part of CO3D", TRANSFORMS),
    other(
        &["*.sens"],
        "",
        "a recording of ScanNet",
        "unpack it into color, pose and intrinsic by ScanNet's SensReader",
    ),
];

/// Files that were made from photographs, and have none.
const RESULTS: [Other; 4] = [
    other(&["*.npz", "*.npy"], "", "a file of NumPy", TRANSFORMS),
    other(&["dataparser_transforms.json"], "", "a training of nerfstudio", DATA),
    other(&["*.ingp", "*.msgpack"], "", "a snapshot of instant-ngp", DATA),
    other(
        &["*.ply", "*.splat", "*.ksplat", "*.spz", "*.sog", "*.glb", "*.obj"],
        "",
        "a set of points, Gaussians or faces",
        DATA,
    ),
];

/// The error about cameras that a file, or one in a folder, states.
pub(crate) fn cameras(path: &Path) -> Option<DataError> {
    find(&CAMERAS, path)
}

/// The error about what was made from photographs.
pub(crate) fn results(path: &Path) -> Option<DataError> {
    find(&RESULTS, path)
}

fn find(others: &[Other], path: &Path) -> Option<DataError> {
    let files = if path.is_file() { vec![path.to_owned()] } else { inside(path) };
    let of =
        |other: &Other| Some((files.iter().find(|file| other.is(file))?.clone(), other.what, other.advice));
    let (path, what, advice) = others.iter().find_map(of)?;
    Some(DataError::UnsupportedFeature { path, key: what.to_owned(), advice })
}

impl Other {
    fn is(&self, path: &Path) -> bool {
        let name = path.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
        let is_called = |pattern: &&str| {
            let (pattern, is_kind) = match pattern.strip_suffix('/') {
                Some(folder) => (folder, path.is_dir()),
                None => (*pattern, path.is_file()),
            };
            let pattern = pattern.to_lowercase();
            let fits = pattern.strip_prefix('*').map_or(name == pattern, |end| name.ends_with(end));
            fits && is_kind
        };
        let text = || if path.is_dir() { names(path).unwrap_or_default().join("/") } else { head(path) };
        self.names.iter().any(is_called) && (self.text.is_empty() || text().contains(self.text))
    }
}

/// The beginning of a file as text; empty where it cannot be read.
pub(super) fn head(path: &Path) -> String {
    let mut head = Vec::new();
    let read = limits::open_regular(path).and_then(|file| file.take(HEAD).read_to_end(&mut head));
    read.map_or(String::new(), |_| String::from_utf8_lossy(&head).into_owned())
}
