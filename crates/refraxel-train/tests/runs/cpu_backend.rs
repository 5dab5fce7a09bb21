//! The CPU backend passes the conformance suite, and gives the same bits at any number of threads.

use refraxel_core::Extent;
use refraxel_core::index::priors::Penalty;
use refraxel_train::backend::conformance::absorbing::{tinted_ball, tinted_nested_balls};
use refraxel_train::backend::conformance::bent::bent_model;
use refraxel_train::backend::conformance::clearcoated::clearcoated_model;
use refraxel_train::backend::conformance::mirrored::{nested_balls, sharp_ball};
use refraxel_train::backend::conformance::scenes::{batch, index_objective, objective, straight_model};
use refraxel_train::backend::conformance::{Suite, Tolerances};
use refraxel_train::backend::{
    AbsorptionObjective, Caches, IndexObjective, Objective, ReflectionObjective, step,
};
use refraxel_train::cancel::Cancel;
use refraxel_train::model::{Model, Optimiser};
use refraxel_train::{Backend, CpuBackend};

refraxel_train::conformance_tests!(Suite { make: CpuBackend::new, tolerances: Tolerances::SINGLE_PRECISION });

#[test]
fn measured_depth_has_the_reference_gradient() {
    refraxel_train::backend::conformance::straight::measured_depth_has_the_reference_gradient(&Suite {
        make: CpuBackend::new,
        tolerances: Tolerances::SINGLE_PRECISION,
    });
}

/// Learns from a model with a number of threads.
fn learned(threads: usize, model: Model, objective: &Objective) -> (Model, Optimiser) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| {
        let mut backend = CpuBackend::new(model);
        (0..4).for_each(|k| _ = step(&mut backend, &batch(700), objective, k));
        for caches in [Caches::Reflection, Caches::Clearcoat] {
            backend.bake(caches, &objective.marching, &Cancel::new()).unwrap();
        }
        let snapshot = backend.snapshot();
        (snapshot.model.into_owned(), snapshot.optimiser.into_owned())
    })
}

fn assert_same_with_any_number_of_threads(model: impl Fn() -> Model, objective: &Objective) {
    let (one, moments) = learned(1, model(), objective);
    for threads in [2, 3] {
        let (many, many_moments) = learned(threads, model(), objective);
        assert!(one.field.density[..] == many.field.density[..], "{threads}");
        assert!(one.field.colour[..] == many.field.colour[..], "{threads}");
        let index = |m: &Model| -> Vec<Vec<f32>> {
            m.refraction.medium.regions().iter().map(|r| r.coefficients().to_vec()).collect()
        };
        assert!(index(&one) == index(&many), "{threads}");
        assert!(one.refraction.absorption() == many.refraction.absorption(), "{threads}");
        assert!(one.reflection == many.reflection && one.clearcoat == many.clearcoat, "{threads}");
        assert!(moments == many_moments, "{threads}");
    }
    assert!(one.field.density[..] != model().field.density[..], "nothing was learned");
}

const REFLECTION: ReflectionObjective =
    ReflectionObjective { rate: 0.01, rate_strength: 0.01, rate_clearcoat: 0.01 };

#[test]
fn straight_steps_are_the_same_for_any_number_of_threads() {
    let o = Objective { tv_density: 0.01, tv_colour: 0.01, sample_colour: 0.1, ..objective() };
    assert_same_with_any_number_of_threads(|| straight_model(2, Extent::Bounded), &o);
}

#[test]
fn bent_steps_are_the_same_for_any_number_of_threads() {
    let index = IndexObjective {
        blur: 1.0,
        clip: 1.0,
        variation: (0.1, Penalty::Charbonnier { epsilon: 0.01 }),
        deviation: (0.1, Penalty::Squared),
        ..index_objective()
    };
    let o = Objective { index: Some(index), ..objective() };
    assert_same_with_any_number_of_threads(|| bent_model(Extent::Bounded), &o);
}

#[test]
fn mirrors_learn_the_same_with_any_number_of_threads() {
    let o = Objective { reflection: Some(REFLECTION), ..objective() };
    assert_same_with_any_number_of_threads(sharp_ball, &o);
}

#[test]
fn bodies_in_bodies_learn_the_same_with_any_number_of_threads() {
    let o = Objective { index: Some(index_objective()), reflection: Some(REFLECTION), ..objective() };
    assert_same_with_any_number_of_threads(nested_balls, &o);
}

#[test]
fn tints_learn_the_same_with_any_number_of_threads() {
    let absorption = Some(AbsorptionObjective { rate: 0.01 });
    let o = Objective { reflection: Some(REFLECTION), absorption, ..objective() };
    for model in [tinted_ball, tinted_nested_balls] {
        assert_same_with_any_number_of_threads(model, &o);
    }
}

#[test]
fn clearcoats_learn_the_same_with_any_number_of_threads() {
    let o = Objective { reflection: Some(REFLECTION), ..objective() };
    assert_same_with_any_number_of_threads(|| clearcoated_model(Extent::Bounded), &o);
}
