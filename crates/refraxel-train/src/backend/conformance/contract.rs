//! What [`Backend`] promises besides numbers.

use super::absorbing::tinted_nested_balls;
use super::bent::{bent_model, graded_body_model, sharp_model};
use super::clearcoated::clearcoated_model;
use super::mirrored::sharp_ball;
use super::scenes::{batch, index_objective, objective, straight_model};
use super::suite::Suite;
use crate::backend::{
    AbsorptionObjective, Backend, BrickMask, Caches, Layers, Objective, ReflectionObjective, Snapshot, step,
};
use crate::cancel::Cancel;
use crate::model::{Model, Optimiser};
use refraxel_core::{Background, Extent};

/// Everything that can learn does.
fn everything() -> Objective {
    let reflection = Some(ReflectionObjective { rate: 0.01, rate_strength: 0.01, rate_clearcoat: 0.01 });
    let (tv_density, tv_colour) = (0.01, 0.01);
    let absorption = Some(AbsorptionObjective { rate: 0.01 });
    Objective { index: Some(index_objective()), reflection, absorption, tv_density, tv_colour, ..objective() }
}

/// All parameters of a model, one after the other.
fn parameters(model: &Model) -> Vec<f32> {
    let mut all = [&model.field.density[..], &model.field.colour].concat();
    if let Background::Environment(map) = &model.background {
        all.extend(map.texels.as_flattened());
    }
    for region in model.refraction.medium.regions() {
        all.extend(region.coefficients());
        all.extend(region.level_set().map_or(&[][..], |l| l.coefficients()));
        all.extend(region.absorption());
    }
    for mirror in &model.reflection.mirrors {
        all.push(mirror.strength);
        all.extend(mirror.outer.coefficients.iter().chain(&mirror.inner.coefficients));
    }
    if let Some(clearcoat) = &model.clearcoat {
        all.extend(clearcoat.strength.coefficients.iter().chain(&clearcoat.radiance.coefficients));
    }
    all
}

fn owned(snapshot: Snapshot) -> (Model, Optimiser) {
    (snapshot.model.into_owned(), snapshot.optimiser.into_owned())
}

/// Snapshot, learn on, load, learn again: the same bits.
pub fn a_loaded_snapshot_goes_on_as_if_nothing_had_happened<B: Backend>(suite: &Suite<B>) {
    let coated = clearcoated_model(Extent::Bounded);
    goes_on(suite, vec![tinted_nested_balls(), bent_model(Extent::Contracted), coated]);
}

/// The same where nothing bends or mirrors.
pub fn a_loaded_snapshot_of_straight_rays_goes_on_as_if_nothing_had_happened<B: Backend>(suite: &Suite<B>) {
    goes_on(suite, vec![straight_model(2, Extent::Bounded), straight_model(1, Extent::Contracted)]);
}

/// The same where rays bend in smooth regions and at sharp surfaces, and nothing mirrors.
pub fn a_loaded_snapshot_of_bent_rays_goes_on_as_if_nothing_had_happened<B: Backend>(suite: &Suite<B>) {
    goes_on(suite, vec![graded_body_model(Extent::Bounded), bent_model(Extent::Bounded)]);
}

fn goes_on<B: Backend>(suite: &Suite<B>, models: Vec<Model>) {
    for model in models {
        let (mut backend, b, o) = (suite.backend(model), batch(300), everything());
        (0..3).for_each(|k| _ = step(&mut backend, &b, &o, k));
        let (model, optimiser) = owned(backend.snapshot());
        assert!(optimiser.fits(&model));
        (3..6).for_each(|k| _ = step(&mut backend, &b, &o, k));
        let (once, moments) = owned(backend.snapshot());
        assert_ne!(parameters(&once), parameters(&model));
        let mut other = suite.backend(straight_model(0, Extent::Bounded));
        other.load(model, Some(optimiser));
        (3..6).for_each(|k| _ = step(&mut other, &b, &o, k));
        let (again, moments_again) = owned(other.snapshot());
        assert!(parameters(&again) == parameters(&once), "the same parameters");
        assert!(moments_again == moments, "the same moments");
    }
}

/// NaN or infinity among the parameters.
pub fn a_parameter_that_is_not_a_number_is_reported<B: Backend>(suite: &Suite<B>) {
    for poison in [f32::NAN, f32::INFINITY] {
        for which in 0..2 {
            let mut model = straight_model(1, Extent::Bounded);
            let values = if which == 0 { &mut model.field.density } else { &mut model.field.colour };
            values[64..].fill(poison);
            let outcome = step(&mut suite.backend(model), &batch(50), &objective(), 0);
            assert!(!outcome.finite, "{poison} in array {which}");
        }
    }
}

