//! Tinted bodies that mirror, against the reference; derivatives are central differences of it.

use super::mirrored::{
    agrees_with_the_reference, compare_what_all_have, compare_what_nested_bodies_have,
    compare_what_sharp_bodies_have, nested_balls, sharp_ball, soft_ball,
};
use super::scenes::{batch, index_objective, objective, still};
use super::suite::Suite;
use crate::backend::{AbsorptionObjective, Backend, BatchGradient, Layers, Objective, step};
use crate::model::Model;

const TINT: [f32; 3] = [0.3, 1.6, 3.0];

/// A model whose body absorbs.
fn tinted(mut model: Model) -> Model {
    model.refraction.medium.region_mut(0).set_absorption(TINT);
    model
}

/// A tinted ball that mirrors.
pub fn tinted_ball() -> Model {
    tinted(sharp_ball())
}

/// Bodies in bodies that mirror, each with a colour of its own; the bubble absorbs, too.
pub fn tinted_nested_balls() -> Model {
    let mut model = tinted(nested_balls());
    model.refraction.medium.region_mut(1).set_absorption([2.5, 0.2, 0.8]);
    model.refraction.medium.region_mut(2).set_absorption([0.4, 3.0, 0.1]);
    model
}

/// Colours of sharp, soft and nested bodies, which mirror, too.
pub fn absorbing_bodies_look_as_the_reference_says<B: Backend>(suite: &Suite<B>) {
    agrees_with_the_reference(suite, tinted_ball(), 40);
    agrees_with_the_reference(suite, tinted(soft_ball()), 30);
    agrees_with_the_reference(suite, tinted_nested_balls(), 40);
}

/// dLoss/d(absorption), and of all that lies before, in and behind a tinted body.
pub fn gradients_of_absorbing_bodies_match_central_differences<B: Backend>(suite: &Suite<B>) {
    let of = |got: &BatchGradient| got.absorption[0].map(|a| a as f32);
    let (got, d) = compare_what_sharp_bodies_have(suite, tinted_ball());
    d.compare(&of(&got), suite.tolerances.bent, |m| &mut m.mirrors[0].absorption);
    let (got, d) = compare_what_all_have(suite, tinted(soft_ball()));
    d.compare(&of(&got), suite.tolerances.bent, |m| &mut m.mirrors[0].absorption);
}

/// The same of bodies in bodies: along each segment the coefficients of the body that rules there.
pub fn gradients_of_absorbing_bodies_in_bodies_match_central_differences<B: Backend>(suite: &Suite<B>) {
    let (got, d) = compare_what_nested_bodies_have(suite, tinted_nested_balls());
    for (k, absorption) in got.absorption.iter().enumerate() {
        let absorption = absorption.map(|a| a as f32);
        d.compare(&absorption, suite.tolerances.bent, |m| &mut m.mirrors[k].absorption);
    }
}

/// As long as the coefficients are 0, nothing changes but that they have a gradient.
pub fn clear_glass_that_may_learn_to_absorb_shows_and_teaches_the_same<B: Backend>(suite: &Suite<B>) {
    let (backend, b) = (suite.backend(sharp_ball()), batch(200));
    let clear = Objective { index: Some(index_objective()), ..objective() };
    let learning = Objective { absorption: Some(AbsorptionObjective { rate: 0.1 }), ..clear };
    let [one, other] = [clear, learning].map(|o| backend.gradient(&b, &o));
    assert!(one.outcome == other.outcome && one.rays == other.rays);
    assert!(one.field.density == other.field.density && one.field.colour == other.field.colour);
    assert!(one.medium == other.medium && one.reflection == other.reflection);
    assert!(one.background == other.background);
    assert_eq!(one.absorption, [[0.0; 3]]);
    assert!(other.absorption[0].iter().all(|a| *a != 0.0));
}

/// From clear glass, with everything else known and held.
pub fn tinted_glass_is_learned_from_pictures<B: Backend>(suite: &Suite<B>) {
    let (truth, mut b) = (suite.backend(tinted_ball()), batch(600));
    b.offset.fill(0.5);
    let seen = truth.render(&b.rays, &objective().marching, Layers::All);
    b.target = seen.iter().map(|p| p.colour).collect();
    let mut backend = suite.backend(sharp_ball());
    let learning = Objective { absorption: Some(AbsorptionObjective { rate: 0.1 }), ..still() };
    (0..120).for_each(|k| _ = step(&mut backend, &b, &learning, k));
    let slowly = Objective { absorption: Some(AbsorptionObjective { rate: 0.01 }), ..still() };
    (120..240).for_each(|k| _ = step(&mut backend, &b, &slowly, k));
    let found = backend.medium().medium.regions()[0].absorption();
    for (found, truth) in found.iter().zip(TINT) {
        assert!((found - truth).abs() < 0.05 * truth, "{found} {truth}");
    }
}
