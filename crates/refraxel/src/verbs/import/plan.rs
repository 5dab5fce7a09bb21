//! What an import will do.

use super::calls::{self, Call, Dialect, Program, Settings, Shared};
use super::source::Source;
use super::tools::Colmap;
use crate::cli::{ImportArgs, Matching};
use crate::verbs::files::absolute;
use refraxel_data::MaskMeaning;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;

/// Photographs of which every pair is compared, at most: 19 900 pairs.
const ALL_PAIRS: usize = 200;

/// An import, before anything is written.
pub(super) struct Plan {
    pub(super) source: Source,
    pub(super) root: PathBuf,
    settings: Settings,
    /// The calls of COLMAP.
    pub(super) colmap: Vec<Call>,
}

impl Plan {
    pub(super) fn new(args: &ImportArgs, source: Source, root: PathBuf, colmap: Option<&Colmap>) -> Self {
        let (shared, masks, follow) = match &source {
            Source::Photographs(set) => (set.shared, set.meaning.is_some(), set.photos.len() > ALL_PAIRS),
            Source::Video(_) => (Shared::ByAll, false, true),
        };
        let usual = if follow { Matching::Sequential } else { Matching::Exhaustive };
        let matching = args.matching.unwrap_or(usual);
        let dialect = colmap.map_or(Dialect::usual(), |colmap| colmap.dialect);
        let threads = args.work.threads.map(usize::from);
        let settings = Settings { dialect, matching, shared, masks, threads };
        let colmap = calls::colmap(&root, &settings);
        Self { source, root, settings, colmap }
    }

    /// Whether Python calls COLMAP.
    pub(super) fn uses_pycolmap(&self) -> bool {
        self.settings.dialect.program == Program::Pycolmap
    }

    /// Everything that the features and matches of an earlier import depend on.
    pub(super) fn record(&self, args: &ImportArgs, colmap: &Colmap) -> Value {
        let stamp = |path: &Path| {
            let found = path.metadata().ok();
            let changed = found.as_ref().and_then(|f| f.modified().ok()?.duration_since(UNIX_EPOCH).ok());
            json!([path, found.map(|f| f.len()), changed.map(|time| time.as_millis() as u64)])
        };
        let (files, meaning, frames): (Vec<Value>, _, _) = match &self.source {
            Source::Photographs(set) => {
                let files = set.photos.iter().flat_map(|p| [Some(&p.file), p.mask.as_ref()]);
                (files.flatten().map(|path| stamp(path)).collect(), set.meaning, None)
            }
            Source::Video(frames) => {
                (vec![stamp(&frames.video)], None, Some(frames.call(&self.root).to_string()))
            }
        };
        // The number of threads changes nothing.
        let colmap_calls = calls::colmap(&self.root, &Settings { threads: None, ..self.settings });
        let calls: Vec<String> = frames.into_iter().chain(colmap_calls.iter().map(Call::to_string)).collect();
        json!({
            "source": absolute(&args.source),
            "colmap": colmap.version,
            "commands": calls,
            "mask_meaning": meaning.map(MaskMeaning::name),
            "files": files,
        })
    }
}
