//! Keys of frames that say something about the picture that is not used: they are named, not passed over in silence.

use crate::json::Object;
use crate::{DataError, Problem};
use std::collections::BTreeSet;
use std::path::Path;

/// Keys of nerfstudio, instant-ngp and others whose meaning is not modelled.
const KEYS: [&str; 9] = [
    "appearance_id",
    "appearance_embedding",
    "bg_color",
    "camera_index",
    "camera_to_world",
    "exposure",
    "exposure_time",
    "normal_path",
    "semantics_path",
];

/// What frames state and what is not used of it.
#[derive(Default)]
pub(super) struct Unused {
    keys: BTreeSet<&'static str>,
    bad: usize,
    /// The earliest and the latest time.
    times: Option<[f64; 2]>,
}

impl Unused {
    /// Looks at a frame; false where it is marked as one that should not be used.
    pub fn look(&mut self, frame: &Object) -> Result<bool, DataError> {
        let is_bad = frame.flag("is_bad")?;
        self.bad += usize::from(is_bad);
        self.keys.extend(KEYS.into_iter().filter(|key| frame.get(key).is_some()));
        if let Some(time) = frame.get("time").and_then(|time| time.as_f64()) {
            let [first, last] = self.times.unwrap_or([time; 2]);
            self.times = Some([first.min(time), last.max(time)]);
        }
        Ok(!is_bad)
    }

    /// What to tell about a file.
    pub fn problems(&self, file: &Path) -> Vec<Problem> {
        let file = file.display();
        let moves = self.times.filter(|[first, last]| first < last).map(|[first, last]| {
            Problem::warning(format!(
                "{file}: time goes from {first} to {last}: if things move, they will be blurred, because the scene is taken to \
                 be still"
            ))
        });
        let keys = self.keys.iter().copied().collect::<Vec<_>>().join(", ");
        let ignored =
            (!keys.is_empty()).then(|| Problem::note(format!("{file}: these keys are not used: {keys}")));
        let bad = (self.bad > 0).then(|| {
            Problem::note(format!("{file}: {} frames are marked is_bad and are left out", self.bad))
        });
        moves.into_iter().chain(ignored).chain(bad).collect()
    }
}
