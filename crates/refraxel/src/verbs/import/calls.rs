//! The calls of ffmpeg and COLMAP that an import makes, as data.

use crate::cli::Matching;
use crate::shell::quoted;
use std::fmt;
use std::path::Path;

/// COLMAP's camera model: focal lengths of both axes and four coefficients of distortion.
///
/// One camera takes all photographs, so that its eight parameters are determined many times over; a model that is too
/// simple would bend straight lines, and rays would miss the glass.
pub const CAMERA_MODEL: &str = "OPENCV";

/// What to do where COLMAP finds too little that several photographs show.
pub const TOO_LITTLE: &str = "it found too little that several photographs show; take more, each of which shows most of what \
                              its neighbour shows, sharp and bright, with textured things around the glass";

/// What is done, in this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Frames are taken from a video.
    Frames,
    /// Features are found in photographs.
    Features,
    /// Features of pairs of photographs are matched.
    Matches,
    /// Cameras are posed.
    Poses,
    /// All cameras are refined together.
    Refinement,
}

impl Stage {
    /// Name for progress and messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Frames => "frames",
            Self::Features => "features",
            Self::Matches => "matches",
            Self::Poses => "poses",
            Self::Refinement => "refinement",
        }
    }
}

/// One call of a program.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Call {
    pub stage: Stage,
    pub program: &'static str,
    pub words: Vec<String>,
}

impl fmt::Display for Call {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let words: Vec<String> = self.words.iter().map(|word| quoted(word)).collect();
        write!(f, "{} {}", self.program, words.join(" "))
    }
}

/// How COLMAP is there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Program {
    /// The program `colmap`.
    Colmap,
    /// The Python module `pycolmap`, for `python3`.
    Pycolmap,
}

/// What does by pycolmap what the program does, with the same verbs and options.
pub const PYCOLMAP: &str = include_str!("pycolmap_calls.py");
/// Its name in the work folder.
pub const PYCOLMAP_FILE: &str = "pycolmap_calls.py";

/// How this COLMAP is called, and how it names the sections of its options; they were renamed in version 3.13.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Dialect {
    pub program: Program,
    pub extraction: &'static str,
    pub matching: &'static str,
}

impl Dialect {
    pub const UP_TO_3_12: Self =
        Self { program: Program::Colmap, extraction: "SiftExtraction", matching: "SiftMatching" };
    pub const SINCE_3_13: Self =
        Self { program: Program::Colmap, extraction: "FeatureExtraction", matching: "FeatureMatching" };
    pub const PYCOLMAP: Self = Self { program: Program::Pycolmap, ..Self::SINCE_3_13 };

    /// By what `colmap feature_extractor -h` lists.
    pub fn of_help(help: &str) -> Self {
        if help.contains("--FeatureExtraction.use_gpu") { Self::SINCE_3_13 } else { Self::UP_TO_3_12 }
    }

    /// Of the package that most people would install now: Debian and Ubuntu have older versions than Homebrew.
    pub fn usual() -> Self {
        if cfg!(target_os = "macos") { Self::SINCE_3_13 } else { Self::UP_TO_3_12 }
    }
}

/// Which photographs share the parameters of a camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shared {
    /// All of them.
    ByAll,
    /// Those in one folder, which are of one size.
    InFolders,
}

/// What the calls of COLMAP depend on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settings {
    pub dialect: Dialect,
    pub matching: Matching,
    pub shared: Shared,
    /// There is a folder of masks.
    pub masks: bool,
    /// `None` for as many as the machine has.
    pub threads: Option<usize>,
}

/// The calls that pose the photographs in `work/images`. The largest model has to be moved to `work/sparse/0` before the
/// refinement.
///
/// The mapper holds the principal point in the middle of the picture, because few photographs do not determine it. The
/// refinement frees it where all photographs share one camera: on 50 photographs of a phone, rotations were then 0.08° off
/// instead of 0.65° (docs/photographs.md).
pub fn colmap(work: &Path, settings: &Settings) -> Vec<Call> {
    let Settings { dialect: Dialect { program, extraction, matching }, .. } = settings;
    let file = |name: &str| work.join(name).display().to_string();
    let database = || vec!["--database_path".to_owned(), file("features.db")];
    let threads = |section: &str| {
        let flag = |n: usize| [format!("--{section}.num_threads"), n.to_string()];
        settings.threads.map(flag).into_iter().flatten()
    };
    let call = |stage, verb: &str, words: Vec<String>| {
        let (program, script) = match program {
            Program::Colmap => ("colmap", None),
            Program::Pycolmap => ("python3", Some(file(PYCOLMAP_FILE))),
        };
        Call { stage, program, words: script.into_iter().chain([verb.to_owned()]).chain(words).collect() }
    };
    let on_cpu = |section: &str| [format!("--{section}.use_gpu"), "0".to_owned()];

    let mut features = database();
    features.extend(["--image_path".to_owned(), file("images")]);
    features.extend(["--ImageReader.camera_model", CAMERA_MODEL].map(str::to_owned));
    let single = match settings.shared {
        Shared::ByAll => "--ImageReader.single_camera",
        Shared::InFolders => "--ImageReader.single_camera_per_folder",
    };
    features.extend([single, "1"].map(str::to_owned));
    if settings.masks {
        features.extend(["--ImageReader.mask_path".to_owned(), file("feature_masks")]);
    }
    features.extend(on_cpu(extraction).into_iter().chain(threads(extraction)));

    let matcher = match settings.matching {
        Matching::Exhaustive => "exhaustive_matcher",
        Matching::Sequential => "sequential_matcher",
    };
    let mut matches = database();
    if settings.matching == Matching::Sequential {
        // Loops need a vocabulary, which newer versions would download.
        matches.extend(["--SequentialMatching.loop_detection", "0"].map(str::to_owned));
    }
    matches.extend(on_cpu(matching).into_iter().chain(threads(matching)));

    let mut poses = database();
    poses.extend(["--image_path".to_owned(), file("images"), "--output_path".to_owned(), file("sparse")]);
    poses.extend(threads("Mapper"));

    let mut calls = vec![
        call(Stage::Features, "feature_extractor", features),
        call(Stage::Matches, matcher, matches),
        call(Stage::Poses, "mapper", poses),
    ];
    if settings.shared == Shared::ByAll {
        let model = file("sparse/0");
        let free = "--BundleAdjustment.refine_principal_point";
        let refinement = ["--input_path", &model, "--output_path", &model, free, "1"].map(str::to_owned);
        calls.push(call(Stage::Refinement, "bundle_adjuster", refinement.to_vec()));
    }
    calls
}