/// A step that overflows leaves the model alone, and so do all steps after it.
pub fn after_a_failure_nothing_changes_until_the_next_load<B: Backend>(suite: &Suite<B>) {
    let mut backend = suite.backend(straight_model(1, Extent::Bounded));
    let (good, o) = (batch(100), objective());
    let mut bad = good.clone();
    bad.target[7] = [f32::INFINITY; 3];
    let before = owned(backend.snapshot());
    assert!(!step(&mut backend, &bad, &o, 0).finite);
    backend.submit(&good, &o, 1);
    assert!(backend.outcomes(true).iter().all(|o| !o.finite));
    assert!(parameters(&backend.snapshot().model) == parameters(&before.0));
    backend.load(before.0.clone(), Some(before.1));
    assert!(step(&mut backend, &good, &o, 2).finite);
    assert!(parameters(&backend.snapshot().model) != parameters(&before.0));
}

/// Rendering, gradients and peak weights only look.
pub fn a_gradient_changes_nothing<B: Backend>(suite: &Suite<B>) {
    looks(suite, sharp_ball());
}

/// The same where nothing bends or mirrors.
pub fn a_gradient_of_straight_rays_changes_nothing<B: Backend>(suite: &Suite<B>) {
    looks(suite, straight_model(1, Extent::Bounded));
}

/// The same where rays bend and nothing mirrors.
pub fn a_gradient_of_bent_rays_changes_nothing<B: Backend>(suite: &Suite<B>) {
    looks(suite, sharp_model(Extent::Bounded));
}

fn looks<B: Backend>(suite: &Suite<B>, model: Model) {
    let (backend, b, o) = (suite.backend(model), batch(100), everything());
    let before = owned(backend.snapshot());
    backend.gradient(&b, &o);
    backend.render(&b.rays, &o.marching, Layers::All);
    let _ = backend.peak_weights(&b.rays, &o.marching, &Cancel::new());
    let after = owned(backend.snapshot());
    assert!(parameters(&before.0) == parameters(&after.0) && before.1 == after.1);
}

/// Data choose the voxels.
pub fn density_is_set_where_the_mask_says_and_its_moments_are_forgotten<B: Backend>(suite: &Suite<B>) {
    let mut backend = suite.backend(straight_model(1, Extent::Bounded));
    (0..2).for_each(|k| _ = step(&mut backend, &batch(300), &objective(), k));
    let mask = BrickMask::new(backend.domain(), backend.map(), |x| x.x > 0.1);
    let before = owned(backend.snapshot());
    backend.set_density(-4.5, &mask);
    let after = owned(backend.snapshot());
    let mut chosen = vec![false; before.0.field.density.len()];
    mask.voxels().for_each(|v| chosen[v] = true);
    assert!(chosen.contains(&true) && chosen.contains(&false));
    for (v, chosen) in chosen.into_iter().enumerate() {
        let [old, new] = [&before, &after].map(|(m, o)| (m.field.density[v], o.density[v], o.colour[v]));
        assert_eq!(new, if chosen { (-4.5, 0.0, 0.0) } else { old });
    }
}

/// All or nothing.
pub fn baking_that_is_cancelled_changes_nothing<B: Backend>(suite: &Suite<B>) {
    let cancelled = Cancel::new();
    cancelled.cancel();
    for (model, caches) in
        [(sharp_ball(), Caches::Reflection), (clearcoated_model(Extent::Bounded), Caches::Clearcoat)]
    {
        let mut backend = suite.backend(model);
        let before = parameters(&backend.snapshot().model);
        assert!(backend.bake(caches, &objective().marching, &cancelled).is_err());
        assert!(parameters(&backend.snapshot().model) == before);
        assert!(backend.bake(caches, &objective().marching, &Cancel::new()).is_ok());
        assert!(parameters(&backend.snapshot().model) != before);
    }
}

/// Whether they lag or not.
pub fn outcomes_come_in_order_and_once<B: Backend>(suite: &Suite<B>) {
    let (mut backend, b) = (suite.backend(straight_model(0, Extent::Bounded)), batch(64));
    let mut seen = Vec::new();
    for k in 10..15 {
        backend.submit(&b, &objective(), k);
        seen.extend(backend.outcomes(false));
    }
    seen.extend(backend.outcomes(true));
    let steps: Vec<(u64, u64)> = seen.iter().map(|o| (o.step, o.rays)).collect();
    assert_eq!(steps, (10..15).map(|k| (k, 64)).collect::<Vec<_>>());
    assert!(backend.outcomes(true).is_empty());
}
