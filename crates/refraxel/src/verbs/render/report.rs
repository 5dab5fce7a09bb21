//! What was rendered, for people and for programs.

use serde::Serialize;
use std::path::PathBuf;

/// The files that were written; keys are absent where nothing was asked for.
#[derive(Default, Serialize)]
pub(super) struct Report {
    pub(super) out: PathBuf,
    pub(super) views: usize,
    pub(super) layers: Vec<String>,
    /// Poses, intrinsics and the units of depth and index.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) cameras: Option<PathBuf>,
    /// Slices of the index.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) slices: Option<PathBuf>,
    /// Whether the slices show the truth.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) truth_shown: Option<bool>,
    /// Bent rays, drawn and as polylines.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) paths: Option<[PathBuf; 2]>,
    /// The film; no other file was written then.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) film: Option<FilmReport>,
    /// The typical index of each region, where it was edited.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) edited_index: Option<Vec<f32>>,
}

/// A film that was written.
#[derive(Serialize)]
pub(super) struct FilmReport {
    pub(super) frames: usize,
    pub(super) fps: f64,
    pub(super) size: [u32; 2],
}

impl Report {
    pub(super) fn text(&self) -> String {
        let out = self.out.display();
        let views = self.cameras.as_ref().map(|cameras| {
            let (views, layers) = (self.views, self.layers.join(", "));
            format!("{views} views ({layers}) in {out}; cameras: {}", cameras.display())
        });
        let film = self.film.as_ref().map(|film| {
            let ([width, height], layers) = (film.size, self.layers.join(", "));
            let seconds = film.frames as f64 / film.fps;
            format!("{out}: {} frames ({layers}), {width} x {height} pixels, {seconds:.1} s", film.frames)
        });
        let slices = self.slices.as_ref().map(|path| {
            let truth =
                if self.truth_shown == Some(true) { "beside the truth" } else { "the truth is not known" };
            format!("slices of the index: {} ({truth})", path.display())
        });
        let paths = self.paths.as_ref();
        let paths =
            paths.map(|[picture, lines]| format!("rays: {} and {}", picture.display(), lines.display()));
        let index = self.edited_index.as_ref().map(|indices| {
            let indices: Vec<String> = indices.iter().map(|n| format!("{n:.3}")).collect();
            format!("rendered with index {}; the run itself is not changed", indices.join(", "))
        });
        [views, film, slices, paths, index].into_iter().flatten().collect::<Vec<_>>().join("\n")
    }
}
