//! An import as lines for a shell, for people who want to see it or to do it by hand.

use super::calls::{Call, PYCOLMAP_FILE, Shared};
use super::frames::Frames;
use super::photos::PhotoSet;
use super::source::Source;
use crate::shell::quoted_path;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// The lines that make `out` in the folder `work`.
pub fn lines(source: &Source, calls: &[Call], work: &Path, out: &Path) -> Vec<String> {
    let mut lines = match source {
        Source::Photographs(set) => copies(set, work),
        Source::Video(frames) => taken(frames, work),
    };
    lines.push(format!("mkdir -p {}", quoted_path(&work.join("sparse"))));
    if calls.iter().any(|call| call.words.first().is_some_and(|word| word.ends_with(PYCOLMAP_FILE))) {
        let file = quoted_path(&work.join(PYCOLMAP_FILE));
        lines.push(format!("# refraxel writes {file}: the verbs and options of COLMAP, by pycolmap"));
    }
    lines.extend(calls.iter().map(Call::to_string));
    lines.push(format!("mv {} {}", quoted_path(work), quoted_path(out)));
    lines
}

fn taken(frames: &Frames, work: &Path) -> Vec<String> {
    let (taken, images) = (work.join("frames"), work.join("images"));
    vec![
        format!("mkdir -p {}", quoted_path(&taken)),
        frames.line(work),
        format!("# refraxel keeps the sharpest of neighbouring frames, {} photographs", frames.count),
        format!("mv {} {}", quoted_path(&taken), quoted_path(&images)),
    ]
}

fn copies(set: &PhotoSet, work: &Path) -> Vec<String> {
    let images = work.join("images");
    let mut lines = Vec::new();
    match set.shared {
        Shared::ByAll => {
            // The names are those of the folder, so that a pattern for each extension finds all.
            let extensions: BTreeSet<_> =
                set.photos.iter().filter_map(|photo| photo.file.extension()).collect();
            let pattern =
                |e: &std::ffi::OsStr| format!("{}/*.{}", quoted_path(&set.folder), e.to_string_lossy());
            let patterns: Vec<String> = extensions.into_iter().map(pattern).collect();
            lines.push(format!("mkdir -p {}", quoted_path(&images)));
            lines.push(format!("cp {} {}/", patterns.join(" "), quoted_path(&images)));
        }
        Shared::InFolders => {
            let mut groups: BTreeMap<_, Vec<String>> = BTreeMap::new();
            for photo in &set.photos {
                groups.entry(Path::new(&photo.name).parent()).or_default().push(quoted_path(&photo.file));
            }
            for (size, files) in groups {
                let folder = quoted_path(&images.join(size.unwrap_or(Path::new(""))));
                lines.push(format!("mkdir -p {folder}"));
                lines.push(format!("cp {} {folder}/", files.join(" ")));
            }
        }
    }
    lines.push("# refraxel turns copies upright where a photograph has an orientation tag".to_owned());
    if set.meaning.is_some() {
        let masks = quoted_path(&work.join("feature_masks/NAME.EXTENSION.png"));
        lines.push(format!("# refraxel writes {masks}: black where features must not be used"));
    }
    lines
}
