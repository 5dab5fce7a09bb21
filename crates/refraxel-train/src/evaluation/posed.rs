//! Where the cameras of evaluated views are, if poses have learned.

use super::{EvaluateError, Part};
use crate::backend::{Backend, Marching};
use crate::events::{Task, Watch};
use crate::poses::{Poses, find};
use crate::schedule::picture_objective;
use refraxel_data::{Dataset, load_photo};

/// The data with the cameras of a part where they are: those of training views as they have learned, each of the others
/// [found](find) against the finished scene by half of its own pixels.
pub fn posed(
    backend: &impl Backend,
    data: &Dataset,
    part: Part,
    poses: &Poses,
    marching: &Marching,
    watch: &mut Watch,
) -> Result<Dataset, EvaluateError> {
    let mut moved = data.clone();
    if part == Part::Train {
        for (&view, pose) in data.split.train.iter().zip(poses.current()) {
            moved.views[view].camera.world_from_camera = pose;
        }
        return Ok(moved);
    }
    let (objective, views) = (picture_objective(*marching), part.views(data));
    for (k, &i) in views.iter().enumerate() {
        watch.progress(Task::Posing, k as u64, views.len() as u64)?;
        let view = &data.views[i];
        let photo = load_photo(view)?;
        moved.views[i].camera = find(backend, &objective, (view, &photo), data.backdrop, poses.unit());
    }
    Ok(moved)
}
