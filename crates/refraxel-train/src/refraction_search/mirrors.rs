//! When surfaces that bend rays begin to mirror.

use super::context::Context;
use crate::backend::{Backend, Caches};
use crate::cancel::Cancelled;
use crate::events::{Event, Observer, Task};
use crate::model::{MirrorSource, PROBE_DEGREE, ProbeLayout, Reflection};
use crate::options::Options;
use crate::rays::{RaySampler, Selection};
use crate::schedule::training_marching;

/// Let surfaces mirror what the field shows by now, where there are some: a lens has none.
pub(super) fn begin_mirroring(
    backend: &mut dyn Backend,
    known: &Context,
    observer: &mut Observer,
) -> Result<(), Cancelled> {
    let c = &known.options.reflection;
    if !c.enabled.is_on() || !has_surfaces(backend, known.sampler) {
        return Ok(());
    }
    let layout = ProbeLayout { longest: c.probes, degree: PROBE_DEGREE };
    backend.set_reflection(Reflection::of(backend.medium(), c.cache, &layout));
    bake_probes(backend, Caches::Reflection, known.options, known.near, observer)
}

/// Lets probes take up the light of the field; where mirrored rays are traced exactly, nobody asks them.
pub(crate) fn bake_probes(
    backend: &mut dyn Backend,
    caches: Caches,
    options: &Options,
    near: f32,
    observer: &mut Observer,
) -> Result<(), Cancelled> {
    if options.reflection.cache != MirrorSource::Exact {
        observer.progress(Task::Baking, 0, 1)?;
        backend.bake(caches, &training_marching(options, near), observer.cancel())?;
        observer.tell(Event::Progress { task: Task::Baking, done: 1, total: 1 });
    }
    Ok(())
}

/// Rays that say whether what is refractive has a surface.
const RAYS_FOR_SURFACES: usize = 256;

/// Something refractive has a sharp surface, or transitions that most rays through it meet.
fn has_surfaces(backend: &dyn Backend, sampler: &RaySampler) -> bool {
    let (refraction, domain) = (backend.medium(), backend.domain());
    let is_sharp = refraction.medium.regions().iter().any(|r| r.level_set().is_some());
    let rays = || sampler.batch(0, RAYS_FOR_SURFACES, Selection::Inside(1.0)).rays;
    is_sharp || refraction.mirrors(&rays(), domain)
}