/// The call that takes `count` frames, evenly spread, at `rate` frames per second, as `work/frames/00001.jpg` and so on.
pub fn frames(video: &Path, work: &Path, count: usize, rate: &str) -> Call {
    let (video, out) = (video.display().to_string(), work.join("frames/%05d.jpg").display().to_string());
    let (rate, count) = (format!("fps={rate}"), count.to_string());
    // `-q:v 2` is the best quality that ffmpeg gives a JPEG by this option.
    let words = [
        "-nostdin",
        "-hide_banner",
        "-y",
        "-i",
        &video,
        "-map",
        "0:v:0",
        "-vf",
        &rate,
        "-frames:v",
        &count,
        "-q:v",
        "2",
        &out,
    ];
    Call { stage: Stage::Frames, program: "ffmpeg", words: words.map(str::to_owned).to_vec() }
}

#[cfg(test)]
mod tests {
    use super::*;

    const USUAL: Settings = Settings {
        dialect: Dialect::UP_TO_3_12,
        matching: Matching::Exhaustive,
        shared: Shared::ByAll,
        masks: false,
        threads: None,
    };

    fn lines(settings: &Settings) -> Vec<String> {
        colmap(Path::new("my work"), settings).iter().map(Call::to_string).collect()
    }

    #[test]
    fn photographs_of_one_camera_share_it_and_all_pairs_are_matched_on_the_cpu() {
        let expected = [
            "colmap feature_extractor --database_path 'my work/features.db' --image_path 'my work/images' \
             --ImageReader.camera_model OPENCV --ImageReader.single_camera 1 --SiftExtraction.use_gpu 0",
            "colmap exhaustive_matcher --database_path 'my work/features.db' --SiftMatching.use_gpu 0",
            "colmap mapper --database_path 'my work/features.db' --image_path 'my work/images' \
             --output_path 'my work/sparse'",
            "colmap bundle_adjuster --input_path 'my work/sparse/0' --output_path 'my work/sparse/0' \
             --BundleAdjustment.refine_principal_point 1",
        ];
        assert_eq!(lines(&USUAL), expected);
    }

    #[test]
    fn masks_threads_sizes_and_videos_change_the_calls() {
        let settings = Settings {
            dialect: Dialect::SINCE_3_13,
            matching: Matching::Sequential,
            shared: Shared::InFolders,
            masks: true,
            threads: Some(2),
        };
        let lines = lines(&settings);
        assert!(lines[0].ends_with(
            "--ImageReader.single_camera_per_folder 1 --ImageReader.mask_path 'my work/feature_masks' \
             --FeatureExtraction.use_gpu 0 --FeatureExtraction.num_threads 2"
        ));
        assert!(lines[1].starts_with("colmap sequential_matcher") && lines[1].contains("loop_detection 0"));
        assert!(lines[1].ends_with("--FeatureMatching.use_gpu 0 --FeatureMatching.num_threads 2"));
        assert!(lines[2].ends_with("--Mapper.num_threads 2") && lines.len() == 3, "{lines:?}");
    }

    #[test]
    fn pycolmap_is_called_with_the_same_verbs_and_options() {
        let of = |dialect| lines(&Settings { dialect, ..USUAL });
        let program = of(Dialect::SINCE_3_13)
            .into_iter()
            .map(|line| line.replacen("colmap ", "python3 'my work/pycolmap_calls.py' ", 1));
        assert_eq!(of(Dialect::PYCOLMAP), program.collect::<Vec<_>>());
        for line in of(Dialect::PYCOLMAP) {
            let verb = line.split(' ').nth(3).unwrap();
            assert!(PYCOLMAP.contains(&format!("\"{verb}\"")), "{verb}");
        }
    }

    #[test]
    fn the_dialect_is_that_of_the_help() {
        assert_eq!(Dialect::of_help("  --SiftExtraction.use_gpu arg (=1)"), Dialect::UP_TO_3_12);
        assert_eq!(Dialect::of_help("  --FeatureExtraction.use_gpu arg (=1)"), Dialect::SINCE_3_13);
    }

    #[test]
    fn frames_are_taken_at_an_even_rate() {
        let call = frames(Path::new("walk.mp4"), Path::new("work"), 240, "12.5");
        assert_eq!(
            call.to_string(),
            "ffmpeg -nostdin -hide_banner -y -i walk.mp4 -map 0:v:0 -vf fps=12.5 -frames:v 240 -q:v 2 work/frames/%05d.jpg"
        );
    }
}
